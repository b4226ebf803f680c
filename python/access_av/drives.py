"""Recorded drives: write them from a scenario, find out where the vehicle was."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av import _core
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av._core import Scenario, Site, Vehicle


DATATYPES = ("ci16_le", "cf32_le")


@dataclass(frozen=True)
class SynthesizedDrive:
    """A drive that was written.

    Attributes
    ----------
    recording
        The SigMF metadata.
    bursts
        SSB bursts in it.
    samples
        Samples per antenna.
    """

    recording: Path
    bursts: int
    samples: int


def synthesize(
    scenario: Scenario | str,
    directory: str | Path,
    *,
    seed: int = 1,
    run: int = 0,
    duration_s: float | None = None,
    continuous: bool = False,
    datatype: str = "ci16_le",
) -> SynthesizedDrive:
    """Record a scenario's drive as somebody on the vehicle would have.

    Writes ``iq.sigmf-meta`` and ``iq.sigmf-data`` (all antennas, the truth in the annotations),
    ``odometry.csv``, ``site.toml``, ``vehicle.toml``, ``scenario.toml`` and ``truth.tum``.

    Parameters
    ----------
    scenario
        What is driven, or its name or path.
    directory
        Where the files go; made if it is not there.
    seed, run
        The random streams.
    duration_s
        Seconds from the start on; the whole drive without.
    continuous
        Also the time between the SSB bursts, which makes the files many times larger.
    datatype
        ``ci16_le`` or ``cf32_le``.

    Raises
    ------
    SettingsError
        When the scenario cannot be sent as samples.
    InputError
        When the datatype is another one.

    Examples
    --------
    >>> import tempfile
    >>> import access_av
    >>> with tempfile.TemporaryDirectory() as drive:
    ...     access_av.synthesize("paper-real-odometry-2", drive, duration_s=2.0).bursts
    101
    """
    if datatype not in DATATYPES:
        raise InputError(f"datatype is {datatype!r}; allowed: {', '.join(DATATYPES)}")
    chosen = _core.Scenario.load(scenario) if isinstance(scenario, str) else scenario
    made = _core.synthesize(
        chosen,
        directory,
        seed=seed,
        run=run,
        duration_s=duration_s,
        continuous=continuous,
        datatype=datatype,
    )
    return SynthesizedDrive(*made)


@dataclass(frozen=True)
class Drive:
    """A located drive. :mod:`access_av.columns` says what each table's columns are.

    Attributes
    ----------
    poses
        One row per odometry sample. ``searching`` as long as the first pose is not known; the
        pose is then the mean of where the vehicle may be.
    angles
        One row per angle: SSB, angle, and what the localizer did with it.
    remarks
        What was wrong with single items of the input.
    smoothed
        ``poses`` as seen from the end of the drive, from the first known one on; ``None`` unless
        asked for. Protection levels are not smoothed.
    """

    poses: pl.DataFrame
    angles: pl.DataFrame
    remarks: list[str]
    _core: _core.LocatedDrive
    smoothed: pl.DataFrame | None = None

    def write_mcap(self, path: str | Path) -> None:
        """Write poses, verdicts and diagnostics as MCAP (ROS 2); no poses while searching."""
        self._core.write_mcap(path)

    def write_tum(self, path: str | Path) -> None:
        """Write the poses, from the first that is known on, as a TUM trajectory."""
        self._core.write_tum(path)

    def write_smoothed_tum(self, path: str | Path) -> None:
        """Write the smoothed poses as a TUM trajectory."""
        self._core.write_smoothed_tum(path)


def locate(
    site: Site | str | Path,
    odometry: str | Path,
    recording: str | Path,
    *,
    vehicle: Vehicle | str | Path = "default",
    topic: str | None = None,
    start_time_s: float = 0.0,
    start: tuple[float, float, float] | None = None,
    from_scratch: bool = False,
    smooth: bool = False,
) -> Drive:
    """Locate a recorded drive.

    Parameters
    ----------
    site
        Radio heads and, where there is one, the road; or the name or path of a site file.
    odometry
        CSV with the columns ``time_s``, ``distance_m``, ``speed_mps`` and, with a gyroscope,
        ``yaw_rate_radps``; or an MCAP file with ``nav_msgs/msg/Odometry``.
    recording
        SigMF recording of the array's samples, or a CSV log of angles with the columns ``time_s``,
        ``pci``, ``ssb_index``, ``phase_rad``, ``phase_sigma_rad``, ``angle_rad``, ``snr_db``.
    vehicle
        Array, odometer, and how the vehicle locates itself; or the name or path of a vehicle
        file. Its wake-up policy is honoured.
    topic
        Topic of the odometry in an MCAP file with several.
    start_time_s
        Time of the recording's first sample by the odometry's clock.
    start
        Initial pose (x in metres, y in metres, heading in radians) in place of the vehicle's.
        Without any, the vehicle is found along the road, by two radio heads or more.
    from_scratch
        Find the vehicle along the road even if its file has an initial pose.
    smooth
        Also look back from the end of the drive: every pose by all angles, before it and after.

    Raises
    ------
    RecordingError
        When the recording or the odometry cannot be used.
    SettingsError
        When the site or vehicle file cannot be used.

    Examples
    --------
    >>> import tempfile
    >>> import access_av
    >>> with tempfile.TemporaryDirectory() as drive:
    ...     _ = access_av.synthesize("paper-real-odometry-2", drive, duration_s=2.0)
    ...     located = access_av.locate(
    ...         f"{drive}/site.toml",
    ...         f"{drive}/odometry.csv",
    ...         f"{drive}/iq.sigmf-meta",
    ...         vehicle=f"{drive}/vehicle.toml",
    ...     )
    >>> located.poses.height
    101
    """
    located = _core.locate(
        site if isinstance(site, _core.Site) else _core.Site.load(str(site)),
        vehicle if isinstance(vehicle, _core.Vehicle) else _core.Vehicle.load(str(vehicle)),
        odometry,
        recording,
        topic=topic,
        start_time_s=start_time_s,
        start=start,
        from_scratch=from_scratch,
        smooth=smooth,
    )
    angles = pl.DataFrame(located.angles).with_columns(pl.col(pl.Float64).fill_nan(None))
    smoothed = _poses(located.smoothed) if smooth else None
    return Drive(_poses(located.poses), angles, located.remarks, located, smoothed)


def _poses(columns: Mapping[str, Any]) -> pl.DataFrame:
    table = pl.DataFrame(columns, schema_overrides={"integrity": pl.String})
    return table.with_columns(pl.col(pl.Float64).fill_nan(None))


def error_m(poses: pl.DataFrame, truth: str | Path) -> pl.DataFrame:
    """Horizontal error at the times that a TUM trajectory of the truth has too.

    Parameters
    ----------
    poses
        Poses of a located drive; those before the first known one are passed over.
    truth
        TUM trajectory; times within a microsecond belong together.

    Raises
    ------
    InputError
        When the file is no TUM trajectory, or shares no time with the drive.
    """
    rows = [line.split() for line in Path(truth).read_text(encoding="utf-8").splitlines()]
    if not rows or any(len(row) != 8 for row in rows):
        raise InputError(f"{truth}: not a TUM trajectory (8 numbers a line)")
    true = pl.DataFrame(
        {
            "time_us": [round(float(row[0]) * 1e6) for row in rows],
            "true_x_m": [float(row[1]) for row in rows],
            "true_y_m": [float(row[2]) for row in rows],
        }
    )
    timed = poses.with_columns(time_us=(pl.col("time_s") * 1e6).round().cast(pl.Int64))
    both = timed.filter(~pl.col("searching")).join(true, on="time_us")
    if both.is_empty():
        raise InputError(f"{truth}: no time in common with the drive")
    dx, dy = pl.col("x_m") - pl.col("true_x_m"), pl.col("y_m") - pl.col("true_y_m")
    return both.select("time_s", error_m=(dx**2 + dy**2).sqrt())


def summary(drive: Drive, truth: str | Path | None = None) -> dict[str, float]:
    """The drive in a few numbers; errors only where the truth is known."""
    numbers = {
        "duration_s": float(drive.poses["time_s"][-1] - drive.poses["time_s"][0]),
        "angles": float(drive.angles.height),
        "accepted": float(drive.angles["accepted"].sum()),
        "remarks": float(len(drive.remarks)),
    }
    known = drive.poses.filter(~pl.col("searching"))
    if known.height < drive.poses.height and not known.is_empty():
        numbers["found_s"] = float(known["time_s"][0] - drive.poses["time_s"][0])
        steps = drive.poses.select("time_s", "speed_mps").with_columns(
            driven_m=(pl.col("time_s").diff().fill_null(0.0) * pl.col("speed_mps").abs()).cum_sum()
        )
        numbers["found_m"] = float(steps.filter(time_s=known["time_s"][0])["driven_m"][0])
    if truth is not None and not known.is_empty():
        errors = error_m(drive.poses, truth)["error_m"]
        numbers["rms_error_m"] = float((errors**2).mean() ** 0.5)  # type: ignore[operator]
        numbers["p90_error_m"] = float(errors.quantile(0.9, "linear") or 0.0)
        if drive.smoothed is not None and not drive.smoothed.is_empty():
            errors = error_m(drive.smoothed, truth)["error_m"]
            numbers["smoothed_rms_error_m"] = float((errors**2).mean() ** 0.5)  # type: ignore[operator]
    return numbers
