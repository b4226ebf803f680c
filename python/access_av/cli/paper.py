"""Commands of the group ``paper``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, is_narrow, progress, say, show_rows, table
from access_av.signal.methods import label
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import polars as pl

    from access_av.paper.chosen import Effect
    from access_av.paper.sampled_interpretations import Confirmed, Sample
    from access_av.paper.study import Study

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
    _show_study(made)
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
    _show_chosen(found, runs)
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
    _show_search(found, checked)
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
        _show_points(nearest, title="Operating point with the minimum energy")
    if found.is_empty():
        raise typer.Exit(opt.MISSED)
    if as_json:
        return
    _show_points(found, title=f"Operating points with {query}")
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


@opt.command(app, "Energy", "paper codesign --runs 20")
def codesign(
    interpretation: Annotated[str, Option(help="Name of an interpretation of the paper.")] = "gate",
    runs: opt.Runs = 100,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    as_json: opt.AsJson = False,
) -> None:
    """Compare tracker, policy and engine with the paper's adaptive point in each power mode.

    Energies of a trip include angle estimates and receiver. Ranges cover all parameter ranges of
    the platform files. Second row of each mode: with the paper's energy per estimate. Third row:
    with the energy of this project's cycles at the clock of the mode. The share is the energy
    relative to the paper's, at the worst end of the range.
    """
    from dataclasses import asdict

    from access_av.paper.codesign import compare
    from access_av.tables.results_directory import json_text

    with progress("Driving") as tick:
        found = compare(interpretation, runs=runs, seed=seed, threads=threads, progress=tick)
    if as_json:
        records = [
            {
                **asdict(each),
                "policy_ratio": each.policy_ratio,
                "engine_ratio": each.engine_ratio,
                "is_better": each.is_better,
            }
            for each in found
        ]
        print(json_text(records))
        return
    head = ["mode", "point", "RMS m", "angle estimates", "received", "energy J", "share ≤"]
    made = table(head, title=f"Interpretation {interpretation}, {runs} runs, seed {seed}", text=2)
    for each in found:
        for name, point, share in (
            ("paper", each.paper, ""),
            ("own policy", each.policy, f"{each.policy_ratio:.3f}"),
            ("own policy and engine", each.engine, f"{each.engine_ratio:.2g}"),
        ):
            low_j, value_j, high_j = point.energy_j
            made.add_row(
                str(each.mode) if name == "paper" else "",
                name,
                f"{point.rms_error_m:.3f}",
                f"{point.aoa_estimates:.0f}",
                f"{point.bursts_received:.0f}",
                f"{value_j:.3g} ({low_j:.3g}…{high_j:.3g})",
                share,
            )
    console.print(made)
    better = sum(each.is_better for each in found)
    console.print(
        f"Smaller error and energy in {better} of {len(found)} power modes. "
        f"Boundary: {found[0].paper.boundary} (paper), {found[0].engine.boundary} (own engine)."
    )


def _show_study(study: Study) -> None:
    """Prints the verdict, the main figures, and the interpretations that were not evaluated.

    The report and the tables contain everything else.
    """
    from access_av.paper import summary

    console.print(f"{summary.headline(study)}.", style="bold")
    title = f"Adaptive MUSIC, interpretation “{study.shown.interpretation.title}”"
    made = table(["figure", "paper", "obtained", "verdict"], title=title, text=1)
    for cells in summary.main_figures(study):
        made.add_row(*cells)
    console.print(made)
    if seeds := summary.seeds_text(study):
        console.print(seeds)
    for name, why in study.unusable.items():
        console.print(f"Not evaluated: {name}: {why}")


def _show_chosen(effects: Sequence[Effect], runs: int) -> None:
    """Prints the open choices of the paper, the chosen values, and the effect of alternatives."""
    columns: list[tuple[str, Callable[[Effect], str]]] = [
        ("choice", lambda it: it.what if it.is_shipped else ""),
        ("value", lambda it: it.value if it.is_shipped else f"instead {it.value}"),
        ("angle estimates", lambda it: f"{it.aoa_estimates:.0f}"),
        ("maximum m", lambda it: f"{it.worst_error_m:.2f}"),
        ("RMS m", lambda it: f"{it.rms_error_m:.3f} ± {it.rms_std_m:.3f}"),
        ("80 ms: RMS", lambda it: f"{it.fixed_rms_m:.3f}"),
        ("every SSB: RMS", lambda it: f"{it.every_ssb_rms_m:.3f}"),
    ]
    title = f"Single changes, mode 0 of the shipped interpretation, {runs} runs"
    show_rows(columns, effects, title=title, text=2)


def _show_search(found: Sample, checked: Sequence[Confirmed]) -> None:
    """Prints the best interpretations of a search, and their confirmation by more runs."""
    held = found.held()
    made = table(
        ["claims met", "angle estimates", "maximum m", "drawn values"],
        title=f"Best of {len(held)} interpretations ({len(found.margins)} claims)",
    )
    for index in found.best()[:8]:
        drawn = ", ".join(f"{name} {value_text(it)}" for name, it in found.values(index).items())
        made.add_row(
            f"{held[index]:.0f}",
            f"{found.aoa_estimates[index]:.0f}",
            f"{found.worst_error_m[index]:.2f}",
            drawn,
        )
    console.print(made)
    if checked:
        again = table(["interpretation", "claims met", "not met"], title="Confirmation", text=1)
        for each in checked:
            again.add_row(each.label, str(each.held), ", ".join(each.missed))
        console.print(again)


def _show_points(points: pl.DataFrame, title: str = "") -> None:
    """Prints operating points as a table."""
    head = ["mode", "method", "energy J", "RMS m", "worst X m", "worst Y m", "angle estimates"]
    if is_narrow():
        head = ["mode", "method", "J", "RMS m", "X m", "Y m"]
    made = table(head, title=title, text=2)
    for point in points.iter_rows(named=True):
        cells = [
            str(point["mode"]) if is_narrow() else f"{point['mode']} {point['mode_name']}",
            label(point["method"], adaptive=point["adaptive"]),
            f"{point['energy_j']:.1f}",
            f"{point['rms_error_m']:.3f}",
            f"{point['worst_error_x_m']:.3f}",
            f"{point['worst_error_y_m']:.3f}",
            f"{point['aoa_estimates']:.0f}",
        ]
        made.add_row(*cells[: len(head)])
    console.print(made)
