"""Comparison of simulator and Algorithm 1 with a second implementation, written from the paper
alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

import second_implementation as second
from access_av import Scenario
from access_av.device.platform import Platform
from access_av.paper.ablation import fixed
from access_av.paper.driver import Driver
from access_av.paper.interpretations import load
from access_av.paper.outcome import resamples

if TYPE_CHECKING:
    from collections.abc import Callable

RUNS, T_BASE_MS = 100, 80.0
# Standard deviations of the intervals of six comparisons; a correct value is outside with a
# probability of 1/500.
SURE = 3.1


@pytest.fixture(scope="module")
def driver() -> Driver:
    return Driver(Platform.load("jetson-agx-xavier"), runs=RUNS, seed=11)


@pytest.fixture(scope="module")
def trip() -> second.Trip:
    return second.Trip(RUNS, seed=12)


@pytest.fixture(scope="module")
def angles(trip: second.Trip) -> dict[str, np.ndarray]:
    return {"music": trip.music(), "esprit": trip.esprit()}


def test_the_second_implementation_is_short_and_independent() -> None:
    text = Path(second.__file__).read_text(encoding="utf-8")
    assert len(text.splitlines()) < 120
    assert "access_av" not in text


def test_unspecified_parameters_are_equal_in_both() -> None:
    paper = json.loads(Scenario.load("paper").to_json())
    [head] = paper["site"]["radio_heads"]
    assert head["eirp_dbm"] == second.POWER_DBM + 10.0
    assert paper["site"]["carrier_mhz"] * 1e6 == second.CARRIER_HZ
    assert 10.0 ** (paper["site"]["rician_k_db"] / 10.0) == second.RICIAN_K
    due = paper["vehicle"]["wake_up"]["trigger"]
    assert due["snr_set_point"]["offset_db"] == second.OFFSET_DB
    assert due["snr_scale_db"] == second.SCALE_DB


Policy = "Callable[[second.Trip], second.Wanted]"
CASES: dict[str, tuple[str, Callable[[], Scenario], Callable[[second.Trip], second.Wanted]]] = {
    "every SSB": ("music", lambda: fixed(load("gate").scenario, 20.0), lambda it: it.fixed(0.02)),
    "every SSB, ESPRIT": (
        "esprit",
        lambda: fixed(load("gate").scenario, 20.0).with_overrides(
            {"vehicle.estimator.method": "esprit"}
        ),
        lambda it: it.fixed(0.02),
    ),
    "fixed": ("music", lambda: fixed(load("gate").scenario, T_BASE_MS), lambda it: it.fixed(0.08)),
    "Algorithm 1 at every SSB": (
        "music",
        lambda: load("every-ssb").scenario,
        lambda it: it.algorithm_1(0.08),
    ),
    "Algorithm 1 at wake-ups": (
        "music",
        lambda: load("wake-ups").scenario,
        lambda it: it.algorithm_1(0.08, asleep=True),
    ),
    "gate": (
        "music",
        lambda: load("gate").scenario,
        lambda it: it.algorithm_1(0.08, clamp=0.5, gate_db=3.0),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_both_have_equal_estimates_and_errors(
    name: str, driver: Driver, trip: second.Trip, angles: dict[str, np.ndarray]
) -> None:
    method, scenario, policy = CASES[name]
    aoa_estimates, errors_m = trip.drive(angles[method], policy(trip))
    ours = driver.drive(scenario()).drives
    assert aoa_estimates == pytest.approx(float(ours.aoa_estimates[0]), rel=0.01)
    square_m2 = np.mean(np.sum(errors_m**2, axis=0), axis=1)
    theirs_m = np.sqrt(resamples(RUNS, 200) @ square_m2)
    differs_m = abs(float(ours.rms_error_m[0] - theirs_m[0]))
    std_m = np.hypot(np.std(ours.rms_error_m[1:]), np.std(theirs_m[1:]))
    assert differs_m < SURE * std_m, (ours.rms_error_m[0], theirs_m[0])
    # The interval of 100 runs is short enough for a meaningful test.
    assert std_m < 0.3 * theirs_m[0]
