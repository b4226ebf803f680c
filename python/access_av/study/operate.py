"""Recommended operating point: screening, finalists with two seeds, and rivals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.run.runs import Runs
from access_av.study import economy
from access_av.study.points import (
    MODE_KEY,
    OK_MARGIN,
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
    # Begins a stage of the study: name, number of its runs.
    Begin = Callable[[str, int], None]

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
    ok_delta
        Paired difference of the share of time in state ``ok``, as ``delta_m``; ``None`` without a
        monitor.
    delta_j
        Energy of a trip minus that of the recommended point, at the central values.
    day_share
        The difference in energy as a share of the fleet's energy of a day at the recommended
        point, idle computers included; ``None`` without a figure of idle power.
    """

    point: Point
    delta_m: tuple[float, float, float]
    ok_delta: tuple[float, float, float] | None
    delta_j: float
    day_share: float | None

    @property
    def is_equivalent(self) -> bool:
        """Whether no difference in error, in the share of time ``ok`` and in energy matters.

        The 95 % interval of the error difference contains 0; that of the share of time contains 0
        or the share differs by at most :data:`OK_MARGIN`; the energy differs by less than
        :data:`MATTERS_SHARE` of the fleet's day.
        """
        _, low, high = self.delta_m
        same_energy = self.delta_j == 0.0 or (
            self.day_share is not None and abs(self.day_share) < MATTERS_SHARE
        )
        same_ok = (
            self.ok_delta is None
            or abs(self.ok_delta[0]) <= OK_MARGIN
            or self.ok_delta[1] <= 0.0 <= self.ok_delta[2]
        )
        return low <= 0.0 <= high and same_ok and same_energy


@dataclass(frozen=True)
class Recommendation:
    """Operating points of a study and the recommended one.

    Attributes
    ----------
    points
        All points; the finalists, which are simulated in every power mode, come first.
    front
        Indices of the available finalists that no other available one exceeds in energy and
        error.
    chosen
        Index of the recommended point; ``None`` without a figure of energy.
    rivals
        The finalists in every power mode, except the recommended point.
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


def operate(
    plant: _core.Plant,
    targets: Targets,
    nominal: Runs,
    runs: int,
    seed: int,
    simulate: Simulate,
    begin: Begin,
) -> Recommendation:
    """Finds the available operating point with the least energy that meets the targets.

    Every operation is screened in the vehicle's own power mode. The recommended one and its rivals
    are then simulated in every power mode, with two seeds, until both recommend the same point or
    equivalent ones, or :data:`MOST_BLOCKS` blocks of runs are simulated.

    Parameters
    ----------
    runs
        Runs of each operation, power mode and block.
    begin
        Called at the beginning of each stage.
    """
    scenario = plant.scenario()
    own = own_mode(scenario)
    screened = _screened(scenario, targets, nominal, runs, seed, simulate, begin)
    finalists = [
        _Finalist(it, modes, changed, [])
        for it in _finalists(screened)
        for changed in [scenario.with_overrides(dict(it.settings))]
        for modes in mode_groups(changed)
    ]
    found = Recommendation(screened, front(screened), None, [], ())
    for block in range(MOST_BLOCKS):
        begin(
            "best operations" if block == 0 else "best operations again", 2 * runs * len(finalists)
        )
        for it in finalists:
            label = f"{it.operation.name}, mode {it.modes[0].number}"
            in_mode = it.scenario.with_overrides({MODE_KEY: it.driven_mode(own)})
            for which in range(2):
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
    own = own_mode(plant.scenario())

    def points_of(blocks: slice) -> list[Point]:
        driven = [Runs.joined(it.blocks[blocks]) for it in finalists]
        own_runs = [
            one
            for it, one in zip(finalists, driven, strict=True)
            if not it.operation.settings and it.driven_mode(own) == own
        ]
        baseline = own_runs[0] if own_runs else None
        return [
            point
            for it, one in zip(finalists, driven, strict=True)
            for point in points(one, it.operation, it.modes, targets, baseline, simulated=True)
        ]

    by_seed = [points_of(slice(which, None, 2)) for which in range(2)]
    pooled = points_of(slice(None))
    known = {one.operation.name for one in pooled}
    every = [*pooled, *(it for it in screened if it.operation.name not in known)]
    chosen = recommended(pooled)
    named = tuple(name for it in by_seed if (name := _name(it)) is not None)
    rivals = [] if chosen is None else _rivals(plant, targets, pooled, pooled[chosen])
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
    begin: Begin,
) -> list[Point]:
    """Simulates every operation in the vehicle's power mode; returns the energies in all modes."""
    found, every, baseline = [], operations(scenario), nominal.first(runs)
    begin("operations", runs * (len(every) - 1))
    for it in every:
        changed = scenario.with_overrides(dict(it.settings)) if it.settings else scenario
        driven = simulate(it.name, changed, runs, seed) if it.settings else baseline
        for modes in mode_groups(changed):
            own = own_mode(changed) in [mode.number for mode in modes]
            found += points(driven, it, modes, targets, baseline, simulated=own)
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
    available = [it for it in others if it.is_available]
    possible = [it for it in available if it.judgement is not Judgement.MISSED]
    if best.judgement.holds:
        # Operations with less energy may meet the targets; those with more are needed if this one
        # does not.
        rivals = [it for it in possible if it.energy_j <= best.energy_j][::-1]
        rivals += [it for it in possible if it.energy_j > best.energy_j]
    else:
        rivals = sorted(available, key=lambda it: it.error_m)
    own = screened[0].operation
    named = [best.operation, *([] if own == best.operation else [own])]
    named += [it.operation for it in rivals if it.operation not in named]
    return named[:MOST_FINALISTS]


def _rivals(plant: _core.Plant, targets: Targets, pooled: list[Point], best: Point) -> list[Rival]:
    """Returns the finalists in every power mode, except the recommended point."""
    percent = targets.each[0].percent
    best_wh = _day_wh(plant, best)
    found: list[Rival] = []
    for it in sorted(pooled, key=lambda one: one.energy_j):
        if it.name == best.name:
            continue
        day_wh = _day_wh(plant, it)
        share = None if best_wh is None or day_wh is None else (day_wh - best_wh) / best_wh
        delta_m = it.driven.delta_m(best.driven, percent)
        ok_delta = it.driven.ok_delta(best.driven)
        found.append(Rival(it, delta_m, ok_delta, it.energy_j - best.energy_j, share))
    return found


def _day_wh(plant: _core.Plant, it: Point) -> float | None:
    """Returns the energy of the fleet's day; ``None`` without a figure of idle power."""
    day = economy.day(plant, it)
    return None if day.idle_wh is None else day.idle_wh.central + day.trips_wh.central
