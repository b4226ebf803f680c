"""Proposed localizer and wake-up policy on the paper's trip, in the paper's accounting.

A Kalman filter with pose and odometer states replaces dead reckoning. A policy that wakes up before
the error exceeds a target replaces Algorithm 1. Radio, vehicle, odometer, runs, estimator (MUSIC),
its duration and its energy per execution are those of the paper.

The information that each method has decides such a comparison. On the paper's trip, odometer and
start are exact, so that a method that knows the road needs no angle. :func:`fair` therefore
compares both with equal information: with and without the road, with the paper's odometer and with
a real one. It adds the result of one single angle, and the posterior bound.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.paper.outcome import Drives, interval
from access_av.run.error_bound import along_route

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av._core import Scenario
    from access_av.device.platform import Platform
    from access_av.paper.driver import Driver
    from access_av.paper.evaluation import Evaluation

# Target error of the proposed policy with a probability of 90 %: the paper's 0.3 m.
BOUND_M = 0.3
# Minimum variance reduction of an early wake-up. The value was selected on this trip so that it
# meets the target error without a road map.
MIN_VARIANCE_REDUCTION_M2 = BOUND_M**2 / 200.0
# SNR headroom of an early reception: three standard deviations of the paper's fading.
HEADROOM_DB = 9.0


@dataclass(frozen=True)
class Comparison:
    """Comparison of the proposed method with the paper's adaptive point in a power mode.

    Columns ``comparisons`` of :mod:`access_av.columns`.

    Attributes
    ----------
    ours
        Runs of the proposed tracker.
    """

    mode: int
    map: bool
    aoa_estimates: float
    papers_aoa_estimates: float
    energy_j: float | None
    papers_energy_j: float | None
    worst_error_m: float
    papers_worst_m: float
    rms_error_m: float
    papers_rms_m: float
    rms_error_reduction_m: float
    rms_error_reduction_low_m: float
    rms_error_reduction_high_m: float
    estimates_saved: float
    estimates_saved_low: float
    estimates_saved_high: float
    ours: Drives | None = field(default=None, repr=False, compare=False)

    @property
    def is_better(self) -> bool:
        """Whether error and energy are both smaller, each with 95 % confidence."""
        return self.rms_error_reduction_low_m > 0.0 and self.estimates_saved_low > 0.0


def tracked(scenario: Scenario, base_ms: float, *, knows_road: bool = True) -> Scenario:
    """Returns the scenario with the proposed tracker and uncertainty-driven wake-up."""
    return scenario.with_overrides(
        {
            "vehicle.localizer.kind": "tracker",
            "vehicle.localizer.map": knows_road,
            # Prior of the path without a map: the paper's trip is nearly straight.
            "vehicle.localizer.curvature_rms_per_m": 0.001,
            "vehicle.localizer.curvature_correlation_m": 400.0,
            "vehicle.integrity.enabled": False,
            "vehicle.wake_up": {
                "policy": "uncertainty",
                "target_error_m": BOUND_M,
                "base_ms": base_ms,
                "min_variance_reduction_m2": 1e6,  # wake up only for the target error
            },
        }
    )


def _ours(scenario: Scenario, base_ms: float, *, knows_road: bool) -> Scenario:
    return tracked(scenario, base_ms, knows_road=knows_road).with_overrides(
        {
            "vehicle.estimator.method": "music",
            "vehicle.wake_up.min_variance_reduction_m2": MIN_VARIANCE_REDUCTION_M2,
            "vehicle.wake_up.snr_headroom_db": HEADROOM_DB,
        }
    )


def compare(
    driver: Driver, evaluation: Evaluation, progress: Callable[[int, int], None]
) -> list[Comparison]:
    """Compares the proposed method in every power mode, with and without a road map."""
    found: list[Comparison] = []
    for mode in driver.platform.modes:
        for knows_road in (True, False):
            base_ms = mode.base_wake_up_ms["music"]
            scenario = _ours(evaluation.scenario, base_ms, knows_road=knows_road)
            drives = driver.drive(scenario).drives
            found.append(
                compared_with_paper(evaluation, mode.number, drives, knows_road=knows_road)
            )
            progress(len(found), 2 * len(driver.platform.modes))
    return found


def simulations(platform: Platform) -> int:
    """Returns the number of different settings of :func:`compare` and :func:`fair`."""
    bases = {mode.base_wake_up_ms["music"] for mode in platform.modes}
    # With an exact odometer, the paper's method and the tracker are settings of :func:`compare`.
    return 2 * len(bases) + sum(
        who != "bound" if real else who == "one angle" for real, _, who in EQUAL
    )


def compared_with_paper(
    evaluation: Evaluation, mode: int, ours: Drives, *, knows_road: bool
) -> Comparison:
    """Compares runs of the proposed method with the paper's adaptive point in a mode."""
    papers = evaluation.outcome.adaptive[mode]
    per_execution_j = evaluation.outcome.energy_per_execution_j[mode].get("music")
    papers_j, ours_j = (
        None
        if per_execution_j is None
        else float(np.atleast_1d(it.aoa_estimates[0] * per_execution_j)[0]) + papers.other_energy_j
        for it in (papers, ours)
    )
    less_m = papers.rms_error_m - ours.rms_error_m
    less = papers.aoa_estimates - ours.aoa_estimates
    least_m, most_m = interval(less_m)
    least, most = interval(less)
    return Comparison(
        mode=mode,
        map=knows_road,
        aoa_estimates=float(ours.aoa_estimates[0]),
        papers_aoa_estimates=float(papers.aoa_estimates[0]),
        energy_j=ours_j,
        papers_energy_j=papers_j,
        worst_error_m=float(ours.worst_m[0]),
        papers_worst_m=float(papers.worst_m[0]),
        rms_error_m=float(ours.rms_error_m[0]),
        papers_rms_m=float(papers.rms_error_m[0]),
        rms_error_reduction_m=float(less_m[0]),
        rms_error_reduction_low_m=least_m,
        rms_error_reduction_high_m=most_m,
        estimates_saved=float(less[0]),
        estimates_saved_low=least,
        estimates_saved_high=most,
        ours=ours,
    )


