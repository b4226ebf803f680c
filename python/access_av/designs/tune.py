"""Optimization of gains, weights and set points of a wake-up policy.

Optuna suggests the points, all of which use the same runs. Selection by these runs is biased;
therefore the best points are simulated again in new runs. Two of them are compared with the given
policy in a third set of runs: the best one, and the best one that meets the limits with the upper
ends of its intervals. The given policy remains unless one of them is better.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.designs.driven import Design, Driven, designs_of, drive, joined
from access_av.designs.front import differences
from access_av.designs.search import suggested
from access_av.designs.space import Dimension, Space
from access_av.errors import InputError
from access_av.settings import as_dict
from access_av.statistics.paired import half_width
from access_av.statistics.percentiles import column

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av._core import Scenario
    from access_av.designs.query import Query
    from access_av.run.campaign import Campaign

# Tunable keys of each policy: key, minimum, maximum; logarithmic scale if positive.
Range = tuple[str, float, float]
PID: list[Range] = [
    ("kp", 0.05, 5.0),
    ("ki", 0.005, 1.0),
    ("kd", 0.01, 2.0),
    ("weight_snr", 0.0, 1.0),
    ("weight_velocity", 0.0, 1.0),
    ("snr_scale_db", 2.0, 40.0),
    ("integral_clamp", 0.05, 5.0),
    ("snr_set_point.offset_db", -5.0, 12.0),
]
GATE: Range = ("snr_set_point.offset_db", -5.0, 9.0)
RANGES: dict[str, list[Range]] = {
    "fixed": [("interval_ms", 20.0, 5000.0)],
    "pid": PID,
    "gated": [GATE, *((f"trigger.{key}", low, high) for key, low, high in PID)],
    "uncertainty": [
        ("target_error_m", 0.05, 2.0),
        ("min_variance_reduction_m2", 1e-6, 0.1),
        ("snr_headroom_db", 0.0, 12.0),
    ],
}
FINALISTS = 8


@dataclass(frozen=True)
class Tuned:
    """A policy before and after tuning, in new runs.

    Attributes
    ----------
    less
        Paired differences before − after of energy (J) and squared error (m²): mean and the ends
        of the 95 % interval, shape (2, 3).
    """

    before: Driven
    after: Driven
    less: Any
    drives: int

    @property
    def is_better(self) -> bool:
        """Returns whether tuning found an improvement."""
        return self.after is not self.before


def space_of(scenario: Scenario) -> Space:
    """Returns the tunable keys of a scenario's wake-up policy.

    Examples
    --------
    >>> from access_av import Scenario
    >>> [dimension.key.split('.')[-1] for dimension in space_of(Scenario.load("yard")).dimensions]
    ['target_error_m', 'min_variance_reduction_m2', 'snr_headroom_db']
    """
    policy = as_dict(scenario.resolved().vehicle)["wake_up"]
    found = []
    for key, low, high in RANGES[policy["policy"]]:
        table: Any = policy
        for step in key.split(".")[:-1]:
            table = table.get(step, {})
        # Skip set points of another kind, and gains of fixed wake-up times.
        if key.endswith("offset_db") and table.get("kind") != "expected":
            continue
        if key.startswith("trigger.") and policy["trigger"]["policy"] != "pid":
            continue
        found.append(Dimension(f"vehicle.wake_up.{key}", "", low, high, low > 0.0))
    return Space(tuple(found))


def tune(
    campaign: Campaign,
    scenario: Scenario,
    limits: Query,
    *,
    designs: int = 64,
    runs: int = 20,
    seed: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Tuned:
    """Tunes a scenario's wake-up policy.

    Parameters
    ----------
    limits
        Limits. The objective is minimum energy. If only the energy is limited, it is the minimum
        error: of the percentile if given, otherwise RMS.
    designs
        Number of points that Optuna suggests.
    runs
        Number of runs per point, of the second simulation and of the final comparison.

    Raises
    ------
    InputError
        No limit, a platform without the energy of the method, or Optuna is not installed.
    """
    if limits.is_empty:
        raise InputError("no limit given: add a maximum error or a maximum energy")
    space = space_of(scenario)
    if not space.dimensions:
        raise InputError(f"{scenario.name}: its wake-up policy has no parameters to tune")

    def order(driven: Driven, *, with_margin: bool = True) -> tuple[float, float]:
        """Returns the sort key of a design: violation of the limits, then objective."""
        objective, constraints = _rated(limits, driven, with_margin=with_margin)
        return max(0.0, *constraints.values()), objective

    def again(some: list[Design], first_run: int) -> list[Driven]:
        made = drive(campaign, some, first_run=first_run, runs=runs, seed=seed)
        return [joined(one, [part]) for one, part in zip(some, made, strict=True)]

    found = suggested(
        campaign,
        scenario,
        space,
        count=designs,
        runs=runs,
        seed=seed,
        goal=partial(_rated, limits),
        progress=progress,
    )
    tried = sorted(found.driven, key=order)
    if not np.isfinite(tried[0].mean_energy_j):
        name = tried[0].design.platform.name
        raise InputError(f"platform {name} contains no energy of the vehicle's estimator")
    finalists = [it.design for it in tried[:FINALISTS]]
    confirmed = again(finalists, runs)
    as_found = partial(order, with_margin=False)
    safest, best = (min(confirmed, key=it).design for it in (order, as_found))
    [baseline] = designs_of(scenario, [{}])
    last = [baseline, safest, *([best] if best is not safest else [])]
    # Prefer the first of equal ones, which is the given policy.
    before, *others = again(last, 2 * runs)
    after = min([before, *others], key=as_found)
    less = -differences(after, [before])[0][:, [0, 2, 1]]
    return Tuned(before, after, less, found.drives + runs * (len(finalists) + len(last)))


def _rated(
    limits: Query, driven: Driven, *, with_margin: bool = True
) -> tuple[float, dict[str, float]]:
    """Returns the objective of a design, and the relative violation of each limit.

    With a margin, errors are the upper ends of their intervals.
    """
    count, square_m2 = driven.square_m2.size, driven.rms_m**2
    if with_margin and count > 1:
        spread_m2 = float(np.std(driven.square_m2, ddof=1))
        square_m2 += half_width(spread_m2, count) / np.sqrt(count)
    [error] = driven.percentiles([limits.percent], of_seen=True)
    error_m = error.high if with_margin and error.high is not None else error.value
    row = {
        "energy_j": driven.mean_energy_j,
        "rms_error_m": float(np.sqrt(square_m2)),
        "p90_max_error_m": driven.p90_worst_m,
        column(limits.percent): error_m,
    }
    constraints = {name: ratio - 1.0 for name, ratio in limits.excess(row).items()}
    if not limits.binds_energy_alone:
        return driven.mean_energy_j, constraints
    return driven.rms_m if limits.percentile is None else error_m, constraints
