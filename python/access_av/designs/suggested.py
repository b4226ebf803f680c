"""Designs that Optuna suggests, in the light of those that were driven (extra ``optuna``).

It is asked and told; its own storage, in which what was killed stays running, is not used. What was
driven lies in parts: the same seed suggests the same designs again, and those are there already.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.designs.drives import designs_of, drive, joined
from access_av.designs.search import Found
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av._core import Scenario
    from access_av.campaign import Campaign
    from access_av.designs.space import Space

# Designs that are asked for before the last ones are told: enough for all workers.
BATCH = 16
# What a design is told as whose vehicle is never found, or that has no energy figure.
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
    """Drive so many designs that Optuna's NSGA-II suggests, for least energy and least error.

    Raises
    ------
    InputError
        When Optuna is not there.
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
    values: list[dict[str, Any]] = []
    parts = []
    while len(values) < count:
        trials = [study.ask() for _ in range(min(BATCH, count - len(values)))]
        asked = [_values(trial, space) for trial in trials]
        designs = designs_of(scenario, asked)
        made = drive(campaign, designs, first_run=0, runs=runs, seed=seed)
        for trial, design, part in zip(trials, designs, made, strict=True):
            if part is None:
                raise InputError("--optuna looks at all drives: it cannot be shared by --shard")
            found = joined(design, [part])
            aims = found.mean_energy_j, float(np.mean(found.square_m2))
            study.tell(trial, [min(aim, HOPELESS) for aim in aims])
            parts.append(part)
        values += asked
        if progress is not None:
            progress(len(values), count)
    once = {repr(each): index for index, each in enumerate(values)}
    designs = designs_of(scenario, [values[index] for index in once.values()])
    driven = [
        joined(design, [parts[index]]) for design, index in zip(designs, once.values(), strict=True)
    ]
    return Found(driven, count * runs)


def _values(trial: Any, space: Space) -> dict[str, Any]:
    """What a trial suggests; choices by their number, as they may be tables."""
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
