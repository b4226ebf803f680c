"""A wall hides a radio head in the channel, in the wake-up policy and in the bound."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av import Plant, Scenario, SettingsError, simulate
from access_av._core import Bound, Site
from access_av.run.error_bound import along_route, bound

if TYPE_CHECKING:
    from collections.abc import Sequence

# Between the straight of 200 m and the first radio head, at (60, 25).
WALL = {"polyline_m": [[40.0, 10.0], [80.0, 10.0]]}
GATE_PCI = 21


def trip(**more: Any) -> Scenario:
    """The first 150 m of the plant `bends`."""
    scenario = Plant.load("bends").scenario()
    every_ssb = {"policy": "fixed", "interval_ms": 20.0}
    return scenario.with_overrides({"motion.stops": [], "vehicle.wake_up": every_ssb, **more})


GATE_M = (60.0, 25.0)


def hidden(x_m: Any, head_m: Sequence[float] = GATE_M) -> Any:
    """Returns whether the wall is between a position on the straight (y = 0) and a radio head."""
    crossing_m = x_m + 10.0 / head_m[1] * (head_m[0] - x_m)  # x of the line at y = 10
    return np.abs(crossing_m - 60.0) <= 20.0


@pytest.fixture(scope="module")
def walled() -> Scenario:
    return trip(**{"site.walls": [WALL]})


def test_no_angle_is_estimated_through_a_wall(walled: Scenario) -> None:
    found = simulate(walled, runs=1, seed=3, keep_trajectories=True)
    assert found.aoa_estimates is not None
    assert found.trajectories is not None
    places = found.trajectories.select("time_s", "true_x_m").sort("time_s")
    taken = found.aoa_estimates.filter(pci=GATE_PCI).sort("time_s")
    taken = taken.join_asof(places, on="time_s", strategy="nearest")
    straight = taken.filter(pl.col("true_x_m") < 190.0)["true_x_m"].to_numpy()
    assert len(straight) > 100
    # The position error is up to a metre, and the array is not at the odometer's reference point.
    assert not hidden(straight[(straight > 30.0) & (straight < 90.0)]).any()


def test_the_channel_behind_a_wall_has_no_direct_wave() -> None:
    """A vehicle without the wall in its site receives the radio head weakly, and has errors."""
    nominal = {"truth.std_factor": 0.0, "site.rician_k_db": 60.0}
    open_air = trip(**nominal)
    behind = trip(**nominal, **{"truth.site.walls": [WALL]})
    assert behind.resolved() != open_air.resolved()
    levels = {}
    for name, scenario in (("open", open_air), ("behind", behind)):
        found = simulate(scenario, runs=1, seed=3, keep_trajectories=True)
        assert found.aoa_estimates is not None
        levels[name] = found.aoa_estimates.filter(pci=GATE_PCI).select("time_s", "snr_db")
    both = levels["open"].join(levels["behind"], on="time_s", suffix="_behind")
    lost_db = (both["snr_db"] - both["snr_db_behind"]).to_numpy()
    # Concrete at 3.5 GHz: 19 dB loss of a wave without scatter; no loss elsewhere.
    assert lost_db.max() == pytest.approx(19.0, abs=0.5)
    assert (np.abs(lost_db) < 1e-9).mean() > 0.4


def test_the_bound_uses_the_radio_heads_that_the_vehicle_receives(walled: Scenario) -> None:
    x_m = np.arange(0.0, 190.0, 3.7)
    y_m = np.zeros_like(x_m)
    open_db, walled_db = (Bound(it).snr_db(x_m, y_m) for it in (trip(), walled))
    heads = json.loads(walled.site.to_json())["radio_heads"]
    behind = np.array([hidden(x_m, head["position_m"]) for head in heads])
    assert behind[0].any()
    assert np.array_equal(walled_db, np.where(behind, -np.inf, open_db))
    before, after = (along_route(it)["bound_m"].to_numpy() for it in (trip(), walled))
    assert (after >= before - 1e-12).all()
    assert after.max() > 1.05 * before[after.argmax()]
    shares = [bound(it, map_step_m=50.0).heads["visible_share"][0] for it in (walled, trip())]
    assert shares[0] < shares[1]


def test_a_glass_wall_attenuates_without_hiding_a_radio_head() -> None:
    glass = trip(**{"site.walls": [{**WALL, "loss_db": 3.0}]})
    weaker_db = Bound(trip()).snr_db(np.array([60.0]), np.zeros(1)) - Bound(glass).snr_db(
        np.array([60.0]), np.zeros(1)
    )
    # (10 / 10^0.3 + 1) / 11 of the power.
    assert weaker_db[0, 0] == pytest.approx(2.624, abs=1e-3)


def test_invalid_walls_are_rejected() -> None:
    site = json.loads(trip().site.to_json())

    def said(*walls: dict[str, Any]) -> list[str]:
        found = Site.load("yard").with_overrides({**site, "walls": list(walls)}).warnings()
        return [f"{it.key}: {it.why}" for it in found]

    assert not said(WALL)
    across = {"polyline_m": [[100.0, -10.0], [100.0, 10.0]]}
    crosses = "walls[1].polyline_m: it crosses the road at 100 m along the road"
    assert said(WALL, across) == [crosses]
    x_m, y_m, _ = site["radio_heads"][0]["position_m"]
    ring = [
        [x_m + dx_m, y_m + dy_m] for dx_m, dy_m in ((-5, -5), (5, -5), (5, 5), (-5, 5), (-5, -5))
    ]
    assert any(
        "radio_heads[0].position_m: walls hide the road from it" in it
        for it in said({"polyline_m": ring})
    )
    for wall, key in (
        ({"polyline_m": [[0.0, 0.0]]}, r"walls\[0\].polyline_m"),
        ({**WALL, "loss_db": -3.0}, r"walls\[0\].loss_db"),
        ({**WALL, "height_m": 3.0}, "height_m"),
    ):
        with pytest.raises(SettingsError, match=key):
            said(wall)
