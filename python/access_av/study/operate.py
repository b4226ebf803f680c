"""Recommended operating point: the best one, or the vehicle's own one if that is equivalent."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from access_av.study import economy
from access_av.study.points import (
    MATTERS_SHARE,
    MODE_KEY,
    OK_MARGIN,
    OWN,
    Point,
    best,
    front,
    mode_groups,
    operations,
    own_mode,
    points,
)
from access_av.verdicts import Judgement

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from access_av import _core
    from access_av.run.runs import Runs
    from access_av.study.targets import Targets

    # Simulation function: name, scenario, number of runs, seed.
    Simulate = Callable[[str, _core.Scenario, int, int], Runs]
    # Begins a stage of the study: name, number of its runs.
    Begin = Callable[[str, int], None]


@dataclass(frozen=True)
class Rival:
    """A point in comparison with a reference.

    Attributes
    ----------
    point
        The rival.
    reference
        The point with which it is compared.
    delta_m
        Paired difference of the error to that of the reference, and the ends of its 95 %
        interval; percentile of the target of the whole trip. The intervals of all operations hold
        together.
    ok_delta
        Paired difference of the share of time in state ``ok``, as ``delta_m``; ``None`` without a
        monitor.
    delta_j
        Energy of a trip minus that of the reference, at the central values.
    day_share
        The difference in energy as a share of the fleet's energy of a day at the reference, with
        idle computers if their power is known.
    """

    point: Point
    reference: Point
    delta_m: tuple[float, float, float]
    ok_delta: tuple[float, float, float] | None
    delta_j: float
    day_share: float

    @classmethod
    def of(
        cls,
        plant: _core.Plant,
        targets: Targets,
        point: Point,
        reference: Point,
        comparisons: int,
    ) -> Rival:
        """Compares a point with a reference, in pairs of runs."""
        day_wh = _day_wh(plant, reference)
        more_wh = _day_wh(plant, point) - day_wh
        return cls(
            point=point,
            reference=reference,
            delta_m=point.driven.delta_m(reference.driven, targets.each[0].percent, comparisons),
            ok_delta=point.driven.ok_delta(reference.driven, comparisons),
            delta_j=point.energy_j - reference.energy_j,
            day_share=more_wh / day_wh if day_wh else 0.0,
        )

    @property
    def is_equivalent(self) -> bool:
        """Whether no difference to the reference is a disadvantage that matters.

        Accuracy: the point meets the targets, and its judgement is not worse; or the error is not
        larger with 95 % confidence. State ``ok``: the share of time is lower by at most
        :data:`OK_MARGIN`, or it is not lower with 95 % confidence. Energy of the fleet's day: it
        is higher by less than :data:`MATTERS_SHARE`.
        """
        mine, its = self.point.judgement, self.reference.judgement
        meets = mine.holds and Judgement.of_all((mine, its)) is its
        delta_m, low_m, _ = self.delta_m
        is_accurate = meets or (delta_m < math.inf and low_m <= 0.0)
        is_ok = self.ok_delta is None or self.ok_delta[0] >= -OK_MARGIN or self.ok_delta[2] >= 0.0
        return is_accurate and is_ok and self.day_share < MATTERS_SHARE


@dataclass(frozen=True)
class Recommendation:
    """Operating points of a study and the recommended one.

    Attributes
    ----------
    points
        All operations in all power modes.
    front
        Indices of the available points that no other available one exceeds in energy and error.
    best
        Index of the point with the least energy that meets the targets, otherwise of the most
        accurate one; ``None`` without a figure of energy.
    chosen
        Index of the recommended point; ``None`` without a figure of energy.
    rivals
        Comparisons with the recommended point: other operations in its mode, and its operation in
        other modes.
    """

    points: list[Point]
    front: list[int]
    best: int | None
    chosen: int | None
    rivals: list[Rival]

    @property
    def comparisons(self) -> int:
        """Number of operations, simulated separately, that are compared with one."""
        return _comparisons(self.points)

    @property
    def point(self) -> Point | None:
        """The recommended point."""
        return None if self.chosen is None else self.points[self.chosen]


def operate(
    plant: _core.Plant,
    targets: Targets,
    runs: int,
    seed: int,
    simulate: Simulate,
    begin: Begin,
) -> Recommendation:
    """Compares all operations in equal environments, and recommends a point.

    The operations are the same for every seed. The vehicle's own operation, or its own mode, is
    recommended unless the best point has an advantage that matters. The recommendation therefore
    depends on the seed only if the runs are too few to prove the advantage.

    Parameters
    ----------
    runs
        Runs of each operation.
    begin
        Called at the beginning of the stage.
    """
    scenario = plant.scenario()
    own = own_mode(scenario)
    groups = [
        (it, modes, changed)
        for it in operations(scenario)
        for changed in [scenario.with_overrides(dict(it.settings)) if it.settings else scenario]
        for modes in mode_groups(changed)
    ]
    begin("operations", runs * (len(groups) + 1))
    baseline = simulate(OWN, scenario, runs, seed)
    found: list[Point] = []
    for it, modes, changed in groups:
        numbers = [mode.number for mode in modes]
        is_own = own in numbers
        label = it.name if is_own else f"{it.name}, mode {numbers[0]}"
        in_mode = changed if is_own else changed.with_overrides({MODE_KEY: numbers[0]})
        driven = simulate(label, in_mode, runs, seed)
        found += points(driven, it, modes, targets, baseline)
    leader = best(found)
    if leader is None:
        return Recommendation(found, front(found), None, None, [])
    chosen = _chosen(plant, targets, found, leader)
    # The other operations in the chosen mode, and the chosen operation in other modes.
    operation, mode = found[chosen].operation, found[chosen].mode
    others = [it for it in found if it.operation == operation or it.mode == mode]
    others = sorted((it for it in others if it is not found[chosen]), key=lambda it: it.energy_j)
    comparisons = _comparisons(found)
    rivals = [Rival.of(plant, targets, it, found[chosen], comparisons) for it in others]
    return Recommendation(found, front(found), leader, chosen, rivals)


def _chosen(plant: _core.Plant, targets: Targets, found: Sequence[Point], leader: int) -> int:
    """Returns the point with the fewest changes of the vehicle that is equivalent to the best."""
    reference = found[leader]
    places = {(it.operation.name, it.mode): place for place, it in enumerate(found)}
    names, modes = (OWN, reference.operation.name), (own_mode(plant.scenario()), reference.mode)
    for place in map(places.get, product(names, modes)):
        if place is None or not found[place].is_available:
            continue
        rival = Rival.of(plant, targets, found[place], reference, _comparisons(found))
        if rival.is_equivalent:
            return place
    return leader


def _comparisons(found: Sequence[Point]) -> int:
    return max(1, len({it.driven.name for it in found}) - 1)


def _day_wh(plant: _core.Plant, it: Point) -> float:
    """Returns the energy of the fleet's day, with idle computers if their power is known."""
    day = economy.day(plant, it)
    return day.trips_wh.central + (0.0 if day.idle_wh is None else day.idle_wh.central)
