"""Tables of the page of a study, compared cell by cell with its parquet tables and shipped prices.

The expected values are computed here, without code of the package's study and report.
"""

from __future__ import annotations

import html
import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av.tables.toml import tomllib
from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

TRIPS, VEHICLES, HOURS, YEARS = 40, 6, 16.0, 4.0
EXTENTS = ("low", "value", "high")
WORDS = {
    "met": "good enough",
    "probably_met": "probably good enough",
    "probably_missed": "probably not good enough",
    "missed": "not good enough",
}


@pytest.fixture(scope="module")
def page(short_study: Path) -> str:
    return (short_study / "report.html").read_text("utf-8")


@pytest.fixture(scope="module")
def said(short_study: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((short_study / "study.json").read_text("utf-8"))
    return found


@pytest.fixture(scope="module")
def points(short_study: Path) -> pl.DataFrame:
    """Operating points with their energy of a trip, in the order of the page's numbers."""
    table = pl.read_parquet(short_study / "points.parquet")
    energy = {
        f"{extent}_j": pl.col(f"estimates_{extent}_j") + pl.col(f"listening_{extent}_j")
        for extent in EXTENTS
    }
    return table.with_columns(**energy).sort(
        pl.col("value_j") + pl.col("idle_value_j"), "target_error_m", maintain_order=True
    )


def plain(cell: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", cell)).split())


def rows_of(page: str, *heads: str) -> list[list[str]]:
    """Cells of all tables whose heads contain these texts."""
    found, exists = list[list[str]](), False
    for table in re.findall(r"<table.*?</table>", page, re.S):
        named = [plain(it) for it in re.findall(r"<th[^>]*>(.*?)</th>", table, re.S)]
        if not set(heads) <= set(named):
            continue
        exists = True
        for row in re.findall(r"<tr>(.*?)</tr>", table.split("<tbody>")[1], re.S):
            found.append([plain(it) for it in re.findall(r"<td[^>]*>(.*?)</td>", row, re.S)])
    assert exists, heads
    return found


def number(text: str) -> float:
    """The first number of a text."""
    found = re.search(r"[-+]?[\d,]*\.?\d+(?:e[-+]\d+)?", text.replace("−", "-"))
    assert found is not None, text
    return float(found.group().replace(",", ""))


def ends(text: str) -> list[float]:
    """Low, central and high value; one number stands for all."""
    parts = [number(it) for it in text.split("…")]
    return parts * 3 if len(parts) == 1 else parts


def close(text: str, expected: list[float]) -> None:
    """Values are shown with three digits, or as integers from 100 on."""
    assert np.allclose(ends(text), expected, rtol=5.1e-3), (text, expected)


def test_every_point_has_its_energy_and_error(page: str, points: pl.DataFrame) -> None:
    shown = rows_of(page, "No.", "energy of a trip")
    assert [it[0] for it in shown] == [str(it) for it in range(1, points.height + 1)]
    for cells, row in zip(shown, points.iter_rows(named=True), strict=True):
        assert cells[1] == f"{row['method']}, {row['wake_up']}"
        assert cells[2] == f"{row['mode']} ({row['mode_name']})"
        close(cells[3], [row["value_j"]] * 3)
        assert number(cells[4]) == pytest.approx(row["target_error_m"], abs=5.1e-4)


def test_power_modes_of_the_recommended_operation(page: str, points: pl.DataFrame) -> None:
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    same = points.filter(method=chosen["method"], wake_up=chosen["wake_up"])
    shown = {int(it[0].split()[0]): it for it in rows_of(page, "Power mode", "idle / W")}
    assert shown.keys() == set(same["mode"])
    for row in same.iter_rows(named=True):
        cells = shown[row["mode"]]
        assert number(cells[1]) == pytest.approx(row["target_error_m"], abs=5.1e-4)
        trip_j = [row[f"{it}_j"] for it in EXTENTS]
        idle_w = [row[f"idle_{it}_w"] for it in EXTENTS]
        close(cells[2], trip_j)
        close(cells[3], idle_w)
        day_wh = [
            joules * TRIPS * VEHICLES / 3600.0 + watts * HOURS * VEHICLES
            for joules, watts in zip(trip_j, idle_w, strict=True)
        ]
        close(cells[4], day_wh)


def test_rivals_and_their_differences(page: str, said: dict[str, Any]) -> None:
    shown = rows_of(page, "Rival")
    for cells, it in zip(shown, said["rivals"], strict=True):
        assert cells[0] == it["name"]
        assert number(cells[2]) == pytest.approx(it["error_m"], abs=5.1e-4)
        delta = [it[f"delta{end}_m"] for end in ("", "_low", "_high")]
        assert np.allclose(figures(cells[3]), delta, atol=5.1e-4)
        assert number(cells[4]) == pytest.approx(it["delta_j"], rel=5.1e-3)
        assert number(cells[5]) == pytest.approx(100.0 * it["day_share"], rel=0.051)
        of_ok = [100.0 * it[f"ok_delta{end}"] for end in ("", "_low", "_high")]
        assert np.allclose(figures(cells[6])[1:], of_ok, atol=0.051)
        assert cells[7] == ("equivalent" if it["is_equivalent"] else WORDS[it["judged"]])


def test_composition_of_the_energy(page: str, points: pl.DataFrame) -> None:
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    per_day = TRIPS * VEHICLES / 3600.0
    parts = [
        chosen["estimates_value_j"] * per_day,
        chosen["listening_value_j"] * per_day,
        chosen["idle_value_w"] * HOURS * VEHICLES,
    ]
    shown = rows_of(page, "Part", "Fleet’s day")
    for cells, wh in zip(shown, parts, strict=True):
        close(cells[1], [wh] * 3)
        assert number(cells[3]) == pytest.approx(100.0 * wh / sum(parts), rel=1e-3)
    for cells, wh in zip(shown, parts[:2], strict=False):
        assert number(cells[2]) == pytest.approx(100.0 * wh / sum(parts[:2]), rel=1e-3)
    assert f"Idle computers take {100.0 * parts[2] / sum(parts):.4g} % of" in plain(page)


def test_verdicts_of_targets(page: str, short_study: Path) -> None:
    table = pl.read_parquet(short_study / "targets.parquet")
    shown = [it for it in rows_of(page, "Target", "Share within") if it[2] != "–"]
    assert len(shown) == table.height
    for cells, row in zip(shown, table.iter_rows(named=True), strict=True):
        channel = "nominal" if row["variant"] == "unchanged" else row["variant"]
        stretch = f"{row['from_m']:.0f} to {row['to_m']:.0f} m along the road"
        assert cells[0] == f"{row['target']} {channel}, {stretch}"
        assert cells[2].split() == [f"{row['required_error_m']:g}", "m", f"{row['percent']:g}", "%"]
        assert number(cells[3]) == pytest.approx(row["target_error_m"], abs=5.1e-4)
        if row["target_error_high_m"] is None or np.isinf(row["target_error_high_m"]):
            assert cells[4].startswith("above ")
            assert number(cells[4]) == pytest.approx(row["target_error_low_m"], rel=5.1e-3)
        assert number(cells[5]) == pytest.approx(100.0 * row["within_share"], abs=5.1e-3)
        low, high = (float(it) for it in re.findall(r"([\d.]+)%", cells[6]))
        assert low == pytest.approx(100.0 * row["within_low_share"], abs=5.1e-3)
        assert high == pytest.approx(100.0 * row["within_high_share"], abs=5.1e-3)
        assert cells[7] == WORDS[row["judgement"]]


def test_reliability_of_every_variant(page: str, short_study: Path) -> None:
    drives = pl.read_parquet(short_study / "drives.parquet")
    steps = ("ok_steps", "level_steps", "suspected_steps", "unavailable_steps")
    shown = rows_of(page, "Variant", "Errors while ok")
    assert {it[0] for it in shown} == {*drives["variant"], "nominal"} - {"unchanged"}
    for cells in shown:
        name = "unchanged" if cells[0] == "nominal" else cells[0]
        # The variant “unchanged” of the screening has a part of the drives.
        mine = drives.filter(variant=name)
        sums = np.array(mine.select(pl.sum(*steps)).row(0), dtype=float)
        assert np.allclose([number(it) for it in cells[2:6]], 100.0 * sums / sums.sum(), atol=0.051)
        lost = int(mine["is_lost"].sum())
        assert cells[1] == f"{'LOST in ' if lost else ''}{lost} of {mine.height}"
        assert number(cells[6]) == mine["exceedances"].sum()


def test_table_along_the_road(page: str, short_study: Path, said: dict[str, Any]) -> None:
    places = pl.read_parquet(short_study / "places.parquet")
    for cells, row in zip(
        rows_of(page, "Along the road", "minimum RMS"),
        places.gather_every(2).iter_rows(named=True),
        strict=True,
    ):
        assert cells[0] == f"{row['along_m']:.0f} m"
        assert cells[1] == ("kept" if row["target_error_m"] <= 0.2 else "missed")
        for cell, name in ((cells[2], "target_error_m"), (cells[3], "median_error_m")):
            assert number(cell) == pytest.approx(row[name], abs=5.1e-4)
        assert (cells[4] == "–") == (row["level_m"] is None)
        if row["level_m"] is not None:
            assert number(cells[4]) == pytest.approx(row["level_m"], abs=5.1e-3)
        assert number(cells[5]) == pytest.approx(100.0 * row["reliable_share"], abs=0.51)
        assert number(cells[6]) == pytest.approx(row["bound_m"], abs=5.1e-4)
        assert number(cells[7]) == pytest.approx(row["along_road_error_per_degree_m"], abs=5.1e-3)
        assert number(cells[8]) == pytest.approx(row["best_snr_db"], abs=0.51)
    kept = (places["target_error_m"] <= 0.2).mean()
    assert f"{kept:.0%} of the road meet the target" in plain(page)
    worst = rows_of(page, "Why")
    assert len(worst) == len(said["worst"])
    for cells, place in zip(worst, said["worst"], strict=True):
        nearest = places.sort((pl.col("along_m") - place["along_m"]).abs()).row(0, named=True)
        assert number(cells[1]) == pytest.approx(nearest["along_m"], abs=0.51)
        assert number(cells[3]) == pytest.approx(nearest["target_error_m"], abs=5.1e-3)
        x_m, y_m = map(float, re.findall(r"-?\d+", cells[2]))
        assert np.allclose([x_m, y_m], [nearest["x_m"], nearest["y_m"]], atol=0.51)


def test_radio_heads_are_on_the_stated_side(page: str) -> None:
    # The road: 20 m straight on, a quarter of a circle of 6 m to the left, 6 m straight on.
    straight = np.column_stack([np.arange(0.0, 20.0, 0.01), np.zeros(2000)])
    angle = np.arange(0.0, np.pi / 2.0, 0.001)
    bend = np.column_stack([20.0 + 6.0 * np.sin(angle), 6.0 - 6.0 * np.cos(angle)])
    last = np.column_stack([np.full(600, 26.0), 6.0 + np.arange(0.0, 6.0, 0.01)])
    road = np.vstack([straight, bend, last])
    along_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(road, axis=0).T))])
    shown = rows_of(page, "Radio head")
    for cells, head in zip(shown, ([10.0, 20.0], [60.0, 10.0]), strict=True):
        away = np.array(head) - road
        nearest = int(np.hypot(*away.T).argmin())
        forward = road[nearest] - road[nearest - 1]
        left = forward[0] * away[nearest, 1] - forward[1] * away[nearest, 0] > 0.0
        assert number(cells[1]) == pytest.approx(along_m[nearest], abs=0.51)
        assert number(cells[2]) == pytest.approx(np.hypot(*away[nearest]), abs=0.51)
        assert cells[2].endswith("left" if left else "right")


