"""Commands of the group ``paper``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, say, show_points, table

app = typer.Typer()

InterpretationOption = Annotated[
    str, Option(help="Interpretation: name, or path of a scenario file.")
]


@opt.command(app, "Claims", "paper evaluate --runs 20 --out results/quick")
def evaluate(
    interpretation: Annotated[
        list[str] | None,
        Option(help="Interpretation: name, or path of a scenario file; repeatable."),
    ] = None,
    scenario: Annotated[
        str | None, Option(help="Scenario of the paper's trip, in place of interpretations.")
    ] = None,
    platform: opt.PlatformOption = "jetson-agx-xavier",
    runs: opt.Runs = 100,
    seed: opt.Seed = 1,
    seeds: Annotated[
        int, Option(min=1, help="Number of seeds for the claims, starting at --seed.")
    ] = 1,
    sensitivity: Annotated[
        bool,
        Option("--sensitivity", help="Also analyse the sensitivity of the claims (takes minutes)."),
    ] = False,
    claims: Annotated[Path | None, Option(help="Claims file, in the format of paper.toml.")] = None,
    threads: opt.Threads = None,
    executor: opt.ExecutorOption = None,
    out: opt.Out = None,
) -> None:
    """Evaluate the paper's claims under its interpretations, and write the report.

    Three campaigns for each interpretation: every method at every SSB, every method at the minimum
    interval of the computer, and adaptive MUSIC, each over all power modes. results/latest points
    to the files.
    """
    from access_av.cli.paper_tables import show_study
    from access_av.report.paper import results
    from access_av.run.campaign import campaign
    from access_av.tables.results_directory import RESULTS

    names = [*(interpretation or []), *([scenario] if scenario else [])]
    parts = RESULTS / "parts"
    with progress("Evaluating", percent=True) as tick, campaign(parts, executor, threads) as kept:
        made, directory = results.run(
            names,
            platform,
            runs=runs,
            seed=seed,
            seeds=seeds,
            threads=threads,
            out=out,
            unknowns=kept if sensitivity else None,
            stated=None if claims is None else _claims(claims),
            progress=tick,
        )
    show_study(made)
    say(
        f"{runs} runs per setting in {made.duration_s:.1f} s. "
        f"Report: {directory.path / 'report.html'}"
    )


def _claims(path: Path) -> dict[str, Any]:
    from access_av.errors import InputError
    from access_av.tables import toml

    found = toml.read(path).get("claims")
    if not isinstance(found, dict) or not found:
        raise InputError(f"{path}: no table [claims]")
    for name, entry in found.items():
        if not isinstance(entry, dict):
            raise InputError(f"{path}: claims.{name}: must be a table")
        needed = {"statement", "paper_section", "unit", "rule", "stated"}
        if missing := sorted(needed - entry.keys()):
            raise InputError(f"{path}: claims.{name}: {', '.join(missing)} missing")
        if not {"rests_on", "evidence"} & entry.keys():
            raise InputError(f"{path}: claims.{name}: add `rests_on` or `evidence`")
    return dict(found)


@opt.command(app, "Claims", "paper interpretations gate-t-max")
def interpretations(
    name: Annotated[str | None, Argument(help="Interpretation to print as a scenario.")] = None,
) -> None:
    """List the interpretations of the paper, or print one with all default values."""
    from access_av.paper import interpretations as known

    if name is not None:
        print(known.load(name).scenario.to_toml(), end="")
        return
    made = table(["interpretation", "description", "calibrated to the claims"], text=3)
    for one in known.load_all():
        made.add_row(one.name, one.scenario.description, ", ".join(one.chosen) or "nothing")
    console.print(made)


@opt.command(app, "Claims", "paper assumptions --runs 100", name="assumptions")
def chosen(
    platform: opt.PlatformOption = "jetson-agx-xavier",
    runs: opt.Runs = 30,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    as_json: opt.AsJson = False,
) -> None:
    """Print the open choices of the paper: chosen value, reason, and effect of alternatives.

    One choice is changed at a time, in the shipped interpretation and mode 0. The command access-av
    paper evaluate --sensitivity evaluates joint changes.
    """
    from dataclasses import asdict

    from access_av.cli.paper_tables import show_chosen
    from access_av.device.platform import Platform
    from access_av.paper.chosen import effects
    from access_av.paper.driver import Driver
    from access_av.tables.results_directory import json_text

    with progress("Driving") as tick:
        driver = Driver(Platform.load(platform), runs, seed, threads)
        found = effects(driver, runs, progress=tick)
    if as_json:
        print(json_text([asdict(each) for each in found]))
        return
    show_chosen(found, runs)
    for each in found:
        if each.is_shipped:
            console.print(f"{each.what}: {each.why}")


@opt.command(
    app,
    "Claims",
    "paper search-controllers --worlds 64 --controllers 32",
    name="search-controllers",
)
def search(
    platform: opt.PlatformOption = "jetson-agx-xavier",
    worlds: Annotated[int, Option(min=1, help="Number of environments.")] = 64,
    controllers: Annotated[int, Option(min=1, help="Number of controllers per environment.")] = 32,
    runs: opt.Runs = 20,
    confirm: Annotated[
        int, Option(min=0, help="Runs per setting for the best interpretation and its neighbours.")
    ] = 200,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    executor: opt.ExecutorOption = None,
    out: Annotated[
        Path | None, Option(help="Scenario file to write for the best interpretation.")
    ] = None,
) -> None:
    """Search for the interpretation of Algorithm 1 without a gate that meets most claims.

    Draws the open choices of the paper; without a gate, with t_max. results/parts keeps the runs,
    so that a repeated command continues. The best interpretation and its neighbours are simulated
    again with more runs.
    """
    from access_av.cli.paper_tables import show_search
    from access_av.device.platform import Platform
    from access_av.paper.sampled_interpretations import as_scenario, confirmed, sample
    from access_av.run.campaign import campaign
    from access_av.tables.results_directory import RESULTS, write_whole

    board = Platform.load(platform)
    parts = RESULTS / "parts"
    with progress("Worlds") as tick, campaign(parts, executor, threads) as kept:
        found = sample(
            kept, board, worlds=worlds, controllers=controllers, runs=runs, seed=seed, progress=tick
        )
        checked = confirmed(kept, board, found, runs=confirm, seed=seed + 1) if confirm else []
    show_search(found, checked)
    if out is not None:
        best = checked[0].values if checked else found.values(found.best()[0])
        write_whole(out, as_scenario(best).to_toml())
        say(f"Interpretation: {out}")


@opt.command(app, "Energy", "paper explore --max-energy-j 260 --max-rms-m 0.15")
def explore(
    max_energy_j: Annotated[float | None, opt.limit("Maximum energy of a trip, in J.")] = None,
    max_error_m: opt.MaxError = None,
    percentile: opt.PercentileOption = None,
    max_rms_m: Annotated[
        float | None, opt.limit("Maximum RMS error over track and runs, in m.")
    ] = None,
    max_worst_m: Annotated[float | None, opt.limit("Maximum mean error in X and Y, in m.")] = None,
    max_aoa_estimates: Annotated[
        float | None, opt.limit("Maximum number of angle estimates per trip.")
    ] = None,
    mode: Annotated[list[int] | None, Option(help="Power mode; repeatable.")] = None,
    fixed: Annotated[bool, Option("--fixed", help="Also consider fixed wake-up times.")] = False,
    interpretation: InterpretationOption = "gate",
    results: Annotated[
        Path | None,
        Option(help="Results folder of access-av paper evaluate.", show_default="results/latest"),
    ] = None,
    as_json: opt.AsJson = False,
) -> None:
    """Find operating points of the paper's trip within an energy budget and an error bound.

    Uses the last evaluation, or runs it first. The command access-av design sweep does this for
    other trips. Exit code 3 if no operating point qualifies.
    """
    from access_av.designs.query import Query
    from access_av.designs.query import explore as answer
    from access_av.report.paper.results import operating_points
    from access_av.statistics.percentiles import column, ends_text
    from access_av.tables.results_directory import json_text

    with progress("Operating points") as tick:
        points = operating_points(results, interpretation, progress=tick)
    if not fixed:
        points = points.filter(adaptive=True)
    query = Query(
        max_energy_j, max_rms_m, max_worst_m, max_aoa_estimates, mode, max_error_m, percentile
    )
    found = answer(points, query)
    if as_json:
        print(json_text(found.to_dicts()))
    elif found.is_empty():
        console.print(f"No operating point has {query}.")
        nearest = points.sort("energy_j").head(1)
        show_points(nearest, title="Operating point with the minimum energy")
    if found.is_empty():
        raise typer.Exit(opt.MISSED)
    if as_json:
        return
    show_points(found, title=f"Operating points with {query}")
    best = found.row(0, named=True)
    name = column(query.percent)
    ends = [best[name.replace("_error_m", f"_error_{end}_m")] for end in ("low", "high")]
    console.print(
        f"Minimum energy: mode {best['mode']}, {best['energy_j']:.1f} J "
        f"(energy per estimate: {best['energy_provenance']}); {query.percent:g} % of errors "
        f"within {best[name]:.3g} m (95 %: {ends_text(*ends)})."
    )


@opt.command(app, "Energy", "paper fit --runs 100 --out fitted.toml")
def fit(
    interpretation: InterpretationOption = "gate",
    platform: opt.PlatformOption = "jetson-agx-xavier",
    runs: opt.Runs = 100,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    out: Annotated[
        Path | None, Option(help="Platform file to write with the fitted values.")
    ] = None,
) -> None:
    """Fit the energy per estimate of each mode and method to the paper's figures.

    Simulates the number of angle estimates of each setting, then solves for the energies that agree
    with the sums in the paper. The "fitted" values of the shipped platform come from this command.
    """
    from access_av.paper import study
    from access_av.paper.energy_fit import numbers
    from access_av.paper.statements import METHODS
    from access_av.signal.methods import label
    from access_av.tables.results_directory import write_whole

    with progress("Counting angle estimates") as tick:
        fitted = study.fit_platform(
            interpretation, platform, runs=runs, seed=seed, threads=threads, progress=tick
        )
    made = table(["mode", *map(label, METHODS)], title="Energy per estimate in J, fitted")
    for mode in fitted.modes:
        energies = (mode.energy_per_execution_j[method] for method in METHODS)
        made.add_row(str(mode.number), *(f"{energy.value:.4f}" for energy in energies))
    console.print(made)
    free, solved = numbers()
    console.print(f"{free} free parameters, {solved} of them solved from figures of the paper.")
    if out is not None:
        write_whole(out, fitted.to_toml())
        say(f"Platform file: {out}")
