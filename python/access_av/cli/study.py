"""Command ``study``: localization accuracy, remedies and cost of a plant."""

from __future__ import annotations

from typing import Annotated

import typer
from typer import Argument, Option

from access_av._core import Plant
from access_av.cli import options as opt
from access_av.cli.side_by_side import (
    of_scenario,
    records,
    show_compared,
    side_by_side,
    write_compared,
)
from access_av.cli.terminal import console, progress, say, table

app = typer.Typer()


@opt.command(app, "Plants and scenarios", "file new plant mine.toml; access-av study mine.toml")
def study(
    plant: Annotated[str, Argument(help="Plant: shipped name, or path of a TOML file.")],
    runs: Annotated[
        int | None,
        Option(
            min=2,
            max=100_000,
            help="Runs with the nominal channel.",
            show_default="about one minute",
        ),
    ] = None,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    out: opt.Out = None,
    force_remedies: Annotated[
        bool, Option("--force-remedies", help="Simulate remedies even if the target is met.")
    ] = False,
    vary: opt.Vary = None,
    compare: opt.Compare = None,
    percentile: opt.Percents = None,
    as_json: opt.AsJson = False,
) -> None:
    """Evaluate the localization of a plant: accuracy, weak positions, remedies and cost.

    Writes report.html, study.json, recommended.toml (for access-av run), errors.parquet,
    drives.parquet, targets.parquet, places.parquet, places.csv, points.parquet,
    trajectories.parquet (the run that the report plays), plant.toml with all default values, and
    manifest.json. With --sweep or --against also compared.parquet.
    """
    from access_av.report.parts import compared_section
    from access_av.report.study import render_study
    from access_av.study.answer import study_plant
    from access_av.study.compare import combinations
    from access_av.study.study_result import recommended_toml
    from access_av.tables.results_directory import ResultsDirectory, json_text

    chosen = Plant.load(plant)
    opt.look_for_underlay(chosen.scenario().site)
    opt.announce(plant, chosen.warnings())
    others = {name: Plant.load(name) for name in compare or ()}
    for name, other in others.items():
        opt.announce(name, other.warnings())
    scenarios = of_scenario(
        chosen.scenario(), vary, {name: it.scenario() for name, it in others.items()}
    )
    directory = ResultsDirectory.create(f"study-{chosen.name}", out)
    with progress("Driving") as tick:
        found = study_plant(
            chosen,
            runs=runs,
            seed=seed,
            threads=threads,
            force_remedies=force_remedies,
            progress=lambda stage, done, total: tick(done, total, stage),
        )
    for name, rows in found.tables().items():
        directory.write_table(f"{name}.parquet", rows)
    directory.write_text("places.csv", found.places.write_csv(float_precision=4))
    directory.write_json("study.json", found.summary())
    asked = percentile or [50.0, found.percent]
    nominal = found.nominal
    comparison = side_by_side(scenarios, asked, nominal.runs, seed, threads, baseline=nominal)
    write_compared(comparison, directory)
    combined = combinations(vary or ())
    directory.write_text("report.html", render_study(found, compared_section(comparison, combined)))
    if (point := recommended_toml(found)) is not None:
        directory.write_text("recommended.toml", point)
    directory.write_text("plant.toml", chosen.to_toml())
    directory.write_manifest(
        repeat=("study", "plant.toml", "--seed", seed, "--runs", found.nominal.runs),
        plant=chosen.name,
        seed=seed,
        warnings=chosen.warnings(),
    )
    directory.link_latest()
    if as_json:
        result = {
            **found.summary(),
            "compared": records(comparison),
            "directory": str(directory.path),
        }
        print(json_text(result))
        return
    console.print(found.verdict)
    for number, place in enumerate(found.worst, start=1):
        console.print(
            f"Worst position {number}: {place.along_m:.0f} m along the road, "
            f"{place.error_m:.2f} m: {place.why}."
        )
    if found.remedies:
        # Without the column of lost drives, a narrow terminal has space for the measures' names.
        lost = any(it.driven.lost_runs for it in found.remedies)
        within = f"{found.percent:g} % within / m"
        heading = ["measure", within, "change / m", "interval", "", "targets"]
        made = table([*(["lost drives"] if lost else []), *heading], text=1 + lost)
        for it in found.remedies:
            delta, low, high = it.delta_m
            made.add_row(
                *([f"{it.driven.lost_runs} of {it.driven.runs}"] if lost else []),
                it.name,
                f"{it.error.value:.3f}",
                f"{delta:+.3f}",
                f"{low:+.2f} to {high:+.2f}",
                it.effect.words,
                it.judgement.words,
            )
        console.print(made)
    if combined and len(vary or ()) > 1:
        console.print(f"Combinations: {combined}.")
    show_compared(comparison)
    if found.point is not None:
        equal = sum(it.is_equivalent for it in found.recommendation.rivals)
        console.print(f"Recommended: {found.point.name}; equivalent points: {equal}.")
        say(f"Simulate it: access-av run {directory.path / 'recommended.toml'}")
    say(f"Report: {directory.path / 'report.html'}")
