"""Numbers of points in charts: each point has one, and none covers another or a point."""

from __future__ import annotations

import itertools
import json
import re
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import layout
import synthetic
from access_av.report.labels import COINCIDENT_PX, HEIGHT_PX, WIDTHS_PX, Axis, placed
from access_av.report.paper.evaluation import render
from browser import Browser

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

CHARTS = ("overview", "design-x", "design-y", "design-space")


@pytest.mark.parametrize("seed", range(5))
def test_labels_of_random_points_cover_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    height_px = 300.0
    # Half of the points in a cluster of 60 px.
    x = np.concatenate([rng.uniform(0.0, 100.0, 7), rng.uniform(40.0, 60.0, 7)])
    y = np.concatenate([rng.uniform(0.0, 1.0, 7), rng.uniform(0.4, 0.6, 7)])
    rows = pl.DataFrame({"number": np.arange(1, 15), "x": x, "y": y})
    axes = Axis("x", "x", x.tolist()), Axis("y", "y", y.tolist())
    ends_x, ends_y = (it.domain for it in axes)
    found = placed(rows, "number", *axes, height_px)
    named = [int(it) for text in found["label"] for it in layout.names(text)]
    assert sorted(named) == list(range(1, 15))
    for width_px in WIDTHS_PX:
        px = width_px * (x - ends_x[0]) / (ends_x[1] - ends_x[0])
        py = height_px * (ends_y[1] - y) / (ends_y[1] - ends_y[0])
        boxes = []
        for place, row in enumerate(found.iter_rows(named=True)):
            if row["label"]:
                centre = np.array([px[place] + row["dx"], py[place] + row["dy"]])
                half = np.array([3.0 * len(row["label"]), 0.5 * HEIGHT_PX - 1.0])
                boxes.append((centre - half, centre + half))
        for first, second in itertools.combinations(boxes, 2):
            depth = np.minimum(first[1], second[1]) - np.maximum(first[0], second[0])
            assert depth.min() <= 0.0, (width_px, first, second)
        for low, high in boxes:
            nearest = np.clip(np.stack([px, py], 1), low, high)
            assert np.hypot(px - nearest[:, 0], py - nearest[:, 1]).min() > 5.0


def test_only_coincident_points_share_a_label() -> None:
    rows = pl.DataFrame({"n": [1, 2, 3], "x": [0.0, 0.001, 0.2], "y": [0.0, 0.0, 0.0]})
    axes = Axis("x", "x", [-0.85, 0.85]), Axis("y", "y", [-0.85, 0.85])
    assert placed(rows, "n", *axes, 300.0)["label"].to_list() == ["1, 2", "", "3"]
    apart = rows.with_columns(x=pl.Series([0.0, 2.0 * COINCIDENT_PX / 1000.0 * 2.0, 0.5]))
    assert placed(apart, "n", *axes, 300.0)["label"].to_list() == ["1", "2", "3"]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Browser, dict[str, Any]]]:
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no Chromium")
    file: Path = tmp_path_factory.mktemp("page") / "report.html"
    text = render(synthetic.study())
    file.write_text(text, encoding="utf-8")
    found = re.search(r"const charts = (.*?);\n", text)
    assert found is not None
    with Browser(program, f"file://{file}") as browser:
        yield browser, json.loads(found.group(1))


@pytest.mark.parametrize("width", [1300, 400])
def test_every_point_of_the_page_is_numbered_without_overlap(
    width: int, page: tuple[Browser, dict[str, Any]]
) -> None:
    browser, charts = page
    browser.resize(width, 900)
    for name in CHARTS:
        assert layout.label_faults(browser, name, charts[name], width) == []
