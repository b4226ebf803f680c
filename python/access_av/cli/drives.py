"""Commands that synthesize and locate recorded drives: ``record synth``, ``record locate``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Option

from access_av.cli import options as opt
from access_av.cli.side_by_side import PERCENTS, records, show_compared, variants, write_compared
from access_av.cli.terminal import console, errors, progress, say, show_remarks, show_warning
from access_av.errors import InputError

if TYPE_CHECKING:
    import polars as pl

    from access_av._core import Site, Vehicle
    from access_av.drives.recorded import Drive
    from access_av.study.compare import Compared

app = typer.Typer()

# Exit code of a drive whose located poses are not reliable.
UNRELIABLE = 3


@opt.command(app, "Drives", "record synth paper-real-odometry-2 --out drive --duration-s 20")
def synth(
    scenario: opt.ScenarioArgument,
    out: Annotated[Path, Option(help="Output folder.")],
    duration_s: Annotated[
        float | None,
        Option(min=0.02, help="Duration from the start of the drive.", show_default="all"),
    ] = None,
    seed: Annotated[int, Option(min=0, help="Seed of the random numbers.")] = 1,
    run: Annotated[int, Option(min=0, help="Number of the recorded run, from 0.")] = 0,
    continuous: Annotated[
        bool,
        Option("--continuous", help="Also write the samples between the bursts (large files)."),
    ] = False,
    datatype: Annotated[str, Option(help="Sample format: ci16_le or cf32_le.")] = "ci16_le",
    angles: Annotated[
        bool, Option("--angles", help="Write angles.csv instead of samples (small file).")
    ] = False,
    allow_large: opt.AllowLarge = False,
    overrides: opt.Overrides = None,
) -> None:
    """Synthesize a recorded drive: antenna samples, odometry, site, vehicle, truth.

    The samples are a SigMF recording for any receiver. Its annotations and truth.tum contain the
    truth. Without --continuous only the bursts are written, each as a capture with its position in
    time (core:global_index).
    """
    from access_av.drives import recorded as drives
    from access_av.tables.results_directory import ResultsDirectory

    given = opt.overridden(overrides)
    chosen = opt.load_scenario(scenario, allow_large=allow_large, overrides=given)
    directory = ResultsDirectory.create("synth", out)
    if angles:
        count = drives.log_angles(chosen, directory.path, seed=seed, run=run, duration_s=duration_s)
        directory.write_manifest(scenario=chosen.name, seed=seed, run=run)
        say(f"{count} angles: {directory.path / 'angles.csv'}")
        return
    with progress("Recording") as tick:
        made = drives.synthesize(
            chosen,
            directory.path,
            seed=seed,
            run=run,
            duration_s=duration_s,
            continuous=continuous,
            datatype=datatype,
            progress=lambda share: tick(round(100 * share), 100),
        )
    directory.write_manifest(scenario=chosen.name, seed=seed, run=run)
    say(f"{made.bursts} bursts, {made.samples} samples per antenna: {made.recording}")


@opt.command(
    app,
    "Drives",
    "record locate --recording drive/iq.sigmf-meta --odometry drive/odometry.csv "
    "--site drive/site.toml --vehicle drive/vehicle.toml --truth drive/truth.tum",
)
def locate(
    recording: Annotated[
        Path,
        Option(
            help="SigMF recording of the array, angles (CSV, Parquet) or ranges (CSV, or .log of "
            "OpenAirInterface)."
        ),
    ],
    site: opt.SiteOption,
    odometry: Annotated[
        Path | None,
        Option(
            help="Odometry: CSV, or MCAP or rosbag2 folder with nav_msgs/Odometry.",
            show_default="stationary receiver; ranges only",
        ),
    ] = None,
    vehicle: opt.VehicleOption = "default",
    out: opt.Out = None,
    truth: Annotated[Path | None, Option(help="True trajectory as a TUM file.")] = None,
    topic: Annotated[str | None, Option(help="Odometry topic of the bag.")] = None,
    imu_topic: Annotated[
        str | None,
        Option(help="IMU topic for the yaw rate.", show_default="yaw rate of the odometry"),
    ] = None,
    start_time_s: opt.StartTime = 0.0,
    start: Annotated[
        str | None,
        Option(
            metavar="X,Y,HEADING",
            help="Start pose in m, m, rad, or the word unknown.",
            show_default="of the vehicle file",
        ),
    ] = None,
    smooth: Annotated[bool, Option("--smooth", help="Also write the smoothed trajectory.")] = False,
    vary: opt.Vary = None,
    compare: opt.Compare = None,
    percentile: opt.Percents = None,
    as_json: opt.AsJson = False,
) -> None:
    """Locate a recorded drive.

    Writes drive.mcap (poses with covariance and twist, verdicts, diagnostics), trajectory.tum,
    poses.parquet, angles.parquet, findings.parquet, manifest.json and report.html. Unusable parts
    of the input are reported and left out. Without a start pose (vehicle file or --start) the
    vehicle is searched for: with at least two radio heads along a road, otherwise with three.
    --smooth adds smoothed.tum, smoothed.parquet and the topic /access_av/smoothed.

    Odometry, CSV: time_s; distance_m or speed_mps or both; optional yaw_rate_radps. Two wheels:
    left_m and right_m, or left_mps and right_mps, with odometer.track_width_m of the vehicle.

    Odometry, MCAP or rosbag2: nav_msgs/Odometry. If its twist has no yaw rate, the yaw rate is that
    of a sensor_msgs/Imu (z axis up) or of the pose's orientation.

    Angles, CSV or Parquet: time_s; pci; phase_rad (electrical) and phase_sigma_rad, or angle_rad
    (from the array axis) and angle_sigma_rad; optional ssb_index and snr_db.

    Ranges, CSV: time_s; pci; range_m (two-way) or delay_ns (one-way) or delay_samples and
    sample_rate_hz; optional ssb_index, and sigma_m or delay_sigma_ns, by default ranging.sigma_m of
    the vehicle. Or the log (.log, .txt) of an OpenAirInterface UE with delays of PRS: the gNB is
    the pci, the resource the ssb_index. Ranges need a start pose. Without --odometry, the receiver
    is stationary: the command writes position.json and trajectory.tum, and needs no start.

    Truth, TUM: lines t x y z qx qy qz qw at most 1 s apart; # begins a comment. The truth must
    cover half of the drive. Its orientation is not used.

    Site, TOML: radio_heads with pci and position_m; optional road with polyline_m, segments, or
    file (GeoJSON or CSV). docs/locate.md has examples of sites and vehicles.

    --sweep changes a key that begins with site. or vehicle.; --against names another vehicle. Both
    locate the drive again, compare the errors with --truth, and write compared.parquet.

    Exit code 0: located. 2: unusable input. 3: not reliable (never found, unavailable for more than
    a fifth of the time or at the end, displaced by more than 0.5 m by a reported fault of the
    input, or moved by ranges in frequent jumps); the message names the input to check.
    """
    from access_av.drives import recorded as drives
    from access_av.drives.recorded import Drive
    from access_av.report.located import render_located
    from access_av.report.parts import compared_section
    from access_av.run.operation import Operation
    from access_av.tables.results_directory import ResultsDirectory, json_text

    start_unknown = start is not None and start.strip() == "unknown"
    pose = None if start is None or start_unknown else _pose(start)
    plant, carrier = opt.load_site_and_vehicle(site, vehicle, pose)
    others = {name: opt.load_site_and_vehicle(site, name, pose) for name in compare or ()}
    if odometry is None:
        if smooth or vary or compare or start_unknown:
            raise InputError(
                "--odometry: missing; --smooth, --sweep, --against and --start unknown need a drive"
            )
        _locate_stationary(plant, carrier, recording, pose, truth, out, as_json=as_json)
        return
    beliefs = variants((plant, carrier), vary, others, _changed)
    if len(beliefs) > 1 and truth is None:
        raise InputError("--sweep, --against: add --truth FILE, because the errors are compared")
    true = None if truth is None else drives.read_tum(truth)
    directory = ResultsDirectory.create("locate", out)
    located = dict[str, Drive]()
    with progress("Locating") as tick:
        for label, (believed_site, believed_vehicle) in beliefs.items():
            located[label] = drives.locate(
                believed_site,
                odometry,
                recording,
                vehicle=believed_vehicle,
                topic=topic,
                imu_topic=imu_topic,
                start_time_s=start_time_s,
                start=pose,
                start_unknown=start_unknown,
                smooth=smooth and not located,
            )
            tick(len(located), len(beliefs))
    drive = next(iter(located.values()))
    comparison = _compare_variants(located, true, sorted(percentile or PERCENTS))
    if drive.smoothed is not None and drive.smoothed.is_empty() and not _lost(drive):
        raise InputError(f"{vehicle}: --smooth needs localizer.kind = tracker")
    numbers = drives.summary(drive, truth)
    doubt = None if true is None else drives.truth_doubt(drive, true)
    write_compared(comparison, directory)
    drive.write_mcap(directory.path / "drive.mcap")
    drive.write_tum(directory.path / "trajectory.tum")
    directory.write_table("poses.parquet", drive.poses)
    directory.write_table("angles.parquet", drive.angles)
    if not drive.ranges.is_empty():
        directory.write_table("ranges.parquet", drive.ranges)
    directory.write_table("findings.parquet", drive.findings)
    if drive.smoothed is not None:
        directory.write_table("smoothed.parquet", drive.smoothed)
        drive.write_smoothed_tum(directory.path / "smoothed.tum")
    page = render_located(drive, plant, carrier, numbers, true, compared_section(comparison))
    directory.write_text("report.html", page)
    directory.write_text("site.toml", plant.to_toml())
    directory.write_text("vehicle.toml", carrier.to_toml())
    result: dict[str, Any] = {
        **numbers,
        "lost_share": drive.lost_share,
        "unavailable_share": drive.unavailable_share,
        "remarks": drive.remarks,
        "diagnoses": drive.diagnoses,
        "suspicions": drive.suspicions,
        **({} if doubt is None else {"truth": doubt}),
    }
    directory.write_manifest(
        recording=str(recording), odometry=str(odometry), **result, warnings=plant.warnings(carrier)
    )
    directory.link_latest()
    if as_json:
        more = {"compared": records(comparison), "directory": str(directory.path)}
        print(json_text({**result, **more}))
    else:
        _show(drive, numbers)
        if doubt is not None:
            show_warning(f"{truth}: {doubt}")
        show_compared(comparison)
        if (operation := Operation.under(carrier, drive.poses)) is not None:
            console.print(f"{operation.in_words()} {operation.what_helps()}".strip())
        say(f"Files: {directory.path}")
    if not drive.is_reliable:
        errors.print(_unreliable(drive), style="red", soft_wrap=True)
        raise typer.Exit(UNRELIABLE)


def _locate_stationary(
    site: Site,
    vehicle: Vehicle,
    recording: Path,
    pose: tuple[float, float, float] | None,
    truth: Path | None,
    out: Path | None,
    *,
    as_json: bool,
) -> None:
    """Locates a stationary receiver from ranges, and writes and prints its position."""
    from access_av.drives.recorded import read_tum
    from access_av.drives.stationary import locate_stationary
    from access_av.tables.results_directory import ResultsDirectory, json_text

    near_m = None if pose is None else pose[:2]
    found = locate_stationary(site, vehicle, recording, near_m=near_m)
    numbers: dict[str, Any] = {
        "x_m": found.x_m,
        "y_m": found.y_m,
        "covariance_m2": found.covariance_m2.tolist(),
        "std_m": found.std_m,
        "ranges": found.ranges,
        "radio_heads": found.radio_heads,
        "alternatives_m": found.alternatives_m,
        "remarks": found.remarks,
    }
    if truth is not None:
        true = read_tum(truth)
        error_m = (
            found.x_m - float(true["x_m"].median()),  # type: ignore[arg-type]
            found.y_m - float(true["y_m"].median()),  # type: ignore[arg-type]
        )
        numbers["error_m"] = math.hypot(*error_m)
        numbers["nees_per_axis"] = found.nees_per_axis(error_m)
    directory = ResultsDirectory.create("locate", out)
    directory.write_json("position.json", numbers)
    line = f"0 {found.x_m:.6f} {found.y_m:.6f} 0 0 0 0 1\n"
    directory.write_text("trajectory.tum", line)
    directory.write_text("site.toml", site.to_toml())
    directory.write_text("vehicle.toml", vehicle.to_toml())
    directory.write_manifest(
        recording=str(recording), odometry=None, **numbers, warnings=site.warnings(vehicle)
    )
    directory.link_latest()
    if as_json:
        print(json_text({**numbers, "directory": str(directory.path)}))
        return
    show_remarks(found.remarks, "manifest.json")
    say(
        f"{found.ranges} ranges of {found.radio_heads} radio heads. "
        f"Position: x {found.x_m:.2f} m, y {found.y_m:.2f} m, σ {found.std_m:.2f} m."
    )
    if truth is not None:
        console.print(f"Horizontal error: {numbers['error_m']:.3f} m.")
    say(f"Files: {directory.path}")


def _changed(belief: tuple[Site, Vehicle], keys: dict[str, Any]) -> tuple[Site, Vehicle]:
    """Returns site and vehicle with changed keys."""
    parts: dict[str, dict[str, Any]] = {"site": {}, "vehicle": {}}
    for key, value in keys.items():
        part, _, rest = key.partition(".")
        if part not in parts or not rest:
            raise InputError(
                f"--sweep {key}: keys of a recorded drive begin with site. or vehicle."
            )
        parts[part][rest] = value
    site, vehicle = belief
    return site.with_overrides(parts["site"]), vehicle.with_overrides(parts["vehicle"])


def _compare_variants(
    located: dict[str, Drive], truth: pl.DataFrame | None, percents: list[float]
) -> list[Compared]:
    """Compares the variants of a located drive; empty for a single variant."""
    from access_av.drives.recorded import in_stretches
    from access_av.study.compare import beside_first

    if truth is None or len(located) == 1:
        return []
    return beside_first([in_stretches(it, truth, name) for name, it in located.items()], percents)


def _show(drive: Drive, numbers: dict[str, float]) -> None:
    # Suspicions are part of the verdict.
    remarks = [remark for remark in drive.remarks if remark not in drive.suspicions]
    show_remarks(remarks, "report.html")
    kind, accepted = (
        ("ranges", "accepted_ranges") if "ranges" in numbers else ("angles", "accepted")
    )
    console.print(
        f"{numbers[kind]:.0f} {kind}, {numbers[accepted]:.0f} accepted, "
        f"in {numbers['duration_s']:.1f} s."
    )
    if "found_s" in numbers:
        console.print(
            f"Position found after {numbers['found_m']:.1f} m and {numbers['found_s']:.1f} s."
        )
    if "rms_error_m" in numbers:
        console.print(
            f"Horizontal error: RMS {numbers['rms_error_m']:.3f} m, "
            f"90th percentile {numbers['p90_error_m']:.3f} m, over "
            f"{numbers['compared_share']:.0%} of the drive."
        )
    if "smoothed_rms_error_m" in numbers:
        console.print(f"Smoothed: RMS {numbers['smoothed_rms_error_m']:.3f} m.")


def _unreliable(drive: Drive) -> str:
    from access_av.drives.recorded import JUMP_M, MAX_UNAVAILABLE

    if _lost(drive):
        happened = "the vehicle was never found. Give --start, or a longer drive. "
    elif drive.unavailable_share > max(drive.lost_share, MAX_UNAVAILABLE):
        happened = f"the position was unavailable for {drive.unavailable_share:.0%} of the time. "
    elif drive.lost_share:
        at_end = ", including the end," if drive.poses["lost"][-1] else ""
        happened = (
            f"for {drive.lost_share:.0%} of the time{at_end} the angles contradicted the position. "
        )
    elif drive.jumps_repeatedly:
        happened = f"the position jumped {drive.jumps} times by more than {JUMP_M} m. "
    elif drive.rejects_its_ranges:
        happened = "too many ranges contradict the position. "
    else:
        happened = ""
    if drive.suspicions:
        check = " ".join(f"{suspicion}." for suspicion in drive.suspicions)
    elif drive.has_ranges_only:
        check = (
            "Check, in this order: start pose, positions (order x, y, height) and PCIs of the "
            "radio heads, yaw_rate_radps (unit, sign), the clocks of ranges and odometry, "
            "range_m (unit; distance, not the way there and back), ranging.sigma_m, "
            "odometer.scale."
        )
    else:
        check = (
            "Check, in this order: start pose, array.mounting_rad (sign, mirrored array), "
            "positions and PCIs of the radio heads, drive (road or differential), "
            "yaw_rate_radps (unit, sign), phase_rad against angle_rad, the clocks, odometer.scale."
        )
    return f"not reliable: {happened}{check}"


def _lost(drive: Drive) -> bool:
    return bool(drive.poses["searching"].all())


def _pose(text: str) -> tuple[float, float, float]:
    if text.strip() == "scratch":
        raise InputError("--start scratch was renamed in version 0.2.0: write --start unknown")
    try:
        x_m, y_m, heading_rad = (float(part) for part in text.split(","))
    except ValueError as error:
        raise InputError(
            f"--start {text}: write x and y in metres and the heading in radians, as 12.5,-3,0.1, "
            "or the word unknown"
        ) from error
    if not all(map(math.isfinite, (x_m, y_m, heading_rad))):
        raise InputError(f"--start {text}: the numbers must be finite")
    if abs(heading_rad) > math.tau:
        raise InputError(f"--start {text}: the heading exceeds 2π; write it in radians")
    return x_m, y_m, heading_rad
