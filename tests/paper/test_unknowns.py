"""Sampling of unspecified parameters: parts on disk, and Sobol indices of known functions."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import Scenario
from access_av.designs.space import named
from access_av.device.platform import Platform
from access_av.paper import sampled_interpretations
from access_av.paper.interpretations import OPEN, Interpretation
from access_av.paper.open_choices import (
    GATE,
    OPEN_CONTROLLER,
    OPEN_WORLD,
    SHIPPED_WORLD,
    WORLD,
    Dimension,
    latin_hypercube,
)
from access_av.paper.unknowns import sobol
from access_av.run.campaign import Campaign, ResultCache

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

BOARD = Platform.load("jetson-agx-xavier")


def sample(parts: Path) -> sampled_interpretations.Sample:
    found = sampled_interpretations.sample(Campaign(ResultCache(parts)), BOARD, **SMALL)
    assert found is not None
    return found


SMALL = {"worlds": 2, "controllers": 3, "runs": 1}


def drawn(
    margin: np.ndarray, points: np.ndarray, dimensions: tuple[Dimension, ...]
) -> sampled_interpretations.Sample:
    nothing = np.zeros(len(points))
    worlds = np.arange(len(points))
    return sampled_interpretations.Sample(
        dimensions, points, worlds, {"c": margin}, nothing, nothing, nothing
    )


def test_sobol_indices_of_a_known_function_are_estimated() -> None:
    """3 a + 2 ab + choice on (−1, 1): variances 3, 4/9 and 1, noise 0.25; d has no effect."""
    dimensions = (
        *(Dimension(name, name) for name in "ab"),
        Dimension("c", "c", choices=("n", "y")),
        *(Dimension(name, name) for name in "defgh"),
    )
    variances = {"a": 3.0, "ab": 4.0 / 9.0, "c": 1.0}
    whole = sum(variances.values()) + 0.25
    expected = {
        "a": (3.0, 3.0 + variances["ab"]), "b": (0.0, variances["ab"]), "c": (1.0, 1.0),
    }  # fmt: skip
    covered, compared = 0, 0
    for draw in range(10):
        points = latin_hypercube(512, len(dimensions), seed=draw)
        one, two, choice = (2.0 * points - 1.0).T[:3]
        noise = np.random.default_rng(draw).normal(0.0, 0.5, len(points))
        counts_as = 0.1 * (3.0 * one + 2.0 * one * two + np.sign(choice) + noise)
        margin = counts_as / (1.0 - np.abs(counts_as))
        found = sobol(drawn(margin, points, dimensions), runs=1, seed=draw)
        for each in found.indices.iter_rows(named=True):
            if each["dimension"] not in expected:
                assert each["total"] < 0.01, "it is idle"
                continue
            first, total = (value / whole for value in expected[each["dimension"]])
            compared += 2
            covered += each["first_low"] - 1e-9 <= first <= each["first_high"] + 1e-9
            covered += each["total_low"] <= total <= each["total_high"]
            assert abs(each["total"] - total) < 0.05
            assert each["total_high"] - each["total_low"] < 0.1
        [share, explained] = found.claims.select("share_met", "explained_variance").row(0)
        assert explained == pytest.approx(1.0 - 0.25 / whole, abs=0.02)
        assert share == pytest.approx(np.mean(margin >= 0.0))
    # 95 % intervals: fewer than 45 of 60 in them has a probability below 1e-6.
    assert compared == 60
    assert covered >= 45, covered


def test_an_interrupted_search_continues(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judged = []
    judge = sampled_interpretations.judge

    def stops(*arguments: object, **named: object) -> object:
        judged.append(arguments)
        if len(judged) == 2:
            raise KeyboardInterrupt
        return judge(*arguments, **named)

    monkeypatch.setattr(sampled_interpretations, "judge", stops)
    with pytest.raises(KeyboardInterrupt):
        sample(tmp_path)
    assert len(list(tmp_path.glob("*.npz"))) == 1
    found = sample(tmp_path)
    assert len(judged) == 3, "the first part is not computed again"
    assert not list(tmp_path.glob("*.partial"))
    again = sample(tmp_path)
    assert len(judged) == 3
    assert all((again.margins[name] == margin).all() for name, margin in found.margins.items())


def interpretation_of(values: Mapping[str, Any]) -> Interpretation:
    scenario = sampled_interpretations.as_scenario(values)
    return Interpretation("found", "", scenario, OPEN, keeps_t_max=True)


def test_without_a_gate_t_max_is_kept_everywhere(tmp_path: Path) -> None:
    found = sample(tmp_path)
    assert GATE not in found.dimensions
    assert (found.longest_gap_s < 0.26).all()
    best = interpretation_of(found.values(found.best()[0]))
    assert not best.is_gated
    assert best.keeps(float(found.longest_gap_s.max()))


def test_the_shipped_environment_is_in_the_space() -> None:
    paper = json.loads(Scenario.load("paper").to_json())
    values = named(WORLD, SHIPPED_WORLD)
    assert values["eirp_dbm"] == paper["site"]["radio_heads"][0]["eirp_dbm"]
    assert values["rician_k_db"] == paper["site"]["rician_k_db"]
    assert values["scatter"] == paper["channel"]["scatter"]
    assert values["heading"] == paper["vehicle"]["localizer"]["heading_between"]
    assert values["snapshots"] == paper["vehicle"]["receiver"]["snapshots"]


def test_every_point_of_the_space_is_a_scenario() -> None:
    dimensions = (*OPEN_WORLD, *OPEN_CONTROLLER, GATE)
    corners = [np.full(len(dimensions), end) for end in (0.0, 1.0 - 1e-9)]
    for point in [*corners, *latin_hypercube(30, len(dimensions), seed=2)]:
        values = named(dimensions, point.tolist())
        interpretation = interpretation_of(values)
        assert interpretation.is_gated == (values["gate"] != "none")
        # The written file of a point is the point.
        written = interpretation.scenario.to_toml()
        assert Scenario.from_toml(written) == interpretation.scenario
