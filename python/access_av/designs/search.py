"""Simulation of designs: all runs of each, successive halving, or designs suggested by Optuna.

Optuna (extra ``optuna``) is used by ``ask`` and ``tell`` without its storage, because killed trials
stay active there. Results are stored in parts: an equal seed suggests equal designs, whose results
exist already. Optuna's pruners are not used, because they do not support two objectives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.designs.driven import Design, Driven, drive, in_worlds, in_worst, joined
from access_av.designs.front import aims
from access_av.errors import InputError
from access_av.statistics.pareto import pareto_front

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from access_av._core import Scenario
    from access_av.designs.driven import Part
    from access_av.designs.space import Space
    from access_av.run.campaign import Campaign

# Successive halving: factor of fewer designs and more runs per round.
KEEP_ONE_IN = 3
FIRST_RUNS = 2
# Number of designs per batch of suggestions, enough for all workers.
BATCH = 16
# The first third of the suggestions for a goal covers the space evenly, by a Sobol sequence.
STARTUP_SHARE = 3
# Objective value of a design without position or without energy.
HOPELESS = 1e12


@dataclass(frozen=True)
class Found:
    """Designs with all runs, and the number of simulated runs.

    Attributes
    ----------
    drives
        Total number of runs, counted per design.
    """

    driven: list[Driven]
    drives: int


def rounds(runs: int, *, halving: bool) -> list[int]:
    """Returns the numbers of runs after which the designs are compared.

    Examples
    --------
    >>> rounds(20, halving=True), rounds(20, halving=False)
    ([2, 6, 20], [20])
    """
    counts, upto = [], FIRST_RUNS
    while halving and 2 * upto <= runs:
        counts.append(upto)
        upto *= KEEP_ONE_IN
    return [*counts, runs]


def search(
    campaign: Campaign,
    designs: Sequence[Sequence[Design]],
    *,
    runs: int,
    seed: int,
    halving: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Found:
    """Simulates the designs.

    Parameters
    ----------
    designs
        Designs in every environment; each is rated in its worst one.
    runs
        Number of runs of each remaining design in each environment.
    halving
        Whether inferior designs are dropped early; all designs use the same runs.
    """
    if not designs:
        raise InputError("no designs to simulate")
    left: list[tuple[Sequence[Design], list[list[Part]]]] = [
        (worlds, [[] for _ in worlds]) for worlds in designs
    ]
    done = drives = 0
    driven: list[Driven] = []
    stages = rounds(runs, halving=halving)
    for stage, upto in enumerate(stages):
        every = [one for worlds, _ in left for one in worlds]
        made = drive(
            campaign, every, first_run=done, runs=upto - done, seed=seed, progress=progress
        )
        kept = [parts for _, of_worlds in left for parts in of_worlds]
        for parts, part in zip(kept, made, strict=True):
            parts.append(part)
        drives += len(every) * (upto - done)
        done = upto
        driven = [_rated(worlds, parts) for worlds, parts in left]
        if stage + 1 < len(stages):
            keep = max(len(left) // KEEP_ONE_IN, 1)
            left = [left[place] for place in sorted(ranking(driven)[:keep])]
    return Found(driven, drives)


def ranking(driven: Sequence[Driven]) -> list[int]:
    """Returns the designs in order of Pareto rank."""
    energy_j, square_m2 = aims(driven)
    left = np.arange(len(driven))
    found: list[int] = []
    while left.size:
        on_front = left[pareto_front(energy_j[left], square_m2[left])]
        if on_front.size == 0:
            on_front = left[np.argsort(energy_j[left], kind="stable")]
        found += on_front.tolist()
        left = np.setdiff1d(left, on_front)
    return found


def suggested(
    campaign: Campaign,
    scenario: Scenario,
    space: Space,
    *,
    count: int,
    runs: int,
    seed: int,
    goal: Callable[[Driven], tuple[float, Mapping[str, float]]] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Found:
    """Simulates designs that Optuna suggests from the results of earlier ones.

    Parameters
    ----------
    goal
        Returns objective and constraints by name of a design; a constraint is met up to 0. The
        tree-structured Parzen estimator minimizes the objective; the space must consist of ranges.
        Default: NSGA-II minimizes energy and squared error.

    Raises
    ------
    InputError
        Optuna is not installed.
    """
    try:
        import optuna
    except ImportError as error:
        raise InputError("--optuna needs the extra: pip install 'access-av[optuna]'") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    sampler = (
        optuna.samplers.NSGAIISampler(seed=seed % 2**32, population_size=BATCH)
        if goal is None
        else optuna.samplers.TPESampler(seed=seed % 2**32, n_startup_trials=count // STARTUP_SHARE)
    )
    study = optuna.create_study(
        directions=["minimize"] * (2 if goal is None else 1), sampler=sampler
    )
    if goal is not None:
        for point in space.sobol(count // STARTUP_SHARE):
            study.enqueue_trial(point)
    kept: dict[str, tuple[Mapping[str, Any], list[Part]]] = {}
    done = 0
    while done < count:
        trials = [study.ask() for _ in range(min(BATCH, count - done))]
        asked = [_values(trial, space) for trial in trials]
        designs = in_worlds(scenario, asked, space.worlds)
        made = drive(
            campaign, [one for it in designs for one in it], first_run=0, runs=runs, seed=seed
        )
        for number, (trial, worlds) in enumerate(zip(trials, designs, strict=True)):
            mine = made[number * len(worlds) : (number + 1) * len(worlds)]
            driven = _rated(worlds, [[part] for part in mine])
            values: Sequence[float] = (driven.mean_energy_j, float(np.mean(driven.square_m2)))
            if goal is not None:
                objective, constraints = goal(driven)
                values = [objective]
                for name, violation in constraints.items():
                    trial.set_constraint(name, min(violation, HOPELESS))
            study.tell(trial, [min(value, HOPELESS) for value in values])
            kept.setdefault(repr(asked[number]), (asked[number], list(mine)))
        done += len(trials)
        if progress is not None:
            progress(done, count)
    # Label all designs together, because a label contains the differing values.
    designs = in_worlds(scenario, [chosen for chosen, _ in kept.values()], space.worlds)
    rated = [
        _rated(worlds, [[part] for part in mine])
        for worlds, (_, mine) in zip(designs, kept.values(), strict=True)
    ]
    return Found(rated, count * runs * len(space.worlds))


def _rated(worlds: Sequence[Design], parts: Sequence[Sequence[Part]]) -> Driven:
    """Returns a design in its worst environment, from the parts in each environment."""
    return in_worst([joined(*pair) for pair in zip(worlds, parts, strict=True)])


def _values(trial: Any, space: Space) -> dict[str, Any]:
    """Returns the values of a trial; choices by index, because they can be tables."""
    found = {}
    for dimension in space.dimensions:
        if dimension.choices:
            number = trial.suggest_int(dimension.key, 0, len(dimension.choices) - 1)
            found[dimension.key] = dimension.choices[number]
        else:
            found[dimension.key] = trial.suggest_float(
                dimension.key, dimension.low, dimension.high, log=dimension.is_log
            )
    return found
