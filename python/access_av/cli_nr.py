"""Commands that take or make recordings: ``scan``, ``synth``, ``locate``."""

from __future__ import annotations

import json
import math
from pathlib import Path  # noqa: TC003 (Typer reads annotations at run time)
from typing import TYPE_CHECKING, Annotated

import typer

from access_av.errors import InputError
from access_av.terminal import console, errors, show_cells

if TYPE_CHECKING:
    from access_av.drives import Drive

app = typer.Typer()

MOST_REMARKS = 10


@app.command(
    epilog="Example: [bold]access-av scan captures/*.sigmf-meta --json[/]",
)
def scan(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="SigMF recordings; with --sample-rate-hz one raw cf32 file a channel."),
    ],
    ssb_freq_hz: Annotated[
        float | None,
        typer.Option(min=0.0, help="Centre of the SSB; else the raster is searched."),
    ] = None,
    scs_khz: Annotated[
        int | None, typer.Option(help="Subcarrier spacing, 15 or 30; else both are tried.")
    ] = None,
    centre_hz: Annotated[
        float | None, typer.Option(min=0.0, help="Centre of the recording; else as recorded.")
    ] = None,
    sample_rate_hz: Annotated[
        float | None, typer.Option(help="The files are raw cf32, and this is their rate.")
    ] = None,
    spacing_wavelengths: Annotated[
        float | None,
        typer.Option(min=0.01, max=10.0, help="Antenna spacing; else as recorded, or 0.5."),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            metavar="GAINS", help="Gain of each channel, as 1,0.9+0.2j,1j,-1; else as recorded."
        ),
    ] = None,
    unconfirmed: Annotated[
        bool, typer.Option(help="Also SSBs too weak for their message to be decoded.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Find every SSB in recordings of cells that nobody has described.

    Prints cell, beam, time, frequency offset, strength and message of each SSB whose message passes
    its checksum, and with several channels the angle it arrives from. Channels that are clipped,
    silent or exchanged are named.
    """
    from access_av import nr
    from access_av._core import Recording

    gains = None if calibration is None else _gains(calibration)
    if sample_rate_hz is not None:
        opened = [Recording.open_raw(recordings, sample_rate_hz=sample_rate_hz)]
    else:
        opened = [Recording.open(path) for path in recordings]
    found = []
    for path, recording in zip(recordings, opened, strict=False):
        for warning in recording.warnings:
            errors.print(f"[yellow]warning:[/] {warning}", soft_wrap=True)
        result = nr.scan_as_recorded(
            recording,
            spacing_wavelengths=spacing_wavelengths,
            calibration=gains,
            centre_frequency_hz=centre_hz,
            ssb_freq_hz=ssb_freq_hz,
            scs_khz=scs_khz,
        )
        for fault in result.faults:
            errors.print(f"[yellow]warning:[/] {path}: {fault}", soft_wrap=True)
        cells = [nr.record(cell) for cell in result.cells]
        weak = [] if unconfirmed else [cell for cell in cells if cell["mib_bits"] is None]
        cells = [cell for cell in cells if cell not in weak]
        found += [{"recording": str(path), **cell} for cell in cells]
        if as_json:
            continue
        if cells:
            show_cells(path.name, cells)
        else:
            console.print(f"{path}: no SSB found.", soft_wrap=True)
        if weak:
            console.print(f"{len(weak)} more without a message: --unconfirmed lists them.")
    if as_json:
        print(json.dumps(found, indent=2))


@app.command(
    epilog="Example: [bold]access-av synth paper-real-odometry-2 --out drive --duration-s 20[/]",
)
def synth(
    scenario: Annotated[str, typer.Argument(help="Shipped name, or path of a TOML file.")],
    out: Annotated[Path, typer.Option(help="Directory for the files.")],
    duration_s: Annotated[
        float | None, typer.Option(min=0.02, help="From the start on; else the whole drive.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same samples.")] = 1,
    run: Annotated[int, typer.Option(min=0, help="Number of the run.")] = 0,
    continuous: Annotated[
        bool, typer.Option("--continuous", help="Also the time between the bursts (large).")
    ] = False,
    datatype: Annotated[str, typer.Option(help="ci16_le or cf32_le.")] = "ci16_le",
) -> None:
    """Record a scenario's drive: samples of all antennas, odometry, site, truth.

    The samples are SigMF, so that any other receiver can be fed with them; the truth is in their
    annotations and in truth.tum. Without --continuous the receiver sleeps between the bursts, and
    each capture says where in time it belongs (core:global_index).
    """
    from access_av import drives

    made = drives.synthesize(
        scenario,
        out,
        seed=seed,
        run=run,
        duration_s=duration_s,
        continuous=continuous,
        datatype=datatype,
    )
    console.print(
        f"{made.bursts} bursts, {made.samples} samples per antenna: {made.recording}",
        soft_wrap=True,
    )


@app.command(
    epilog="Example: [bold]access-av locate --recording drive/iq.sigmf-meta "
    "--odometry drive/odometry.csv --site drive/site.toml --truth drive/truth.tum[/]",
)
def locate(
    recording: Annotated[Path, typer.Option(help="SigMF recording, or CSV log of angles.")],
    odometry: Annotated[Path, typer.Option(help="CSV, or MCAP with nav_msgs/Odometry.")],
    site: Annotated[Path, typer.Option(help="TOML: radio heads, road, array.")],
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; else a new one in results/.")
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(help="TUM trajectory to compare with, where there is one.")
    ] = None,
    topic: Annotated[str | None, typer.Option(help="Topic of the odometry in the MCAP.")] = None,
    start_time_s: Annotated[
        float, typer.Option(help="Time of the first sample by the odometry's clock.")
    ] = 0.0,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,HEADING",
            help="Initial pose in m, m, rad, in place of the site's; or the word scratch.",
        ),
    ] = None,
    smooth: Annotated[
        bool, typer.Option("--smooth", help="Also each pose by the angles that came after it.")
    ] = False,
) -> None:
    """Locate a recorded drive.

    Writes drive.mcap (poses with covariance and twist, verdicts, diagnostics), trajectory.tum,
    poses.parquet, angles.parquet and report.html. Items of the input that cannot be used are
    named, and the rest is used. Without an initial pose, in the site file or by --start, the
    vehicle is found along the road; that takes two radio heads or more. --smooth adds
    smoothed.tum, smoothed.parquet and the topic /access_av/smoothed.
    """
    from access_av import drives
    from access_av.files import ResultsDirectory
    from access_av.report.located import render_located

    from_scratch = start is not None and start.strip() == "scratch"
    drive = drives.locate(
        site,
        odometry,
        recording,
        topic=topic,
        start_time_s=start_time_s,
        start=None if start is None or from_scratch else _pose(start),
        from_scratch=from_scratch,
        smooth=smooth,
    )
    if drive.smoothed is not None and drive.smoothed.is_empty() and not _lost(drive):
        raise InputError(f"{site}: --smooth needs localizer.kind = tracker")
    numbers = drives.summary(drive, truth)
    directory = ResultsDirectory.create("locate", out)
    drive.write_mcap(directory.path / "drive.mcap")
    drive.write_tum(directory.path / "trajectory.tum")
    directory.write_table("poses.parquet", drive.poses)
    directory.write_table("angles.parquet", drive.angles)
    if drive.smoothed is not None:
        directory.write_table("smoothed.parquet", drive.smoothed)
        drive.write_smoothed_tum(directory.path / "smoothed.tum")
    site_text = site.read_text(encoding="utf-8")
    directory.write_text("report.html", render_located(drive, site_text, numbers))
    directory.write_text("site.toml", site_text)
    directory.write_manifest(recording=str(recording), odometry=str(odometry), **numbers)
    directory.link_latest()
    for remark in drive.remarks[:MOST_REMARKS]:
        errors.print(f"[yellow]warning:[/] {remark}", soft_wrap=True)
    if len(drive.remarks) > MOST_REMARKS:
        errors.print(f"[yellow]warning:[/] {len(drive.remarks) - MOST_REMARKS} more like these")
    console.print(
        f"{numbers['angles']:.0f} angles, {numbers['accepted']:.0f} accepted, "
        f"in {numbers['duration_s']:.1f} s."
    )
    if "found_s" in numbers:
        console.print(
            f"Found after {numbers['found_m']:.1f} m and {numbers['found_s']:.1f} s from scratch."
        )
    elif _lost(drive):
        console.print("Not found: several places on the road fit the angles.")
    if "rms_error_m" in numbers:
        console.print(
            f"Horizontal error: RMS {numbers['rms_error_m']:.3f} m, "
            f"90th percentile {numbers['p90_error_m']:.3f} m."
        )
    if "smoothed_rms_error_m" in numbers:
        console.print(f"Smoothed: RMS {numbers['smoothed_rms_error_m']:.3f} m.")
    console.print(f"Files: {directory.path}", soft_wrap=True)


def _lost(drive: Drive) -> bool:
    return bool(drive.poses["searching"].all())


def _pose(text: str) -> tuple[float, float, float]:
    try:
        x_m, y_m, heading_rad = (float(part) for part in text.split(","))
    except ValueError as error:
        raise InputError(
            f"--start {text}: write x and y in metres and the heading in radians, as 12.5,-3,0.1, "
            "or the word scratch"
        ) from error
    if not all(map(math.isfinite, (x_m, y_m, heading_rad))):
        raise InputError(f"--start {text}: the numbers must be finite")
    return x_m, y_m, heading_rad


def _gains(text: str) -> list[complex]:
    try:
        return [complex(part.replace(" ", "")) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--calibration {text}: write one complex number a channel, as 1,0.9+0.2j,1j,-1"
        ) from error
