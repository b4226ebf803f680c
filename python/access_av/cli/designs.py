"""Commands ``design sweep``, ``select`` and ``tune``: configurations of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, errors, progress, say, show_rows, table
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl

    from access_av.designs.space import Space
    from access_av.designs.tune import Tuned

app = typer.Typer()

TABLE = "designs.parquet"
# Maximum number of designs whose settings are checked for implausible values.
MOST_CHECKED = 1000
# Maximum number of rows in the terminal.
SHOWN = 20
# Minimum columns: design, energy, percentile and its interval.
LEAST_COLUMNS = 5
# Percentiles of a tuned policy.
SHOWN_PERCENTS = (50.0, 90.0, 99.0)


@opt.command(
    app, "Operating points", "design sweep paper --space space.toml --halving", name="sweep"
)
def designs(
    scenario: opt.ScenarioArgument,
    space: Annotated[
        Path, Option(help="TOML file with the varied keys of the scenario and their values.")
    ],
    sobol: Annotated[
        int | None,
        Option(
            min=1,
            max=100_000,
            help="Number of designs of a Sobol sequence.",
            show_default="the whole grid",
        ),
    ] = None,
    halving: Annotated[
        bool, Option("--halving", help="Drop inferior designs early (successive halving).")
    ] = False,
    optuna: Annotated[
        int | None, Option(min=1, max=100_000, help="Number of designs suggested by Optuna.")
    ] = None,
    runs: opt.Runs = 20,
    seed: opt.Seed = 1,
    executor: opt.ExecutorOption = None,
    threads: opt.Threads = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Simulate all designs of a space, and find the Pareto front of energy and error.

    All designs use the same runs. The table [world] of the space contains environments that cannot
    be chosen, such as the Rician K; each design is rated in its worst one. results/parts keeps the
    runs, so that a repeated command continues. Writes designs.parquet (input of access-av design
    select), worlds.parquet, report.html, scenario.toml and space.toml.
    """
    from access_av.designs.driven import in_worlds
    from access_av.designs.front import rows_of, rows_of_worlds
    from access_av.designs.search import search, suggested
    from access_av.designs.space import Space
    from access_av.errors import InputError
    from access_av.report.designs import render_designs
    from access_av.run.campaign import campaign
    from access_av.tables.results_directory import RESULTS, ResultsDirectory, json_text

    chosen = opt.load_scenario(scenario)
    read = Space.read(space)
    if optuna is not None and (sobol is not None or halving):
        raise InputError("--optuna selects the designs itself: omit --sobol and --halving")
    every = []
    if optuna is None:
        choices = read.grid() if sobol is None else read.sobol(sobol)
        every = in_worlds(chosen, choices, read.worlds)
        said = {str(it) for it in chosen.warnings()}
        for worlds in every[:MOST_CHECKED]:
            new = [it for it in worlds[0].scenario.warnings() if str(it) not in said]
            said |= {str(it) for it in new}
            opt.announce(f"{space}: {worlds[0].label}", new)
    with progress("Driving") as tick, campaign(RESULTS / "parts", executor, threads) as kept:
        found = (
            search(kept, every, runs=runs, seed=seed, halving=halving, progress=tick)
            if optuna is None
            else suggested(kept, chosen, read, count=optuna, runs=runs, seed=seed, progress=tick)
        )
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
            *("design", "sweep", "scenario.toml", "--space", "space.toml", *how),
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
        f"{front.height} of {rows.height} designs are on the Pareto front of energy and RMS "
        f"error (95 % confidence, {runs} runs each)",
    )
    if not of_worlds.is_empty():
        console.print(
            f"Results are those of the worst of {len(read.worlds)} environments: "
            f"{', '.join(read.worlds)}. worlds.parquet contains all of them."
        )
    say(f"{found.drives} runs. Report: {directory.path / 'report.html'}")
    say(f"Next: access-av design select {directory.path} --max-error-m 0.3 --percentile 99")


