from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import Scenario, _core
from access_av.report.placement import render_bound
from access_av.run.error_bound import ErrorBound, bound

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished


@pytest.fixture(scope="module")
def four_heads() -> ErrorBound:
    return bound("paper-real-odometry-4", map_step_m=40.0)


def test_more_radio_heads_bound_the_error_more_tightly(four_heads: ErrorBound) -> None:
    least = [
        bound(name, map_step_m=100.0).route["bound_m"].median()
        for name in ("paper-real-odometry", "paper-real-odometry-2")
    ]
    assert least[0] > least[1] > four_heads.route["bound_m"].median()


def test_the_route_is_that_of_the_scenario(four_heads: ErrorBound) -> None:
    route = four_heads.route
    assert route["time_s"].diff().drop_nulls().is_between(0.02 - 1e-9, 0.02 + 1e-9).all()
    assert abs(route["along_m"][-1] - 300.0) < 1e-6
    parts_m = np.hypot(route["along_std_m"], route["across_std_m"])
    assert np.allclose(parts_m, route["bound_m"], rtol=1e-12)
    assert route["bound_m"][0] < 2e-6  # the start is known to a micrometre, the minimum σ
    assert (route["bound_m"][1:] > 0.0).all()


def test_the_bound_map_covers_road_and_radio_heads(four_heads: ErrorBound) -> None:
    site, half_m = four_heads.site, 0.5 * four_heads.map_step_m
    for name in ("x_m", "y_m"):
        for table in (four_heads.route, four_heads.heads):
            assert site[name].min() - half_m < table[name].min()
            assert site[name].max() + half_m > table[name].max()
    assert site["bound_m"].drop_nulls().is_between(0.0, 1e3).all()
    assert site["bound_m"].null_count() < site.height


def test_four_times_the_angles_halve_the_error_bound() -> None:
    core = _core.Bound(Scenario.load("paper-real-odometry-4"))
    x_m, y_m = np.array([120.0]), np.array([10.0])
    once, fourfold = (core.at(x_m, y_m, looks, 0.0)[0] for looks in (10.0, 40.0))
    assert abs(once / fourfold - 2.0) < 1e-3


def test_one_radio_head_leaves_a_direction_undetermined() -> None:
    alone = bound("paper", map_step_m=50.0)
    assert alone.site["bound_m"].null_count() == alone.site.height
    assert "does not determine a position" in render_bound(alone)


def test_the_snr_of_the_bound_is_that_of_the_link_budget() -> None:
    core = _core.Bound(
        Scenario.load("paper").with_overrides({"site.radio_heads[0].eirp_dbm": -17.0})
    )
    # The unit test of the core contains the calculation: 8.083 dB at 100 m.
    snr_db = core.snr_db(np.array([205.0]), np.array([0.0]))
    assert snr_db.shape == (1, 1)
    assert abs(snr_db[0, 0] - 8.083) < 2e-3


def test_invalid_positions_of_a_bound_are_rejected() -> None:
    core = _core.Bound(Scenario.load("paper"))
    one, two = np.zeros(1), np.zeros(2)
    with pytest.raises(ValueError, match="equal lengths"):
        core.at(one, two, 1.0, 0.0)
    for looks in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="looks"):
            core.at(one, one, looks, 0.0)
    for heading_std_rad in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="heading_std_rad"):
            core.at(one, one, 1.0, heading_std_rad)


def test_the_bound_report_loads_nothing_and_names_the_radio_heads(four_heads: ErrorBound) -> None:
    page = render_bound(four_heads)
    markup = re.sub(r"(<script>).*?(</script>)", r"\1\2", page, flags=re.DOTALL)
    assert not re.search(r"<(link|img|iframe|script)[^>]*\b(src|href)=", markup)
    assert not re.search(r"@import|url\(|https?:", markup)
    specs = json.loads(page.split("const charts = ")[1].split(";\n")[0])
    assert set(specs) == set(re.findall(r'class="chart" id="([^"]+)"', page)) == {"route", "site"}
    for name in four_heads.heads["name"]:
        assert name in markup


def test_the_command_writes_the_files_that_its_help_lists(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av(
        "design", "bound", "yard", "--map-step-m", "25", "--out", tmp_path / "b", columns=80
    )
    assert done.code == 0, done.err
    assert "lower bound of the RMS error" in done.out
    assert "dock" in done.out
    names = {path.name for path in (tmp_path / "b").iterdir()}
    said = " ".join(done.out.split())
    assert "fails level 5 on 21.6% of the route" in said
    assert "Cheapest change that reaches the level: 8 antennas." in said
    page = (tmp_path / "b" / "report.html").read_text()
    assert "fails level 5" in page
    assert names == {
        "bound.parquet", "map.parquet", "report.html", "scenario.toml", "manifest.json",
    }  # fmt: skip
    narrow = access_av("design", "bound", "yard", "--out", tmp_path / "b", columns=60).out
    assert re.search(r"^ 6 +0\.3 +99\.9% .* not reached", narrow, re.MULTILINE)
    route = pl.read_parquet(tmp_path / "b/bound.parquet")
    result = json.loads(access_av("design", "bound", "yard", "--json", "--out", tmp_path / "b").out)
    assert result["next_level"]["cheapest"] == "8 antennas"
    assert result["median_m"] == route["bound_m"].median()
    assert result["median_m"] < result["p90_m"] < result["max_m"]
    assert [head["pci"] for head in result["heads"]] == [11, 12, 13, 14]
