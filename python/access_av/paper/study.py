"""A study from start to files: every reading evaluated and judged, the report; open it again."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av._core import SettingsError
from access_av.errors import InputError
from access_av.files import RESULTS, ResultsDirectory
from access_av.paper import ablation, ours, readings
from access_av.paper.claims import Claim, as_records, check_claims
from access_av.paper.drives import Driver
from access_av.paper.energy_fit import fit_energy
from access_av.paper.evaluation import Evaluation, cases, demands, evaluate, evaluate_with
from access_av.paper.readings import SHIPPED
from access_av.paper.search import sample
from access_av.paper.unknowns import Unknowns, sobol
from access_av.platform import Figure, Platform

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from access_av.paper.outcome import Drives
    from access_av.paper.readings import Reading

POINTS_FILE = "operating_points.parquet"
FIT_SOURCE = "access-av fit: agrees with the sums and statements of the paper"
# Of `evaluate --unknowns`: worlds, controllers in each, drives per setting.
UNKNOWNS = (128, 8, 10)


@dataclass(frozen=True)
class Study:
    """The paper under several readings.

    Attributes
    ----------
    evaluations
        One per reading, in their order.
    claims
        Of all readings.
    ablations
        Each reading with a constant in the controller's place, by power mode.
    front
        MUSIC at fixed intervals, in ms.
    ours
        Our localizer and wake-up beside the shipped reading, by power mode.
    unknowns
        On what the claims hang, where asked for.
    unusable
        Readings that could not be evaluated, and why.
    """

    evaluations: list[Evaluation]
    claims: list[Claim]
    ablations: list[ablation.Ablation]
    front: list[tuple[float, Drives]]
    ours: list[ours.Comparison]
    unknowns: Unknowns | None
    unusable: Mapping[str, str]
    duration_s: float

    @property
    def shown(self) -> Evaluation:
        """The evaluation that the report shows in full: the shipped reading's, or the first."""
        shipped = (each for each in self.evaluations if each.reading.name == SHIPPED)
        return next(shipped, self.evaluations[0])

    def of(self, reading: str) -> list[Claim]:
        """The claims under one reading."""
        return [claim for claim in self.claims if claim.reading == reading]

    def tables(self) -> dict[str, pl.DataFrame]:
        """What is written, as tables; columns as :mod:`access_av.columns` has them."""
        named = {
            name: pl.concat(
                [
                    getattr(each, name).select(pl.lit(each.reading.name).alias("reading"), pl.all())
                    for each in self.evaluations
                ]
            )
            for name in ("points", "errors")
        }
        front = [
            {
                "base_wake_up_ms": interval_ms,
                "executions": float(drives.executions[0]),
                "worst_error_x_m": float(drives.worst_x_m[0]),
                "worst_error_y_m": float(drives.worst_y_m[0]),
                "rms_error_m": float(drives.rms_error_m[0]),
            }
            for interval_ms, drives in self.front
        ]
        tables = {
            "operating_points": named["points"],
            "errors": named["errors"],
            "snr": self.shown.snr,
            "ablations": pl.DataFrame([asdict(each) for each in self.ablations]),
            "fixed_front": pl.DataFrame(front),
            "ours": pl.DataFrame([asdict(each) for each in self.ours]),
        }
        if self.unknowns is not None:
            tables["unknowns"] = pl.DataFrame([asdict(each) for each in self.unknowns.indices])
        return tables