def test_prices_of_measures_and_their_verdicts(page: str, said: dict[str, Any]) -> None:
    shipped = tomllib.loads((ROOT / "python/access_av/economics/prices.toml").read_text("utf-8"))
    rate = shipped["currency"]["per_usd"]["EUR"]

    def price(name: str, units: int) -> list[float]:
        return [units * shipped[name][it] * rate[it] for it in EXTENTS]

    single = {
        "add a mast": price("radio_head", 1),
        "move a radio head": price("move_radio_head", 1),
        "calibrate the antennas": price("calibration", VEHICLES),
        "a better odometer": price("odometer", VEHICLES),
        "SSBs twice as often": price("cell_settings", 1),
        "remember the odometer’s scale": price("vehicle_settings", 1),
        "survey the radio heads": [2 * it for it in (10.0, 20.0, 40.0)],
    }
    stated = {it["name"]: it for it in said["remedies"]}
    shown = rows_of(page, "Measure", "Lost drives")
    assert len(shown) == 1 + len(stated)
    for cells in shown[1:]:
        # The name is in front of the description, which repeats no name.
        name = max((it for it in stated if cells[0].startswith(it)), key=len)
        cost = np.sum([single[it] for it in name.split(" + ")], axis=0)
        close(cells[4], cost.tolist())
        it = stated[name]
        delta, low, high = figures(cells[3])
        assert delta == pytest.approx(it["delta_m"], abs=5.1e-4)
        assert low == pytest.approx(it["delta_low_m"], abs=5.1e-4)
        assert high == pytest.approx(it["delta_high_m"], abs=5.1e-4)
        effect = "helps" if it["delta_high_m"] < 0.0 else "harms"
        if it["delta_low_m"] <= 0.0 <= it["delta_high_m"]:
            effect = "not sure"
        assert cells[3].endswith(effect)
        if cost[1] > 0.0:
            assert number(cells[5]) == pytest.approx(-100.0 * it["delta_m"] / cost[1], rel=0.06)
        assert cells[6] == WORDS[it["judged"]]