@opt.command(
    app,
    "Operating points",
    "design select results/mine --max-energy-j 1 --max-error-m 0.3",
    name="select",
)
def choose(
    results: Annotated[Path, Argument(help="Results folder of access-av design sweep.")],
    max_error_m: opt.MaxError = None,
    percentile: opt.PercentileOption = None,
    max_rms_m: opt.MaxRms = None,
    max_worst_m: Annotated[
        float | None, opt.limit("Maximum error of a run, in 90 % of the runs, in m.")
    ] = None,
    max_energy_j: Annotated[float | None, opt.limit("Maximum mean energy of a trip, in J.")] = None,
    as_json: opt.AsJson = False,
) -> None:
    """Choose the design with the least energy that meets all limits.

    Designs that meet the error limit with 95 % confidence come first. A design must meet the limits
    in every environment. If none does, the command prints the limits that would have to change,
    with exit code 3.
    """
    from access_av.designs.query import Query, what_to_change
    from access_av.errors import InputError
    from access_av.tables import validation
    from access_av.tables.results_directory import json_text

    file = results / TABLE
    if not file.is_file():
        raise InputError(f"{results}: no results of access-av design sweep ({TABLE} is missing)")
    rows = validation.read(file, "table of designs")
    validation.check_types(rows, str(file), "operating_points", "`designs.parquet`")
    limits = Query(
        max_energy_j=max_energy_j,
        max_rms_m=max_rms_m,
        max_worst_m=max_worst_m,
        max_error_m=max_error_m,
        percentile=percentile,
    )
    kept = limits.kept(rows)
    advice = what_to_change(limits, rows) if kept.is_empty() else []
    if as_json:
        print(json_text({"kept": kept.to_dicts(), "advice": advice}))
    elif advice:
        console.print("No design meets all limits. Limits that a design would meet:")
        for line in advice:
            say(f"  {line}")
    else:
        title = f"{kept.height} of {rows.height} designs meet the limits, the least energy first"
        _show(kept, title, limits.percent)
        for line in limits.in_words(kept.row(0, named=True)):
            say(f"First design: {line}.")
    if advice:
        raise typer.Exit(opt.MISSED)


