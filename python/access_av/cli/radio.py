"""Commands for the radio of a site: ``import-paths``, ``plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import progress, say, show_next_level, show_plan

app = typer.Typer()


@opt.command(
    app,
    "Radio heads",
    "design import-paths paths.parquet --site street.toml --carrier-mhz 3750 --out street.npz",
    name="import-paths",
)
def import_paths(
    table: Annotated[Path, Argument(help="Ray-traced paths: Parquet or CSV, one row per path.")],
    site: opt.SiteOption,
    carrier_mhz: Annotated[
        float, Option(min=100.0, help="Carrier frequency of the traced paths, in MHz.")
    ],
    out: Annotated[Path, Option(help="File to write (.npz), for channel.paths of a scenario.")],
) -> None:
    """Convert ray-traced paths into a channel for scenarios.

    A scenario uses it by [bold]channel = { model = "paths", paths = "FILE.npz" }[/], for snapshots
    and for samples.

    One row is one path in the map frame: x_m, y_m, z_m (position of the array); pci; gain_re,
    gain_im (amplitude between isotropic antennas); delay_s (from radio head to array); azimuth_rad,
    elevation_rad (of arrival, upwards from the horizon); ssb_index if a cell has several radio
    heads.
    """
    from access_av.radio import ray_paths

    found = ray_paths.import_paths(table, opt.load_site(site), out, carrier_mhz=carrier_mhz)
    say(
        f"{out}: {found['paths']} paths between {found['heads']} radio heads and "
        f"{found['places']} positions"
    )


@opt.command(app, "Radio heads", "design plan yard", "design plan yard --masts masts.csv --add 2")
def plan(
    scenario: opt.ScenarioArgument,
    masts: Annotated[
        Path | None,
        Option(
            help="CSV of candidate masts: name, x_m, y_m, z_m.",
            show_default="positions around the weakest point of the route",
        ),
    ] = None,
    add: Annotated[int, Option(min=1, help="Number of radio heads to add.")] = 1,
    eirp_dbm: Annotated[
        float | None,
        Option(
            help="EIRP of the added radio heads, in dBm.", show_default="EIRP of the site's first"
        ),
    ] = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Plan radio heads, and report the changes that reach the next 3GPP service level.

    Selects the masts with the smallest 90th percentile of the error bound along the route. Prints
    the service levels that the bound then permits, the weakest positions of the present site, and
    the effect of single changes: SSBs more often, a better odometer, more antennas, radio heads.
    Writes masts.parquet, scenario.toml with the new radio heads, and manifest.json.
    """
    from access_av.radio.placement import plan as plan_heads
    from access_av.radio.upgrades import next_level
    from access_av.tables.results_directory import ResultsDirectory, json_text

    chosen = opt.load_scenario(scenario)
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
    say(f"Site: {directory.path / 'scenario.toml'}")
