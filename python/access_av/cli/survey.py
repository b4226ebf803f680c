"""Command ``record survey``: site and vehicle parameters estimated from ordinary drives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, say, show_remarks, show_warning, table
from access_av.errors import InputError

if TYPE_CHECKING:
    from access_av._core import Site, Vehicle

app = typer.Typer()


@opt.command(
    app,
    "Drives",
    "record synth yard --angles --out drives/1; "
    "access-av record survey drives/* --site yard --vehicle drives/1/vehicle.toml",
)
def survey(
    drives: Annotated[
        list[Path],
        Argument(
            help="Folders of drives: odometry.csv or odometry.mcap, angles.csv, vehicle.toml; or "
            "folders of ranges: ranges.csv, truth.tum."
        ),
    ],
    site: opt.SiteOption,
    vehicle: opt.VehicleOption,
    position_std_m: Annotated[
        float,
        Option(
            min=1e-3,
            max=100.0,
            help="Prior σ of radio-head x and y, in m, if the site file has none.",
        ),
    ] = 2.0,
    mounting_std_rad: Annotated[
        float,
        Option(
            min=1e-6, max=3.2, help="Prior σ of the mounting, in rad, if the vehicle file has none."
        ),
    ] = 0.05,
    phase_std_rad: Annotated[
        float,
        Option(
            min=1e-6,
            max=3.2,
            help="Prior σ of the phase per element, in rad, if the vehicle file has none.",
        ),
    ] = 0.1,
    threads: opt.Threads = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Survey radio-head positions and array mounting, or range offsets, from drives.

    Estimates the positions, the mounting of the array and its phase per element jointly from the
    angles of all drives. The road and the start poses define the frame. Parameters that the drives
    do not determine are reported and stay unchanged. Writes site.toml and vehicle.toml with the
    estimates, their standard deviations, and the posterior probability of a displaced site plan,
    survey.parquet, covariance.json and manifest.json.

    Range offsets: every folder contains ranges.csv (or ranges.log of an OpenAirInterface UE) and
    truth.tum, the position of a stationary receiver (one line) or of a drive. Writes site.toml with
    range_offset_m and range_offset_std_m of the radio heads, offsets.json and manifest.json. At
    least two positions determine the standard deviation.
    """
    from access_av.drives import self_survey
    from access_av.drives.range_survey import log_of
    from access_av.tables.results_directory import ResultsDirectory, json_text

    for number, folder in enumerate(drives):
        if folder.resolve() in (earlier.resolve() for earlier in drives[:number]):
            raise InputError(f"{folder}: given twice; a drive counts once")
    plant, carrier = opt.load_site_and_vehicle(site, vehicle)
    with_ranges = [folder for folder in drives if log_of(folder) is not None]
    if with_ranges:
        if other := next((folder for folder in drives if folder not in with_ranges), None):
            raise InputError(f"{other}: no range log; a survey is of ranges or of angles")
        _survey_offsets(plant, carrier, drives, out, as_json=as_json)
        return
    logged = [self_survey.read_drive(folder) for folder in drives]
    with progress("Replays") as tick:
        found = self_survey.survey(
            plant,
            carrier,
            logged,
            position_std_m=position_std_m,
            mounting_std_rad=mounting_std_rad,
            phase_std_rad=phase_std_rad,
            threads=threads,
            progress=tick,
        )
    directory = ResultsDirectory.create("survey", out)
    rows = found.table()
    directory.write_text("site.toml", found.site.to_toml())
    directory.write_text("vehicle.toml", found.vehicle.to_toml())
    directory.write_table("survey.parquet", rows)
    keys = [it.key for it in found.parameters]
    covariance = {"parameters": keys, "covariance": found.covariance.tolist()}
    directory.write_json("covariance.json", covariance)
    directory.write_manifest(
        site=site,
        vehicle=vehicle,
        drives=[str(it) for it in drives],
        warnings=plant.warnings(carrier),
    )
    if as_json:
        figures = {
            "angles": found.angles,
            "used": found.used,
            "nis": found.nis,
            "site_frame_offset": found.site_frame_offset,
        }
        print(json_text({**figures, "parameters": rows.to_dicts(), "directory": directory.path}))
        return
    made = table(["parameter", "unit", "before", "estimate", "σ"], title="Survey", text=2)
    for it in found.parameters:
        learnt = (f"{it.found:.4f}", f"{it.std:.4f}") if it.is_learnt else ("–", "not determined")
        made.add_row(it.key, it.unit, f"{it.before:.4f}", *learnt)
    console.print(made)
    if found.used < 0.5 * found.angles:
        show_warning(
            f"{found.angles - found.used} of {found.angles} angles are outliers and were not "
            f"used; check site, vehicle and start poses"
        )
    for it in found.parameters:
        if not it.is_as_believed:
            say(
                f"{it.key} deviates by {it.found - it.before:+.3f} {it.unit} from the given value "
                f"with standard deviation {it.std_before:g}: measure it again"
            )
    say(
        f"{found.used} of {found.angles} angles used; mean normalized innovation squared "
        f"{found.nis:.2f} (correct model: at most 1)"
    )
    if found.site_frame_offset is not None:
        say(
            f"posterior probability of a displaced site plan: {found.site_frame_offset:.1g} "
            f"(vehicle.toml, {self_survey.OFFSET_KEY})"
        )
    say(f"{directory.path}/site.toml, vehicle.toml")


def _survey_offsets(
    site: Site, vehicle: Vehicle, folders: list[Path], out: Path | None, *, as_json: bool
) -> None:
    """Estimates range offsets, writes the site, and prints the offsets."""
    from access_av.drives.range_survey import survey_offsets
    from access_av.tables.results_directory import ResultsDirectory, json_text

    found = survey_offsets(site, vehicle, folders)
    directory = ResultsDirectory.create("survey", out)
    directory.write_text("site.toml", found.site.to_toml())
    directory.write_json("offsets.json", found.offsets.to_dicts())
    directory.write_manifest(
        site=site.name, drives=[str(it) for it in folders], remarks=found.remarks
    )
    if as_json:
        rows = found.offsets.to_dicts()
        print(json_text({"offsets": rows, "directory": str(directory.path)}))
        return
    show_remarks(found.remarks, "manifest.json")
    made = table(
        ["radio head", "positions", "ranges", "offset / m", "σ / m"], title="Ranges", text=1
    )
    for row in found.offsets.iter_rows(named=True):
        offset_m, std_m = row["range_offset_m"], row["range_offset_std_m"]
        made.add_row(
            f"pci {row['pci']}, ssb_index {row['ssb_index']}",
            f"{row['positions']}",
            f"{row['ranges']}",
            "–" if offset_m is None else f"{offset_m:+.2f}",
            "unknown" if std_m is None else f"{std_m:.2f}",
        )
    console.print(made)
    say(f"{directory.path}/site.toml")
