"""Every figure of a study, computed again from its tables."""

from __future__ import annotations

import base64
import html
import json
import os
import re
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import layout
from access_av import Plant, Scenario, SettingsError, drives, simulate, study_plant
from access_av.errors import InputError
from access_av.run.error_bound import along_route
from access_av.run.pairs import ErrorSamples
from access_av.statistics.paired import paired_difference
from access_av.study.compare import beside_first
from access_av.study.compare import table as compared_table
from access_av.study.places import worst_places
from access_av.study.points import mode_groups
from access_av.study.unverified import unverified
from access_av.tables.columns.tables import TABLES
from access_av.tables.toml import tomllib
from access_av.verdicts import Agreement, Effect, Judgement
from browser import Browser

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# A short road, so that all simulations take seconds.
PLANT = """
name = "short"
target = "0.2 m 90 %"
vehicle = "tugger"
[site]
name = "short"
[site.road]
segments = [{ length_m = 30.0 }, { radius_m = 10.0, turn_deg = 90.0 }, { length_m = 20.0 }]
[[site.radio_heads]]
name = "a <b>bold</b> mast"
position_m = [10.0, 20.0, 8.0]
position_std_m = 0.1
pci = 1
eirp_dbm = 10.0
[[site.radio_heads]]
name = "other"
position_m = [60.0, 10.0, 8.0]
position_std_m = 0.1
pci = 2
ssb_index = 1
eirp_dbm = 10.0
[motion]
stops = [{ name = "dock <i>", at_m = 25.0, dwell_s = 2.0 }]
[[targets]]
name = "gate <i>"
at_m = 50.0
target = "0.1 m 90 %"
[[targets]]
from_m = 5.0
to_m = 20.0
target = "2 m 95 %"
[fleet]
vehicles = 6
hours_per_day = 16.0
trips_per_day = 40
years = 4.0
[prices]
currency = "EUR"
lidar = 3000.0
survey = { low = 10.0, value = 20.0, high = 40.0, source = "offer of <i>somebody</i>" }
"""
RUNS = 4
# Two grey pixels.
PICTURE = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR4nGM4cxcAAngBqtw5YnsAAAAASUVORK5CYII="
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the command for the short plant."""
    from access_av.cli.main import main

    folder = tmp_path_factory.mktemp("study")
    (folder / "short.toml").write_text(PLANT, "utf-8")
    command = ["access-av", "study", str(folder / "short.toml"), "--runs", str(RUNS)]
    more = ["--force-remedies", "--sweep", "site.rician_k_db=3", "--out", str(folder / "out")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [*command, *more])
        with pytest.raises(SystemExit) as stopped:
            main()
    assert not stopped.value.code
    return folder / "out"


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Pages of other commands, of short drives over a picture."""
    from access_av.cli.main import main

    folder = tmp_path_factory.mktemp("pages")
    (folder / "plan.png").write_bytes(PICTURE)
    site = tomllib.loads(PLANT)["site"]
    scenario = (
        Plant.from_toml(PLANT)
        .scenario()
        .with_overrides(
            {
                "site": {
                    **site,
                    "underlay": {
                        "file": str(folder / "plan.png"),
                        "metres_per_pixel": 40.0,
                        "zero_px": [0.0, 1.0],
                    },
                }
            }
        )
    )
    (folder / "short.toml").write_text(scenario.to_toml(), "utf-8")
    logged = folder / "logged"
    drives.log_angles(scenario, logged)
    located = [
        *(
            "record",
            "locate",
            "--recording",
            logged / "angles.csv",
            "--odometry",
            logged / "odometry.csv",
        ),
        *("--site", logged / "site.toml", "--vehicle", logged / "vehicle.toml"),
        *("--truth", logged / "truth.tum"),
    ]
    commands = {
        "run": ["run", folder / "short.toml", "--runs", "2"],
        "bound": ["design", "bound", folder / "short.toml"],
        "integrity": [
            "design",
            "integrity",
            folder / "short.toml",
            "--runs",
            "1",
            "--fault",
            "none",
        ],
        "locate": located,
    }
    for name, command in commands.items():
        with pytest.MonkeyPatch.context() as patch:
            arguments = ["access-av", *command, "--out", folder / name]
            patch.setattr(sys, "argv", [str(it) for it in arguments])
            with pytest.raises(SystemExit) as stopped:
                main()
            assert not stopped.value.code, name
    return {name: folder / name / "report.html" for name in commands}


@pytest.fixture(scope="module")
def said(results: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((results / "study.json").read_text("utf-8"))
    return found


@pytest.fixture(scope="module")
def page(results: Path) -> str:
    """Returns the text of the page, without scripts and tags."""
    text = (results / "report.html").read_text("utf-8")
    text = re.sub(r"<script>.*?</script>|<style>.*?</style>", "", text, flags=re.S)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text)).split())


def errors(results: Path, variant: str) -> Any:
    rows = pl.read_parquet(results / "errors.parquet").filter(variant=variant)
    runs = rows["run"].n_unique()
    return rows.sort("run", "time_s")["error_m"].to_numpy().astype(float).reshape(runs, -1)


