"""Results of a campaign with exact models, and with model errors."""

from __future__ import annotations

from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

import pytest

from access_av import Scenario, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping


# Settings without uncertainty.
EXACT = {
    "vehicle.array": {},
    "vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0},
    **{f"site.radio_heads[{head}].position_std_m": 0.0 for head in range(4)},
}


def anees(name: str, runs: int, changes: Mapping[str, object] = MappingProxyType({})) -> float:
    # All runs are kept (3 GB). Without integrity monitoring, which would replace a wrong filter.
    usual = {"allow_large": True, "vehicle.integrity.enabled": False}
    scenario = Scenario.load(name).with_overrides(usual | dict(changes))
    consistency = simulate(scenario, runs=runs, seed=5, keep_trajectories=True).consistency
    assert consistency is not None
    assert consistency.anees is not None
    return consistency.anees


def test_the_localizer_is_consistent_with_errors_of_the_specified_deviations() -> None:
    # Independent runs determine the interval, not their length: the last 250 m of the trip. The
    # interval of 500 whole runs is 0.90 to 0.96; that of 60 runs is about three times as wide.
    assert 0.8 < anees("yard", 60, {"motion.start_at_m": 950.0}) < 1.15


@cache
def anees_of_exact_settings(name: str) -> float:
    return anees(name, 4, EXACT)


@pytest.mark.parametrize("name", ["yard-array-off", "yard-heads-off"])
def test_a_difference_between_truth_and_model_changes_the_results(name: str) -> None:
    assert anees_of_exact_settings(name) > 5.0


def test_a_noisy_odometer_is_visible_in_the_consistency() -> None:
    half = EXACT | {"motion.start_at_m": 600.0}
    noisy = anees("yard-odometer-noisy", 12, half)
    assert 1.3 < noisy < anees_of_exact_settings("yard-heads-off")
