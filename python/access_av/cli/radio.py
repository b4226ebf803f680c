"""Commands for the radio of a site: ``bound``, ``import-paths``, ``plan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, say, show, show_rows, table
from access_av.report import shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import polars as pl

    from access_av.radio.placement import Plan
    from access_av.run.service_levels import Verdict

app = typer.Typer()


@opt.command(app, "Radio heads", "design bound yard --map-step-m 10 --out results/yard-bound")
def bound(
    scenario: opt.ScenarioArgument,
    out: opt.Out = None,
    allow_large: opt.AllowLarge = False,
    map_step_m: Annotated[
        float | None, Option(help="Side length of the map's squares.", show_default="by the size")
    ] = None,
    kinds: Annotated[
        bool,
        Option(
            "--kinds",
            help="Also list the bound with delays, carrier phases and power, for several clocks.",
        ),
    ] = False,
    as_json: opt.AsJson = False,
) -> None:
    """Compute the smallest possible localization error of a site.

    The posterior Cramér-Rao bound of the horizontal error along the route and over the site. Prints
    the 3GPP service levels that it permits, where it fails the next one, and the cheapest change
    that reaches it.

    Writes bound.parquet, map.parquet, report.html, scenario.toml and manifest.json. --kinds prints
    the bound with further measurements of each SSB, for several clocks, with and without a road,
    and writes kinds.parquet.
    """
    from access_av.radio.measurement_kinds import kinds_table
    from access_av.radio.upgrades import next_level
    from access_av.report.placement import render_bound
    from access_av.run.error_bound import bound as error_bound
    from access_av.tables.results_directory import ResultsDirectory, json_text

    chosen = opt.load_scenario(scenario, allow_large=allow_large)
    directory = ResultsDirectory.create(f"bound-{chosen.name}", out)
    with progress("Bounding"):
        found = error_bound(chosen, map_step_m=map_step_m)
        missed = next_level(chosen)
        by_kind = kinds_table(chosen) if kinds else None
    if by_kind is not None:
        directory.write_table("kinds.parquet", by_kind)
    directory.write_table("bound.parquet", found.route)
    directory.write_table("map.parquet", found.site)
    directory.write_text("report.html", render_bound(found, missed))
    directory.write_text("scenario.toml", found.scenario.to_toml())
    directory.write_manifest(
        scenario=found.scenario.name, map_step_m=found.map_step_m, warnings=chosen.warnings()
    )
    summary = found.summary()
    if as_json:
        record = {**summary, "next_level": missed and missed.as_record()}
        if by_kind is not None:
            record["kinds"] = by_kind.to_dicts()
        print(json_text({**record, "directory": str(directory.path)}))
        return
    _show_bound(summary, found.verdicts)
    if by_kind is not None:
        _show_kinds(by_kind)
    if missed is not None:
        console.print(missed.in_words())
        say(f"Further radio heads: access-av design plan {scenario}")
    say(f"Report: {directory.path / 'report.html'}")


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
    _show_plan(found)
    if missed is not None:
        console.print(missed.in_words())
        show(shown.next_level(missed))
    say(f"Site: {directory.path / 'scenario.toml'}")


def _show_bound(summary: dict[str, Any], verdicts: Sequence[Verdict]) -> None:
    """Prints the bound along the route, and the SNR of each radio head."""
    made = table(["lower bound of the RMS error", "m"], title=summary["scenario"])
    for name, key in (("median along the route", "median_m"), ("90th percentile", "p90_m")):
        made.add_row(name, f"{summary[key]:.3f}")
    made.add_row("worst position", f"{summary['max_m']:.3f}")
    console.print(made)
    show(shown.radio_heads(summary["heads"]))
    show(shown.service_levels(verdicts), title="3GPP positioning service levels")


def _show_kinds(bounds: pl.DataFrame) -> None:
    """Prints the bound by radio heads, kind of measurement and clocks."""
    columns: list[tuple[str, Callable[[Any], str]]] = [
        ("radio heads", lambda row: str(row["num_heads"])),
        ("measurements", lambda row: row["kinds"]),
        ("clocks", lambda row: row["clocks"]),
        ("without road m", lambda row: f"{row['bound_without_road_m']:.3f}"),
        ("with road m", lambda row: f"{row['bound_with_road_m']:.3f}"),
    ]
    show_rows(columns, bounds.to_dicts(), title="Lower bound by measurement", text=3)


def _show_plan(found: Plan) -> None:
    """Prints the selected masts, and the next best ones."""
    console.print(
        f"{found.scenario.name}: 90th percentile of the error bound along the route "
        f"{found.before_m:.3f} m; with {', '.join(found.chosen)} {found.after_m:.3f} m."
    )
    made = table(["mast", "90th percentile with this mast only, m"])
    for row in found.ranking.head(10).iter_rows(named=True):
        made.add_row(row["name"], f"{row['p90_bound_m']:.3f}")
    console.print(made)
    show(
        shown.service_levels(found.verdicts),
        title=f"3GPP positioning service levels with {', '.join(found.chosen)}",
    )