def percentile(values: Any, percent: float) -> float:
    """Smallest error that a percentage of all errors does not exceed."""
    pooled = np.sort(np.asarray(values).ravel())
    return float(pooled[int(np.ceil(percent / 100.0 * pooled.size)) - 1])


def test_percentiles_and_shares_are_those_of_the_errors(
    results: Path, said: dict[str, Any], page: str
) -> None:
    for key, variant in (("nominal", "unchanged"), ("poor_los", "poor line of sight")):
        found = errors(results, variant)
        assert said[key]["runs"] == len(found)
        assert said[key]["target_error_m"] == pytest.approx(percentile(found, 90.0))
        assert said[key]["within_share"] == pytest.approx((found <= 0.2).mean())
        low, high = said[key]["within_low_share"], said[key]["within_high_share"]
        assert low <= said[key]["within_share"] <= high
        assert f"{percentile(found, 90.0):.3f} m" in page
    assert said["verdict"] in page


def test_remedies_are_driven_in_the_same_worlds(
    results: Path, said: dict[str, Any], page: str
) -> None:
    prices = {"survey the radio heads": (2, 20.0), "calibrate the antennas": (6, 150.0 * 0.92)}
    pairs = said["before_measures"]["runs"]
    before = errors(results, "unchanged")[:pairs]
    assert said["before_measures"]["target_error_m"] == pytest.approx(percentile(before, 90.0))
    single = [it for it in said["remedies"] if len(it["settings"]) == 1]
    assert len(single) == 7
    costs = {it["name"]: it["cost"]["central"] for it in single}
    for remedy in said["remedies"]:
        found = errors(results, remedy["name"])
        assert remedy["runs"] == len(found) == pairs
        assert remedy["cost"]["central"] == pytest.approx(
            sum(costs[name] for name in remedy["name"].split(" + "))
        )
        if remedy["cost"]["central"]:
            gained_cm = 100.0 * (percentile(before, 90.0) - percentile(found, 90.0))
            assert remedy["cm_per_price"] == pytest.approx(gained_cm / remedy["cost"]["central"])
        assert remedy["target_error_m"] == pytest.approx(percentile(found, 90.0))
        expected = paired_difference(found, before, 90.0)
        less = [remedy[key] for key in ("delta_m", "delta_low_m", "delta_high_m")]
        assert less == pytest.approx(expected)
        units, price = prices.get(remedy["name"], (0, 0.0))
        assert not units or remedy["cost"]["central"] == pytest.approx(units * price)
        assert f"{remedy['target_error_m']:.3f} m" in page
    assert [it["delta_m"] for it in single] == sorted(it["delta_m"] for it in single)
    holding = [it for it in said["remedies"] if it["judged"] in ("met", "probably_met")]
    cheapest = min(holding, key=lambda it: it["cost"]["central"], default=None)
    assert said["cheapest_measure"] == (cheapest and cheapest["name"])


def test_energy_is_joules_times_trips_times_vehicles(results: Path, said: dict[str, Any]) -> None:
    points = pl.read_parquet(results / "points.parquet")
    chosen = points.filter("recommended")
    assert chosen.height == 1
    assert chosen["on_front"].all()
    for ours, theirs in (("low", "low"), ("value", "central"), ("high", "high")):
        trip_j = chosen[f"estimates_{ours}_j"][0] + chosen[f"listening_{ours}_j"][0]
        assert said["recommended"]["trip_j"][theirs] == pytest.approx(trip_j)
        assert said["day"]["trips_wh"][theirs] == pytest.approx(trip_j * 40 * 6 / 3600.0)
        idle_wh = chosen[f"idle_{ours}_w"][0] * 16.0 * 6
        assert said["day"]["idle_wh"][theirs] == pytest.approx(idle_wh)
    idle, trips = said["day"]["idle_wh"]["central"], said["day"]["trips_wh"]["central"]
    assert said["day"]["idle_share"] == pytest.approx(idle / (idle + trips))
    parts = said["day"]["composition_wh"]
    assert parts["idle"] == idle
    assert parts["estimates"] + parts["receiver"] == pytest.approx(trips)
    assert parts["receiver"] == pytest.approx(chosen["listening_value_j"][0] * 40 * 6 / 3600.0)


def test_the_energy_of_a_trip_follows_from_the_platform_and_its_drives(results: Path) -> None:
    from access_av.device.platform import Platform

    points = pl.read_parquet(results / "points.parquet").filter("recommended")
    few = pl.read_parquet(results / "drives.parquet").filter(variant=points["variant"][0])
    assert few.height == points["runs"][0]
    vehicle = Scenario.load(str(results / "recommended.toml")).vehicle
    platform = Platform.load("jetson-agx-xavier-engine").core
    aoa_estimates, bursts_received = (
        round(few[name].to_numpy().mean()) for name in ("aoa_estimates", "bursts_received")
    )
    energy = platform.energy_j(
        vehicle, aoa_estimates, bursts_received, few["duration_s"][0], "value"
    )
    assert energy is not None
    assert points["estimates_value_j"][0] == pytest.approx(energy[0])
    assert points["listening_value_j"][0] == pytest.approx(energy[1])


