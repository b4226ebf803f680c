"""The command ``survey``: site and vehicle as ordinary drives show them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from access_av.cli.options import AsJson, Out, Threads, load_site_and_vehicle
from access_av.cli.terminal import console, progress, show_warning, table
from access_av.errors import InputError

app = typer.Typer()


@app.command(
    epilog="Example: [bold]access-av synth yard --angles --out drives/1; "
    "access-av survey drives/* --site yard --vehicle drives/1/vehicle.toml[/]",
)
def survey(
    drives: Annotated[
        list[Path],
        typer.Argument(help="Folders with odometry.csv or .mcap, angles.csv, vehicle.toml."),
    ],
    site: Annotated[str, typer.Option(help="Radio heads and road: shipped name, or TOML file.")],
    vehicle: Annotated[
        str, typer.Option(help="Array, odometer, localizer: shipped name, or TOML file.")
    ],
    position_std_m: Annotated[
        float,
        typer.Option(min=1e-3, max=100.0, help="Of a radio head's x and y, if the site has none."),
    ] = 2.0,
    mounting_std_rad: Annotated[
        float, typer.Option(min=1e-6, max=3.2, help="Of the array's direction, if none is stated.")
    ] = 0.05,
    phase_std_rad: Annotated[
        float, typer.Option(min=1e-6, max=3.2, help="Of the phase per element, if none is stated.")
    ] = 0.1,
    threads: Threads = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Find out from ordinary drives where the radio heads stand and how the array is mounted.

    Places of radio heads, direction of the array and its phase per element are adjusted together
    until the angles of all drives fit best; the road and the drives' starts hold the frame. What
    the drives say nothing of is named and left as it was. Writes site.toml and vehicle.toml with
    what was learnt and its standard deviations, survey.parquet, covariance.json and manifest.json.
    """
    from access_av.drives import self_survey
    from access_av.tables.results_directory import ResultsDirectory, json_text

    for number, folder in enumerate(drives):
        if folder.resolve() in (earlier.resolve() for earlier in drives[:number]):
            raise InputError(f"{folder}: given twice; a drive counts once")
    plant, carrier = load_site_and_vehicle(site, vehicle)
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
        figures = {"angles": found.angles, "used": found.used, "nis": found.nis}
        print(json_text({**figures, "parameters": rows.to_dicts(), "directory": directory.path}))
        return
    made = table(["", "unit", "before", "found", "deviation"], title="Surveyed by driving", text=2)
    for it in found.parameters:
        learnt = (f"{it.found:.4f}", f"{it.std:.4f}") if it.is_learnt else ("–", "nothing learnt")
        made.add_row(it.key, it.unit, f"{it.before:.4f}", *learnt)
    console.print(made)
    if found.used < 0.5 * found.angles:
        show_warning(
            f"{found.angles - found.used} of {found.angles} angles do not fit, and were left out; "
            "check site, vehicle and the drives' starts"
        )
    for it in found.parameters:
        if not it.is_as_believed:
            console.print(
                f"{it.key} is {it.found - it.before:+.3f} {it.unit} from where it was said to be, "
                f"with a standard deviation of {it.std_before:g}: survey it again",
                soft_wrap=True,
            )
    console.print(
        f"{found.used} of {found.angles} angles; mean squared innovation over its variance "
        f"{found.nis:.2f} (1 where noise is as stated)",
        soft_wrap=True,
    )
    console.print(f"{directory.path}/site.toml, vehicle.toml", soft_wrap=True)
