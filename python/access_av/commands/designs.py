"""Commands ``designs`` and ``choose``: which design of a scenario is worth having."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from access_av.commands.options import (
    OTHER_SHARES,
    AsJson,
    DaskOption,
    Out,
    Runs,
    ScenarioArgument,
    Seed,
    ShardOption,
    Threads,
    load_scenario,
)
from access_av.report.parts import value_text
from access_av.terminal import console, progress, table

if TYPE_CHECKING:
    import polars as pl

app = typer.Typer()

TABLE = "designs.parquet"
# Rows that a terminal is shown.
SHOWN = 20


def _bound(text: str) -> Any:
    return typer.Option(min=0.0, help=text)


@app.command(
    epilog="Example: [bold]access-av designs paper --space space.toml --halving[/]",
)
def designs(
    scenario: ScenarioArgument,
    space: Annotated[Path, typer.Option(help="TOML: keys of the scenario, and their values.")],
    sobol: Annotated[
        int | None,
        typer.Option(min=1, max=100_000, help="So many designs spread evenly; else the grid."),
    ] = None,
    halving: Annotated[
        bool, typer.Option("--halving", help="Leave out early what is behind.")
    ] = False,
    optuna: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="So many designs that Optuna suggests.")
    ] = None,
    runs: Runs = 20,
    seed: Seed = 1,
    shard: ShardOption = "1/1",
    dask: DaskOption = None,
    threads: Threads = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Drive every design of a space, and find those that no other beats in energy and error.

    All designs see the same runs. Drives are kept in results/parts: a command that was stopped goes
    on. Writes designs.parquet, which ``access-av choose`` is asked, and report.html.
    """
    from access_av.campaign import Campaign, Shard, executor
    from access_av.designs.drives import designs_of
    from access_av.designs.search import search
    from access_av.designs.space import Space
    from access_av.designs.suggested import suggested
    from access_av.designs.table import rows_of
    from access_av.errors import InputError
    from access_av.files import RESULTS, ResultsDirectory, json_text
    from access_av.parts import Parts
    from access_av.report.designs import render_designs

    chosen = load_scenario(scenario)
    read = Space.read(space)
    share = Shard.parse(shard)
    if optuna is not None and (sobol is not None or halving or share != Shard()):
        raise InputError("--optuna chooses by itself: not with --sobol, --halving or --shard")
    every = []
    if optuna is None:
        every = designs_of(chosen, read.grid() if sobol is None else read.sobol(sobol))
    with progress("Driving") as tick, executor(dask, threads) as (pool, workers):
        campaign = Campaign(Parts(RESULTS / "parts"), pool, workers, share)
        found = (
            search(campaign, every, runs=runs, seed=seed, halving=halving, progress=tick)
            if optuna is None
            else suggested(
                campaign, chosen, read, count=optuna, runs=runs, seed=seed, progress=tick
            )
        )
    if found is None:
        console.print(OTHER_SHARES.format(shard))
        return
    rows = rows_of(found.driven)
    directory = ResultsDirectory.create(f"designs-{chosen.name}", out)
    directory.write_table(TABLE, rows)
    directory.write_text("report.html", render_designs(chosen, found.driven, rows))
    directory.write_manifest(
        scenario=chosen.name, runs=runs, seed=seed, drives=found.drives, warnings=chosen.warnings()
    )
    front = rows.filter("on_front").sort("energy_j")
    if as_json:
        answer = {"front": front.to_dicts(), "drives": found.drives}
        print(json_text(answer))
        return
    _show(front, f"{found.drives} drives of designs; of these no other is surely better")
    console.print(f"Report: {directory.path / 'report.html'}", soft_wrap=True)
    console.print(f"Ask: access-av choose {directory.path} --max-rms-m 0.1", soft_wrap=True)


@app.command(
    epilog="Example: [bold]access-av choose results/latest --max-energy-j 1 --max-rms-m 0.1[/]",
)
def choose(
    results: Annotated[Path, typer.Argument(help="Directory that access-av designs wrote.")],
    max_energy_j: Annotated[float | None, _bound("Mean energy of a trip.")] = None,
    max_rms_m: Annotated[float | None, _bound("RMS error over track and runs.")] = None,
    max_worst_m: Annotated[float | None, _bound("Largest error, in nine of ten runs.")] = None,
    as_json: AsJson = False,
) -> None:
    """Choose the design with the least energy that keeps what it has to.

    Where none does: what would have to change.
    """
    from access_av import given_tables
    from access_av.designs.table import Constraints, what_to_change
    from access_av.errors import InputError
    from access_av.files import json_text

    file = results / TABLE
    if not file.is_file():
        raise InputError(f"{results}: no designs here ({TABLE} is missing)")
    rows = given_tables.read(file, "table of designs")
    given_tables.check_types(rows, str(file), "designs")
    constraints = Constraints(max_energy_j, max_rms_m, max_worst_m)
    kept = constraints.kept(rows)
    advice = what_to_change(constraints, rows) if kept.is_empty() else []
    if as_json:
        print(json_text({"kept": kept.to_dicts(), "advice": advice}))
    elif advice:
        console.print("No design keeps all of it. What would have to change:")
        for line in advice:
            console.print(f"  {line}", soft_wrap=True)
    else:
        _show(kept, f"{kept.height} of {rows.height} designs keep it, the least energy first")


def _show(rows: pl.DataFrame, title: str) -> None:
    made = table(["design", "energy J", "RMS m", "executions", "listened"], title=title)
    for row in rows.head(SHOWN).iter_rows(named=True):
        values = (row["energy_j"], row["rms_error_m"], row["executions"], row["listened"])
        made.add_row(row["choice"], *map(value_text, values))
    console.print(made)