def test_no_point_of_the_front_is_beaten(results: Path) -> None:
    points = pl.read_parquet(results / "points.parquet").with_columns(
        energy_j=pl.sum_horizontal(f"{it}_value_j" for it in ("estimates", "listening", "idle"))
    )
    points = points.filter(pl.col("variant").str.contains(", mode"))  # the finalists
    assert points["is_simulated"].all()
    for one in points.filter("on_front").iter_rows(named=True):
        better = points.filter(
            pl.col("energy_j") < one["energy_j"], pl.col("target_error_m") <= one["target_error_m"]
        )
        assert better.is_empty()
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    for judgements in (["met"], ["met", "probably_met"]):
        kept = points.filter("on_front", pl.col("judgement").is_in(judgements))
        if not kept.is_empty():
            assert chosen["energy_j"] == kept["energy_j"].min()
            return
    assert chosen["target_error_m"] == points["target_error_m"].min()


def test_money_and_carbon_add_up(said: dict[str, Any], page: str) -> None:
    ways = said["ways"]
    # Published prices are US dollars; the plant counts in euros.
    eur, hours = 0.92, 16.0 * 250.0
    idle_w = said["recommended"]["idle_w"]["value"]
    lidar = ways["LiDARs, each with a computer"]
    assert lidar["capital"]["central"] == pytest.approx(6 * (3000.0 + 900.0 * eur))
    kwh = (8.0 + idle_w) * hours * 6 / 1000.0
    assert lidar["use_kg_per_year"]["central"] == pytest.approx(kwh * 0.381)
    assert lidar["yearly"]["central"] == pytest.approx(kwh * 0.15 * eur)
    roadside = ways["roadside units"]
    assert roadside["capital"]["central"] == pytest.approx(2 * 14_000.0 * eur)
    kwh = 2 * 35.0 * hours / 1000.0
    assert roadside["yearly"]["central"] == pytest.approx((2 * 2400.0 + kwh * 0.15) * eur)
    uwb = ways["UWB anchors and tags"]
    anchors = 5  # 65.7 m of road, one for each 15 m
    assert uwb["capital"]["central"] == pytest.approx((anchors * 400.0 + 6 * 100.0) * eur)
    kwh = (anchors * 2.0 + 6 * 0.2) * hours / 1000.0
    assert uwb["yearly"]["central"] == pytest.approx(kwh * 0.15 * eur)
    ours = ways["5G receivers, computers are there anyway"]
    kwh = said["day"]["trips_wh"]["central"] / 1000.0 * 250.0
    assert ours["yearly"]["central"] == pytest.approx(kwh * 0.15 * eur)
    assert ours["capital"]["central"] == pytest.approx(6 * 30.71 * eur)
    with_idle = ways["5G receivers, each with a computer"]
    kwh += said["day"]["idle_wh"]["central"] / 1000.0 * 250.0
    assert with_idle["yearly"]["central"] == pytest.approx(kwh * 0.15 * eur)
    assert with_idle["capital"]["central"] == pytest.approx(6 * (30.71 + 900.0) * eur)
    assert said["prices"]["lidar"]["is_published"] is False
    assert said["prices"]["computer"]["is_published"] is True
    assert said["currency"] == "EUR"
    assert "offer of <i>somebody</i>" in page
    assert "EUR" in page


def test_places_are_those_of_the_road(results: Path, said: dict[str, Any], page: str) -> None:
    places = pl.read_csv(results / "places.csv")
    assert places["along_m"].to_list()[:3] == [0.5, 1.5, 2.5]
    assert (places["passes"] == (places["target_error_m"] <= 0.2)).all()
    worst = max(said["worst"], key=lambda it: it["error_m"])
    assert worst["error_m"] == pytest.approx(places["target_error_m"].max(), abs=1e-4)
    assert all(it["why"] for it in said["worst"])
    assert "These figures every 3 m" in page
    for name in ("target_error_m", "median_error_m", "bound_m"):
        assert f"{places[name][9]:.3f} m" in page
    # Protection levels and reliability, computed again from the table of errors.
    route = along_route(Plant.from_toml(PLANT).scenario())
    rows = pl.read_parquet(results / "errors.parquet").filter(variant="unchanged")
    along_m = np.interp(rows["time_s"], route["time_s"], route["along_m"])
    near = rows.filter(pl.Series(np.abs(along_m - 10.5) <= 5.0))["protection_level_m"]
    at = places.row(10, named=True)
    assert at["reliable_share"] == pytest.approx(1.0 - near.null_count() / len(near), abs=1e-4)
    assert at["level_m"] == pytest.approx(near.quantile(0.5, "lower"), abs=1e-3)
    # On the straight before the first bend, distance and coordinates agree.
    straight = places.filter(pl.col("along_m") < 29.0)
    assert np.allclose(straight["x_m"], straight["along_m"], atol=1e-3)
    # One degree of both angles on a straight, by hand.
    at = places.row(5, named=True)
    heads = np.array([[10.0, 20.0], [60.0, 10.0]])
    away = heads - [at["x_m"], at["y_m"]]
    known = ((away[:, 1] / (away**2).sum(axis=1)) ** 2).sum()
    assert at["along_road_error_per_degree_m"] == pytest.approx(
        np.radians(1.0) / np.sqrt(known), rel=1e-3
    )


