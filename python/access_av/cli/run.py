"""Command ``run``: simulate one scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from access_av.cli import options as opt
from access_av.cli.side_by_side import (
    PERCENTS,
    of_scenario,
    plug_ins_of,
    show_compared,
    side_by_side,
    write_compared,
)
from access_av.cli.terminal import console, progress, say, table
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from access_av.run.simulation import Simulation

app = typer.Typer()

# Percentiles that only the report contains, so that the table fits a screen of 24 lines.
REPORT_ONLY_PERCENTS = (95.0, 99.9)


@opt.command(app, "Plants and scenarios", "run paper --runs 10 --set site.rician_k_db=10")
def run(
    scenario: opt.ScenarioArgument,
    runs: opt.Runs = 1,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    out: opt.Out = None,
    allow_large: opt.AllowLarge = False,
    vary: opt.Vary = None,
    compare: opt.Compare = None,
    percentile: opt.Percents = None,
    overrides: opt.Overrides = None,
) -> None:
    """Simulate one scenario and write its trajectories.

    Writes trajectories.parquet, aoa_estimates.parquet, trajectory.tum and truth.tum (the first
    run), report.html, scenario.toml with all default values, and manifest.json. With --sweep or
    --against also compared.parquet. --against estimator=FILE.py:NAME compares with a plug-in;
    policy and localizer are possible, too.
    """
    import polars as pl

    from access_av.report.drive import render_drive
    from access_av.report.parts import compared_section
    from access_av.run.assumptions import energy_boundary, in_words, optimistic_assumptions
    from access_av.run.simulation import simulate
    from access_av.tables.results_directory import ResultsDirectory, tum_trajectory

    given = opt.overridden(overrides)
    chosen = opt.load_scenario(scenario, allow_large=allow_large, overrides=given)
    plug_ins = plug_ins_of(compare)
    others = {
        name: chosen if name in plug_ins else opt.load_scenario(name, allow_large=allow_large)
        for name in compare or ()
    }
    scenarios = of_scenario(chosen, vary, others)
    directory = ResultsDirectory.create(f"run-{chosen.name}", out)
    with progress("Driving") as tick:
        result = simulate(
            chosen, runs=runs, seed=seed, threads=threads, keep_trajectories=True, progress=tick
        )
    if result.trajectories is None or result.aoa_estimates is None:  # keep_trajectories is set
        raise RuntimeError("the simulation stored no trajectories")
    directory.write_table("trajectories.parquet", result.trajectories)
    directory.write_table("aoa_estimates.parquet", result.aoa_estimates)
    first = result.trajectories.filter(run=0)
    known = first.filter(~pl.col("searching"))
    for name, poses, prefix in (("trajectory.tum", known, ""), ("truth.tum", first, "true_")):
        columns = ("time_s", f"{prefix}x_m", f"{prefix}y_m", f"{prefix}heading_rad")
        directory.write_text(name, tum_trajectory(*(poses[column] for column in columns)))
    asked = percentile or PERCENTS
    comparison = side_by_side(scenarios, asked, runs, seed, threads, plug_ins)
    write_compared(comparison, directory)
    page = render_drive(chosen, result, seed, compared_section(comparison))
    directory.write_text("report.html", page)
    directory.write_text("scenario.toml", chosen.resolved().to_toml())
    assumed = optimistic_assumptions(chosen)
    directory.write_manifest(
        repeat=("run", "scenario.toml", "--runs", runs, "--seed", seed),
        scenario=chosen.name,
        runs=runs,
        seed=seed,
        assumed=assumed,
        warnings=chosen.warnings(),
    )
    directory.link_latest()

    show_compared(comparison)
    title = f"{chosen.name}: {runs} run{'s' * (runs > 1)}, seed {seed}"
    _show(result, title, energy_boundary(chosen))
    if assumed:
        say(in_words(assumed))
    if (levels := result.service_levels) and not all(verdict.reached for verdict in levels):
        say(f"Possible improvements: access-av design plan {scenario}")
    say(f"Report: {directory.path / 'report.html'}")


def _show(result: Simulation, title: str, energy_boundary: str | None) -> None:
    """Prints errors, angle estimates and energy of a simulation as a table."""
    from access_av.run.service_levels import reached_in_words

    steps, runs = result.steps, result.runs
    made = table(["", "value", "95 % interval"], title=title)
    rows: dict[str, tuple[Any, str]] = {
        "RMS error / m": (result.rms_error_m, ""),
    }
    for each in result.percentiles or ():
        if each.percent in REPORT_ONLY_PERCENTS:
            continue
        rows[f"{each.percent:g}th percentile of the error / m"] = each.value, each.interval
    rows |= {
        "maximum mean error along the track, X / m": (steps["mean_abs_error_x_m"].max(), ""),
        "maximum mean error along the track, Y / m": (steps["mean_abs_error_y_m"].max(), ""),
        "duration / s": (steps["time_s"].max(), ""),
        "angle estimates": (runs["aoa_estimates"].mean(), ""),
        f"energy / J, {energy_boundary or 'not counted'}": (runs["energy_j"].mean(), ""),
    }
    if runs["found_s"].fill_null(1.0).max() != 0.0:
        found = runs.height - runs["found_s"].null_count()
        rows["runs with a successful search"] = found, ""
        rows["distance until found, median / m"] = runs["found_m"].median(), ""
        rows["distance until found, maximum / m"] = runs["found_m"].max(), ""
    consistency = result.consistency
    if consistency is not None and consistency.anees is not None:
        interval = consistency.anees_interval if runs.height > 1 else None
        rows["NEES per axis (expected: 1)"] = (
            consistency.anees,
            "" if interval is None else f"{interval[0]:.3g} to {interval[1]:.3g}",
        )
    integrity = result.integrity
    if integrity is not None:
        rows["protection level / error, median"] = integrity.median_level_over_error, ""
    for name, (value, interval_text) in rows.items():
        made.add_row(name, value_text(value), interval_text)
    console.print(made)
    if (operation := result.operation) is not None:
        console.print(f"{operation.in_words()} {operation.what_helps()}".strip())
    if levels := result.service_levels:
        console.print(f"3GPP positioning service: {reached_in_words(levels)} reached (see report).")
