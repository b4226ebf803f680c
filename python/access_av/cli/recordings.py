"""Commands that evaluate samples: ``record scan``, ``record aoa``, ``record angles``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, is_narrow, progress, say, show_warning, table
from access_av.errors import InputError
from access_av.tables.numbers import unsigned_zero

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.drives.angle_log import AngleLog
    from access_av.signal.recorded_angles import BurstAngle

app = typer.Typer()

NOT_FOUND = """\
Possible remedies:
  --centre-hz, if the recording contains a wrong centre frequency
  --ssb-freq-hz and --scs-khz, which find weaker cells; also --cfo-ppm 20 for poor oscillators
  a recording of at least 160 ms, the maximum SSB period of a cell"""


@opt.command(app, "Samples", "record scan captures/*.sigmf-meta --json")
def scan(
    recordings: Annotated[
        list[Path],
        Argument(help="SigMF recordings; with --sample-rate-hz raw cf32 files, one per channel."),
    ],
    ssb_freq_hz: Annotated[
        float | None,
        Option(
            min=0.0,
            help="Centre frequency of the SSB, in Hz.",
            show_default="all points of the synchronization raster",
        ),
    ] = None,
    scs_khz: Annotated[
        int | None, Option(help="Subcarrier spacing in kHz: 15 or 30.", show_default="both")
    ] = None,
    cfo_ppm: Annotated[
        float | None,
        Option(
            min=0.0, help="Maximum frequency offset of the oscillator, in ppm; needs --ssb-freq-hz."
        ),
    ] = None,
    centre_hz: Annotated[
        float | None,
        Option(
            min=0.0, help="Centre frequency of the recording, in Hz.", show_default="as recorded"
        ),
    ] = None,
    sample_rate_hz: Annotated[
        float | None, Option(help="Sample rate of raw cf32 files, in Hz.")
    ] = None,
    spacing_wavelengths: Annotated[
        float | None,
        Option(
            min=0.01,
            max=10.0,
            help="Antenna spacing, in wavelengths.",
            show_default="as recorded, or 0.5",
        ),
    ] = None,
    calibration: Annotated[
        str | None,
        Option(
            metavar="GAINS",
            help="Complex gain of each channel, for example 1,0.9+0.2j,1j,-1.",
            show_default="as recorded",
        ),
    ] = None,
    unconfirmed: Annotated[bool, Option(help="Also list SSBs without a decoded message.")] = False,
    as_json: opt.AsJson = False,
) -> None:
    """Find every SSB in recordings of unknown cells.

    Prints cell, beam, time, frequency offset, SNR and message of each SSB with a valid checksum.
    With several channels also the angle of arrival with its standard deviation (receiver noise
    only). Clipped, silent and exchanged channels are reported.
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
            _show_cells(path.name, cells)
        else:
            say(f"{path}: no SSB found. Searched:")
            for where in result.looked:
                say(f"  {where}")
            say(NOT_FOUND)
        if weak:
            console.print(f"{len(weak)} SSBs without a decoded message: --unconfirmed lists them.")
    if as_json:
        print(json_text(found))


@opt.command(app, "Samples", "record aoa captures/array1.sigmf-meta --json")
def aoa(
    recording: Annotated[Path, Argument(help="SigMF recording of an array.")],
    spacing: Annotated[
        float | None,
        Option(
            min=0.01,
            max=10.0,
            help="Spacing of a linear array, in wavelengths.",
            show_default="as recorded",
        ),
    ] = None,
    as_json: opt.AsJson = False,
) -> None:
    """Estimate angles of arrival from a multi-antenna recording.

    Reference bursts calibrate the channels; every other annotated burst gives an angle. Azimuths
    are counter-clockwise from the array's broadside. Standard deviations cover the receiver noise
    only.
    """
    from access_av.signal.recorded_angles import estimate_bursts
    from access_av.tables.results_directory import json_text

    with progress("Estimating"):
        bursts = estimate_bursts(recording, spacing_wavelengths=spacing)
    if as_json:
        print(json_text([burst.as_record() for burst in bursts]))
    else:
        _show_bursts(bursts)


