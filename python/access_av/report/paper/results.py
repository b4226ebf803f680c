"""Results of an evaluation on disk: computing, writing with the report, reading."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.device.platform import Platform
from access_av.errors import InputError
from access_av.paper.interpretations import SHIPPED, load_all
from access_av.paper.study import Study, study
from access_av.tables import validation
from access_av.tables.results_directory import RESULTS, ResultsDirectory

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from access_av.report.chart import Spec

# Cost of the report, in runs of a setting of the evaluation on two cores.
REPORT_COST = 4000
POINTS_FILE = "operating_points.parquet"
# Charts that are also written as SVG, and their width (px): those that need the whole study, and
# two of the sensitivity analysis.
PICTURES, WIDTH = ("ablation", "front", "sobol", "share"), 640


def write(
    made: Study,
    directory: ResultsDirectory,
    progress: Callable[[int, int], None],
) -> None:
    """Writes tables, claims, report, scenarios, platform and manifest."""
    # Libraries of charts take 40 MB: import them after the simulations have released their memory.
    import vl_convert

    from access_av.report.paper.evaluation import render

    tables = made.tables()
    for name in list(tables):
        directory.write_table(f"{name}.parquet", tables.pop(name))
    directory.write_json("claims.json", [asdict(claim) for claim in made.claims])
    progress(1, 4)
    specs: dict[str, Spec] = {}
    directory.write_text("report.html", render(made, specs))
    progress(2, 4)
    for name in (it for it in PICTURES if it in specs):
        drawn = specs[name] | {"width": WIDTH, "background": "white"}
        directory.write_text(f"{name}.svg", vl_convert.vegalite_to_svg(drawn))
    shown = made.shown
    directory.write_text("scenario.toml", shown.scenario.resolved(shown.platform.core).to_toml())
    directory.write_text("platform.toml", shown.platform.to_toml())
    directory.write_manifest(
        interpretations=[each.interpretation.name for each in made.evaluations],
        unusable=dict(made.unusable),
        platform=shown.platform.name,
        runs=shown.runs,
        seed=shown.seed,
        duration_s=round(made.duration_s, 3),
    )
    directory.link_latest()
    progress(4, 4)


def run(
    names: Sequence[str] = (),
    platform: str = "jetson-agx-xavier",
    *,
    runs: int,
    seed: int,
    out: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **how: Any,
) -> tuple[Study, ResultsDirectory]:
    """Evaluates these interpretations, or all shipped ones, and writes the results.

    ``progress`` is called as ``progress(done, total)`` with costs, including that of the report.
    """
    simulated = 0

    def of_study(done: int, total: int) -> None:
        nonlocal simulated
        simulated = total
        if progress is not None:
            progress(done, total + REPORT_COST)

    def of_report(done: int, total: int) -> None:
        of_study(simulated + REPORT_COST * done // total, simulated)

    chosen, board = load_all(names), Platform.load(platform)
    directory = ResultsDirectory.create("evaluate", out)
    made = study(chosen, board, runs=runs, seed=seed, progress=of_study, **how)
    write(made, directory, of_report)
    return made, directory


def operating_points(
    results: Path | None = None,
    interpretation: str = SHIPPED,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> pl.DataFrame:
    """Returns the operating points of an earlier evaluation, otherwise of a new one.

    Parameters
    ----------
    results
        Directory of an evaluation. Default: ``results/latest`` if it is one, else the newest one in
        ``results/``, else a new evaluation of the paper.
    interpretation
        Name of the interpretation.
    progress
        Called as ``progress(done, total)`` during a new evaluation.

    Raises
    ------
    InputError
        If ``results`` contains no evaluation of this interpretation.
    """
    if results is not None:
        file = results / POINTS_FILE
        if not file.is_file():
            raise InputError(f"{results}: no results of an evaluation ({POINTS_FILE} is missing)")
    else:
        earlier = sorted(RESULTS.glob(f"*-evaluate/{POINTS_FILE}"))
        earlier += RESULTS.glob(f"latest/{POINTS_FILE}")
        if not earlier:
            _, directory = run([interpretation], runs=100, seed=1, progress=progress)
            earlier = [directory.path / POINTS_FILE]
        file = earlier[-1]
    points = _points(file)
    there = points["interpretation"].unique(maintain_order=True).to_list()
    if interpretation not in there:
        raise InputError(
            f"{file.parent}: the results do not contain interpretation {interpretation}; they "
            f"contain: {', '.join(there)}"
        )
    return points.filter(pl.col("energy_j").is_not_null(), interpretation=interpretation)


def _points(file: Path) -> pl.DataFrame:
    """Reads a table of operating points, with all its columns."""
    points = validation.read(file, "table of operating points")
    validation.check_types(points, str(file), "operating_points", f"`{POINTS_FILE}`")
    return points
