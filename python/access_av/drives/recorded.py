"""Recorded drives: synthesis from a scenario, and localization."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from access_av import _core
from access_av.drives import angle_log, truth_frame
from access_av.errors import InputError
from access_av.run.pairs import STRETCHES, ErrorSamples
from access_av.run.service_levels import INDEPENDENT_S
from access_av.statistics.consistency import DIMENSIONS, nees_of_step
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from access_av._core import Scenario, Site, Vehicle


# Maximum interval between two poses of the truth that is interpolated linearly (s).
MOST_TRUTH_GAP_S = 1.0

# Minimum share of the drive with known truth.
MIN_COMPARED = 0.5

# Maximum unavailable share of a reliable drive.
MAX_UNAVAILABLE = 0.2

# Minimum correction of the position in one step that counts as a jump, in metres. It equals the
# displacement by which a reported fault makes a drive unreliable.
JUMP_M = 0.5

# Minimum distance driven per jump of a reliable drive with ranges, in metres. A lawn mower jumps 5
# times in 1859 m; wrong yaw rates and exchanged coordinates cause a jump at least every 6 m.
JUMP_SPACING_M = 20.0

# Number of jumps that are permitted over any distance: one corrects a wrong start pose, and one a
# first correction that was ambiguous.
PERMITTED_JUMPS = 2

# Maximum rejected share of the ranges of a reliable drive. A fifth of blocked paths causes 0.22;
# yaw rates in degrees and exchanged coordinates cause 0.45.
MAX_REJECTED_RANGES = 0.4

# Distance driven since the previous odometry sample, in metres.
STEP_M = pl.col("speed_mps").abs() * pl.col("time_s").diff()

# Wrong time units, in units per second.
TIME_UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}

# Columns of the estimated vehicle parameters, in the order of the core.
TEXT, NUMBER = pl.String(), pl.Float64()
FINDINGS = {"key": TEXT, "unit": TEXT, "before": NUMBER, "found": NUMBER, "std": NUMBER}

DATATYPES = ("ci16_le", "cf32_le")


@dataclass(frozen=True)
class SynthesizedDrive:
    """Result of a synthesis.

    Attributes
    ----------
    recording
        SigMF metadata file.
    bursts
        Number of SSB bursts.
    samples
        Number of samples per antenna.
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
    """Synthesizes the recording of a scenario's drive.

    Writes ``iq.sigmf-meta`` and ``iq.sigmf-data`` (all antennas, the truth in the annotations),
    ``odometry.csv``, ``site.toml``, ``vehicle.toml``, ``scenario.toml`` and ``truth.tum``.

    Parameters
    ----------
    scenario
        Scenario, or its name or path.
    directory
        Output folder; created if missing.
    seed, run
        Seed and number of the random stream.
    duration_s
        Duration from the start in seconds. Default: the whole drive.
    continuous
        Whether samples between the SSB bursts are written, which multiplies the file size.
    datatype
        ``ci16_le`` or ``cf32_le``.
    progress
        Called with the completed share of the drive, from 0 to 1.

    Raises
    ------
    SettingsError
        Scenario without simulation at sample level.
    InputError
        Unknown datatype.

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
    """Synthesizes a scenario's drive as a log of the angles found by the vehicle's receiver.

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
        Scenario whose angles depend on the reception times (samples, latency, noisy SNR).

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
    """A located drive. :mod:`access_av.columns` describes the columns of the tables.

    Attributes
    ----------
    poses
        One row per odometry sample. While ``searching``, the pose is the mean of the possible
        positions.
    angles
        One row per angle: SSB, angle, and its use by the localizer.
    ranges
        One row per range: radio head, range, and its use by the localizer.
    remarks
        Faults of the input and other observations; of remarks that differ only in numbers, the
        first one.
    diagnoses
        Remarks about wrong inputs that the localizer has confirmed.
    suspicions
        Diagnoses that displaced the drive, which is therefore not reliable.
    findings
        Estimated vehicle parameters at the end of the drive: one row per parameter with nominal
        value, estimate and standard deviation.
    smoothed
        Smoothed ``poses`` from the first known one; ``None`` unless requested. Protection levels
        are not smoothed.
    """

    poses: pl.DataFrame
    angles: pl.DataFrame
    ranges: pl.DataFrame
    remarks: list[str]
    diagnoses: list[str]
    suspicions: list[str]
    findings: pl.DataFrame
    _core: _core.LocatedDrive
    smoothed: pl.DataFrame | None = None

    @property
    def lost_share(self) -> float:
        """Returns the share of the time in which the angles contradicted the position.

        The value is 1 if the vehicle was never found.
        """
        return self._core.lost_share

    @property
    def unavailable_share(self) -> float:
        """Returns the share of the time since the first known pose without an available position.

        The value is 1 if the vehicle was never found.
        """
        known = self.poses.filter(~pl.col("searching"))
        if known.is_empty():
            return 1.0
        unavailable = pl.col("lost") | (pl.col("integrity") == "unavailable").fill_null(value=False)
        return float(known.select(unavailable.mean()).item())

    @property
    def has_ranges_only(self) -> bool:
        """Returns whether the drive has ranges and no angles."""
        return self.angles.is_empty() and not self.ranges.is_empty()

    @property
    def jumps(self) -> int:
        """Returns the number of corrections of the position by more than 0.5 m in one step."""
        moved_m = (pl.col("x_m").diff() ** 2 + pl.col("y_m").diff() ** 2).sqrt()
        known = self.poses.filter(~pl.col("searching"))
        return int(known.select((moved_m - STEP_M > JUMP_M).sum()).item())

    @property
    def jumps_repeatedly(self) -> bool:
        """Returns whether the position jumped more than twice and more than once per 20 m driven.

        Only for drives with ranges and no angles, because the diagnosis of wrong inputs needs
        angles.
        """
        if not self.has_ranges_only:
            return False
        permitted = float(self.poses.select(STEP_M.sum()).item()) / JUMP_SPACING_M
        return self.jumps > max(PERMITTED_JUMPS, permitted)

    @property
    def rejects_its_ranges(self) -> bool:
        """Returns whether more than two fifths of the ranges were rejected, without angles."""
        if not self.has_ranges_only:
            return False
        return 1.0 - float(self.ranges["accepted"].mean()) > MAX_REJECTED_RANGES  # type: ignore[arg-type]

    @property
    def is_reliable(self) -> bool:
        """Returns whether the drive is reliable.

        The vehicle was found, its position was available for four fifths of the time and at the
        end, no reported fault of the input displaced it by more than 0.5 m, and ranges without
        angles did not move it in jumps and were mostly accepted.
        """
        is_lost = self._core.is_lost_for_long or self.unavailable_share > MAX_UNAVAILABLE
        contradicts = self.jumps_repeatedly or self.rejects_its_ranges
        return not (is_lost or contradicts or self.suspicions)

    def write_mcap(self, path: str | Path) -> None:
        """Writes poses, verdicts and diagnostics as MCAP (ROS 2); no poses while searching."""
        self._core.write_mcap(path)

    def write_tum(self, path: str | Path) -> None:
        """Writes the poses from the first known one as a TUM trajectory."""
        self._core.write_tum(path)

    def write_smoothed_tum(self, path: str | Path) -> None:
        """Writes the smoothed poses as a TUM trajectory."""
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
    start_unknown: bool = False,
    smooth: bool = False,
) -> Drive:
    """Locates a recorded drive.

    Parameters
    ----------
    site
        Site, or the name or path of a site file.
    odometry
        CSV with the columns ``time_s``, ``distance_m`` or ``speed_mps`` or both, and optionally
        ``yaw_rate_radps``. For two wheels: ``left_m`` and ``right_m``, or ``left_mps`` and
        ``right_mps``, with ``odometer.track_width_m`` of the vehicle. Or an MCAP file or a rosbag2
        folder with ``nav_msgs/msg/Odometry``. If its twist has no yaw rate, the yaw rate is that of
        a ``sensor_msgs/msg/Imu`` or of the pose's orientation; a remark names the source.
    recording
        SigMF recording of the array's samples, or a log of angles, CSV or Parquet, with the columns
        ``time_s``, ``pci`` and either ``phase_rad`` (electrical angle) with ``phase_sigma_rad``, or
        ``angle_rad`` (from the array axis) with ``angle_sigma_rad``; optionally ``ssb_index`` and
        ``snr_db``. The standard deviation covers the whole error: the site's ``rician_k_db`` adds
        nothing. Or a log of ranges, CSV, with the columns ``time_s``, ``pci`` and either
        ``range_m`` or ``delay_ns`` or ``delay_samples`` with ``sample_rate_hz``; optionally
        ``ssb_index`` and ``sigma_m`` or ``delay_sigma_ns``. Or the log of an OpenAirInterface UE
        with positioning reference signals, ``.log`` or ``.txt``. Ranges need a start pose.
    vehicle
        Vehicle, or the name or path of a vehicle file. Its wake-up policy is applied.
    topic
        Odometry topic, if the bag contains several.
    imu_topic
        IMU topic for the yaw rate, in place of the odometry's yaw rate.
    start_time_s
        Time of the recording's first sample by the odometry's clock.
    start
        Start pose (x in metres, y in metres, heading in radians) in place of the vehicle's.
        Without a start pose the vehicle is searched for, with at least two radio heads along a road
        and three elsewhere.
    start_unknown
        Whether to search for the vehicle even if its file has a start pose.
    smooth
        Whether to add the smoothed trajectory, which uses all angles for every pose.

    Raises
    ------
    RecordingError
        Unusable recording or odometry.
    SettingsError
        Unusable site or vehicle file.

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
        start_unknown=start_unknown,
        smooth=smooth,
    )
    return Drive(
        poses=TABLES["trajectories"].frame(located.poses),
        angles=TABLES["measurements"].frame(located.angles),
        ranges=TABLES["measurements"].frame(located.ranges),
        remarks=located.remarks,
        diagnoses=located.diagnoses,
        suspicions=located.suspicions,
        findings=pl.DataFrame(list(located.findings.values()), schema=FINDINGS),
        smoothed=TABLES["trajectories"].frame(located.smoothed) if smooth else None,
        _core=located,
    )


def read_tum(file: str | Path) -> pl.DataFrame:
    """Reads a TUM trajectory: ``time_s``, ``x_m``, ``y_m``, ``heading_rad``; ``#`` is a comment.

    Raises
    ------
    RecordingError
        When the file is no TUM trajectory.
    """
    return pl.DataFrame(_core.read_tum(file)).sort("time_s")


def error_m(poses: pl.DataFrame, truth: str | Path | pl.DataFrame) -> pl.DataFrame:
    """Returns the horizontal error at the times of the poses; interpolates the truth linearly.

    Parameters
    ----------
    poses
        Poses of a located drive. Poses before the first known one are left out, and poses outside
        the truth or in a gap of more than one second of it.
    truth
        TUM trajectory with its own times, or the table of :func:`read_tum`. Its headings are not
        used.

    Raises
    ------
    RecordingError
        When the file is no TUM trajectory.
    InputError
        Truth for less than half of the drive, with impossible steps, or in another frame or unit.
    """
    known = poses.filter(~pl.col("searching")).sort("time_s")
    true = truth if isinstance(truth, pl.DataFrame) else read_tum(truth)
    true = true.select("time_s", "x_m", "y_m").sort("time_s")
    which = "the truth" if isinstance(truth, pl.DataFrame) else str(truth)
    if true.is_empty():
        raise InputError(f"{which}: contains no pose")
    both = _between(known, true)
    if both.height < MIN_COMPARED * known.height:
        covered = both.height / max(known.height, 1)
        raise InputError(
            f"{which}: it covers {covered:.0%} of the drive; at least {MIN_COMPARED:.0%} is "
            f"required; "
            f"{_why_apart(known, true)}"
        )
    span = pl.col("t1") - pl.col("t0")
    share = pl.when(span > 0).then((pl.col("time_s") - pl.col("t0")) / span).otherwise(0.0)
    dx = pl.col("x_m") - pl.col("x0") - share * (pl.col("x1") - pl.col("x0"))
    dy = pl.col("y_m") - pl.col("y0") - share * (pl.col("y1") - pl.col("y0"))
    errors = both.select("time_s", error_m=(dx**2 + dy**2).sqrt(), error_x_m=dx, error_y_m=dy)
    truth_frame.check(which, known, true, errors)
    return errors


def _between(known: pl.DataFrame, true: pl.DataFrame) -> pl.DataFrame:
    """Returns the poses with known truth, each with the true poses before and after it."""
    before = true.rename({"x_m": "x0", "y_m": "y0"}).with_columns(t0="time_s")
    after = true.rename({"x_m": "x1", "y_m": "y1"}).with_columns(t1="time_s")
    return (
        known.join_asof(before, on="time_s", strategy="backward")
        .join_asof(after, on="time_s", strategy="forward")
        .filter(pl.col("t1") - pl.col("t0") <= MOST_TRUTH_GAP_S)
    )


def _why_apart(known: pl.DataFrame, true: pl.DataFrame) -> str:
    """Returns the reason why a truth covers little of a drive, and the remedy."""
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


def _interval_s(of: pl.DataFrame) -> str:
    return f"{of['time_s'][0]:.3f} to {of['time_s'][-1]:.3f} s"


def truth_doubt(drive: Drive, truth: pl.DataFrame) -> str | None:
    """Returns the reason to doubt the frame of a truth; ``None`` without one.

    Parameters
    ----------
    drive
        A located drive.
    truth
        Truth, as returned by :func:`read_tum`.
    """
    known = drive.poses.filter(~pl.col("searching"))
    if known.is_empty():
        return None
    return truth_frame.explanation(known, error_m(drive.poses, truth))


def in_stretches(drive: Drive, truth: pl.DataFrame, name: str) -> ErrorSamples:
    """Splits the errors of a drive into sections, for comparison of variants of the drive.

    An error that is constant during the drive, such as a displaced site plan, is common to all
    sections. The interval of a difference therefore shows its significance for this drive, and not
    its value for other drives.

    Parameters
    ----------
    drive
        A located drive.
    truth
        Truth, as returned by :func:`read_tum`.
    name
        Name of the variant.

    Raises
    ------
    InputError
        Truth and drive without common time.
    """
    searching = drive.poses.select("time_s", still="searching")
    poses = drive.poses.with_columns(searching=pl.lit(value=False))
    every = error_m(poses, truth).join(searching, on="time_s", maintain_order="left")
    errors_m = every.select(pl.when("still").then(math.inf).otherwise("error_m")).to_numpy()
    duration_s = float(every["time_s"][-1] - every["time_s"][0])
    count = max(1, int(duration_s / INDEPENDENT_S))
    epochs = every.height // count
    errors_m = errors_m[: count * epochs].reshape(count, epochs)
    return ErrorSamples(name=name, errors_m=errors_m, duration_s=duration_s / count, rows=STRETCHES)


def summary(drive: Drive, truth: str | Path | None = None) -> dict[str, float]:
    """Returns the main figures of the drive; errors only with known truth."""
    numbers = {
        "duration_s": float(drive.poses["time_s"][-1] - drive.poses["time_s"][0]),
        "angles": float(drive.angles.height),
        "accepted": float(drive.angles["accepted"].sum()),
        "remarks": float(len(drive.remarks)),
    }
    if not drive.ranges.is_empty():
        numbers["ranges"] = float(drive.ranges.height)
        numbers["accepted_ranges"] = float(drive.ranges["accepted"].sum())
    known = drive.poses.filter(~pl.col("searching"))
    if known.height < drive.poses.height and not known.is_empty():
        numbers["found_s"] = float(known["time_s"][0] - drive.poses["time_s"][0])
        steps = drive.poses.select("time_s", "speed_mps").with_columns(
            driven_m=STEP_M.fill_null(0.0).cum_sum()
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
    """Compares the error with the reported uncertainty.

    Returns the mean NEES over both axes, the share of the time in state ``ok``, and the share of
    the time with state ``ok`` and an error above the protection level.
    """
    ok = pl.col("integrity") == "ok"
    row = poses.join(against, on="time_s").select(
        nees_per_axis=nees_of_step().mean() / DIMENSIONS,
        ok_share=ok.mean(),
        beyond_while_ok=(ok & (pl.col("error_m") > pl.col("protection_level_m"))).mean(),
    )
    return {name: value for name, value in row.row(0, named=True).items() if value is not None}
