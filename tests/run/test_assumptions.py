"""Optimistic assumptions are listed; the shipped plants assume nothing to be exact."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from access_av import Scenario
from access_av.run.assumptions import optimistic_assumptions

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished


@pytest.mark.parametrize(
    "name",
    ["yard", "campus-handover", "yard-array-off", "yard-heads-off", "yard-odometer-noisy"],
)
def test_shipped_plants_are_monitored_and_without_exact_values(name: str) -> None:
    scenario = Scenario.load(name)
    assert optimistic_assumptions(scenario) == []
    settings = json.loads(scenario.resolved().to_json())
    assert settings["vehicle"]["integrity"]["enabled"]
    assert settings["vehicle"]["array"]["position_m"][2] > 0.0
    heads = settings["site"]["radio_heads"]
    assert all(head["position_m"][2] > 0.0 and head["position_std_m"] > 0.0 for head in heads)
    assert len({head["ssb_index"] for head in heads}) == len(heads)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"vehicle.integrity.enabled": False}, "vehicle.integrity.enabled"),
        ({"vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0}}, "vehicle.start"),
        ({"vehicle.odometer": {"rate_hz": 50.0}}, "vehicle.odometer"),
        ({"vehicle.array": {"elements": 4}}, "vehicle.array"),
        (
            {f"site.radio_heads[{head}].position_std_m": 0.0 for head in range(4)},
            "site.radio_heads",
        ),
        ({"truth.std_factor": 0.0}, "truth.std_factor"),
        ({"vehicle.platform.name": "jetson-agx-xavier"}, "vehicle.platform"),
    ],
)
def test_each_value_is_reported_with_its_key(changes: dict[str, object], named: str) -> None:
    [found] = optimistic_assumptions(Scenario.load("yard").with_overrides(changes))
    assert f"({named}" in found


def test_dead_reckoning_with_several_radio_heads_causes_a_warning(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av("run", "paper", "--set", "motion.start_at_m=290", "--out", tmp_path)
    assert done.code == 0, done.err
    [line] = [line for line in done.out.splitlines() if line.startswith("Optimistic assumptions")]
    assumed = json.loads((tmp_path / "manifest.json").read_text())["assumed"]
    assert assumed
    assert all(what in line for what in assumed)
    assert assumed[0] in (tmp_path / "report.html").read_text()
    many = Scenario.load("yard").with_overrides(
        {"vehicle.localizer.kind": "dead-reckoning", "vehicle.wake_up": {"policy": "fixed"}}
    )
    assert any("4 radio heads" in what for what in optimistic_assumptions(many))