def test_variants_stand_side_by_side(results: Path, page: str) -> None:
    compared = pl.read_parquet(results / "compared.parquet").filter(percent=90.0)
    assert compared["variant"].to_list() == ["unchanged", "site.rician_k_db = 3"]
    first, second = compared["percentile_m"]
    assert first == pytest.approx(percentile(errors(results, "unchanged"), 90))
    assert compared["delta_m"].to_list() == [None, pytest.approx(second - first)]
    assert "site.rician_k_db = 3" in page


def test_nothing_of_the_pages_overlaps_or_is_cut(results: Path, pages: dict[str, Path]) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    papers = set()
    for name, page in {"study": results / "report.html", **pages}.items():
        with Browser(program, page.as_uri()) as browser:
            for width, look in layout.VIEWS:
                found = layout.measure(browser, width, look)
                assert found["width"] == width
                assert found["found"] == [], (name, width, look)
                papers.add(found["paper"])
                if look != "print" and "ACCESS_AV_AXE" in os.environ:
                    assert layout.hindrances(browser) == [], (name, width, look)
            assert browser.errors == []
    assert len(papers) == 2  # dark, and not


def test_every_operating_point_is_numbered_without_overlap(results: Path) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    page = results / "report.html"
    found = re.search(r"const charts = (.*?);\n", page.read_text("utf-8"))
    assert found is not None
    spec = json.loads(found.group(1))["ways"]
    [rows] = [rows for rows in spec["datasets"].values() if "label" in rows[0]]
    points = pl.read_parquet(results / "points.parquet").filter(
        pl.col("target_error_m").is_finite()
    )
    energy_j = sum(points[f"{part}_value_j"] for part in ("estimates", "listening"))
    drawn = sorted((it["energy_j"], it["error_m"]) for it in rows)
    expected = sorted(zip(energy_j, points["target_error_m"], strict=True))
    assert np.allclose(drawn, expected, atol=1e-4)
    with Browser(program, page.as_uri()) as browser:
        for width in (1300, 400):
            browser.resize(width, 900)
            assert layout.label_faults(browser, "ways", spec, width) == []


def test_a_drive_is_played_and_whoever_wants_less_motion_has_the_slider(results: Path) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to play it with")
    told, at_s = "document.querySelector('#map .role-title').textContent", "input[name=at_s]"
    with Browser(program, (results / "report.html").as_uri()) as browser:
        browser.wait_for("document.querySelector('.vega-bind button')", seconds=60.0)
        first = browser.evaluate(told)
        assert first.startswith("0.0 s: ")
        browser.evaluate("document.querySelector('.vega-bind button').click()")
        browser.wait_for(f"document.querySelector('{at_s}').value > 1")
        browser.evaluate("document.querySelector('.vega-bind button').click()")
        assert browser.evaluate("document.querySelector('.vega-bind button').textContent") == "Play"
        assert browser.evaluate(told) != first
        less = {"name": "prefers-reduced-motion", "value": "reduce"}
        browser.call("Emulation.setEmulatedMedia", features=[less])
        browser.evaluate("window.isBefore = true")
        browser.call("Page.reload")
        browser.wait_for(f"!window.isBefore && document.querySelector('{at_s}')", seconds=60.0)
        browser.evaluate("new Promise((done) => setTimeout(done, 500))")
        assert browser.evaluate("document.querySelector('.vega-bind button')") is None
        browser.evaluate(f"document.querySelector('{at_s}').focus()")
        for kind in ("keyDown", "keyUp"):
            key = {"key": "ArrowRight", "windowsVirtualKeyCode": 39}
            browser.call("Input.dispatchKeyEvent", type=kind, **key)
        browser.wait_for(f"!{told}.startsWith('0.0 s: ')")


