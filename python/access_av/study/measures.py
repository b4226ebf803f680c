"""Measures that reduce the error: single ones, and the cheapest set that meets the targets."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.economics.carbon import Range
from access_av.verdicts import Effect, Judgement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av import _core
    from access_av.run.runs import Runs
    from access_av.statistics.percentiles import Percentile
    from access_av.study.economy import Prices
    from access_av.study.operate import Begin, Simulate
    from access_av.study.remedies import Remedy
    from access_av.study.targets import Targets

# Maximum number of simulated sets of measures, the cheapest first.
MOST_SETS = 4
# A set is simulated if the product of its measures' error ratios is below the target times this
# factor: the ratios of measures that act on the same error do not multiply.
PREDICTION_MARGIN = 1.15
# Both place a radio head at the position where the bound is reduced the most.
EXCLUSIVE = frozenset({"move a radio head", "add a mast"})
CM_PER_M = 100.0


@dataclass(frozen=True)
class Measure:
    """One or several remedies that were simulated together.

    Attributes
    ----------
    error
        Error at the percentile of the target of the whole trip.
    delta_m
        Paired difference of ``error`` to the plant without the measure, and the ends of its 95 %
        interval; negative if the measure helps.
    judgement
        Whether the drives meet all targets.
    cost
        Price of the measure, low to high.
    """

    remedies: tuple[Remedy, ...]
    driven: Runs
    error: Percentile
    delta_m: tuple[float, float, float]
    judgement: Judgement
    cost: Range

    @property
    def name(self) -> str:
        """Names of the remedies."""
        return " + ".join(it.name for it in self.remedies)

    @property
    def what(self) -> str:
        """Description of the changes of the plant, for the report."""
        return "; ".join(it.what for it in self.remedies)

    @property
    def effect(self) -> Effect:
        """Effect of the measure."""
        return Effect.of(self.delta_m)

    @property
    def cm_per_price(self) -> float | None:
        """Reduction of the error in centimetres per unit of currency; ``None`` if it is free."""
        if self.cost.central <= 0.0 or not math.isfinite(self.delta_m[0]):
            return None
        return -CM_PER_M * self.delta_m[0] / self.cost.central


@dataclass(frozen=True)
class Measures:
    """Measures of a plant on one sample of drives.

    Attributes
    ----------
    before
        Paired runs without any measure.
    single
        Measures of one remedy, the most effective one first.
    sets
        Measures of several remedies, the cheapest one first.
    """

    before: Runs
    single: list[Measure]
    sets: list[Measure]

    @property
    def every(self) -> list[Measure]:
        """All measures."""
        return [*self.single, *self.sets]

    @property
    def cheapest(self) -> Measure | None:
        """The cheapest measure whose drives meet all targets; ``None`` if none does."""
        holding = [it for it in self.every if it.judgement.holds]
        return min(holding, key=lambda it: it.cost.central, default=None)


def measures(
    scenario: _core.Scenario,
    changes: Sequence[Remedy],
    before: Runs,
    targets: Targets,
    prices: Prices,
    seed: int,
    simulate: Simulate,
    begin: Begin,
) -> Measures:
    """Simulates measures in the environments of ``before``.

    Parameters
    ----------
    before
        Runs without any measure; each measure gets an equal number.
    begin
        Called at the beginning of each stage.
    """
    runs = before.runs

    def measure(remedies: tuple[Remedy, ...]) -> Measure:
        changed = scenario
        # Apply a new list of radio heads before the keys of single radio heads.
        for it in sorted(remedies, key=lambda one: "site.radio_heads" not in one.settings):
            changed = it.applied(changed)
        name = " + ".join(it.name for it in remedies)
        driven = simulate(name, changed, runs, seed)
        cost = Range(0.0, 0.0, 0.0)
        for it in remedies:
            cost = cost.plus(prices.ranges[it.price].scaled(it.units))
        percent = targets.each[0].percent
        return Measure(
            remedies=remedies,
            driven=driven,
            error=driven.percentile(percent),
            delta_m=driven.delta_m(before, percent),
            judgement=targets.judgement(driven),
            cost=cost,
        )

    begin("measures", runs * len(changes))
    single = [measure((it,)) for it in changes]
    found = Measures(before, sorted(single, key=lambda it: it.delta_m[0]), [])
    chosen = _sets(found, targets)
    begin("sets of measures", runs * len(chosen))
    for remedies in chosen:
        found.sets.append(measure(remedies))
        if found.sets[-1].judgement.holds:
            break
    return found


def _sets(found: Measures, targets: Targets) -> list[tuple[Remedy, ...]]:
    """Returns sets that may meet the targets and are cheaper than any single measure."""
    percent, error_m = targets.each[0].percent, targets.each[0].error_m
    before_m = found.before.percentile(percent).value
    helping = [it for it in found.single if it.delta_m[0] < 0.0 and it.effect is not Effect.HARMS]
    limit = found.cheapest
    candidates = []
    for count in range(2, len(helping) + 1):
        for chosen in itertools.combinations(helping, count):
            cost = sum(it.cost.central for it in chosen)
            if {it.name for it in chosen} >= EXCLUSIVE:
                continue
            if limit is not None and cost >= limit.cost.central:
                continue
            ratio = math.prod(it.error.value / before_m for it in chosen)
            candidates.append((cost, before_m * ratio, tuple(it.remedies[0] for it in chosen)))
    likely = [it for it in candidates if it[1] <= PREDICTION_MARGIN * error_m]
    if not likely and limit is None:
        # If no set is expected to meet the targets, simulate the most effective one.
        likely = sorted(candidates, key=lambda it: it[1])[:1]
    likely.sort(key=lambda it: (it[0], it[1]))
    return [remedies for _, _, remedies in likely[:MOST_SETS]]
