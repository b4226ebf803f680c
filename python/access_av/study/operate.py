"""Recommended operating point: screening, finalists with two seeds, and rivals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.run.runs import Runs
from access_av.study import economy
from access_av.study.points import (
    MODE_KEY,
    Operation,
    Point,
    front,
    mode_groups,
    operations,
    own_mode,
    points,
    recommended,
)
from access_av.verdicts import Agreement, Judgement

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av import _core
    from access_av.device.platform import PowerMode
    from access_av.study.targets import Targets

    # Simulation function: name, scenario, number of runs, seed.
    Simulate = Callable[[str, _core.Scenario, int, int], Runs]

# Operations that are simulated in every power mode with two seeds: the one that screening
# recommends, the vehicle's own, and their rivals.
MOST_FINALISTS = 3
# Maximum number of blocks of runs per seed until the recommendations of both seeds agree.
MOST_BLOCKS = 2
# Offset of the seed of each further block of runs.
SEED_STEP = 1000
# Share of a fleet's energy of a day, idle computers included, below which a difference does not
# matter: energy meters for billing have this accuracy (IEC 62053-21, class 1).
MATTERS_SHARE = 0.01


@dataclass(frozen=True)
class Rival:
    """A point next to the recommended one.

    Attributes
    ----------
    point
        The rival.
    delta_m
        Paired difference of the error to that of the recommended point, and the ends of its 95 %
        interval; percentile of the target of the whole trip.
    delta_j
        Energy of a trip minus that of the recommended point, at the central values.
    day_share
        The difference in energy as a share of the fleet's energy of a day at the recommended
        point, idle computers included; ``None`` without a figure of idle power.
    """

    point: Point
    delta_m: tuple[float, float, float]
    delta_j: float
    day_share: float | None

    @property
    def is_equivalent(self) -> bool:
        """Whether neither the difference in error nor that in energy matters.

        The 95 % interval of the error difference contains 0, and the energy differs by less than
        :data:`MATTERS_SHARE` of the fleet's day.
        """
        _, low, high = self.delta_m
        same_energy = self.delta_j == 0.0 or (
            self.day_share is not None and abs(self.day_share) < MATTERS_SHARE
        )
        return low <= 0.0 <= high and same_energy


@dataclass(frozen=True)
class Recommendation:
    """Operating points of a study and the recommended one.

    Attributes
    ----------
    points
        All points; the finalists, which are simulated in every power mode, come first.
    front
        Indices of the finalists that no other one exceeds in energy and error.
    chosen
        Index of the recommended point; ``None`` without a figure of energy.
    rivals
        The other finalists, in the mode of least energy, and the recommended operation in the
        other power modes.
    by_seed
        The points that the two seeds recommend by themselves.
    """

    points: list[Point]
    front: list[int]
    chosen: int | None
    rivals: list[Rival]
    by_seed: tuple[str, ...]

    @property
    def point(self) -> Point | None:
        """The recommended point."""
        return None if self.chosen is None else self.points[self.chosen]

    @property
    def agreement(self) -> Agreement:
        """Whether both seeds recommend this point, or another one that is equivalent."""
        if self.point is None or set(self.by_seed) <= {self.point.name}:
            return Agreement.AGREED
        equivalent = {it.point.name for it in self.rivals if it.is_equivalent}
        others = set(self.by_seed) - {self.point.name}
        return Agreement.EQUIVALENT if others <= equivalent else Agreement.UNDECIDED


@dataclass(frozen=True)
class _Finalist:
    """Runs of an operation in a group of power modes, by block."""

    operation: Operation
    modes: list[PowerMode]
    scenario: _core.Scenario
    blocks: list[Runs]

    def driven_mode(self, own: int) -> int:
        """Power mode in which the group is simulated: the vehicle's own mode if it is included."""
        modes = [it.number for it in self.modes]
        return own if own in modes else modes[0]

    def points(self, blocks: list[Runs], targets: Targets) -> list[Point]:
        driven = Runs.joined(blocks)
        return points(driven, self.operation, self.modes, targets, simulated=True)


def likely_blocks(scenario: _core.Scenario) -> int:
    """Number of blocks of runs of :func:`operate` if one block per seed is enough."""
    return len(operations(scenario)) + 2 * MOST_FINALISTS * len(mode_groups(scenario))