@opt.command(app, "Operating points", "design tune yard --max-error-m 0.5 --percentile 99")
def tune(
    scenario: opt.ScenarioArgument,
    max_error_m: opt.MaxError = None,
    percentile: opt.PercentileOption = None,
    max_rms_m: opt.MaxRms = None,
    max_worst_m: Annotated[
        float | None, opt.limit("Maximum error of a drive, kept in 90 % of the runs, in m.")
    ] = None,
    max_energy_j: Annotated[
        float | None, opt.limit("Maximum energy of a trip, in J; the error is minimized.")
    ] = None,
    platform: opt.PlatformOption = "jetson-agx-xavier-engine",
    mode: Annotated[int, Option(min=0, max=255, help="Power mode of the platform.")] = 0,
    designs: Annotated[
        int, Option(min=2, max=10_000, help="Number of points that Optuna suggests.")
    ] = 192,
    runs: opt.Runs = 20,
    seed: opt.Seed = 1,
    executor: opt.ExecutorOption = None,
    threads: opt.Threads = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Tune gains, weights and set points of a scenario's wake-up policy.

    Minimizes the energy under an error limit, or the error under an energy limit. The result and
    the given policy are compared in new runs; without an improvement the given policy remains.
    Writes vehicle.toml, tuned.json, scenario.toml (unchanged) and manifest.json. results/parts
    keeps the runs, so that a repeated command continues.

    Exit code 0: the limits are met in these runs. 3: a limit is missed; the message gives its
    margin.
    """
    from access_av.designs.front import row_of
    from access_av.designs.query import Query
    from access_av.designs.tune import space_of
    from access_av.designs.tune import tune as search
    from access_av.run.campaign import campaign
    from access_av.tables.results_directory import RESULTS, ResultsDirectory, json_text

    chosen = opt.load_scenario(
        scenario, overrides={"vehicle.platform": {"name": platform, "mode": mode}}
    )
    given: dict[str, Any] = {
        "max_error_m": max_error_m,
        "percentile": percentile,
        "max_rms_m": max_rms_m,
        "max_worst_m": max_worst_m,
        "max_energy_j": max_energy_j,
    }
    limits = Query(**given)
    with progress("Tuning") as tick, campaign(RESULTS / "parts", executor, threads) as kept:
        found = search(kept, chosen, limits, designs=designs, runs=runs, seed=seed, progress=tick)
    row = row_of(found.after)
    is_kept, verdicts = limits.keeps(row), limits.in_words(row)
    directory = ResultsDirectory.create(f"tune-{chosen.name}", out)
    directory.write_text("vehicle.toml", found.after.design.scenario.vehicle.to_toml())
    record = {
        "values": dict(found.after.design.values),
        "is_better": found.is_better,
        "is_kept": is_kept,
        "constraints": verdicts,
        "energy_j": [found.before.mean_energy_j, found.after.mean_energy_j],
        "rms_error_m": [found.before.rms_m, found.after.rms_m],
        "before": row_of(found.before),
        "after": row,
        "energy_less_j": found.less[0].tolist(),
        "square_less_m2": found.less[1].tolist(),
        "drives": found.drives,
    }
    directory.write_json("tuned.json", record)
    directory.write_text("scenario.toml", chosen.to_toml())
    how = {"platform": platform, "mode": mode, "designs": designs, "runs": runs, "seed": seed}
    options = {f"--{name.replace('_', '-')}": it for name, it in {**given, **how}.items()}
    typed = [it for option in options.items() if option[1] is not None for it in option]
    directory.write_manifest(
        repeat=("design", "tune", "scenario.toml", *typed),
        scenario=chosen.name,
        runs=runs,
        seed=seed,
        warnings=chosen.warnings(),
    )
    if as_json:
        print(json_text({**record, "directory": str(directory.path)}))
    else:
        _show_tuned(found, space_of(chosen))
        for verdict in verdicts:
            say(f"{verdict}.")
        say(f"{directory.path / 'vehicle.toml'}")
    if not is_kept:
        errors.print(
            "Limits not met: no parameters of this policy meet the limits. More radio heads, a "
            f"better odometer or a surveyed road can help: access-av design plan {scenario}",
            style="red",
            soft_wrap=True,
        )
        raise typer.Exit(opt.MISSED)


def _show(rows: pl.DataFrame, title: str, percent: float = 99.0) -> None:
    """Prints designs as a table, with as many columns as the terminal can show."""
    from access_av.statistics.percentiles import column, ends_text

    name = column(percent)
    low, high = (name.replace("_error_m", f"_error_{end}_m") for end in ("low", "high"))
    columns: list[tuple[str, Callable[[dict[str, Any]], str]]] = [
        ("design", lambda row: row["choice"] or "baseline"),
        *([("worst in", lambda row: row["world"])] if (rows["world"] != "").any() else []),
        ("energy J", lambda row: _known(row["energy_j"])),
        (f"{percent:g} % m", lambda row: _known(row[name])),
        ("(95 %)", lambda row: ends_text(row[low], row[high])),
        ("RMS m", lambda row: _known(row["rms_error_m"])),
        ("median m", lambda row: _known(row["p50_error_m"])),
        ("angle estimates", lambda row: _known(row["aoa_estimates"])),
        ("received", lambda row: _known(row["bursts_received"])),
    ]
    show_rows(columns, rows.head(SHOWN).iter_rows(named=True), title=title, least=LEAST_COLUMNS)
    if rows.height > SHOWN:
        console.print(f"{rows.height - SHOWN} more in {TABLE}.")
    if rows["energy_j"].null_count() == rows.height and rows.height:
        console.print(
            "Energy is unknown, because the platform has no value for this method. Set "
            "vehicle.platform to another one (access-av file list platform)."
        )


def _known(value: float | None) -> str:
    return "–" if value is None else value_text(value)


def _show_tuned(found: Tuned, space: Space) -> None:
    values = found.after.design.values
    if found.is_better:
        made = table(["", "range", "tuned"], title="Wake-up policy", text=2)
        for dimension in space.dimensions:
            ends = f"{dimension.low:g} to {dimension.high:g}"
            key = dimension.key.removeprefix("vehicle.wake_up.")
            made.add_row(key, ends, f"{values[dimension.key]:.4g}")
        console.print(made)
    both = (found.before, found.after) if found.is_better else (found.before,)
    made = table(["in new runs", "baseline", "tuned"][: 1 + len(both)])
    made.add_row("energy of a trip / J", *(f"{it.mean_energy_j:.3f}" for it in both))
    made.add_row("RMS error / m", *(f"{it.rms_m:.3f}" for it in both))
    for each in zip(*(it.percentiles(SHOWN_PERCENTS) for it in both), strict=True):
        name = f"{each[0].percent:g}th percentile of the error / m (95 %)"
        made.add_row(name, *(f"{it.value:.3f} ({it.interval})" for it in each))
    made.add_row("angle estimates", *(f"{it.aoa_estimates.mean():.0f}" for it in both))
    console.print(made)
    if not found.is_better:
        console.print("No improvement found: the policy is unchanged.")
        return
    mean_j, low_j, high_j = found.less[0]
    if mean_j >= 0.0:
        console.print(f"Energy saved: {mean_j:.3f} J (95 %: {low_j:.3f} to {high_j:.3f})")
    else:
        console.print(f"Additional energy: {-mean_j:.3f} J (95 %: {-high_j:.3f} to {-low_j:.3f})")
