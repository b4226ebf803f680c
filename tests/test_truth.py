"""What a campaign shows where the world is as believed, and where it is not."""

from __future__ import annotations

import pytest

from access_av import Scenario, simulate


def anees(scenario: str | Scenario, runs: int) -> float:
    if isinstance(scenario, str):
        scenario = Scenario.load(scenario)
    # All runs are kept, 3 GB of them.
    scenario = scenario.with_overrides({"allow_large": True})
    consistency = simulate(scenario, runs=runs, seed=5, keep_trajectories=True).consistency
    assert consistency is not None
    assert consistency.anees is not None
    return consistency.anees


def test_with_everything_drawn_as_stated_it_is_as_wrong_as_it_says() -> None:
    # 60 runs: the interval of 500, 0.90 to 0.96, and half as wide again three times over.
    assert 0.8 < anees("yard-surveyed", 60) < 1.15


@pytest.mark.parametrize("name", ["yard-array-off", "yard-heads-off"])
def test_a_world_that_is_not_as_believed_shows(name: str) -> None:
    assert anees(name, 4) > 5.0


def test_a_noisy_odometer_shows() -> None:
    assert 1.3 < anees("yard-odometer-noisy", 12) < anees("yard-heads-off", 4)
