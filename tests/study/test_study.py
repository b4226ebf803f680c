"""Simulations of a study: seeds, power modes, shipped plants; explanations of large errors."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import Plant, Scenario, simulate, study_plant
from access_av.run.error_bound import along_route
from access_av.study.operate import Rival
from access_av.study.places import worst_places
from access_av.study.points import mode_groups
from short_plant import LAST_METRES, PLANT

if TYPE_CHECKING:
    from pathlib import Path


def test_the_same_seed_gives_the_same_study_of_a_plant_and_of_its_file(tmp_path: Path) -> None:
    plant = Plant.from_toml(LAST_METRES)
    (tmp_path / "short.toml").write_text(plant.to_toml(), "utf-8")
    told: list[tuple[str, int, int]] = []
    found = study_plant(plant, runs=2, seed=3, threads=1, progress=lambda *it: told.append(it))
    first = found.summary()
    again = study_plant(tmp_path / "short.toml", runs=2, seed=3, threads=2).summary()
    assert first == again
    # A lost drive is the first statement after the verdict.
    errors_m = found.nominal.errors_m.copy()
    errors_m[0] = 40.0
    lost = replace(found, nominal=replace(found.nominal, errors_m=errors_m))
    assert ": LOST in 1 of 2 drives; 90 % of the position errors are within 40.00 m" in lost.verdict
    # The total of a stage is known at its beginning and reached, but for sets of measures, which
    # end when one meets the targets.
    stages = list(dict.fromkeys(stage for stage, _, _ in told))
    assert stages[:3] == ["nominal channel", "poor line of sight", "operations"]
    for stage in stages:
        mine = [(done, total) for name, done, total in told if name == stage]
        done = [it for it, _ in mine]
        assert {total for _, total in mine} == {mine[0][1]}
        assert done[0] == 0
        assert done == sorted(done)
        assert stage == "sets of measures" or done[-1] == mine[0][1]


def test_modes_with_different_wake_ups_are_simulated_separately(tmp_path: Path) -> None:
    def groups(scenario: Scenario) -> list[list[int]]:
        return [[it.number for it in group] for group in mode_groups(scenario)]

    def driven(scenario: Scenario, mode: int) -> float:
        in_mode = scenario.with_overrides({"vehicle.platform.mode": mode})
        return float(simulate(in_mode, runs=2).runs["aoa_estimates"].to_numpy().mean())

    # Reception takes 1400 to 8700 times the energy of an estimate: all modes wake up equally often.
    scenario = Plant.from_toml(PLANT).scenario()
    assert groups(scenario) == [list(range(8))]
    assert driven(scenario, 0) == pytest.approx(driven(scenario, 1), rel=0.05)
    # With estimates of 10 million cycles, it takes 1.3 to 8 times the energy.
    platform = tmp_path / "slow.toml"
    platform.write_text(
        'extends = "jetson-agx-xavier-engine"\nname = "slow"\n'
        "[cpu.cycles_per_execution.maximum-likelihood]\n"
        'value = 1e7\nlow = 1e7\nhigh = 1e7\nprovenance = "assumed"\nsource = "test"\n',
        "utf-8",
    )
    slow = scenario.with_overrides({"vehicle.platform.name": str(platform)})
    found = groups(slow)
    assert [1, 2, 3] in found
    assert len(found) > 2
    assert sorted(number for group in found for number in group) == list(range(8))
    fixed = {"vehicle.wake_up": {"policy": "fixed", "interval_ms": 500.0}}
    assert len(groups(slow.with_overrides(fixed))) == 1


def places_of(dilution_m: list[float | None], visible: list[int]) -> pl.DataFrame:
    """A straight road, metre by metre."""
    count = len(dilution_m)
    return pl.DataFrame(
        {
            "along_m": np.arange(count) + 0.5,
            "x_m": np.arange(count) + 0.5,
            "y_m": np.zeros(count),
            "target_error_m": np.where(np.arange(count) == 150, 1.0, 0.1),
            "bound_m": np.full(count, 0.1),
            "along_road_error_per_degree_m": pl.Series(dilution_m, dtype=pl.Float64),
            "heads_visible": visible,
            "best_snr_db": np.full(count, 20.0),
        }
    )


def test_an_error_is_explained_by_the_road_section_where_it_arose() -> None:
    wall = 'name = "hall 3"\npolyline_m = [[100.0, 5.0], [140.0, 5.0]]'
    text = PLANT.replace("[[targets]]", f"[[site.walls]]\n{wall}\n[[targets]]", 1)
    plant = Plant.from_toml(text.replace("[10.0, 20.0, 8.0]", "[120.0, 20.0, 8.0]"))
    hidden = [100 <= at < 140 for at in range(300)]
    places = places_of([None if it else 1.0 for it in hidden], [0 if it else 2 for it in hidden])
    why = worst_places(places, plant)[0].why
    assert why.startswith("carried over from the stretch 100 to 140 m, where no radio head")
    assert "“hall 3” hides “a <b>bold</b> mast”" in why
    here = places.with_columns(
        target_error_m=pl.when(pl.col("along_m") == 120.5).then(2.0).otherwise(0.1)
    )
    assert worst_places(here, plant)[0].why.startswith("no radio head is in reach and in sight (“")
    lost = here.with_columns(pl.col("target_error_m") * 10.0)
    assert worst_places(lost, plant)[0].why.startswith("lost drives determine the percentile here")
    good = places_of([1.0] * 300, [2] * 300)
    assert "carried over" not in worst_places(good, plant)[0].why


@pytest.mark.parametrize("name", Plant.names())
def test_each_shipped_plant_gets_a_point_equivalent_to_the_best_of_the_front(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Uses the last section of the road; `benches/shipped_plants.py` simulates the whole road."""
    # The study of the short plant simulates all estimators.
    monkeypatch.setattr("access_av.study.points.METHODS", ("root-music",))
    plant = Plant.load(name)
    road_m = along_route(plant.scenario())["along_m"].max()
    assert isinstance(road_m, float)
    last = {"motion.start_at_m": round(0.97 * road_m), "motion.stops": []}
    found = study_plant(plant.with_overrides(last), runs=2)
    recommendation = found.recommendation
    assert recommendation.best in found.front
    assert recommendation.best is not None
    assert found.point is not None
    best, comparisons = found.points[recommendation.best], recommendation.comparisons
    assert Rival.of(found.plant, found.targets, found.point, best, comparisons).is_equivalent
    driven = [found.nominal, found.poor_los, *(it.driven for it in found.remedies)]
    driven += [it.driven for it in found.points]
    assert all(it.scenario.vehicle.alert_limit_m is not None for it in driven)
    assert all(it.ok_share is not None for it in driven)
