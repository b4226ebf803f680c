"""Commands that look into recordings: ``scan``, ``aoa``, ``angles``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from access_av.cli.options import AsJson, Out, load_site_and_vehicle
from access_av.cli.terminal import (
    console,
    progress,
    show_angles,
    show_bursts,
    show_cells,
    show_warning,
)
from access_av.errors import InputError

app = typer.Typer()

NOT_FOUND = """\
Try --centre-hz if the recording's centre is not as it states; --ssb-freq-hz and --scs-khz, which
find weaker cells; with them --cfo-ppm 20 for poor oscillators; a recording of 160 ms or more, the
longest time between the SSBs of a cell."""


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
    cfo_ppm: Annotated[
        float | None,
        typer.Option(min=0.0, help="With --ssb-freq-hz: largest offset of the oscillators."),
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
    as_json: AsJson = False,
) -> None:
    """Find every SSB in recordings of cells that nobody has described.

    Prints cell, beam, time, frequency offset, strength and message of each SSB whose message passes
    its checksum, and with several channels the angle it arrives from, its standard deviation by the
    receiver's noise alone. Channels that are clipped, silent or exchanged are named.
    """
    from access_av._core import Recording
    from access_av.signal import nr
    from access_av.tables.results_directory import json_text

    gains = None if calibration is None else _gains(calibration)
    found = []
    for path in recordings[: None if sample_rate_hz is None else 1]:
        with progress(f"Scanning {path.name}"):
            if sample_rate_hz is None:
                recording = Recording.open(path)
            else:
                recording = Recording.open_raw(recordings, sample_rate_hz=sample_rate_hz)
            result = nr.scan_as_recorded(
                recording,
                spacing_wavelengths=spacing_wavelengths,
                calibration=gains,
                centre_frequency_hz=centre_hz,
                ssb_freq_hz=ssb_freq_hz,
                scs_khz=scs_khz,
                cfo_ppm=cfo_ppm,
            )
        for warning in recording.warnings:
            show_warning(warning)
        for fault in result.faults:
            show_warning(f"{path}: {fault}")
        cells = [nr.record(cell) for cell in result.cells]
        weak = [] if unconfirmed else [cell for cell in cells if cell["mib_bits"] is None]
        cells = [cell for cell in cells if cell not in weak]
        found += [{"recording": str(path), **cell} for cell in cells]
        if as_json:
            continue
        if cells:
            show_cells(path.name, cells)
        else:
            console.print(f"{path}: no SSB found. Looked for were", soft_wrap=True)
            for where in result.looked:
                console.print(f"  {where}", soft_wrap=True)
            console.print(NOT_FOUND, soft_wrap=True)
        if weak:
            console.print(f"{len(weak)} more without a message: --unconfirmed lists them.")
    if as_json:
        print(json_text(found))


@app.command(epilog="Example: [bold]access-av aoa captures/array1.sigmf-meta --json[/]")
def aoa(
    recording: Annotated[Path, typer.Argument(help="SigMF recording of an array.")],
    spacing: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            max=10.0,
            help="Antennas in a row with this spacing in wavelengths; else as recorded.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Estimate angles of arrival from a multi-antenna recording.

    Reference bursts calibrate the channels, every other annotated burst is estimated. Azimuths
    are counter-clockwise from the array's broadside, standard deviations by the receiver's noise
    alone.
    """
    from access_av.signal.recorded_angles import estimate_bursts
    from access_av.tables.results_directory import json_text

    with progress("Estimating"):
        bursts = estimate_bursts(recording, spacing_wavelengths=spacing)
    if as_json:
        print(json_text([burst.as_record() for burst in bursts]))
    else:
        show_bursts(bursts)


@app.command(
    epilog="Example: [bold]access-av angles drive/iq.sigmf-meta --site drive/site.toml "
    "--vehicle drive/vehicle.toml --out angles[/]",
)
def angles(
    recording: Annotated[Path, typer.Argument(help="SigMF recording of the array.")],
    site: Annotated[str, typer.Option(help="Radio heads: shipped name, or TOML file.")],
    vehicle: Annotated[
        str, typer.Option(help="Array, receiver, estimator: shipped name, or TOML file.")
    ] = "default",
    start_time_s: Annotated[
        float, typer.Option(help="Time of the first sample by the odometry's clock.")
    ] = 0.0,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Make a log of angles of a recording's samples, for locate.

    Every SSB of the site's radio heads, as the vehicle's receiver and estimator find it. Writes
    angles.csv and angles.parquet, either of which [bold]access-av locate --recording[/] takes, with
    site.toml and vehicle.toml beside them.

    phase_sigma_rad is all of the error that is believed, the receiver's noise and the site's
    scatter (rician_k_db); phase_noise_sigma_rad is the noise alone. The array's mounting and
    calibration are in neither: the vehicle's file states them, and locate reckons with them.
    """
    from access_av.drives.angle_log import estimate_angles
    from access_av.tables.results_directory import ResultsDirectory, json_text

    plant, carrier = load_site_and_vehicle(site, vehicle)
    with progress("Estimating"):
        found = estimate_angles(plant, recording, vehicle=carrier, start_time_s=start_time_s)
    directory = ResultsDirectory.create("angles", out)
    directory.write_text("angles.csv", found.csv())
    directory.write_table("angles.parquet", found.angles)
    directory.write_text("site.toml", found.site.to_toml())
    directory.write_text("vehicle.toml", found.vehicle.to_toml())
    counts = {
        "angles": found.angles.height,
        "resolved": int(found.angles["resolved"].sum()),
    }
    directory.write_manifest(
        recording=str(recording),
        start_time_s=start_time_s,
        found=counts,
        warnings=[*plant.warnings(carrier), *found.warnings],
    )
    directory.link_latest()
    if as_json:
        told = {**counts, "warnings": found.warnings, "directory": str(directory.path)}
        print(json_text(told))
        return
    for warning in found.warnings:
        show_warning(warning)
    show_angles(found)
    console.print(f"Files: {directory.path}", soft_wrap=True)


def _gains(text: str) -> list[complex]:
    try:
        return [complex(part.replace(" ", "")) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--calibration {text}: write one complex number a channel, as 1,0.9+0.2j,1j,-1"
        ) from error
