"""Command ``design bound``: error bound of a placement of radio heads."""

from __future__ import annotations

from typing import Annotated

import typer
from typer import Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, say, show_bound, show_kinds

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
    show_bound(summary, found.verdicts)
    if by_kind is not None:
        show_kinds(by_kind)
    if missed is not None:
        console.print(missed.in_words())
        say(f"Further radio heads: access-av design plan {scenario}")
    say(f"Report: {directory.path / 'report.html'}")
