"""Bound by kind of measurement."""

from __future__ import annotations

import polars as pl
import pytest

from access_av import Scenario, columns
from access_av.radio.measurement_kinds import CLOCKS, KINDS, kinds_table

SHORT = {"site.road.segments": [{"length_m": 60.0, "turn_rad": 0.3}]}


@pytest.fixture(scope="module")
def kinds() -> pl.DataFrame:
    return kinds_table(Scenario.load("paper-real-odometry-2").with_overrides(SHORT))


def bounds(kinds: pl.DataFrame, heads: int, name: str) -> list[float]:
    of_kind = (pl.col("num_heads") == heads) & (pl.col("kinds") == name)
    return kinds.filter(of_kind)["bound_without_road_m"].to_list()


def test_the_bound_table_has_every_combination_of_measurements_and_clocks(
    kinds: pl.DataFrame,
) -> None:
    assert kinds.columns == list(columns.TABLES["bound_kinds"].columns)
    with_clocks = sum(bool(extra & {"delay", "phase"}) for extra in KINDS.values())
    assert kinds.height == 2 * (len(KINDS) - with_clocks + with_clocks * len(CLOCKS))
    assert (kinds["bound_with_road_m"] <= kinds["bound_without_road_m"]).all()


def test_further_measurements_and_better_clocks_reduce_the_bound(kinds: pl.DataFrame) -> None:
    (angles,) = bounds(kinds, 2, "angles")
    for name in ("angles, delays", "angles, phases"):
        by_clock = bounds(kinds, 2, name)
        assert by_clock[0] <= angles * (1.0 + 1e-6)
        # From independent clocks to one oscillator.
        assert by_clock[:4] == sorted(by_clock[:4], reverse=True)
    # One radio head: the offset of its delays is unknown, so that they add nothing.
    (alone,) = bounds(kinds, 1, "angles")
    assert bounds(kinds, 1, "angles, delays")[0] == pytest.approx(alone, rel=0.02)


def test_power_adds_nothing_to_angles(kinds: pl.DataFrame) -> None:
    (angles,), (with_power,) = (bounds(kinds, 2, name) for name in ("angles", "angles, power"))
    assert with_power == pytest.approx(angles, rel=0.01)
