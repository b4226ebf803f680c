from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

import synthetic
from access_av.designs.query import Query, explore

if TYPE_CHECKING:
    import polars as pl


@pytest.fixture(scope="module")
def points() -> pl.DataFrame:
    return synthetic.evaluation().campaign("R")


def test_budget_of_210_j_leaves_mode_7(points: pl.DataFrame) -> None:
    assert explore(points, Query(max_energy_j=210.0))["mode"].to_list() == [7]


def test_results_are_ordered_by_energy(points: pl.DataFrame) -> None:
    found = explore(points, Query())
    assert found.height == 8
    assert found["energy_j"].is_sorted()


def test_selected_points_meet_every_limit_of_the_query(points: pl.DataFrame) -> None:
    found = explore(
        points, Query(max_energy_j=260.0, max_rms_m=0.15, max_worst_m=0.2, max_aoa_estimates=350)
    )
    assert sorted(found["mode"]) == [2, 3]


def test_modes_can_be_selected(points: pl.DataFrame) -> None:
    assert sorted(explore(points, Query(modes=[1, 4]))["mode"]) == [1, 4]


def test_an_empty_result_is_valid(points: pl.DataFrame) -> None:
    assert explore(points, Query(max_energy_j=1.0)).is_empty()


def test_a_query_reads_as_a_sentence() -> None:
    assert str(Query(max_energy_j=260.0, max_rms_m=0.15)) == "energy ≤ 260 J and RMS error ≤ 0.15 m"
    assert str(Query()) == "any operating point"
