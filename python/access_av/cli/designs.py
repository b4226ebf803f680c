"""Commands ``designs`` and ``choose``: which design of a scenario is worth having."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from access_av.cli.options import (
    MISSED,
    OTHER_SHARES,
    AsJson,
    DaskOption,
    MaxError,
    MaxRms,
    Out,
    PercentileOption,
    Runs,
    ScenarioArgument,
    Seed,
    ShardOption,
    Threads,
    load_scenario,
)
from access_av.cli.terminal import console, progress, table, width
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl

app = typer.Typer()

TABLE = "designs.parquet"
# Rows that a terminal is shown.
SHOWN = 20
# Design, energy, percentile and its interval.
LEAST_COLUMNS = 5


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

    All designs see the same runs. What is not chosen but given, such as the Rician K, stands in the
    space's table [world], and each design is judged in the worst of these worlds. Drives are kept
    in results/parts: a command that was stopped goes on. Writes designs.parquet, which access-av
    choose is asked, worlds.parquet, report.html, scenario.toml and space.toml.
    """
    from access_av.designs.driven import in_worlds
    from access_av.designs.search import search
    from access_av.designs.space import Space
    from access_av.designs.suggested import suggested
    from access_av.designs.table import rows_of, rows_of_worlds
    from access_av.errors import InputError
    from access_av.report.designs import render_designs
    from access_av.run.campaign import Campaign, Shard, executor
    from access_av.run.result_cache import Parts
    from access_av.tables.results_directory import RESULTS, ResultsDirectory, json_text

    chosen = load_scenario(scenario)
    read = Space.read(space)
    share = Shard.parse(shard)
    if optuna is not None and (sobol is not None or halving or share != Shard()):
        raise InputError("--optuna chooses by itself: not with --sobol, --halving or --shard")
    every = []
    if optuna is None:
        choices = read.grid() if sobol is None else read.sobol(sobol)
        every = in_worlds(chosen, choices, read.worlds)
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
    rows, of_worlds = rows_of(found.driven), rows_of_worlds(found.driven)
    directory = ResultsDirectory.create(f"designs-{chosen.name}", out)
    directory.write_table(TABLE, rows)
    if not of_worlds.is_empty():
        directory.write_table("worlds.parquet", of_worlds)
    directory.write_text("report.html", render_designs(chosen, found.driven, rows, of_worlds))
    directory.write_text("scenario.toml", chosen.to_toml())
    directory.write_text("space.toml", space.read_text(encoding="utf-8"))
    how: list[object] = [] if sobol is None else ["--sobol", sobol]
    how += ["--halving"] if halving else []
    how += [] if optuna is None else ["--optuna", optuna]
    directory.write_manifest(
        repeat=(
            *("designs", "scenario.toml", "--space", "space.toml", *how),
            *("--runs", runs, "--seed", seed),
        ),
        scenario=chosen.name,
        space=read.as_record(),
        runs=runs,
        seed=seed,
        drives=found.drives,
        warnings=chosen.warnings(),
    )
    front = rows.filter("on_front").sort("energy_j", "rms_error_m")
    if as_json:
        answer = {"front": front.to_dicts(), "drives": found.drives}
        print(json_text(answer))
        return
    _show(
        front,
        f"{front.height} of {rows.height} designs may be on the Pareto front of energy and RMS "
        f"error (95 %, {runs} drives of each)",
    )
    if not of_worlds.is_empty():
        console.print(
            f"Each is shown in the worst of {len(read.worlds)} worlds: {', '.join(read.worlds)}. "
            "worlds.parquet has all of them."
        )
    console.print(
        f"{found.drives} drives. Report: {directory.path / 'report.html'}", soft_wrap=True
    )
    console.print(
        f"Ask: access-av choose {directory.path} --max-error-m 0.3 --percentile 99", soft_wrap=True
    )


@app.command(
    epilog="Example: [bold]access-av choose results/mine --max-energy-j 1 --max-error-m 0.3[/]",
)
def choose(
    results: Annotated[Path, typer.Argument(help="Directory that access-av designs wrote.")],
    max_error_m: MaxError = None,
    percentile: PercentileOption = None,
    max_rms_m: MaxRms = None,
    max_worst_m: Annotated[
        float | None, _bound("Largest error of a run, in nine of ten runs.")
    ] = None,
    max_energy_j: Annotated[float | None, _bound("Mean energy of a trip.")] = None,
    as_json: AsJson = False,
) -> None:
    """Choose the design with the least energy that keeps what it has to.

    Those whose percentile keeps it with 95 % confidence come first. Designs that were driven in
    several worlds have to keep it in every one of them. Where none keeps it: what would have to
    change, and exit code 3.
    """
    from access_av.designs.table import Constraints, what_to_change
    from access_av.errors import InputError
    from access_av.tables import validation
    from access_av.tables.results_directory import json_text

    file = results / TABLE
    if not file.is_file():
        raise InputError(f"{results}: no designs here ({TABLE} is missing)")
    rows = validation.read(file, "table of designs")
    validation.check_types(rows, str(file), "designs")
    constraints = Constraints(max_energy_j, max_rms_m, max_worst_m, max_error_m, percentile)
    kept = constraints.kept(rows)
    advice = what_to_change(constraints, rows) if kept.is_empty() else []
    if as_json:
        print(json_text({"kept": kept.to_dicts(), "advice": advice}))
    elif advice:
        console.print("No design keeps all of it. What would have to be allowed, by which design:")
        for line in advice:
            console.print(f"  {line}", soft_wrap=True)
    else:
        title = f"{kept.height} of {rows.height} designs keep it, the least energy first"
        _show(kept, title, constraints.percent)
        for line in constraints.in_words(kept.row(0, named=True)):
            console.print(f"The first: {line}.", soft_wrap=True)
    if advice:
        raise typer.Exit(MISSED)


def _show(rows: pl.DataFrame, title: str, percent: float = 99.0) -> None:
    """Designs as a table, in as many columns as the terminal has room for."""
    from access_av.statistics.percentiles import column, ends_text

    name = column(percent)
    low, high = (name.replace("_error_m", f"_error_{end}_m") for end in ("low", "high"))
    columns: list[tuple[str, Callable[[dict[str, Any]], str]]] = [
        ("design", lambda row: row["choice"] or "as it is"),
        *([("worst in", lambda row: row["world"])] if (rows["world"] != "").any() else []),
        ("energy J", lambda row: _known(row["energy_j"])),
        (f"{percent:g} % m", lambda row: _known(row[name])),
        ("(95 %)", lambda row: ends_text(row[low], row[high])),
        ("RMS m", lambda row: _known(row["rms_error_m"])),
        ("median m", lambda row: _known(row["p50_error_m"])),
        ("executions", lambda row: _known(row["executions"])),
        ("listened", lambda row: _known(row["listened"])),
    ]
    while True:
        made = table([head for head, _ in columns], title=title)
        for row in rows.head(SHOWN).iter_rows(named=True):
            made.add_row(*(cell(row) for _, cell in columns))
        if width(made) <= console.width or len(columns) <= LEAST_COLUMNS:
            break
        columns.pop()
    console.print(made)
    if rows.height > SHOWN:
        console.print(f"{rows.height - SHOWN} more in {TABLE}.")
    if rows["energy_j"].null_count() == rows.height and rows.height:
        console.print(
            "Energy is not known: the platform has no figure for this method; vehicle.platform "
            "names another one (access-av platform list)."
        )


def _known(value: float | None) -> str:
    return "–" if value is None else value_text(value)
