"""A study from start to files: evaluate, judge the claims, write the report; open it again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from access_av.errors import InputError
from access_av.files import RESULTS, ResultsDirectory
from access_av.paper.claims import Claim, as_records, check_claims
from access_av.paper.energy_fit import demands, fit_energy
from access_av.paper.evaluation import Evaluation, evaluate, require_energy
from access_av.paper.report.page import render
from access_av.platform import Figure, Platform

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

POINTS_FILE = "operating_points.parquet"
FIT_SOURCE = "access-av fit: agrees with the sums and statements of the paper"


@dataclass(frozen=True)
class Study:
    """A finished evaluation, its verdicts, and where its files are."""

    evaluation: Evaluation
    claims: list[Claim]
    directory: ResultsDirectory


def run(
    scenario: str,
    platform: str,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    out: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Evaluate, judge the claims, write tables, report, scenario, platform and manifest."""
    board = Platform.load(platform)
    require_energy(board)
    directory = ResultsDirectory.create("evaluate", out)
    evaluation = evaluate(scenario, board, runs=runs, seed=seed, threads=threads, progress=progress)
    claims = check_claims(evaluation)
    directory.write_table(POINTS_FILE, evaluation.points)
    directory.write_table("errors.parquet", evaluation.errors)
    directory.write_table("snr.parquet", evaluation.snr)
    directory.write_json("claims.json", as_records(claims))
    directory.write_text("report.html", render(evaluation, claims))
    directory.write_text("scenario.toml", evaluation.scenario.resolved(board.core).to_toml())
    directory.write_text("platform.toml", evaluation.platform.to_toml())
    directory.write_manifest(
        scenario=evaluation.scenario.name,
        platform=evaluation.platform.name,
        runs=runs,
        seed=seed,
        duration_s=round(evaluation.duration_s, 3),
    )
    directory.link_latest()
    return Study(evaluation, claims, directory)


def fit_platform(
    scenario: str,
    platform: str,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Platform:
    """Count executions by simulation, and fit the platform's energies per execution to the paper.

    Returns
    -------
    Platform
        The platform with fitted energies, each with its provenance.

    See Also
    --------
    access_av.paper.energy_fit.fit_energy : How.
    """
    board = Platform.load(platform)
    executions = evaluate(scenario, board, runs=runs, seed=seed, threads=threads, progress=progress)
    energies_j = fit_energy(demands(executions))
    return board.with_energy(
        {
            mode: {
                method: Figure(round(value, 4), "fitted", FIT_SOURCE, "unstated")
                for method, value in by_method.items()
            }
            for mode, by_method in energies_j.items()
        }
    )


def operating_points(
    results: Path | None = None, *, progress: Callable[[int, int], None] | None = None
) -> pl.DataFrame:
    """Operating points of an earlier evaluation, or of a new one where there is none.

    Parameters
    ----------
    results
        Directory of an evaluation. ``None`` takes ``results/latest`` if that is one, else the
        newest one in ``results/`` and, where there is none, runs the paper's.
    progress
        Called as ``progress(done, total)`` while a new one runs.

    Raises
    ------
    InputError
        When ``results`` holds no evaluation.
    """
    if results is not None:
        file = results / POINTS_FILE
        if not file.is_file():
            raise InputError(f"{results}: no evaluation here ({POINTS_FILE} is missing)")
    else:
        earlier = sorted(RESULTS.glob(f"*-evaluate/{POINTS_FILE}"))
        earlier += RESULTS.glob(f"latest/{POINTS_FILE}")
        if not earlier:
            new = run("paper", "jetson-agx-xavier", runs=100, seed=1, progress=progress)
            return _with_energy(new.evaluation.points)
        file = earlier[-1]
    return _with_energy(pl.read_parquet(file))


def _with_energy(points: pl.DataFrame) -> pl.DataFrame:
    return points.filter(pl.col("energy_j").is_not_null())
