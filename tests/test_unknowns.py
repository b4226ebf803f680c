"""Sampling what the paper leaves open: parts on disk, and indices of functions that are known."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av import Scenario
from access_av.paper import search
from access_av.paper.space import CONTROLLER, GATE, WORLD, Dimension, latin_hypercube, named
from access_av.paper.unknowns import sobol
from access_av.platform import Platform

if TYPE_CHECKING:
    from pathlib import Path

BOARD = Platform.load("jetson-agx-xavier")
SMALL = {"worlds": 2, "controllers": 3, "runs": 1}


def drawn(
    margin: np.ndarray, points: np.ndarray, dimensions: tuple[Dimension, ...]
) -> search.Sample:
    nothing = np.zeros(len(points))
    worlds = np.arange(len(points))
    return search.Sample(dimensions, points, worlds, {"c": margin}, nothing, nothing, nothing)


def test_indices_of_a_function_that_is_known() -> None:
    """3 a + 2 ab + choice on (−1, 1): variances 3, 4/9 and 1, beside noise of 0.25."""
    dimensions = (
        *(Dimension(name, name) for name in "ab"),
        Dimension("c", "c", choices=("n", "y")),
    )
    points = latin_hypercube(2048, 3, seed=4)
    one, two, choice = (2.0 * points - 1.0).T
    noise = np.random.default_rng(5).normal(0.0, 0.5, len(points))
    margin = 0.2 * (3.0 * one + 2.0 * one * two + np.sign(choice) + noise)
    found = sobol(drawn(margin, points, dimensions), runs=1)
    variances = {"a": 3.0, "ab": 4.0 / 9.0, "c": 1.0}
    whole = sum(variances.values()) + 0.25
    expected = {
        "a": (3.0, 3.0 + variances["ab"]), "b": (0.0, variances["ab"]), "c": (1.0, 1.0),
    }  # fmt: skip
    for each in found.indices:
        first, total = (value / whole for value in expected[each.dimension])
        assert each.first_low - 0.01 <= first <= each.first_high + 0.01, each
        assert each.total_low - 0.01 <= total <= each.total_high + 0.01, each
        assert each.total_high - each.total_low < 0.1
    assert found.explained["c"] == pytest.approx(1.0 - 0.25 / whole, abs=0.02)
    assert found.holds["c"] == pytest.approx(np.mean(margin >= 0.0))


def test_a_search_that_was_stopped_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judged = []
    judge = search.judge

    def stops(*arguments: object, **named: object) -> object:
        judged.append(arguments)
        if len(judged) == 2:
            raise KeyboardInterrupt
        return judge(*arguments, **named)

    monkeypatch.setattr(search, "judge", stops)
    with pytest.raises(KeyboardInterrupt):
        search.sample(BOARD, tmp_path, **SMALL)
    assert len(list(tmp_path.glob("*.npz"))) == 1
    found = search.sample(BOARD, tmp_path, **SMALL)
    assert len(judged) == 3, "the first part is not computed again"
    assert not list(tmp_path.glob("*.partial"))
    again = search.sample(BOARD, tmp_path, **SMALL)
    assert len(judged) == 3
    assert all((again.margins[name] == margin).all() for name, margin in found.margins.items())


def test_without_a_gate_t_max_is_kept_everywhere(tmp_path: Path) -> None:
    found = search.sample(BOARD, tmp_path, **SMALL)
    assert GATE not in found.dimensions
    assert (found.longest_gap_s < 0.26).all()
    best = search.as_reading(found.values(found.best()[0]))
    assert not best.is_gated
    assert best.keeps(float(found.longest_gap_s.max()))


def test_every_point_of_the_space_is_a_scenario() -> None:
    dimensions = (*WORLD, *CONTROLLER, GATE)
    corners = [np.full(len(dimensions), end) for end in (0.0, 1.0 - 1e-9)]
    for point in [*corners, *latin_hypercube(30, len(dimensions), seed=2)]:
        values = named(dimensions, point.tolist())
        reading = search.as_reading(values)
        assert reading.is_gated == (values["gate"] != "none")
        assert isinstance(reading.scenario, Scenario)
