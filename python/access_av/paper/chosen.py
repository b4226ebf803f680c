"""Assumptions where the paper is not specific, with reason and effect of alternatives.

One assumption of the default interpretation is changed at a time; ``chosen.toml`` lists them.
:mod:`access_av.paper.unknowns` varies all of them together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.paper.ablation import fixed
from access_av.paper.interpretations import SHIPPED, load
from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av._core import Scenario
    from access_av.paper.driver import Driver

# Number of runs of an alternative, sufficient for a comparison but not for a verdict.
RUNS = 30
BASE_MS, EVERY_SSB_MS = 80.0, 20.0


@dataclass(frozen=True)
class Effect:
    """Result of the shipped interpretation in mode 0 with one value.

    Columns ``assumptions`` of :mod:`access_av.columns`; errors and estimates are those of adaptive
    MUSIC unless the name of the column contains another setting.
    """

    what: str
    value: str
    why: str
    is_shipped: bool
    aoa_estimates: float
    worst_error_m: float
    rms_error_m: float
    rms_std_m: float
    fixed_rms_m: float
    every_ssb_rms_m: float


def entries() -> list[dict[str, Any]]:
    """Returns the assumptions, each with ``what``, ``value``, ``why`` and ``alternatives``.

    Examples
    --------
    >>> entries()[0]["what"]
    'radiated power'
    """
    return list(shipped("paper", "chosen.toml")["chosen"])


def effects(
    driver: Driver, runs: int = RUNS, *, progress: Callable[[int, int], None] | None = None
) -> list[Effect]:
    """Returns the shipped values, each followed by the effects of its alternatives."""
    paper = load(SHIPPED).scenario
    driver = replace(driver, methods=("music",), runs=runs, known={}, traces=[])
    here = _driven(driver, paper)
    found: list[Effect] = []
    chosen = entries()
    for index, entry in enumerate(chosen):
        what, why = entry["what"], entry["why"]
        found.append(Effect(what, entry["value"], why, True, **here))
        for other in entry["alternatives"]:
            there = _driven(driver, paper.with_overrides(other["changes"]))
            found.append(Effect(what, other["value"], why, False, **there))
        # An environment is used only once, so that its traces can be deleted.
        del driver.traces[1:]
        if progress is not None:
            progress(index + 1, len(chosen))
    return found


def _driven(driver: Driver, scenario: Scenario) -> dict[str, float]:
    adaptive = driver.drive(
        scenario.with_overrides({"vehicle.wake_up.trigger.base_ms": BASE_MS})
    ).drives
    often, seldom = (driver.drive(fixed(scenario, ms)).drives for ms in (EVERY_SSB_MS, BASE_MS))
    return {
        "aoa_estimates": float(adaptive.aoa_estimates[0]),
        "worst_error_m": float(adaptive.worst_m[0]),
        "rms_error_m": float(adaptive.rms_error_m[0]),
        "rms_std_m": float(np.std(adaptive.rms_error_m[1:])),
        "fixed_rms_m": float(seldom.rms_error_m[0]),
        "every_ssb_rms_m": float(often.rms_error_m[0]),
    }