@opt.command(
    app,
    "Samples",
    "record angles drive/iq.sigmf-meta --site drive/site.toml "
    "--vehicle drive/vehicle.toml --out angles",
)
def angles(
    recording: Annotated[Path, Argument(help="SigMF recording of the array.")],
    site: opt.SiteOption,
    vehicle: opt.VehicleOption = "default",
    start_time_s: opt.StartTime = 0.0,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Estimate the angles of a recording's SSBs, as input of record locate.

    Uses the vehicle's receiver and estimator for every SSB of the site's radio heads. Writes
    angles.csv, angles.parquet (inputs of [bold]access-av record locate --recording[/]), site.toml
    and vehicle.toml.

    phase_sigma_rad covers receiver noise and the site's scatter (rician_k_db),
    phase_noise_sigma_rad only receiver noise. Neither covers mounting and calibration of the array,
    whose standard deviations are in the vehicle file.
    """
    from access_av.drives.angle_log import estimate_angles
    from access_av.tables.results_directory import ResultsDirectory, json_text

    plant, carrier = opt.load_site_and_vehicle(site, vehicle)
    with progress("Estimating"):
        found = estimate_angles(plant, recording, vehicle=carrier, start_time_s=start_time_s)
    directory = ResultsDirectory.create("angles", out)
    directory.write_text("angles.csv", found.csv())
    directory.write_table("angles.parquet", found.angles)
    directory.write_text("site.toml", found.site.to_toml())
    directory.write_text("vehicle.toml", found.vehicle.to_toml())
    counts = {"angles": found.angles.height, "resolved": int(found.angles["resolved"].sum())}
    directory.write_manifest(
        recording=str(recording),
        start_time_s=start_time_s,
        found=counts,
        warnings=[*plant.warnings(carrier), *found.warnings],
    )
    directory.link_latest()
    if as_json:
        values = {**counts, "warnings": found.warnings, "directory": str(directory.path)}
        print(json_text(values))
        return
    for warning in found.warnings:
        show_warning(warning)
    _show_angles(found)
    say(f"Files: {directory.path}")


def _gains(text: str) -> list[complex]:
    try:
        return [complex(part.replace(" ", "")) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--calibration {text}: write one complex number per channel, such as 1,0.9+0.2j,1j,-1"
        ) from error


def _show_angles(log: AngleLog) -> None:
    """Prints the angles of a recording: counts and medians per SSB."""
    made = table(["PCI", "SSB", "angles", "resolved", "SNR dB", "σ rad", "σ noise rad"], text=0)
    for row in log.by_ssb().iter_rows():
        *counts, snr_db, sigma_rad, noise_rad = row
        made.add_row(*map(str, counts), f"{snr_db:.1f}", f"{sigma_rad:.4f}", f"{noise_rad:.4f}")
    console.print(made)


def _show_bursts(bursts: Sequence[BurstAngle]) -> None:
    """Prints the angles of bursts, with errors if the truth is known."""
    made = table(["sample", "azimuth °", "σ °", "SNR dB", "truth °", "error °", "doubt"], text=0)
    for burst in bursts:
        azimuth_deg, truth_deg = burst.azimuth_deg, burst.truth_deg
        made.add_row(
            str(burst.sample_start),
            unsigned_zero(f"{azimuth_deg:.2f}"),
            f"{burst.sigma_deg:.3f}",
            f"{burst.snr_db:.1f}",
            "" if truth_deg is None else f"{truth_deg:.2f}",
            "" if truth_deg is None else unsigned_zero(f"{azimuth_deg - truth_deg:+.2f}"),
            burst.doubt or "–",
        )
    console.print(made)
    # Imported here, because it imports NumPy.
    from access_av.signal.recorded_angles import mean_absolute_error_deg

    error_deg = mean_absolute_error_deg(bursts)
    if error_deg is not None:
        console.print(f"Mean absolute error {error_deg:.2f}° over {len(bursts)} bursts.")


def _show_cells(title: str, cells: Sequence[dict[str, Any]]) -> None:
    """Prints the SSBs of one recording; a narrow terminal omits their time and frequency."""
    with_angles = any("azimuth_deg" in cell for cell in cells)
    columns = ["PCI", "SSB", "SFN", "SNR dB", "CFO Hz"]
    if with_angles:
        columns += ["azimuth °", "σ °"]
    if not is_narrow():
        columns += ["sample", "MHz", "kHz"] + ["doubt"] * with_angles
    made = table(columns, title=title, text=0)
    for cell in cells:
        texts = {
            "PCI": str(cell["pci"]),
            "SSB": str(cell["ssb_index"]),
            "SFN": "–" if cell["sfn"] is None else str(cell["sfn"]),
            "SNR dB": f"{cell['snr_db']:.1f}",
            "CFO Hz": unsigned_zero(f"{cell['cfo_hz']:.1f}"),
            "azimuth °": unsigned_zero(f"{cell['azimuth_deg']:.2f}")
            if "azimuth_deg" in cell
            else "–",
            "σ °": f"{cell['sigma_deg']:.3f}" if "sigma_deg" in cell else "–",
            "doubt": cell.get("doubt") or "–",
            "sample": str(cell["sample_start"]),
            "MHz": f"{cell['ssb_freq_hz'] / 1e6:.3f}",
            "kHz": str(cell["scs_khz"]),
        }
        made.add_row(*(texts[column] for column in columns))
    console.print(made)
