"""Evaluation of the paper under several interpretations, with verdicts and comparisons."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av._core import SettingsError
from access_av.device.platform import Figure, Platform
from access_av.errors import InputError
from access_av.paper import ablation, freedoms, own_design, run_tables
from access_av.paper import chosen as chosen_otherwise
from access_av.paper.claims import Claim, check_claims, with_seeds
from access_av.paper.driver import Driver
from access_av.paper.energy_fit import fit_energy
from access_av.paper.evaluation import Evaluation, cases, demands, evaluate, evaluate_with
from access_av.paper.readings import SHIPPED
from access_av.paper.sampled_readings import sample
from access_av.paper.unknowns import Unknowns, sobol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from access_av.paper.outcome import Drives
    from access_av.paper.own_design import Fair
    from access_av.paper.readings import Reading
    from access_av.run.campaign import Campaign

FIT_SOURCE = "access-av fit: agrees with the sums and statements of the paper"
# Sizes of `evaluate --unknowns`: environments, controllers in each, runs per setting.
UNKNOWNS = (512, 2, 8)


@dataclass(frozen=True)
class Study:
    """The paper under several readings.

    Attributes
    ----------
    evaluations
        One per reading, in their order.
    claims
        Verdicts of all interpretations.
    ablations
        Each reading with a constant in the controller's place, by power mode.
    front
        MUSIC at fixed intervals, in ms.
    ours
        Proposed method compared with the shipped interpretation, by power mode.
    unknowns
        Sensitivity of the claims, if requested.
    unusable
        Readings that could not be evaluated, and why.
    bought
        Claims met with each degree of freedom of the energy fit.
    fair
        Both methods with equal information, in mode 0.
    effects
        Effects of alternative assumptions.
    """

    evaluations: list[Evaluation]
    claims: list[Claim]
    ablations: list[ablation.Ablation]
    front: list[tuple[float, Drives]]
    ours: list[own_design.Comparison]
    unknowns: Unknowns | None
    unusable: Mapping[str, str]
    duration_s: float
    bought: list[freedoms.Bought] = field(default_factory=list)
    fair: list[Fair] = field(default_factory=list)
    effects: list[chosen_otherwise.Effect] = field(default_factory=list)

    @property
    def shown(self) -> Evaluation:
        """The evaluation that the report shows in full: the shipped reading's, or the first."""
        shipped = (each for each in self.evaluations if each.reading.name == SHIPPED)
        return next(shipped, self.evaluations[0])

    def of(self, reading: str) -> list[Claim]:
        """The claims under one reading."""
        return [claim for claim in self.claims if claim.reading == reading]

    def tables(self) -> dict[str, pl.DataFrame]:
        """Returns the written tables; columns as :mod:`access_av.columns` has them."""
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
            "ablations": pl.DataFrame([each.as_row() for each in self.ablations]),
            "fixed_front": pl.DataFrame(front),
            "ours": pl.DataFrame([each.as_row() for each in self.ours]),
            "fair": pl.DataFrame([each.as_row() for each in self.fair]),
            "evaluation_runs": run_tables.joined(self._runs()),
            "resamples": run_tables.joined(
                table for each in self.evaluations for table in run_tables.resamples_of(each)
            ),
        }
        if self.bought:
            tables["freedoms"] = pl.DataFrame([each.as_row() for each in self.bought])
        if self.effects:
            tables["chosen"] = pl.DataFrame([asdict(each) for each in self.effects])
        if self.unknowns is not None:
            tables["unknowns"] = pl.DataFrame([asdict(each) for each in self.unknowns.indices])
        return tables

    def _runs(self) -> Iterator[pl.DataFrame]:
        """Yields the runs of every setting: operating points, and what they are compared with."""
        for each in self.evaluations:
            yield from run_tables.runs_of(each)
        music: dict[str, Any] = {"method": "music", "mode": None, "base_wake_up_ms": None}
        shown: dict[str, Any] = {**music, "reading": self.shown.reading.name}
        for one in self.ablations:
            key = {**music, "reading": one.reading, "base_wake_up_ms": one.constant_ms}
            key |= {"campaign": run_tables.CONSTANT, "mode": one.mode, "adaptive": False}
            if one.constant is not None:
                yield run_tables.of_drives(one.constant, None, **key)
        for interval_ms, drives in self.front:
            key = {**shown, "campaign": run_tables.FRONT, "base_wake_up_ms": interval_ms}
            yield run_tables.of_drives(drives, None, adaptive=False, **key)
        for mine in self.ours:
            per_execution_j = self.shown.outcome.energy_per_execution_j[mine.mode].get("music")
            each_j = None if per_execution_j is None else float(per_execution_j.flat[0])
            key = {**shown, "campaign": run_tables.TRACKER, "mode": mine.mode}
            key["variant"] = "road map" if mine.map else "no road map"
            if mine.ours is not None:
                yield run_tables.of_drives(mine.ours, each_j, adaptive=True, **key)
        for equal in self.fair:
            key = {**shown, "campaign": run_tables.EQUAL, "variant": equal.variant}
            if equal.drives is not None:
                yield run_tables.of_drives(equal.drives, None, adaptive=True, **key)