def figures(text: str) -> list[float]:
    """Difference and the ends of its interval."""
    return [float(it) for it in re.findall(r"[-+]?\d+\.\d+", text)]


def test_money_and_carbon_over_the_years(page: str, said: dict[str, Any]) -> None:
    tables = (
        (f"{YEARS:g} years / EUR", "capital", "yearly"),
        (f"{YEARS:g} years / kgCO2e", "embodied_kg", "use_kg_per_year"),
    )
    for head, once, yearly in tables:
        shown = {it[0]: it for it in rows_of(page, head)}
        assert shown.keys() == said["ways"].keys()
        for name, way in said["ways"].items():
            one, each = (
                [way[it][end] for end in ("low", "central", "high")] for it in (once, yearly)
            )
            close(shown[name][1], one)
            close(shown[name][2], each)
            total = [first + YEARS * later for first, later in zip(one, each, strict=True)]
            close(shown[name][3], total)


def test_tiles(page: str, said: dict[str, Any], points: pl.DataFrame) -> None:
    tiles = {
        html.unescape(text): html.unescape(value)
        for value, text in re.findall(r'<div class="tile"><b>(.*?)</b><span>(.*?)</span>', page)
    }
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    day_wh = chosen["value_j"] * TRIPS * VEHICLES / 3600.0
    expected = {
        "error that the vehicle does not exceed for 90 % of time": said["nominal"][
            "target_error_m"
        ],
        "the same percentile with poor line of sight": said["poor_los"]["target_error_m"],
        "a trip at the recommended point, above idle": chosen["value_j"],
        "the fleet’s day at that point, above idle": day_wh,
        "of the time in state ok": 100.0 * said["nominal"]["ok_share"],
    }
    assert tiles.keys() == expected.keys()
    for text, value in expected.items():
        assert number(tiles[text]) == pytest.approx(value, rel=5.1e-3, abs=5.1e-3)
