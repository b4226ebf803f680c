"""Commands of the paper: ``evaluate``, ``explore`` and ``fit``."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from access_av.commands.options import (
    AsJson,
    Out,
    PlatformOption,
    Runs,
    ScenarioOption,
    Seed,
    Threads,
)
from access_av.terminal import console, progress, show_points, table

app = typer.Typer()


@app.command(
    epilog="Example: [bold]access-av evaluate --runs 20 --out results/quick[/]",
)
def evaluate(
    scenario: ScenarioOption = "paper",
    platform: PlatformOption = "jetson-agx-xavier",
    runs: Runs = 100,
    seed: Seed = 1,
    threads: Threads = None,
    out: Out = None,
) -> None:
    """Run the paper's whole evaluation and write the report.

    Three campaigns: every method at every SSB, every method at what the computer manages, and
    adaptive MUSIC, each over all power modes. results/latest points to the files.
    """
    from access_av.paper import study
    from access_av.paper.terminal import show_claims, show_evaluation

    with progress("Driving") as tick:
        finished = study.run(
            scenario, platform, runs=runs, seed=seed, threads=threads, out=out, progress=tick
        )
    show_evaluation(finished.evaluation)
    show_claims(finished.claims)
    console.print(
        f"{runs} runs per setting in {finished.evaluation.duration_s:.1f} s. "
        f"Report: {finished.directory.path / 'report.html'}",
        soft_wrap=True,
    )


def _finite(value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number")
    return value


def _bound(text: str) -> Any:
    return typer.Option(min=0.0, callback=_finite, help=text)


@app.command(
    epilog="Example: [bold]access-av explore --max-energy-j 260 --max-rms-m 0.15[/]",
)
def explore(
    max_energy_j: Annotated[float | None, _bound("Energy of a trip.")] = None,
    max_rms_m: Annotated[float | None, _bound("RMS error over track and runs.")] = None,
    max_worst_m: Annotated[float | None, _bound("Worst mean error, X and Y.")] = None,
    max_executions: Annotated[float | None, _bound("Angle estimates in a trip.")] = None,
    mode: Annotated[list[int] | None, typer.Option(help="Only these power modes.")] = None,
    fixed: Annotated[bool, typer.Option("--fixed", help="Also the fixed wake-up times.")] = False,
    results: Annotated[
        Path | None, typer.Option(help="Results of an evaluation; else results/latest.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find operating points within an energy budget and an error bound.

    Asks the last evaluation; where there is none, runs it first.
    """
    from access_av.design_space import Query
    from access_av.design_space import explore as answer
    from access_av.paper import study

    with progress("No evaluation yet, driving") as tick:
        points = study.operating_points(results, progress=tick)
    if not fixed:
        points = points.filter(adaptive=True)
    query = Query(max_energy_j, max_rms_m, max_worst_m, max_executions, mode)
    found = answer(points, query)
    if as_json:
        print(json.dumps(found.to_dicts(), indent=2))
        return
    if found.is_empty():
        console.print(f"No operating point has {query}.")
        nearest = points.sort("energy_j").head(1)
        show_points(nearest, title="The one with the least energy")
        return
    show_points(found, title=f"Operating points with {query}")
    best = found.row(0, named=True)
    console.print(
        f"Least energy: mode {best['mode']}, {best['energy_j']:.1f} J "
        f"(energy per execution: {best['energy_provenance']})."
    )


@app.command(
    epilog="Example: [bold]access-av fit --runs 100 --out fitted.toml[/]",
)
def fit(
    scenario: ScenarioOption = "paper",
    platform: PlatformOption = "jetson-agx-xavier",
    runs: Runs = 100,
    seed: Seed = 1,
    threads: Threads = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the platform file with the fitted values.")
    ] = None,
) -> None:
    """Fit the energy per execution of each mode and method to the paper's figures.

    Simulates how often each setting executes, then solves for the energies that agree with the
    sums the paper states. This is where the shipped platform's "fitted" values come from.
    """
    from access_av.methods import label
    from access_av.paper import study
    from access_av.paper.methods import METHODS

    with progress("Counting executions") as tick:
        fitted = study.fit_platform(
            scenario, platform, runs=runs, seed=seed, threads=threads, progress=tick
        )
    made = table(["mode", *map(label, METHODS)], title="Energy per execution in J, fitted")
    for mode in fitted.modes:
        energies = (mode.energy_per_execution_j[method] for method in METHODS)
        made.add_row(str(mode.number), *(f"{energy.value:.4f}" for energy in energies))
    console.print(made)
    if out is not None:
        out.write_text(fitted.to_toml(), encoding="utf-8")
        console.print(f"Platform file: {out}", soft_wrap=True)
