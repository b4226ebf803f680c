"""Commands about the radio of a site: ``import-paths``, ``plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from access_av.cli.options import (
    AsJson,
    Out,
    ScenarioArgument,
    load_scenario,
    load_site,
)
from access_av.cli.terminal import console, progress, show_next_level, show_plan

app = typer.Typer()


@app.command(
    "import-paths",
    epilog="Example: [bold]access-av import-paths paths.parquet --site street.toml "
    "--carrier-mhz 3750 --out street.npz[/]",
)
def import_paths(
    table: Annotated[
        Path,
        typer.Argument(help="Parquet or CSV, one row per path."),
    ],
    site: Annotated[str, typer.Option(help="Radio heads: shipped name, or TOML file.")],
    carrier_mhz: Annotated[float, typer.Option(min=100.0, help="Frequency they were traced at.")],
    out: Annotated[Path, typer.Option(help="npz file, for a scenario's channel.paths.")],
) -> None:
    """Make paths that a ray tracer found into a channel that scenarios can name.

    A scenario with [bold]channel = { model = "paths", paths = "FILE.npz" }[/] then drives through
    them, by snapshots or by samples.

    One row is one path, all in the map's frame: x_m, y_m, z_m (of the array); pci; gain_re, gain_im
    (amplitude between isotropic antennas); delay_s (from radio head to array); azimuth_rad,
    elevation_rad (of arrival, from the horizon up); ssb_index where a cell has several radio heads.
    """
    from access_av.radio import ray_paths

    found = ray_paths.import_paths(table, load_site(site), out, carrier_mhz=carrier_mhz)
    console.print(
        f"{out}: {found['paths']} paths between {found['heads']} radio heads and "
        f"{found['places']} places",
        soft_wrap=True,
    )


@app.command(
    epilog="Examples: [bold]access-av plan yard[/], "
    "[bold]access-av plan yard --masts masts.csv --add 2[/]",
)
def plan(
    scenario: ScenarioArgument,
    masts: Annotated[
        Path | None,
        typer.Option(
            help="CSV of candidates: name, x_m, y_m, z_m; else places round the weakest of the "
            "route."
        ),
    ] = None,
    add: Annotated[int, typer.Option(min=1, help="Radio heads to add.")] = 1,
    eirp_dbm: Annotated[
        float | None, typer.Option(help="What they send; else as the site's first.")
    ] = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Tell what brings a site to the next 3GPP service level, and where to put radio heads.

    By the 90th percentile along the route of the bound: each mast is tried. Prints which service
    levels the bound then allows; where the site as it is falls short of the next one, and what
    mends that: cells that send more often, a better odometer, more antennas, the radio heads.
    Writes masts.parquet, scenario.toml with the new radio heads, and manifest.json.
    """
    from access_av.radio.placement import plan as plan_heads
    from access_av.radio.upgrades import next_level
    from access_av.tables.results_directory import ResultsDirectory, json_text

    chosen = load_scenario(scenario)
    with progress("Masts") as tick:
        found = plan_heads(chosen, masts, add=add, eirp_dbm=eirp_dbm, progress=tick)
    missed = next_level(chosen, found)
    directory = ResultsDirectory.create(f"plan-{found.scenario.name}", out)
    directory.write_table("masts.parquet", found.ranking)
    directory.write_text("scenario.toml", found.scenario.to_toml())
    directory.write_manifest(
        scenario=found.scenario.name,
        masts=masts and str(masts),
        add=add,
        warnings=chosen.warnings(),
    )
    if as_json:
        record = {
            "scenario": found.scenario.name,
            "before_m": found.before_m,
            "after_m": found.after_m,
            "chosen": found.chosen,
            "service_levels": [verdict.as_record() for verdict in found.verdicts],
            "next_level": missed and missed.as_record(),
            "directory": str(directory.path),
        }
        print(json_text(record))
        return
    show_plan(found)
    if missed is not None:
        show_next_level(missed)
    console.print(f"Site: {directory.path / 'scenario.toml'}", soft_wrap=True)
