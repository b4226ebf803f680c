"""Evaluation of the paper under several interpretations, with verdicts and comparisons."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av._core import Scenario, SettingsError
from access_av.device.platform import Figure, Platform
from access_av.errors import InputError
from access_av.paper import ablation, freedoms, own_design, run_tables
from access_av.paper import chosen as chosen_otherwise
from access_av.paper.claims import Claim, with_seeds
from access_av.paper.driver import Driver
from access_av.paper.energy_fit import fit_energy
from access_av.paper.evaluation import (
    Evaluation,
    Setting,
    demands,
    evaluate,
    evaluate_with,
    planned,
)
from access_av.paper.interpretations import SHIPPED, Interpretation
from access_av.paper.outcome import Drives, rows
from access_av.paper.sampled_interpretations import sample
from access_av.paper.unknowns import Unknowns, sobol
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from access_av.paper.own_design import Fair
    from access_av.run.campaign import Campaign

FIT_SOURCE = "access-av paper fit: agrees with the sums and statements of the paper"
# Costs relative to a run of a setting of the evaluation, 2.9 ms of one core: a run of the tracker,
# the measurement traces of an environment, and the constant in place of an adaptive setting.
TRACKER_COST, TRACES_COST, ABLATION_COST = 13, 9, 1
# Sizes of `evaluate --sensitivity`: environments, controllers in each, runs per setting.
UNKNOWNS = (512, 2, 8)


@dataclass
class Stages:
    """Progress over stages; the total does not change.

    Attributes
    ----------
    costs
        Cost of each stage, in the order in which they run.
    report
        Called as ``report(done, total)`` with costs.
    completed
        Number of completed stages.
    """

    costs: Sequence[int]
    report: Callable[[int, int], None] | None = None
    completed: int = 0

    @contextmanager
    def stage(self) -> Iterator[Callable[[int, int], None]]:
        """Yields the progress function of the next stage, ``(done, total)`` in any unit.

        The stage is complete at the end of the context, also if an exception leaves it.
        """
        before, cost = sum(self.costs[: self.completed]), self.costs[self.completed]

        def tick(done: int, of: int) -> None:
            if self.report is not None:
                self.report(before + cost * min(done, of) // of, sum(self.costs))

        try:
            yield tick
        finally:
            tick(1, 1)
            self.completed += 1


@dataclass(frozen=True)
class Study:
    """Evaluation of the paper under several interpretations.

    Attributes
    ----------
    evaluations
        One evaluation per interpretation, in their order.
    ablations
        Each interpretation with a constant in place of the controller, by power mode.
    front
        MUSIC at fixed intervals, in ms.
    proposed_vs_paper
        Proposed method compared with the shipped interpretation, by power mode.
    unusable
        Interpretations that could not be evaluated, with the reason.
    fit_options
        Claims met with each degree of freedom of the energy fit.
    """

    evaluations: list[Evaluation]
    claims: list[Claim]
    ablations: list[ablation.Ablation]
    front: list[tuple[float, Drives]]
    proposed_vs_paper: list[own_design.Comparison]
    sensitivity: Unknowns | None
    unusable: Mapping[str, str]
    duration_s: float
    fit_options: list[freedoms.FitOption] = field(default_factory=list)
    equal_information: list[Fair] = field(default_factory=list)
    effects: list[chosen_otherwise.Effect] = field(default_factory=list)

    @property
    def shown(self) -> Evaluation:
        """Evaluation in the report: of the shipped interpretation, otherwise the first."""
        return _shown(self.evaluations)

    def of(self, interpretation: str) -> list[Claim]:
        """Returns the claims under one interpretation."""
        return [claim for claim in self.claims if claim.interpretation == interpretation]

    def tables(self) -> dict[str, pl.DataFrame]:
        """Returns the written tables; see :mod:`access_av.columns`."""
        named = {
            name: pl.concat(
                [
                    getattr(each, name).select(
                        pl.lit(each.interpretation.name).alias("interpretation"), pl.all()
                    )
                    for each in self.evaluations
                ]
            )
            for name in ("points", "errors")
        }
        front = [{"base_wake_up_ms": ms, **drives.figures} for ms, drives in self.front]
        tables = {
            "operating_points": named["points"],
            "errors": named["errors"],
            "snr": self.shown.snr,
            "ablations": rows(self.ablations),
            "fixed_front": pl.DataFrame(front),
            "proposed_vs_paper": rows(self.proposed_vs_paper),
            "equal_information": TABLES["comparisons"].frame(rows(self.equal_information)),
            "evaluation_runs": run_tables.joined(self._runs()),
            "resamples": run_tables.joined(
                table for each in self.evaluations for table in run_tables.resamples_of(each)
            ),
        }
        if self.fit_options:
            tables["fit_degrees_of_freedom"] = rows(self.fit_options)
        if self.effects:
            tables["assumptions"] = rows(self.effects)
        if self.sensitivity is not None:
            tables |= self.sensitivity.tables()
        return tables

    def _runs(self) -> Iterator[pl.DataFrame]:
        """Yields the runs of every setting: operating points and their references."""
        for each in self.evaluations:
            for key, drives, energy_j in run_tables.points_of(each):
                yield run_tables.of_drives(drives, energy_j, **key)
        shown = self.shown
        energies_j = shown.outcome.energy_per_execution_j

        def runs(campaign: str, drives: Drives | None, **key: Any) -> pl.DataFrame:
            key = {"interpretation": shown.interpretation.name, **key}
            return run_tables.of_drives(drives, campaign=campaign, **key)

        for it in self.ablations:
            where = {"interpretation": it.interpretation, "mode": it.mode}
            yield runs(run_tables.CONSTANT, it.constant, **where, base_wake_up_ms=it.constant_ms)
        for interval_ms, drives in self.front:
            yield runs(run_tables.FRONT, drives, base_wake_up_ms=interval_ms)
        for mine in self.proposed_vs_paper:
            each_j = energies_j[mine.mode].get("music")
            yield runs(
                run_tables.TRACKER,
                mine.ours,
                energy_per_execution_j=None if each_j is None else float(each_j.flat[0]),
                mode=mine.mode,
                adaptive=True,
                variant="road map" if mine.map else "no road map",
            )
        for equal in self.equal_information:
            yield runs(run_tables.EQUAL, equal.drives, adaptive=True, variant=equal.variant)


def study(
    chosen: Sequence[Interpretation],
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
    """Evaluates interpretations and claims; compares with constants and with the proposed method.

    Parameters
    ----------
    seeds
        Number of seeds for the claims, starting at ``seed``; all other results use ``seed`` only.
    unknowns
        Campaign of the sensitivity analysis. Default: no sensitivity analysis and no alternative
        assumptions.
    stated
        Claims in the format of ``paper.toml``. Default: this file.
    progress
        Called as ``progress(done, total)`` with costs; the total does not change.

    Raises
    ------
    InputError
        If no interpretation can be evaluated; the message contains the reason.
    """
    started = time.monotonic()
    driver = Driver(platform, runs, seed, threads)
    plans, unusable = [], {}
    for interpretation in chosen:
        try:
            plans.append((interpretation, planned(driver, interpretation)))
        except SettingsError as error:
            unusable[interpretation.name] = str(error)
    other_seeds = range(seed + 1, seed + seeds)
    costs = _costs(driver, [plan for _, plan in plans], len(other_seeds), unknowns is not None)
    work = Stages(costs, progress)
    evaluations, evaluated, ablations = [], [], []
    for interpretation, plan in plans:
        try:
            with work.stage() as tick:
                evaluations.append(evaluate_with(driver, interpretation, plan, tick))
                evaluated.append((interpretation, plan))
                # Compute the ablation now, while the driver has the traces of this environment.
                ablations += ablation.ablate(driver, evaluations[-1])
        except SettingsError as error:
            unusable[interpretation.name] = str(error)
    if not evaluations:
        raise InputError("; ".join(unusable.values()))
    sensitivity, effects = None, []
    if unknowns is not None:
        with work.stage() as tick:
            worlds, controllers, drives = UNKNOWNS
            drawn = sample(
                unknowns,
                platform,
                worlds=worlds,
                controllers=controllers,
                runs=drives,
                seed=seed,
                everything=True,
                progress=tick,
            )
            sensitivity = sobol(drawn, drives)
        with work.stage() as tick:
            effects = chosen_otherwise.effects(driver, progress=tick)
    judgements = {seed: [it for each in evaluations for it in freedoms.judged(each, stated)]}
    for other in other_seeds:
        again = Driver(platform, runs, other, threads, count=0)
        found: list[Claim] = []
        with work.stage() as tick:
            for number, (interpretation, plan) in enumerate(evaluated, start=1):
                found += freedoms.judged(evaluate_with(again, interpretation, plan), stated)
                tick(number, len(evaluated))
        judgements[other] = found
    claims = with_seeds(judgements) if seeds > 1 else judgements[seed]
    shown = _shown(evaluations)
    del driver.traces[1:]
    with work.stage() as tick:
        front = ablation.front(driver, shown.interpretation)
        proposed_vs_paper = own_design.compare(driver, shown, tick)
        equal_information = own_design.fair(driver, shown)
    return Study(
        evaluations=evaluations,
        claims=claims,
        ablations=ablations,
        front=front,
        proposed_vs_paper=proposed_vs_paper,
        sensitivity=sensitivity,
        unusable=unusable,
        duration_s=time.monotonic() - started,
        fit_options=freedoms.ladder(evaluations, claims, shown.interpretation.name, stated),
        equal_information=equal_information,
        effects=effects,
    )


def _shown(evaluations: Sequence[Evaluation]) -> Evaluation:
    shipped = (each for each in evaluations if each.interpretation.name == SHIPPED)
    return next(shipped, evaluations[0])


def _costs(
    driver: Driver, plans: Sequence[Mapping[Setting, Scenario]], other_seeds: int, sensitivity: bool
) -> list[int]:
    """Returns the costs of the stages of :func:`study`, in runs of a setting of the evaluation."""
    costs, seen = [], set[str]()
    for plan in plans:
        new = {scenario.to_toml() for scenario in plan.values()} - seen
        seen |= new
        adaptive = sum(setting.adaptive for setting in plan)
        costs.append(driver.runs * (len(new) + ABLATION_COST * adaptive))
    if sensitivity:
        worlds, controllers, drives = UNKNOWNS
        adaptive = sum(setting.adaptive for setting in plans[0])
        settings = TRACES_COST + len(plans[0]) + (controllers - 1) * adaptive
        costs.append(worlds * drives * settings)
        alternatives = sum(len(entry["alternatives"]) for entry in chosen_otherwise.entries())
        costs.append(alternatives * driver.runs * TRACES_COST)
    costs += [driver.runs * len(seen)] * other_seeds
    tracked = own_design.simulations(driver.platform)
    return [*costs, driver.runs * (len(ablation.FRONT_MS) + TRACKER_COST * tracked)]


def fit_platform(
    interpretation: str,
    platform: str,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Platform:
    """Fits the energies per angle estimate to the paper; counts the estimates by simulation.

    Returns
    -------
    Platform
        The platform with fitted energies, each with its provenance.

    See Also
    --------
    access_av.paper.energy_fit.fit_energy : Method of the fit.
    """
    board = Platform.load(platform)
    found = evaluate(
        interpretation, board, runs=runs, seed=seed, threads=threads, progress=progress
    )
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