def test_the_animated_drive_is_the_first_one(results: Path) -> None:
    text = (results / "report.html").read_text("utf-8")
    specs = json.loads(re.findall(r"const charts = (\{.*\});\n", text)[0])
    [steps] = [
        layer["data"]["values"]
        for layer in specs["map"]["layer"]
        if layer.get("data", {}).get("name") == "played"
    ]
    driven = pl.read_parquet(results / "trajectories.parquet")
    assert 100 < len(steps) <= 302
    for step in (0, len(steps) // 2):
        at_s, off_m, level_m = map(float, re.findall(r"\d+\.\d+", steps[step]["told"]))
        row = driven.row(by_predicate=(pl.col("time_s") - at_s).abs() < 1e-6, named=True)
        assert off_m == pytest.approx(np.hypot(row["error_x_m"], row["error_y_m"]), abs=0.006)
        assert level_m == pytest.approx(row["protection_level_m"], abs=0.006)
        assert steps[step]["x_m"] == pytest.approx(row["true_x_m"], abs=0.06)
    mine = errors(results, "unchanged")[0]
    assert np.hypot(*driven.select("error_x_m", "error_y_m").to_numpy().T)[::5] == pytest.approx(
        mine, abs=1e-6
    )


@pytest.mark.parametrize(
    ("file", "table"),
    [
        ("errors", "study_errors"),
        ("drives", "study_drives"),
        ("targets", "study_targets"),
        ("places", "places"),
        ("points", "study_points"),
        ("compared", "compared"),
        ("trajectories", "trajectories"),
    ],
)
def test_columns_are_those_that_are_documented(results: Path, file: str, table: str) -> None:
    assert tuple(pl.read_parquet(results / f"{file}.parquet").columns) == TABLES[table].columns


def test_the_page_is_small_loads_nothing_and_shows_names_as_they_are(results: Path) -> None:
    text = (results / "report.html").read_text("utf-8")
    assert len(text.encode()) < 2_000_000
    shown = re.sub(r"<script>.*?</script>", "", text, flags=re.S)
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", shown)
    assert "<b>bold</b> mast" not in shown
    assert "<i>somebody" not in shown
    assert "Algorithm 1" not in shown  # no text about the paper's trip


def test_the_same_seed_gives_the_same_study_of_a_plant_and_of_its_file(tmp_path: Path) -> None:
    plant = Plant.from_toml(PLANT).with_overrides({"motion.start_at_m": 45.0, "targets": []})
    (tmp_path / "short.toml").write_text(plant.to_toml(), "utf-8")
    first = study_plant(plant, runs=2, seed=3, threads=1).summary()
    again = study_plant(tmp_path / "short.toml", runs=2, seed=3, threads=2).summary()
    assert first == again


def interval(within: Any, duration_s: float) -> tuple[float, float]:
    """95 % interval of a share of time: Clopper and Pearson's, and the bootstrap's of drives."""
    from scipy.stats import beta

    shares = within.mean(axis=1)
    trials = max(1, int(len(shares) * duration_s / 10.0))
    hits = int(shares.mean() * trials)
    low = beta.ppf(0.025, hits, trials - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, trials - hits) if hits < trials else 1.0
    drawn = np.random.default_rng(0).integers(0, len(shares), (2000, len(shares)))
    ends = np.quantile([shares[it].mean() for it in drawn], [0.025, 0.975])
    return float(min(low, ends[0])), float(max(high, ends[1], shares.mean()))


def judged(within: Any, duration_s: float, percent: float) -> str:
    low, high = interval(within, duration_s)
    required = 0.01 * percent
    if low >= required:
        return "met"
    if high < required:
        return "missed"
    return "probably_met" if within.mean() >= required else "probably_missed"


ORDER = ["met", "probably_met", "probably_missed", "missed"]


def test_each_target_is_judged_on_its_stretch_and_all_by_the_worst(
    results: Path, said: dict[str, Any], page: str
) -> None:
    route = along_route(Plant.from_toml(PLANT).scenario())
    rows = pl.read_parquet(results / "targets.parquet")
    drives = pl.read_parquet(results / "drives.parquet")
    for key, variant in (("nominal", "unchanged"), ("poor_los", "poor line of sight")):
        table = pl.read_parquet(results / "errors.parquet").filter(variant=variant)
        time_s = table.filter(run=0).sort("time_s")["time_s"]
        along_m = np.interp(time_s, route["time_s"], route["along_m"])
        found, duration_s = errors(results, variant), drives["duration_s"][0]
        mine = rows.filter(variant=variant)
        assert mine["target"].to_list() == ["whole trip", "gate <i>", "5 to 20 m"]
        assert mine["from_m"].to_list()[1:] == [45.0, 5.0]
        assert mine["to_m"].to_list()[1:] == [55.0, 20.0]
        for row in mine.iter_rows(named=True):
            part = found[:, (along_m >= row["from_m"]) & (along_m <= row["to_m"])]
            within, on_s = part <= row["required_error_m"], part.shape[1] / found.shape[1]
            assert row["target_error_m"] == pytest.approx(percentile(part, row["percent"]))
            low, high = interval(within, on_s * duration_s)
            assert row["within_share"] == pytest.approx(within.mean())
            assert row["within_low_share"] == pytest.approx(low, abs=1e-9)
            assert row["within_high_share"] == pytest.approx(high, abs=1e-9)
            assert row["judgement"] == judged(within, on_s * duration_s, row["percent"])
        assert said[key]["judged"] == max(mine["judgement"], key=ORDER.index)
    assert "gate <i>" in page
    assert "all targets" in page


def test_reliability_is_counted_from_the_drives(
    results: Path, said: dict[str, Any], page: str
) -> None:
    drives = pl.read_parquet(results / "drives.parquet")
    steps = ("ok_steps", "level_steps", "suspected_steps", "unavailable_steps")
    named = [("unchanged", said["nominal"]), ("poor line of sight", said["poor_los"])]
    named += [(it["name"], it) for it in said["remedies"]]
    for variant, figures in named:
        mine = drives.filter(variant=variant)
        sums = mine.select(pl.sum(*steps)).row(0, named=True)
        total = sum(sums.values())
        assert figures["ok_share"] == pytest.approx(sums["ok_steps"] / total)
        reasons = ("level", "suspected", "contradicted")
        for reason, column in zip(reasons, steps[1:], strict=True):
            assert figures["not_ok_shares"][reason] == pytest.approx(sums[column] / total)
        assert figures["integrity_failures"] == mine["exceedances"].sum()
        found = errors(results, variant)
        lost_s = (found > 5.0).mean(axis=1) * mine["duration_s"][0]
        assert figures["lost_runs"] == int((lost_s > 5.0).sum()) == mine["is_lost"].sum()
        # Protection levels exist in state ok only.
        levels = pl.read_parquet(results / "errors.parquet").filter(variant=variant)
        ok_share = 1.0 - levels["protection_level_m"].null_count() / levels.height
        assert ok_share == pytest.approx(figures["ok_share"], abs=0.02)
    assert said["alert_limit_m"] == pytest.approx(0.4)
    assert "alert limit 0.4 m (twice the target’s 0.2 m)" in page


def test_the_recommended_point_is_entered_as_a_file_that_run_accepts(
    results: Path, said: dict[str, Any], access_av: Callable[..., Any], tmp_path: Path
) -> None:
    file = results / "recommended.toml"
    done = access_av("run", file, "--runs", "1", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    written = tomllib.loads(file.read_text("utf-8"))
    for key, value in said["recommended"]["settings"].items():
        held = written
        for name in key.split("."):
            held = held[name]
        expected = value if isinstance(value, dict) else {"": value}
        found = held if isinstance(value, dict) else {"": held}
        assert {name: found[name] for name in expected} == expected
    # Its drives are those of the study, of both seeds.
    points = pl.read_parquet(results / "points.parquet").filter("recommended")
    drives = pl.read_parquet(results / "drives.parquet").filter(variant=points["variant"][0])
    assert drives["seed"].n_unique() >= 2
    counts = []
    for seed, runs in drives.group_by("seed", maintain_order=True).len().iter_rows():
        again = simulate(Scenario.load(str(file)), runs=runs, seed=seed, errors_every=5)
        counts += again.runs["aoa_estimates"].to_list()
        assert again.errors_m is not None
        mine = errors(results, points["variant"][0])[drives["seed"].to_numpy() == seed]
        assert pytest.approx(mine, rel=1e-5) == np.hypot(*again.errors_m.T).T
        trip_j = said["recommended"]["trip_j"]
        energy_j = again.runs["energy_j"].mean()
        assert trip_j["low"] <= energy_j <= trip_j["high"]
    assert counts == drives["aoa_estimates"].to_list()


def test_rivals_are_compared_in_pairs_and_equivalent_ones_named(
    results: Path, said: dict[str, Any], page: str
) -> None:
    points = pl.read_parquet(results / "points.parquet").with_columns(
        energy_j=pl.sum_horizontal(f"{it}_value_j" for it in ("estimates", "listening", "idle"))
    )
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    best = errors(results, chosen["variant"])
    idle = chosen["idle_value_w"] * 16.0 * 6
    whole_wh = chosen["energy_j"] * 240 / 3600.0 + idle
    assert said["rivals"]
    modes = {it["name"].split(", mode ")[-1] for it in said["rivals"]}
    assert len(modes | {f"{chosen['mode']} ({chosen['mode_name']})"}) == 8  # every power mode
    for rival in said["rivals"]:
        of_mode = points.filter(
            pl.format("{}, {}, mode {} ({})", "method", "wake_up", "mode", "mode_name")
            == rival["name"],
            pl.col("variant").str.contains(", mode"),
        )
        row = of_mode.row(0, named=True)
        expected = paired_difference(errors(results, row["variant"]), best, 90.0)
        delta = [rival[key] for key in ("delta_m", "delta_low_m", "delta_high_m")]
        assert delta == pytest.approx(expected)
        delta_j = row["energy_j"] - chosen["energy_j"]
        assert rival["delta_j"] == pytest.approx(delta_j)
        share = (delta_j * 240 / 3600.0 + (row["idle_value_w"] * 96.0 - idle)) / whole_wh
        assert rival["day_share"] == pytest.approx(share)
        same = delta[1] <= 0.0 <= delta[2] and (delta_j == 0.0 or abs(share) < 0.01)
        assert rival["is_equivalent"] == same
    recommended = said["recommended"]
    others = set(recommended["by_seed"]) - {recommended["name"]}
    equivalent = {it["name"] for it in said["rivals"] if it["is_equivalent"]}
    of_others = "equivalent" if others <= equivalent else "undecided"
    assert recommended["agreement"] == ("agreed" if not others else of_others)
    assert recommended["name"] in page


def test_modes_that_change_the_wake_up_are_driven_apart() -> None:
    scenario = Plant.from_toml(PLANT).scenario()
    groups = [[it.number for it in group] for group in mode_groups(scenario)]
    assert [1, 2, 3] in groups
    assert sorted(number for group in groups for number in group) == list(range(8))
    fixed = scenario.with_overrides({"vehicle.wake_up": {"policy": "fixed", "interval_ms": 500.0}})
    assert len(mode_groups(fixed)) == 1

    def driven(scenario: Scenario, mode: int) -> list[int]:
        in_mode = scenario.with_overrides({"vehicle.platform.mode": mode})
        return simulate(in_mode, runs=2).runs["aoa_estimates"].to_list()

    assert driven(scenario, 1) == driven(scenario, 2) == driven(scenario, 3)
    assert driven(fixed, 0) == driven(fixed, 5)


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


def test_an_error_is_explained_by_the_stretch_on_which_it_arose() -> None:
    wall = 'name = "hall 3"\npoints_m = [[100.0, 5.0], [140.0, 5.0]]'
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
    good = places_of([1.0] * 300, [2] * 300)
    assert "carried over" not in worst_places(good, plant)[0].why


def test_a_template_value_is_unverified_until_it_is_changed() -> None:
    bends = Plant.load("bends")
    keys = {it.key for it in unverified(bends)}
    assert {"site.rician_k_db", "site.radio_heads.eirp_dbm", "fleet.vehicles"} <= keys
    changed = bends.with_overrides({"site.rician_k_db": 9.0, "fleet.vehicles": 7})
    assert keys - {it.key for it in unverified(changed)} == {"site.rician_k_db", "fleet.vehicles"}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"site.radio_heads[0].position_std_m": 10.0}, "10 cm are 0.1"),
        ({"prices.grid_g_per_kwh": 0.38}, "0.38 kg are 380"),
        ({"prices.electricity_per_kwh": 25.0}, "25 cents are 0.25"),
    ],
)
def test_values_in_another_unit_are_doubted(settings: dict[str, Any], words: str) -> None:
    plant = Plant.from_toml(PLANT)
    assert not any(words in str(it) for it in plant.warnings())
    assert any(words in str(it) for it in plant.with_overrides(settings).warnings())


