"""Contribution of the controller: comparison with a constant wake-up time of equal rate.

All other settings are equal, including an SNR threshold, and so are the runs. The paired difference
of a run is the effect of the controller.
"""

from __future__ import annotations

from collections import ChainMap
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from access_av.paper.evaluation import Evaluation, cases, fixed_interval
from access_av.paper.outcome import Drives, interval
from access_av.paper.statements import paper_numbers

if TYPE_CHECKING:
    from access_av._core import Scenario
    from access_av.paper.driver import Driver
    from access_av.paper.interpretations import Interpretation

# Intervals of the front in ms, from every SSB to more than the paper's t_max.
FRONT_MS = (20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 180.0, 240.0, 320.0, 480.0, 1000.0)
# Fraction of the error below which a difference is irrelevant.
LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Ablation:
    """Power mode of an interpretation, with its controller and with a constant wake-up time.

    Columns ``comparisons`` of :mod:`access_av.columns`. The interval of ``gain_m`` is that of a
    joint bootstrap over the common runs. A difference ``matters`` if the whole interval exceeds
    :data:`LEAST_SHARE` of the error.

    Attributes
    ----------
    constant
        Runs with the constant wake-up time.
    """

    interpretation: str
    mode: int
    constant_ms: float
    aoa_estimates: float
    constant_aoa_estimates: float
    rms_error_m: float
    constant_rms_m: float
    gain_m: float
    gain_low_m: float
    gain_high_m: float
    matters: int
    constant: Drives | None = field(default=None, repr=False, compare=False)


def ablate(driver: Driver, evaluation: Evaluation) -> list[Ablation]:
    """Returns the ablation of an interpretation in every power mode with different runs."""
    found = []
    base_seen = set()
    interpretation = evaluation.interpretation
    if interpretation.is_gated:
        # No other interpretation has these constants: forget 60 MB of their results.
        driver = replace(driver, known=ChainMap({}, driver.known))
    for case in cases(driver.platform):
        mode, base_ms = case.mode, case.setting.base_wake_up_ms
        if not case.setting.adaptive or mode is None or base_ms in base_seen:
            continue
        base_seen.add(base_ms)
        drives = evaluation.outcome.adaptive[mode.number]
        constant_ms, constant = (_gated if interpretation.is_gated else _fixed)(
            driver, interpretation, drives, base_ms
        )
        found.append(compare(interpretation.name, mode.number, drives, constant, constant_ms))
    return found


def compare(
    interpretation: str, mode: int, drives: Drives, constant: Drives, constant_ms: float
) -> Ablation:
    """Compares runs with the controller and runs with the constant, with equal seeds."""
    gains_m = constant.rms_error_m - drives.rms_error_m
    low_m, high_m = interval(gains_m) if len(gains_m) > 1 else (0.0, 0.0)
    least_m = LEAST_SHARE * float(drives.rms_error_m[0])
    return Ablation(
        interpretation=interpretation,
        mode=mode,
        constant_ms=constant_ms,
        aoa_estimates=float(drives.aoa_estimates[0]),
        constant_aoa_estimates=float(constant.aoa_estimates[0]),
        rms_error_m=float(drives.rms_error_m[0]),
        constant_rms_m=float(constant.rms_error_m[0]),
        gain_m=float(gains_m[0]),
        gain_low_m=low_m,
        gain_high_m=high_m,
        matters=1 if low_m > least_m else -1 if high_m < -least_m else 0,
        constant=replace(constant, horizontal_m=constant.horizontal_m[:1].copy()),
    )


def front(driver: Driver, interpretation: Interpretation) -> list[tuple[float, Drives]]:
    """Simulates MUSIC at fixed intervals in the environment of an interpretation."""
    return [(ms, driver.drive(fixed(interpretation.scenario, ms)).drives) for ms in FRONT_MS]


def fixed(scenario: Scenario, interval_ms: float) -> Scenario:
    """Returns the scenario with MUSIC at a fixed interval."""
    return scenario.with_overrides(
        {
            "vehicle.estimator.method": "music",
            "vehicle.wake_up": fixed_interval(scenario, interval_ms),
        }
    )


def _fixed(
    driver: Driver, interpretation: Interpretation, drives: Drives, _: float
) -> tuple[float, Drives]:
    """Returns the multiple of the SSB period with the nearest number of angle estimates."""
    period_ms = paper_numbers()["wake_up"]["ssb_period_ms"]
    gap_ms = 1e3 * driver.trip_s / (float(drives.aoa_estimates[0]) - 0.5)
    wanted = float(drives.aoa_estimates[0])
    near = [period_ms * max(1, gap_ms // period_ms + more) for more in (0, 1)]
    found = {ms: driver.drive(fixed(interpretation.scenario, ms)).drives for ms in near}
    best_ms = min(found, key=lambda ms: abs(float(found[ms].aoa_estimates[0]) - wanted))
    return best_ms, found[best_ms]


def _gated(
    driver: Driver, interpretation: Interpretation, drives: Drives, base_ms: float
) -> tuple[float, Drives]:
    """Returns a constant with the same SNR gate and the nearest number of angle estimates.

    Candidates are multiples of the SSB period. The number of estimates decreases with the constant.
    """
    period_ms = paper_numbers()["wake_up"]["ssb_period_ms"]
    t_max_ms = interpretation.wake_up.get("t_max_ms", np.inf)
    wanted = float(drives.aoa_estimates[0])
    best_ms, best = base_ms, None
    constant_ms = base_ms
    while constant_ms <= t_max_ms:
        scenario = interpretation.scenario.with_overrides(
            {
                "vehicle.estimator.method": "music",
                "vehicle.wake_up.trigger": fixed_interval(interpretation.scenario, constant_ms),
            }
        )
        found = driver.drive(scenario).drives
        aoa_estimates = float(found.aoa_estimates[0])
        if best is None or abs(aoa_estimates - wanted) < abs(float(best.aoa_estimates[0]) - wanted):
            best_ms, best = constant_ms, found
        if aoa_estimates <= wanted:
            break
        constant_ms = (constant_ms // period_ms + 1) * period_ms
    assert best is not None
    return best_ms, best