def operate(
    plant: _core.Plant,
    targets: Targets,
    nominal: Runs,
    runs: int,
    seed: int,
    simulate: Simulate,
    plan: Callable[[int], None],
) -> Recommendation:
    """Finds the operating point with the least energy that meets the targets.

    Every operation is screened in the vehicle's own power mode. The recommended one and its rivals
    are then simulated in every power mode, with two seeds, until both recommend the same point or
    equivalent ones, or :data:`MOST_BLOCKS` blocks of runs are simulated.

    Parameters
    ----------
    runs
        Runs of each operation, power mode and block.
    plan
        Called with the number of remaining runs.
    """
    scenario = plant.scenario()
    own = own_mode(scenario)
    screened = _screened(scenario, targets, nominal, runs, seed, simulate, plan)
    finalists = [
        _Finalist(it, modes, changed, [])
        for it in _finalists(screened)
        for changed in [scenario.with_overrides(dict(it.settings))]
        for modes in mode_groups(changed)
    ]
    found = Recommendation(screened, front(screened), None, [], ())
    for block in range(MOST_BLOCKS):
        for number, it in enumerate(finalists):
            label = f"{it.operation.name}, mode {it.modes[0].number}"
            in_mode = it.scenario.with_overrides({MODE_KEY: it.driven_mode(own)})
            for which in range(2):
                plan(runs * (2 * (len(finalists) - number) - which))
                seed_of_block = seed + (2 * block + which) * SEED_STEP
                it.blocks.append(simulate(label, in_mode, runs, seed_of_block))
        found = _recommendation(plant, targets, screened, finalists)
        if found.agreement is not Agreement.UNDECIDED:
            break
    return found


def _recommendation(
    plant: _core.Plant, targets: Targets, screened: list[Point], finalists: list[_Finalist]
) -> Recommendation:
    """Returns the recommendation from the drives of all seeds, and those from each seed."""
    by_seed = [
        [one for it in finalists for one in it.points(it.blocks[which::2], targets)]
        for which in range(2)
    ]
    pooled = [one for it in finalists for one in it.points(it.blocks, targets)]
    known = {one.operation.name for one in pooled}
    every = [*pooled, *(it for it in screened if it.operation.name not in known)]
    chosen = recommended(pooled)
    named = tuple(name for it in by_seed if (name := _name(it)) is not None)
    rivals = [] if chosen is None else _rivals(plant, targets, pooled, pooled[chosen], named)
    return Recommendation(every, front(pooled), chosen, rivals, named)


def _name(found: list[Point]) -> str | None:
    chosen = recommended(found)
    return None if chosen is None else found[chosen].name


def _screened(
    scenario: _core.Scenario,
    targets: Targets,
    nominal: Runs,
    runs: int,
    seed: int,
    simulate: Simulate,
    plan: Callable[[int], None],
) -> list[Point]:
    """Simulates every operation in the vehicle's power mode; returns the energies in all modes."""
    found = []
    blocks = likely_blocks(scenario)
    for number, it in enumerate(operations(scenario)):
        plan(runs * (blocks - number))
        changed = scenario.with_overrides(dict(it.settings)) if it.settings else scenario
        driven = simulate(it.name, changed, runs, seed) if it.settings else nominal.first(runs)
        for modes in mode_groups(changed):
            own = own_mode(changed) in [mode.number for mode in modes]
            found += points(driven, it, modes, targets, simulated=own)
    return found


def _finalists(screened: list[Point]) -> list[Operation]:
    """Returns the finalists: choice of the screening, the vehicle's operation, possible rivals."""
    chosen = recommended(screened)
    if chosen is None:
        return []
    best = screened[chosen]
    cheapest: dict[str, Point] = {}
    for it in sorted(screened, key=lambda one: one.energy_j):
        cheapest.setdefault(it.operation.name, it)
    others = [it for it in cheapest.values() if it.operation.name != best.operation.name]
    possible = [it for it in others if it.judgement is not Judgement.MISSED]
    if best.judgement.holds:
        # Operations with less energy may meet the targets; those with more are needed if this one
        # does not.
        rivals = [it for it in possible if it.energy_j <= best.energy_j][::-1]
        rivals += [it for it in possible if it.energy_j > best.energy_j]
    else:
        rivals = sorted(others, key=lambda it: it.error_m)
    own = screened[0].operation
    named = [best.operation, *([] if own == best.operation else [own])]
    named += [it.operation for it in rivals if it.operation not in named]
    return named[:MOST_FINALISTS]


def _rivals(
    plant: _core.Plant, targets: Targets, pooled: list[Point], best: Point, named: tuple[str, ...]
) -> list[Rival]:
    """Returns finalists in their best mode, other modes, and choices of single seeds."""
    percent = targets.each[0].percent
    best_wh = _day_wh(plant, best)
    seen = {best.name}
    found: list[Rival] = []
    for it in sorted(pooled, key=lambda one: one.energy_j):
        is_first = all(one.point.operation.name != it.operation.name for one in found)
        is_other_mode = it.operation.name == best.operation.name
        if it.name in seen or not (is_first or is_other_mode or it.name in named):
            continue
        seen.add(it.name)
        day_wh = _day_wh(plant, it)
        share = None if best_wh is None or day_wh is None else (day_wh - best_wh) / best_wh
        delta_m = it.driven.delta_m(best.driven, percent)
        found.append(Rival(it, delta_m, it.energy_j - best.energy_j, share))
    return found


def _day_wh(plant: _core.Plant, it: Point) -> float | None:
    """Returns the energy of the fleet's day; ``None`` without a figure of idle power."""
    day = economy.day(plant, it)
    return None if day.idle_wh is None else day.idle_wh.central + day.trips_wh.central
