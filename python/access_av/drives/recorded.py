"""Recorded drives: write them from a scenario, find out where the vehicle was."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av import _core
from access_av.drives import angle_log
from access_av.errors import InputError
from access_av.run.pairs import STRETCHES, Errors
from access_av.run.service_levels import INDEPENDENT_S

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from access_av._core import Scenario, Site, Vehicle


# Maximum interval between two poses of the truth that is interpolated linearly (s).
MOST_TRUTH_GAP_S = 1.0

# Minimum share of the drive for which the truth has to be known.
MIN_COMPARED = 0.5

# Median distance (m) between truth and drive above which they are in different frames.
OTHER_FRAME_M = 1e4

# Extent of the truth relative to the drive's below which its positions are no metres, and the
# extent of the drive (m) from which on this is decided. A degree is 1e5 m.
MIN_EXTENT = 1e-3
MIN_EXTENT_OF_DRIVE_M = 1.0

# Maximum share of a drive that may be unavailable without making it unreliable.
MAX_UNAVAILABLE = 0.2

# Units per second that times are in by mistake.
TIME_UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}

FINDINGS = {"constant": pl.String, "constant_unit": pl.String}

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
    progress: Callable[[float], object] | None = None,
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
    progress
        Called with the share of the drive that is recorded, from 0 to 1.

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
        progress=progress,
    )
    return SynthesizedDrive(*made)


def log_angles(
    scenario: Scenario | str,
    directory: str | Path,
    *,
    seed: int = 1,
    run: int = 0,
    duration_s: float | None = None,
) -> int:
    """Record a scenario's drive as the angles that the vehicle's receiver finds in it.

    Writes ``angles.csv`` with the angle of every SSB, ``odometry.csv``, ``site.toml``,
    ``vehicle.toml``, ``scenario.toml`` and ``truth.tum``.

    Parameters
    ----------
    scenario, directory, seed, run, duration_s
        As for :func:`synthesize`.

    Returns
    -------
    int
        Number of angles.

    Raises
    ------
    SettingsError
        When what an SSB brings hangs on when it is heard (samples, latency, noisy SNR).

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as drive:
    ...     log_angles("yard", drive, duration_s=2.0)
    404
    """
    chosen = _core.Scenario.load(scenario) if isinstance(scenario, str) else scenario
    return _core.log_angles(chosen, directory, seed=seed, run=run, duration_s=duration_s)


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
        What was wrong with the input, or remarkable about the drive; of remarks that differ in
        numbers only the first stands for all.
    diagnoses
        Those of the remarks that name what is wrong with the input as it was given, confirmed by
        the localizer itself.
    suspicions
        Those of the diagnoses that did harm: the drive is not to be relied on.
    findings
        What the drive showed of the vehicle by its end: one row per constant, as stated and as
        found, with its standard deviation; none where the localizer does not look for it.
    smoothed
        ``poses`` as seen from the end of the drive, from the first known one on; ``None`` unless
        asked for. Protection levels are not smoothed.
    """

    poses: pl.DataFrame
    angles: pl.DataFrame
    remarks: list[str]
    diagnoses: list[str]
    suspicions: list[str]
    findings: pl.DataFrame
    _core: _core.LocatedDrive
    smoothed: pl.DataFrame | None = None

    @property
    def lost_share(self) -> float:
        """Share of the time that the angles came from elsewhere than expected.

        1 where the vehicle was never found.
        """
        return self._core.lost_share

    @property
    def unavailable_share(self) -> float:
        """Share of the time, from the first known pose on, in which the position was unavailable.

        1 if the vehicle was never found.
        """
        known = self.poses.filter(~pl.col("searching"))
        if known.is_empty():
            return 1.0
        unavailable = pl.col("lost") | (pl.col("integrity") == "unavailable").fill_null(value=False)
        return float(known.select(unavailable.mean()).item())

    @property
    def is_reliable(self) -> bool:
        """Whether the drive can be relied on.

        The vehicle was found, its position was available for four fifths of the time and at the
        end, and no reported fault of the input displaced it by more than 0.5 m.
        """
        is_lost = self._core.is_lost_for_long or self.unavailable_share > MAX_UNAVAILABLE
        return not (is_lost or self.suspicions)

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
    imu_topic: str | None = None,
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
        CSV with the columns ``time_s``, ``distance_m`` or ``speed_mps`` or both and, from a
        gyroscope or from the wheels, ``yaw_rate_radps``; or of left and right wheel ``left_m`` and
        ``right_m``, or ``left_mps`` and ``right_mps``, where the vehicle states
        ``odometer.track_width_m``; or an MCAP file or a rosbag2 folder with
        ``nav_msgs/msg/Odometry``. Where the twist of that tells no yaw rate, it is taken from a
        ``sensor_msgs/msg/Imu`` beside it, or of the pose's orientation; the remarks say which.
    recording
        SigMF recording of the array's samples, or a log of angles, CSV or Parquet, with the columns
        ``time_s``, ``pci`` and either ``phase_rad`` (electrical angle) with ``phase_sigma_rad``, or
        ``angle_rad`` (from the array's axis) with ``angle_sigma_rad``; ``ssb_index`` and ``snr_db``
        may be there.
        What is stated as the deviation is taken for all of the error: the site's ``rician_k_db``
        adds nothing.
    vehicle
        Array, odometer, and how the vehicle locates itself; or the name or path of a vehicle
        file. Its wake-up policy is honoured.
    topic
        Topic of the odometry in a bag with several.
    imu_topic
        Topic of the IMU that tells the yaw rate, also where the odometry does.
    start_time_s
        Time of the recording's first sample by the odometry's clock.
    start
        Initial pose (x in metres, y in metres, heading in radians) in place of the vehicle's.
        Without any, the vehicle is found: along the road by two radio heads or more, elsewhere by
        three.
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
        angles=angle_log.columns_of(recording),
        topic=topic,
        imu_topic=imu_topic,
        start_time_s=start_time_s,
        start=start,
        from_scratch=from_scratch,
        smooth=smooth,
    )
    angles = pl.DataFrame(located.angles).with_columns(pl.col(pl.Float64).fill_nan(None))
    smoothed = _poses(located.smoothed) if smooth else None
    return Drive(
        poses=_poses(located.poses),
        angles=angles,
        remarks=located.remarks,
        diagnoses=located.diagnoses,
        suspicions=located.suspicions,
        findings=pl.DataFrame(located.findings, schema_overrides=FINDINGS),
        smoothed=smoothed,
        _core=located,
    )


