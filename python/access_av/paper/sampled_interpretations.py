"""Interpretations of the paper, drawn from its unspecified parameters, with verdicts on its claims.

Environments are drawn first, and several controllers for each of them, because the campaigns with
fixed intervals are simulated once for each environment. An environment with its controllers is one
part on disk, so that an interrupted search continues.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av import _core
from access_av._core import Scenario
from access_av.designs.space import named
from access_av.device.platform import Platform
from access_av.paper.claims import margins
from access_av.paper.driver import Driver
from access_av.paper.evaluation import Case, cases, outcome_of
from access_av.paper.open_choices import (
    CONTROLLER,
    GATE,
    OPEN_CONTROLLER,
    OPEN_WORLD,
    SHIPPED_WORLD,
    WORLD,
    Dimension,
    controller_changes,
    latin_hypercube,
    world_changes,
)
from access_av.paper.outcome import Drives, Numbers
from access_av.paper.statements import stated_claims
from access_av.run.campaign import Campaign, Task

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@dataclass(frozen=True)
class Sample:
    """Sampled interpretations and the margins of their claims.

    Attributes
    ----------
    coordinates
        One row per interpretation, from 0 to 1.
    world
        Index of the environment of each interpretation.
    margins
        Margins of each claim, in the order of the interpretations.
    longest_gap_s
        Maximum time between two estimates, over all modes.
    aoa_estimates
        Number of estimates of adaptive MUSIC in the platform's first mode.
    worst_error_m
        Maximum error of adaptive MUSIC, over all modes.
    """

    dimensions: tuple[Dimension, ...]
    coordinates: Numbers
    world: Numbers
    margins: Mapping[str, Numbers]
    longest_gap_s: Numbers
    aoa_estimates: Numbers
    worst_error_m: Numbers

    def held(self) -> Numbers:
        """Returns the number of claims that each interpretation meets."""
        held = [margin >= 0.0 for margin in self.margins.values()]
        return np.asarray(np.sum(held, axis=0), dtype=np.float64)

    def best(self) -> list[int]:
        """Returns the interpretations, ordered by the number of met claims, then by the margin."""
        short = np.sum([np.clip(margin, -1.0, 0.0) for margin in self.margins.values()], axis=0)
        return [int(index) for index in np.lexsort((-short, -self.held()))]

    def values(self, index: int) -> dict[str, Any]:
        """Returns the sampled values of an interpretation."""
        return named(self.dimensions, self.coordinates[index].tolist())


def sample(
    campaign: Campaign,
    platform: Platform,
    *,
    worlds: int,
    controllers: int,
    runs: int,
    seed: int = 1,
    everything: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Sample:
    """Draws interpretations, and evaluates the paper's claims under each.

    Parameters
    ----------
    campaign
        Workers, and storage of each environment with its controllers.
    everything
        Whether all unspecified parameters are drawn, including an SNR gate and the power of a real
        radio head. Otherwise Algorithm 1 without a gate is simulated in environments similar to the
        shipped one, which is the first.
    progress
        Called as ``progress(done, total)`` with numbers of environments.
    """
    own = (*OPEN_CONTROLLER, GATE) if everything else CONTROLLER
    world = OPEN_WORLD if everything else WORLD
    world_points = latin_hypercube(worlds, len(world), seed)
    if not everything:
        world_points[0] = SHIPPED_WORLD
    own_points = latin_hypercube(worlds * controllers, len(own), seed + 1)
    own_points = own_points.reshape(worlds, controllers, len(own))
    tasks = [
        _task(
            platform,
            named(world, world_points[index].tolist()),
            [named(own, point) for point in own_points[index].tolist()],
            runs,
            seed,
        )
        for index in range(worlds)
    ]
    parts = campaign.run(tasks, progress)
    found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    repeated = np.repeat(world_points, controllers, axis=0)
    return Sample(
        dimensions=(*world, *own),
        coordinates=np.hstack([repeated, own_points.reshape(-1, len(own))]),
        world=np.repeat(np.arange(worlds), controllers),
        margins={name: found[name] for name in found if name in stated_claims()},
        **{name: found[name] for name in ("longest_gap_s", "aoa_estimates", "worst_error_m")},
    )


def _task(
    platform: Platform,
    world: Mapping[str, Any],
    controllers: Sequence[Mapping[str, Any]],
    runs: int,
    seed: int,
) -> Task:
    """Returns one part: several controllers in one environment."""
    board = platform.to_toml()
    return Task(
        depends_on={
            "world": world,
            "controllers": controllers,
            "runs": runs,
            "seed": seed,
            "platform": board,
            "scenario": Scenario.load("paper").to_toml(),
            # The rule of a claim with its bound, from which the margin is computed.
            "claims": {
                name: {key: entry.get(key) for key in ("rule", "stated", "tolerance", "query")}
                for name, entry in stated_claims().items()
            },
        },
        work=judge,
        arguments=(board, world, controllers, runs, seed),
    )


def judge(
    board: str,
    world: Mapping[str, Any],
    controllers: Sequence[Mapping[str, Any]],
    runs: int,
    seed: int,
) -> dict[str, Numbers]:
    """Returns margins of all claims and maximum gap, for several controllers in one environment.

    ``board`` is the platform as TOML, because the task may run on another machine. Uses one thread.
    """
    platform = Platform(_core.Platform.from_toml(board))
    driver = Driver(platform, runs, seed, threads=1, count=0)
    clock = {"vehicle.wake_up.trigger.ssb_selection": world.get("ssb_selection", "first-after")}
    paper = Scenario.load("paper").with_overrides(world_changes(world) | clock)
    scenarios = [paper.with_overrides(controller_changes(point, world)) for point in controllers]
    drives: list[tuple[Case, Drives]] = []
    for case in cases(platform):
        if case.setting.adaptive:
            each = [driver.drive(case.apply(scenario)).drives for scenario in scenarios]
            drives.append((case, _side_by_side(each)))
        else:
            drives.append((case, driver.drive(case.apply(paper)).drives))
    outcome, _ = outcome_of(drives, platform, driver.trip_s, fit_each=True)
    gaps_s = [np.atleast_1d(each.longest_gap_s) for each in outcome.adaptive.values()]
    count = len(controllers)
    first = outcome.adaptive[platform.modes[0].number]
    return {
        "longest_gap_s": np.max(gaps_s, axis=0),
        "aoa_estimates": first.aoa_estimates,
        "worst_error_m": np.max([each.worst_m for each in outcome.adaptive.values()], axis=0),
        **{name: np.broadcast_to(margin, count) for name, margin in margins(outcome).items()},
    }


def _side_by_side(interpretations: list[Drives]) -> Drives:
    """Returns one setting under several interpretations, as variants."""

    def joined(name: str) -> Any:
        return np.concatenate([np.atleast_1d(getattr(each, name)) for each in interpretations])

    return Drives(
        **{
            name: joined(name)
            for name in ("aoa_estimates", "worst_x_m", "worst_y_m", "rms_error_m", "horizontal_m")
        },
        longest_gap_s=joined("longest_gap_s"),
    )


def as_scenario(values: Mapping[str, Any]) -> Scenario:
    """Returns a sampled point as a scenario."""
    named_alike = {"name": "found", "description": "Found by access-av paper search-controllers"}
    changes = world_changes(values) | controller_changes(values, values)
    return Scenario.load("paper").with_overrides(named_alike | changes)


# Number of best interpretations that are simulated again, because a maximum over few runs is
# biased.
CANDIDATES = 8


@dataclass(frozen=True)
class Confirmed:
    """Interpretation that was simulated again.

    Attributes
    ----------
    label
        Rank in the search, or the parameter that differs from the best one.
    missed
        Ids of the claims that are not met.
    """

    label: str
    values: Mapping[str, Any]
    held: int
    missed: list[str]


def confirmed(
    campaign: Campaign, platform: Platform, found: Sample, *, runs: int, seed: int
) -> list[Confirmed]:
    """Simulates the best interpretations again, then the neighbours of the best one.

    A neighbour differs by a tenth of the range of one controller parameter, or by another choice.
    The order is by the number of met claims, then by the order of the search.
    """

    def again(worlds: Sequence[Mapping[str, Mapping[str, Any]]]) -> list[list[Confirmed]]:
        tasks = []
        for labelled in worlds:
            [*points] = labelled.values()
            world = {dimension.key: points[0][dimension.key] for dimension in WORLD}
            task = _task(platform, world, points, runs, seed)
            tasks.append(replace(task, depends_on={**task.depends_on, "confirmed": True}))
        return [
            [
                Confirmed(
                    label=label,
                    values=values,
                    held=sum(bool(part[name][index] >= 0.0) for name in found.margins),
                    missed=[name for name in found.margins if part[name][index] < 0.0],
                )
                for index, (label, values) in enumerate(labelled.items())
            ]
            for labelled, part in zip(worlds, campaign.run(tasks), strict=True)
        ]

    best = found.best()[:CANDIDATES]
    candidates = [
        {f"number {place} of the search": found.values(index)}
        for place, index in enumerate(best, start=1)
    ]
    driven = [one for [one] in again(candidates)]
    index, first = max(zip(best, driven, strict=True), key=lambda item: item[1].held)
    [neighbours_again] = again([_neighbours(found, index)])
    rest = [one for one in driven if one is not first]
    return [first, *sorted(neighbours_again + rest, key=lambda each: -each.held)]


def _neighbours(found: Sample, index: int) -> dict[str, dict[str, Any]]:
    start = found.coordinates[index]
    neighbours = {}
    for d, dimension in enumerate(found.dimensions):
        if dimension in CONTROLLER:
            there = start.copy()
            step = 1.0 / len(dimension.choices) if dimension.choices else 0.1
            there[d] += step if start[d] < 0.5 else -step
            values = named(found.dimensions, there.tolist())
            neighbours[f"next to it, {dimension.label}: {values[dimension.key]}"] = values
    return neighbours