@pytest.mark.parametrize(("ends_m", "is_doubtful"), [((-60.0, 180.0), True), ((40.0, 80.0), False)])
def test_a_radio_head_behind_a_hall_is_doubted_on_the_other_side_of_the_road(
    ends_m: tuple[float, float], is_doubtful: bool
) -> None:
    """Radio head `gate` of `bends`, 25 m to the left of a straight of 200 m, behind a long wall."""
    walls = [{"name": "hall", "points_m": [[at_m, 10.0] for at_m in ends_m]}]
    told = Plant.load("bends").with_overrides({"site.walls": walls}).warnings()
    assert any("[60.0, -25.0, 8]" in str(it) for it in told) is is_doubtful


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("lidar = 3000.0", 'lidar = "3000 EUR"'), "without its unit"),
        (("trips_per_day = 40", "trips_per_day = 40000"), "at most"),
        (('target = "0.2 m 90 %"', 'target = "0.2 90 %"'), "0.3 m 99 %"),
        (('vehicle = "tugger"', 'vehicle = "tuger"'), "tugger"),
        (("at_m = 25.0", "at_m = 2500.0"), "motion.stops[0].at_m"),
        (("turn_deg = 90.0", "turn_deg = 90.0, turn_rad = 1.5"), "turn_deg"),
        (("hours_per_day = 16.0", "hours_per_day = 25.0"), "fleet.hours_per_day"),
        (("vehicles = 6", "vehicles = 0"), "fleet.vehicles"),
        (("lidar = 3000.0", "lidar = -3000.0"), "prices.lidar"),
        (("lidar = 3000.0", "lidars = 3000.0"), "prices.lidars"),
        (('currency = "EUR"', 'currency = "SEK"'), "prices.currency_per_usd"),
        (("pci = 2\n", ""), "site.radio_heads[1].pci"),
        (("eirp_dbm = 10.0\n", ""), "site.radio_heads[0].eirp_dbm"),
        (("at_m = 50.0", "at_m = 5000.0"), "targets[0].at_m"),
    ],
)
def test_bad_plants_are_refused_by_their_key(change: tuple[str, str], said: str) -> None:
    text = PLANT.replace(*change)
    assert text != PLANT
    with pytest.raises(SettingsError, match=re.escape(said)):
        Plant.from_toml(text, "mine.toml")