def _poses(columns: Mapping[str, Any]) -> pl.DataFrame:
    table = pl.DataFrame(columns, schema_overrides={"integrity": pl.String})
    return table.with_columns(pl.col(pl.Float64).fill_nan(None))


def read_tum(file: str | Path) -> pl.DataFrame:
    """A TUM trajectory as ``time_s``, ``x_m``, ``y_m``, ``heading_rad``; ``#`` begins a comment.

    Raises
    ------
    RecordingError
        When the file is no TUM trajectory.
    """
    return pl.DataFrame(_core.read_tum(file)).sort("time_s")


def error_m(poses: pl.DataFrame, truth: str | Path | pl.DataFrame) -> pl.DataFrame:
    """Horizontal error at the poses' times; the truth is interpolated linearly.

    Parameters
    ----------
    poses
        Poses of a located drive. Poses before the first known one are left out, and poses before,
        after or in a gap of more than a second of the truth.
    truth
        TUM trajectory, at times of its own, or the table of :func:`read_tum`. Its headings are not
        used.

    Raises
    ------
    RecordingError
        When the file is no TUM trajectory.
    InputError
        When the truth is known for less than half of the drive, or is in another frame.
    """
    known = poses.filter(~pl.col("searching")).sort("time_s")
    true = truth if isinstance(truth, pl.DataFrame) else read_tum(truth)
    true = true.select("time_s", "x_m", "y_m").sort("time_s")
    which = "the truth" if isinstance(truth, pl.DataFrame) else str(truth)
    if true.is_empty():
        raise InputError(f"{which}: holds no pose")
    both = _between(known, true)
    if both.height < MIN_COMPARED * known.height:
        covered = both.height / max(known.height, 1)
        raise InputError(
            f"{which}: covers {covered:.0%} of the drive, at least {MIN_COMPARED:.0%} is needed; "
            f"{_why_apart(known, true)}"
        )
    span = pl.col("t1") - pl.col("t0")
    share = pl.when(span > 0).then((pl.col("time_s") - pl.col("t0")) / span).otherwise(0.0)
    dx = pl.col("x_m") - pl.col("x0") - share * (pl.col("x1") - pl.col("x0"))
    dy = pl.col("y_m") - pl.col("y0") - share * (pl.col("y1") - pl.col("y0"))
    errors = both.select("time_s", error_m=(dx**2 + dy**2).sqrt(), error_x_m=dx, error_y_m=dy)
    _check_frame(which, known, true, errors)
    return errors


def _between(known: pl.DataFrame, true: pl.DataFrame) -> pl.DataFrame:
    """The poses at which the truth is known, with its poses before and after each."""
    before = true.rename({"x_m": "x0", "y_m": "y0"}).with_columns(t0="time_s")
    after = true.rename({"x_m": "x1", "y_m": "y1"}).with_columns(t1="time_s")
    return (
        known.join_asof(before, on="time_s", strategy="backward")
        .join_asof(after, on="time_s", strategy="forward")
        .filter(pl.col("t1") - pl.col("t0") <= MOST_TRUTH_GAP_S)
    )