# Realistic odometer, and start uncertainty at a loading bay.
REAL = {
    "vehicle.odometer.scale_std": 0.003,
    "vehicle.odometer.noise_m_per_sqrt_m": 0.01,
    "vehicle.start.position_std_m": 0.1,
    "vehicle.start.heading_std_rad": 0.02,
}
# Interval for a single estimate at the start: longer than any trip.
ONCE_MS = 3.6e6
# Comparisons with equal information: whether the odometer is real, whether the road is known, and
# the method (see :class:`Fair`).
EQUAL = (
    (False, False, "paper"),
    (False, False, "ours"),
    (False, True, "ours"),
    (False, True, "one angle"),
    (True, False, "paper"),
    (True, False, "ours"),
    (True, False, "bound"),
    (True, True, "ours"),
    (True, True, "one angle"),
    (True, True, "bound"),
)


@dataclass(frozen=True)
class Fair:
    """Method in mode 0 with its information: columns ``comparisons`` of :mod:`access_av.columns`.

    A real odometer has the errors of :data:`REAL`. The bound is the posterior Cramér–Rao bound of
    the tracker's model with an angle at every SSB, a mean over the roads of its curvature prior.

    Attributes
    ----------
    drives
        Runs; ``None`` for the bound.
    """

    real_odometer: bool
    map: bool
    who: str
    aoa_estimates: float
    rms_error_m: float
    rms_low_m: float
    rms_high_m: float
    worst_error_m: float | None
    drives: Drives | None = field(default=None, repr=False, compare=False)

    @property
    def variant(self) -> str:
        """Odometer, road map and method, in the notation of the table of runs."""
        odometer = "real odometer" if self.real_odometer else "exact odometer"
        return f"{odometer}, {'' if self.map else 'no '}road map, {self.who}"


def fair(driver: Driver, evaluation: Evaluation) -> list[Fair]:
    """Compares the paper's method and the proposed one in mode 0 with equal information.

    With the road, the paper's method does not need its angles, because it uses them for the heading
    only; its result is that of the localizer with one angle. The bound is computed with a real
    odometer only, because the model of the localizer has no exact odometer.
    """
    mode = driver.platform.modes[0]
    # A real odometer is another environment, in which only MUSIC is simulated.
    drivers = (driver, replace(driver, methods=("music",), known={}, traces=[]))
    found = []
    for real, knows_road, who in EQUAL:
        paper = evaluation.scenario.with_overrides(
            {"vehicle.platform.mode": mode.number, "vehicle.estimator.method": "music"}
            | (REAL if real else {})
        )
        mine = _ours(paper, mode.base_wake_up_ms["music"], knows_road=knows_road)
        once = mine.with_overrides({"vehicle.wake_up": {"policy": "fixed", "interval_ms": ONCE_MS}})
        if who == "bound":
            route = along_route(once)
            rms_m = float(route.select((pl.col("bound_m") ** 2).mean().sqrt()).item())
            figures = (float(route.height), rms_m, rms_m, rms_m, None)
            found.append(Fair(real, knows_road, who, *figures))
            continue
        scenario = {"paper": paper, "ours": mine, "one angle": once}[who]
        drives = drivers[real].drive(scenario).drives
        rms_m, ends_m = float(drives.rms_error_m[0]), interval(drives.rms_error_m)
        count, worst_m = float(drives.aoa_estimates[0]), float(drives.worst_m[0])
        found.append(Fair(real, knows_road, who, count, rms_m, *ends_m, worst_m, drives))
    return found