def test_nothing_unguarded_is_studied() -> None:
    plant = Plant.from_toml(PLANT).with_overrides({"vehicle.integrity": {"enabled": False}})
    with pytest.raises(InputError, match="unguarded"):
        study_plant(plant)
    assert all(
        Plant.load(name).scenario().vehicle.alert_limit_m is not None for name in Plant.names()
    )


@pytest.mark.parametrize("name", Plant.names())
def test_each_shipped_plant_gets_a_recommended_point_of_the_pareto_front(name: str) -> None:
    """Uses the last section of the road; `benches/shipped_plants.py` simulates the whole road."""
    plant = Plant.load(name)
    road_m = along_route(plant.scenario())["along_m"].max()
    assert isinstance(road_m, float)
    last = {"motion.start_at_m": round(0.97 * road_m), "motion.stops": []}
    found = study_plant(plant.with_overrides(last), runs=2)
    assert found.recommended in found.front
    assert found.point is not None
    assert found.recommendation.agreement in Agreement
    driven = [found.nominal, found.poor_los, *(it.driven for it in found.remedies)]
    driven += [it.driven for it in found.points]
    assert all(it.scenario.vehicle.alert_limit_m is not None for it in driven)
    assert all(it.ok_share is not None for it in driven)


def test_the_command_names_invalid_input(access_av: Callable[..., Any], tmp_path: Path) -> None:
    assert access_av("study", tmp_path).code == 2
    (tmp_path / "file").write_text("", "utf-8")
    done = access_av("study", "bends", "--out", tmp_path / "file")
    assert done.code == 2
    assert "is a file" in done.err
    done = access_av("study", "bends", "--sweep", "site.rician_k_db", "--out", tmp_path / "out")
    assert done.code == 2
    assert "KEY=a,b,c" in done.err


