"""Labels of the chart of designs, measured in a browser."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import numpy as np
import pytest
from test_designs import cloud

import layout
from access_av import Scenario
from access_av.designs.front import front, rows_of, rows_of_worlds
from access_av.report.designs import MOST_NAMES, render_designs
from browser import Browser

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize("count", [12, 300])
def test_designs_are_numbered_without_overlap(count: int, tmp_path: Path) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    rng = np.random.default_rng(count)
    pairs = [(float(rng.uniform(0.1, 9.0)), float(rng.uniform(0.1, 1.0))) for _ in range(count)]
    driven = cloud(4, pairs)
    page = render_designs(Scenario.load("paper"), driven, rows_of(driven), rows_of_worlds(driven))
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    found = re.search(r"const charts = (.*?);\n", page)
    spec = json.loads(found.group(1))["designs"]
    [rows] = [rows for rows in spec["datasets"].values() if "label" in rows[0]]
    numbers = [int(name) for row in rows for name in layout.names(row["label"])]
    assert len(numbers) == len(set(numbers)) == min(count, MOST_NAMES)
    assert set(numbers) >= set(front(driven)[:MOST_NAMES])
    with Browser(program, (tmp_path / "page.html").as_uri()) as browser:
        for width in (1300, 400):
            browser.resize(width, 900)
            assert layout.label_faults(browser, "designs", spec, width) == []