def study(
    chosen: Sequence[Reading],
    platform: Platform,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    parts: Path | None = None,
    stated: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Evaluate readings, judge the claims, and hold them against constants and against ours.

    Parameters
    ----------
    parts
        Where a sample of what the paper leaves open is kept; none is drawn without.
    stated
        Claims as ``paper.toml`` has them; its own when ``None``.

    Raises
    ------
    InputError
        When no reading can be evaluated; names why.
    """
    started = time.monotonic()
    # Four adaptive settings and as many constants a reading; the fixed ones and the front once.
    planned = 8 * len(chosen) + len({case.setting for case in cases(platform)}) + 24
    driver = Driver(platform, runs, seed, threads, progress=progress, planned=planned)
    evaluations, unusable = [], {}
    for reading in chosen:
        try:
            evaluations.append(evaluate_with(driver, reading))
        except SettingsError as error:
            unusable[reading.name] = str(error)
    if not evaluations:
        raise InputError("; ".join(unusable.values()))
    unknowns = None
    if parts is not None:
        worlds, controllers, drives = UNKNOWNS
        drawn = sample(
            platform,
            parts,
            worlds=worlds,
            controllers=controllers,
            runs=drives,
            seed=seed,
            gates=True,
            threads=threads,
            progress=progress,
        )
        unknowns = sobol(drawn, drives)
    made = Study(
        evaluations=evaluations,
        claims=[
            claim
            for each in evaluations
            for claim in check_claims(
                each.outcome,
                reading=each.reading.name,
                chosen=each.reading.chosen,
                stated=stated,
            )
        ],
        ablations=[found for each in evaluations for found in ablation.ablate(driver, each)],
        front=[],
        ours=[],
        unknowns=unknowns,
        unusable=unusable,
        duration_s=0.0,
    )
    shown = made.shown
    return Study(
        **{
            **vars(made),
            "front": ablation.front(driver, shown.reading),
            "ours": ours.compare(driver, shown),
            "duration_s": time.monotonic() - started,
        }
    )


def write(made: Study, out: Path | None, render: Callable[[Study], str]) -> ResultsDirectory:
    """Write tables, claims, report, scenarios, platform and manifest."""
    directory = ResultsDirectory.create("evaluate", out)
    for name, table in made.tables().items():
        directory.write_table(f"{name}.parquet", table)
    directory.write_json("claims.json", as_records(made.claims))
    directory.write_text("report.html", render(made))
    shown = made.shown
    directory.write_text("scenario.toml", shown.scenario.resolved(shown.platform.core).to_toml())
    directory.write_text("platform.toml", shown.platform.to_toml())
    directory.write_manifest(
        readings=[each.reading.name for each in made.evaluations],
        unusable=dict(made.unusable),
        platform=shown.platform.name,
        runs=shown.runs,
        seed=shown.seed,
        duration_s=round(made.duration_s, 3),
    )
    directory.link_latest()
    return directory


def run(
    names: Sequence[str] = (),
    platform: str = "jetson-agx-xavier",
    *,
    runs: int,
    seed: int,
    out: Path | None = None,
    **how: Any,
) -> tuple[Study, ResultsDirectory]:
    """Evaluate these readings, or all that are shipped, and write the results."""
    from access_av.paper.report.page import render

    chosen = readings.load_all(names)
    made = study(chosen, Platform.load(platform), runs=runs, seed=seed, **how)
    return made, write(made, out, render)


def fit_platform(
    reading: str,
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
    found = evaluate(reading, board, runs=runs, seed=seed, threads=threads, progress=progress)
    energies_j = fit_energy(demands(found.outcome, board))
    return board.with_energy(
        {
            mode: {
                method: Figure(round(float(value.item()), 4), "fitted", FIT_SOURCE, "unstated")
                for method, value in by_method.items()
            }
            for mode, by_method in energies_j.items()
        }
    )


def operating_points(
    results: Path | None = None,
    reading: str = SHIPPED,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> pl.DataFrame:
    """Operating points of an earlier evaluation, or of a new one where there is none.

    Parameters
    ----------
    results
        Directory of an evaluation. ``None`` takes ``results/latest`` if that is one, else the
        newest one in ``results/`` and, where there is none, runs the paper's.
    reading
        Under which reading.
    progress
        Called as ``progress(done, total)`` while a new one runs.

    Raises
    ------
    InputError
        When ``results`` holds no evaluation, or not of that reading.
    """
    if results is not None:
        file = results / POINTS_FILE
        if not file.is_file():
            raise InputError(f"{results}: no evaluation here ({POINTS_FILE} is missing)")
    else:
        earlier = sorted(RESULTS.glob(f"*-evaluate/{POINTS_FILE}"))
        earlier += RESULTS.glob(f"latest/{POINTS_FILE}")
        if not earlier:
            _, directory = run([reading], runs=100, seed=1, progress=progress)
            earlier = [directory.path / POINTS_FILE]
        file = earlier[-1]
    points = pl.read_parquet(file)
    there = points["reading"].unique(maintain_order=True).to_list()
    if reading not in there:
        raise InputError(f"{file.parent}: no reading {reading} here; there are: {', '.join(there)}")
    return points.filter(pl.col("energy_j").is_not_null(), reading=reading)