@pytest.mark.parametrize("more", [(), ("--json",)], ids=["text", "json"])
def test_whoever_closes_the_pipe_still_gets_the_files(
    tmp_path: Path, more: tuple[str, ...]
) -> None:
    (tmp_path / "short.toml").write_text(PLANT, "utf-8")
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "access_av", "study", "short.toml", "--runs", "2"]
    try:
        done = subprocess.run(
            [*command, "--out", "out", *more],
            cwd=tmp_path,
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=600,
            check=False,
        )
    finally:
        os.close(writing)
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr
    written = {it.name for it in (tmp_path / "out").iterdir()}
    assert {"report.html", "study.json", "manifest.json", "plant.toml"} <= written


def errors_of(name: str, errors_m: np.ndarray) -> ErrorSamples:
    """Ten drives of 100 s."""
    return ErrorSamples(name=name, errors_m=errors_m, duration_s=100.0)


def test_a_lost_drive_is_stated_first_in_its_row() -> None:
    random = np.random.default_rng(5)
    baseline = np.abs(random.normal(0.0, 0.1, (10, 1000)))
    one_lost, late, short = baseline.copy(), baseline.copy(), baseline.copy()
    one_lost[3, 600:] = 40.0
    late[:, :300] = np.inf  # the search for the first position
    short[:, 500:540] = 40.0  # 4 s
    never = baseline.copy()
    never[0] = np.inf
    unknown = baseline.copy()
    unknown[5:7, 100:] = np.inf
    held = {
        "baseline": baseline, "lost": one_lost, "late": late, "short": short, "never": never,
        "unknown": unknown, "same": baseline.copy(),
    }  # fmt: skip
    found = beside_first([errors_of(*it) for it in held.items()], [50.0])
    rows = {it.driven.name: it.in_words() for it in found}
    assert [it.driven.lost_runs for it in found] == [0, 1, 0, 0, 1, 2, 0]
    assert rows["baseline"] == "baseline"
    assert rows["same"] == "identical to the baseline"
    assert rows["lost"].startswith("LOST in 1 of 10 drives; ")
    assert rows["unknown"].startswith("LOST in 2 of 10 drives; ")
    table = compared_table(found)
    assert table["lost_runs"].to_list() == [0, 1, 0, 0, 1, 2, 0]
    assert tuple(table.columns) == TABLES["compared"].columns


@pytest.mark.parametrize(
    ("factor", "words"), [(0.5, "better: -0.0"), (2.0, "worse: +0.0"), (1.001, "no difference")]
)
def test_a_difference_is_that_of_variant_and_baseline(factor: float, words: str) -> None:
    random = np.random.default_rng(6)
    baseline = np.abs(random.normal(0.0, 0.1, (10, 1000)))
    other = factor * baseline if factor != 1.001 else np.abs(random.normal(0.0, 0.1, (10, 1000)))
    _, found = beside_first([errors_of("a", baseline), errors_of("b", other)], [50.0])
    assert found.delta_m is not None
    expected = np.median(other) - np.median(baseline)
    assert found.delta_m[0][0] == pytest.approx(expected, abs=1e-3)
    assert found.in_words().startswith(words)


@pytest.mark.parametrize(
    ("delta_m", "effect"),
    [
        ((-0.2, -0.3, -0.1), Effect.HELPS),
        ((-0.2, -0.3, 0.1), Effect.UNCERTAIN),
        ((0.2, 0.1, 0.3), Effect.HARMS),
    ],
)
def test_verdicts_are_enums_with_words_of_their_own(
    delta_m: tuple[float, float, float], effect: Effect
) -> None:
    assert Effect.of(delta_m) is effect
    for each in (*Effect, *Judgement):
        assert each.words != each.name
        assert each.badge in ("yes", "fit", "no")


def test_paired_intervals_hold_the_difference_as_often_as_they_say() -> None:
    """The runs differ more than the variants."""
    rng = np.random.default_rng(5)
    held = 0
    trials = 100
    for _ in range(trials):
        scale = np.exp(0.4 * rng.standard_normal((20, 1)))
        first = scale * np.abs(rng.standard_normal((20, 60)))
        second = 0.8 * scale * np.abs(rng.standard_normal((20, 60)))
        _, low, high = paired_difference(second, first, 50.0)
        # The median of a mixture scales by the same factor, so that the difference is a fifth of
        # the first median.
        held += low <= -0.2 * MEDIAN <= high
    # 95 of 100, minus three standard deviations of the count, minus 5 for the small number of runs.
    assert held >= 83


def _median() -> float:
    rng = np.random.default_rng(6)
    scale = np.exp(0.4 * rng.standard_normal(1_000_000))
    return float(np.median(scale * np.abs(rng.standard_normal(1_000_000))))


MEDIAN = _median()
