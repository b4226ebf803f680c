"""Interpretations of the paper: settings, invariants, and the effect of the controller."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import synthetic
from access_av import Scenario, SettingsError
from access_av.device.platform import Platform
from access_av.errors import InputError
from access_av.paper import ablation, interpretations
from access_av.paper.driver import Driver
from access_av.paper.evaluation import evaluate_with
from access_av.report.paper.evaluation import render

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

BASE_MS = (80.0, 100.0, 120.0, 150.0)


@pytest.fixture(scope="module")
def driver() -> Driver:
    return Driver(Platform.load("jetson-agx-xavier"), runs=12, seed=3)


def test_the_shipped_scenario_is_an_interpretation() -> None:
    shipped, paper = interpretations.load(interpretations.SHIPPED).scenario, Scenario.load("paper")
    named = {"name": "paper", "description": paper.description}
    assert shipped.with_overrides(named) == paper


@pytest.mark.parametrize("name", interpretations.names())
def test_t_max_is_kept_by_interpretations_with_this_property(name: str, driver: Driver) -> None:
    interpretation = interpretations.load(name)
    for base_ms in BASE_MS:
        place = "trigger.base_ms" if interpretation.is_gated else "base_ms"
        scenario = interpretation.scenario.with_overrides({f"vehicle.wake_up.{place}": base_ms})
        gap_s = driver.drive(scenario).drives.longest_gap_s
        assert gap_s >= base_ms / 1e3 - 1e-9
        if interpretation.keeps_t_max:
            assert interpretation.keeps(float(gap_s)), gap_s
    if not interpretation.keeps_t_max:
        assert not interpretation.keeps(float(gap_s)), "it could claim to keep t_max"


def test_only_gates_wait_for_a_better_ssb() -> None:
    gated = {name for name in interpretations.names() if interpretations.load(name).is_gated}
    assert gated == {
        "factory",
        *(name for name in interpretations.names() if name.startswith("gate")),
    }
    assert len(gated) == 7


def test_a_controller_with_zero_gains_has_no_effect(driver: Driver) -> None:
    """Algorithm 1 with gains of zero is the constant t_base, which the report must state."""
    gate = interpretations.load("gate")
    idle = interpretations.Interpretation(
        "gate",
        "idle",
        gate.scenario.with_overrides(
            {f"vehicle.wake_up.trigger.{k}": 0.0 for k in ("kp", "ki", "kd")}
        ),
        (),
        keeps_t_max=False,
    )
    evaluation = evaluate_with(driver, idle)
    found = ablation.ablate(driver, evaluation)
    assert [each.matters for each in found] == [0, 0, 0, 0]
    assert all(
        each.gain_m == 0.0 and each.aoa_estimates == each.constant_aoa_estimates for each in found
    )
    study = replace(synthetic.study(), evaluations=[evaluation], ablations=found)
    page = render(study)
    assert "makes no difference" in page
    assert ">helps<" not in page


def test_algorithm_1_has_no_effect_behind_the_gate(driver: Driver) -> None:
    found = ablation.ablate(driver, evaluate_with(driver, interpretations.load("gate")))
    assert [each.matters for each in found] == [0, 0, 0, 0]
    for each in found:
        assert abs(each.aoa_estimates - each.constant_aoa_estimates) < 0.03 * each.aoa_estimates


@pytest.mark.parametrize("name", [name for name in Scenario.names() if name != "paper"])
def test_claims_are_not_judged_on_another_trip(
    name: str, access_av: Callable[..., Finished]
) -> None:
    done = access_av("paper", "evaluate", "--scenario", name)
    assert done.code == 2
    assert f"access-av run {name}" in done.err
    assert f"access-av design bound {name}" in done.err


def test_an_unknown_interpretation_is_rejected_with_its_name() -> None:
    with pytest.raises(InputError, match="unknown interpretation gaet; allowed are: every-ssb"):
        interpretations.load("gaet")


def test_a_contradictory_interpretation_is_reported_and_the_others_are_evaluated(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    file = tmp_path / "hasty.toml"
    file.write_text(
        'extends = "paper"\nname = "hasty"\n[vehicle]\nextends = "paper"\n'
        '[vehicle.wake_up]\npolicy = "pid"\nt_max_ms = 110.0\n'
    )
    done = access_av(
        "paper",
        "evaluate",
        "--interpretation",
        file,
        "--interpretation",
        "gate",
        "--runs",
        "1",
        "--out",
        tmp_path / "e",
    )
    assert done.code == 0, done.err
    output = " ".join(done.out.split())
    assert "Not evaluated: hasty" in output
    assert "wake_up.t_max_ms" in output
    claims = json.loads((tmp_path / "e/claims.json").read_text())
    assert {claim["interpretation"] for claim in claims} == {"gate"}
    alone = access_av(
        "paper", "evaluate", "--interpretation", file, "--runs", "1", "--out", tmp_path / "f"
    )
    assert alone.code == 2
    assert "wake_up.t_max_ms" in alone.err


def test_an_explicit_contradiction_is_refused() -> None:
    changes = {"vehicle.wake_up.trigger.base_ms": 300.0}
    with pytest.raises(SettingsError, match=r"wake_up\.trigger\.target_error_m"):
        Scenario.load("paper").with_overrides(changes)
    late = {"vehicle.wake_up.t_max_ms": 100.0, "vehicle.wake_up.trigger.base_ms": 150.0}
    with pytest.raises(SettingsError, match=r"wake_up\.t_max_ms"):
        Scenario.load("paper").with_overrides(late)


def test_t_max_follows_from_the_position_uncertainty_unless_it_is_stated() -> None:
    gate = interpretations.load("gate")
    assert gate.wake_up["trigger"]["target_error_m"] == 1.0
    assert gate.t_max_s == pytest.approx(0.24, abs=1e-12), "1 m at 15 km/h"
    for changes, t_max_s in (
        ({"target_error_m": 2.0}, 0.48),
        ({"t_max_ms": 300.0}, 0.3),
    ):
        paths = {f"vehicle.wake_up.trigger.{key}": value for key, value in changes.items()}
        changed = replace(gate, scenario=gate.scenario.with_overrides(paths))
        assert changed.t_max_s == pytest.approx(t_max_s, abs=1e-12)


@pytest.mark.parametrize("base_ms", [65.0, 80.0, 150.0])
@pytest.mark.parametrize("serving", ["first-after", "last-before"])
def test_algorithm_1_without_gains_is_the_fixed_interval(
    base_ms: float, serving: str, driver: Driver
) -> None:
    """Both use the same SSBs for every base wake-up time."""
    scenario = interpretations.load("every-ssb").scenario.with_overrides(
        {f"vehicle.wake_up.{name}": 0.0 for name in ("kp", "ki", "kd")}
        | {"vehicle.wake_up.base_ms": base_ms, "vehicle.wake_up.ssb_selection": serving}
    )
    one, other = (
        driver.drive(each).drives for each in (scenario, ablation.fixed(scenario, base_ms))
    )
    period_ms = 20.0
    rounds = np.ceil if serving == "first-after" else np.floor
    gap_s = float(rounds(base_ms / period_ms)) * period_ms / 1e3
    assert one.longest_gap_s == pytest.approx(gap_s)
    # Algorithm 1 has no wake-up time before its second SSB, which gives one additional estimate.
    assert abs(float(one.aoa_estimates[0] - other.aoa_estimates[0])) <= 1.0
    assert float(one.rms_error_m[0]) == pytest.approx(float(other.rms_error_m[0]), rel=0.3)
