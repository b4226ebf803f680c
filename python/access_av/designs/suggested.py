"""Designs suggested by Optuna from the results of earlier designs (extra ``optuna``).

Optuna's interface of ``ask`` and ``tell`` is used without its storage, because killed trials stay
active there. Results are stored in parts: an equal seed suggests equal designs, whose results exist
already.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.designs.driven import drive, in_worlds, in_worst, joined
from access_av.designs.search import Found
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from access_av._core import Scenario
    from access_av.designs.driven import Design, Driven, Part
    from access_av.designs.space import Space
    from access_av.run.campaign import Campaign

# Number of designs per batch, enough for all workers.
BATCH = 16
# Objective value of a design without position or without energy.
HOPELESS = 1e12


def suggested(
    campaign: Campaign,
    scenario: Scenario,
    space: Space,
    *,
    count: int,
    runs: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> Found:
    """Simulates designs that Optuna's NSGA-II suggests, to minimize energy and error.

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
    study = optuna.create_study(
        directions=["minimize", "minimize"],
        sampler=optuna.samplers.NSGAIISampler(seed=seed % 2**32, population_size=BATCH),
    )
    kept: dict[str, tuple[dict[str, Any], list[Part]]] = {}
    done = 0
    while done < count:
        trials = [study.ask() for _ in range(min(BATCH, count - done))]
        asked = [_values(trial, space) for trial in trials]
        designs = in_worlds(scenario, asked, space.worlds)
        every = [one for worlds in designs for one in worlds]
        made = drive(campaign, every, first_run=0, runs=runs, seed=seed)
        parts: list[Part] = list(made)
        for number, (trial, worlds) in enumerate(zip(trials, designs, strict=True)):
            mine = parts[number * len(worlds) : (number + 1) * len(worlds)]
            driven = _judged(worlds, mine)
            aims = driven.mean_energy_j, float(np.mean(driven.square_m2))
            study.tell(trial, [min(aim, HOPELESS) for aim in aims])
            kept.setdefault(repr(asked[number]), (asked[number], mine))
        done += len(trials)
        if progress is not None:
            progress(done, count)
    # Label all designs together, because a label contains the differing values.
    designs = in_worlds(scenario, [chosen for chosen, _ in kept.values()], space.worlds)
    judged = [
        _judged(worlds, mine) for worlds, (_, mine) in zip(designs, kept.values(), strict=True)
    ]
    return Found(judged, count * runs * len(space.worlds))


def _judged(worlds: Sequence[Design], parts: Sequence[Part]) -> Driven:
    return in_worst([joined(one, [part]) for one, part in zip(worlds, parts, strict=True)])


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