def _why_apart(known: pl.DataFrame, true: pl.DataFrame) -> str:
    """Why a truth covers little of a drive, and how to fix it."""
    for unit, per_second in TIME_UNITS.items():
        scaled = true.with_columns(pl.col("time_s") / per_second)
        if _between(known, scaled).height >= MIN_COMPARED * known.height:
            return f"its times are in {unit}, and must be in seconds"
    step_s = true["time_s"].diff().median()
    overlaps = true["time_s"][0] <= known["time_s"][-1] and known["time_s"][0] <= true["time_s"][-1]
    if overlaps and isinstance(step_s, float) and step_s > MOST_TRUTH_GAP_S:
        return f"its poses are {step_s:g} s apart, and must be at most {MOST_TRUTH_GAP_S:g} s apart"
    return (
        f"it is from {_interval_s(true)}, the drive from {_interval_s(known)}; both must be by one "
        f"clock, in seconds, and gaps of more than {MOST_TRUTH_GAP_S:g} s are not interpolated"
    )


def _check_frame(which: str, known: pl.DataFrame, true: pl.DataFrame, errors: pl.DataFrame) -> None:
    """Reject positions of another frame or unit than the map's."""
    apart_m = errors["error_m"].median()
    if isinstance(apart_m, float) and apart_m > OTHER_FRAME_M:
        x_m, y_m = true["x_m"][0], true["y_m"][0]
        raise InputError(
            f"{which}: its first position ({x_m:.0f}, {y_m:.0f}) is in another frame, "
            f"{apart_m / 1e3:.0f} km from the drive (UTM coordinates?); it must be in metres in "
            "the frame of the site: subtract the site's origin"
        )

    def extent_m(of: pl.DataFrame) -> float:
        places = of.select("x_m", "y_m").to_numpy()
        spans = places.max(axis=0) - places.min(axis=0)
        return math.hypot(*spans)

    within = true.filter(pl.col("time_s").is_between(known["time_s"][0], known["time_s"][-1]))
    if within.is_empty():
        return
    drive_m, true_m = extent_m(known), extent_m(within)
    if drive_m > MIN_EXTENT_OF_DRIVE_M and 0.0 < true_m < MIN_EXTENT * drive_m:
        raise InputError(
            f"{which}: its positions extend over {true_m:.2g}, those of the drive over "
            f"{drive_m:.1f} m (longitude and latitude in degrees?); they must be in metres in the "
            "frame of the site"
        )


def _interval_s(of: pl.DataFrame) -> str:
    return f"{of['time_s'][0]:.3f} to {of['time_s'][-1]:.3f} s"


def in_stretches(drive: Drive, truth: pl.DataFrame, name: str) -> Errors:
    """A drive's errors in stretches, which pair with those of the same drive located otherwise.

    Of one drive alone: an error that stays for all of it, such as that of a plan of the site, is
    in every stretch alike. So the interval of a difference says whether it is more than chance on
    this drive, and not what it is on others.

    Parameters
    ----------
    drive
        A located drive.
    truth
        What :func:`read_tum` made of the truth.
    name
        What the variant is called.

    Raises
    ------
    InputError
        When truth and drive share no time.
    """
    searching = drive.poses.select("time_s", still="searching")
    poses = drive.poses.with_columns(searching=pl.lit(value=False))
    every = error_m(poses, truth).join(searching, on="time_s", maintain_order="left")
    errors_m = every.select(pl.when("still").then(math.inf).otherwise("error_m")).to_numpy()
    duration_s = float(every["time_s"][-1] - every["time_s"][0])
    count = max(1, int(duration_s / INDEPENDENT_S))
    epochs = every.height // count
    errors_m = errors_m[: count * epochs].reshape(count, epochs)
    return Errors(name=name, errors_m=errors_m, duration_s=duration_s / count, rows=STRETCHES)


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
        against = error_m(drive.poses, truth)
        errors = against["error_m"]
        numbers |= _honesty(drive.poses, against)
        numbers["compared_share"] = against.height / known.height
        numbers["rms_error_m"] = float((errors**2).mean() ** 0.5)  # type: ignore[operator]
        numbers["p90_error_m"] = float(errors.quantile(0.9, "linear") or 0.0)
        if drive.smoothed is not None and not drive.smoothed.is_empty():
            errors = error_m(drive.smoothed, truth)["error_m"]
            numbers["smoothed_rms_error_m"] = float((errors**2).mean() ** 0.5)  # type: ignore[operator]
    return numbers


def _honesty(poses: pl.DataFrame, against: pl.DataFrame) -> dict[str, float]:
    """Compare what the localizer said of its error with the error.

    Mean NEES over both axes; shares of the time ``ok`` and, of all time, beyond the protection
    level while ``ok``.
    """
    xx, xy, yy = (pl.col(f"covariance_{it}_m2") for it in ("xx", "xy", "yy"))
    dx, dy = pl.col("error_x_m"), pl.col("error_y_m")
    squared = (yy * dx**2 - 2 * xy * dx * dy + xx * dy**2) / (xx * yy - xy**2)
    ok = pl.col("integrity") == "ok"
    row = poses.join(against, on="time_s").select(
        nees_per_axis=squared.filter(squared.is_finite()).mean() / 2,
        ok_share=ok.mean(),
        beyond_while_ok=(ok & (pl.col("error_m") > pl.col("protection_level_m"))).mean(),
    )
    return {name: value for name, value in row.row(0, named=True).items() if value is not None}