def study(
    chosen: Sequence[Reading],
    platform: Platform,
    *,
    runs: int,
    seed: int,
    seeds: int = 1,
    threads: int | None = None,
    unknowns: Campaign | None = None,
    stated: Mapping[str, Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Evaluate readings, judge the claims, and hold them against constants and against ours.

    Parameters
    ----------
    seeds
        With how many seeds the claims are judged, from ``seed`` on; all else is of it alone.
    unknowns
        Who draws a sample of what the paper leaves open, and where it is kept; without, none is
        drawn, and nothing that was chosen is changed.
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
    evaluations, ablations, unusable = [], [], {}
    for reading in chosen:
        try:
            evaluations.append(evaluate_with(driver, reading))
            # At once, while the driver has its world on tape.
            ablations += ablation.ablate(driver, evaluations[-1])
        except SettingsError as error:
            unusable[reading.name] = str(error)
    if not evaluations:
        raise InputError("; ".join(unusable.values()))
    hangs_on = None
    if unknowns is not None:
        worlds, controllers, drives = UNKNOWNS
        drawn = sample(
            unknowns,
            platform,
            worlds=worlds,
            controllers=controllers,
            runs=drives,
            seed=seed,
            everything=True,
            progress=progress,
        )
        hangs_on = None if drawn is None else sobol(drawn, drives)
    claims = {seed: judged(evaluations, stated)}
    for other in range(seed + 1, seed + seeds):
        again = Driver(platform, runs, other, threads, count=0, progress=progress, planned=planned)
        claims[other] = judged([evaluate_with(again, each.reading) for each in evaluations], stated)
    made = Study(
        evaluations=evaluations,
        claims=with_seeds(claims) if seeds > 1 else claims[seed],
        ablations=ablations,
        front=[],
        ours=[],
        unknowns=hangs_on,
        unusable=unusable,
        duration_s=0.0,
    )
    shown = made.shown
    of_shown = shown.reading.name
    return Study(
        **{
            **vars(made),
            "front": ablation.front(driver, shown.reading),
            "ours": own_design.compare(driver, shown),
            "fair": own_design.fair(driver, shown),
            "effects": [] if unknowns is None else chosen_otherwise.effects(driver),
            "bought": freedoms.ladder(evaluations, made.claims, of_shown, stated),
            "duration_s": time.monotonic() - started,
        }
    )


def judged(
    evaluations: Sequence[Evaluation], stated: Mapping[str, Any] | None = None
) -> list[Claim]:
    """The claims under every reading."""
    return [
        claim
        for each in evaluations
        for claim in check_claims(
            each.outcome,
            reading=each.reading.name,
            chosen=each.reading.chosen,
            freedoms=each.freedoms,
            stated=stated,
        )
    ]


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
