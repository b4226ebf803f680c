"""Every figure and verdict of a study, computed again from its tables."""

from __future__ import annotations

import html
import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av import Plant, Scenario, simulate
from access_av.run.error_bound import along_route
from access_av.statistics.paired import paired_difference
from access_av.tables.columns import TABLES
from access_av.tables.toml import tomllib
from short_plant import PLANT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


@pytest.fixture(scope="module")
def results(short_study: Path) -> Path:
    return short_study


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


def test_remedies_are_simulated_in_equal_environments(
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


def ok_shares(results: Path, variant: str) -> Any:
    """Share of the SSBs in state ok, by drive."""
    rows = pl.read_parquet(results / "drives.parquet").filter(variant=variant)
    steps = ("ok_steps", "level_steps", "suspected_steps", "unavailable_steps")
    return (rows["ok_steps"] / rows.select(pl.sum_horizontal(*steps)).to_series()).to_numpy()


def quantile(runs: int, comparisons: int) -> float:
    """Quantile of Student's t for 95 % intervals that hold together, by Bonferroni."""
    from scipy.stats import t

    return float(t.ppf(1.0 - 0.025 / comparisons, runs - 1))


def difference(values: Any, comparisons: int = 1) -> list[float]:
    """Mean of paired differences and its 95 % interval by Student's t."""
    mean, runs = values.mean(), len(values)
    half = quantile(runs, comparisons) * values.std(ddof=1) / np.sqrt(runs)
    return [mean, mean - half, mean + half]


def operating_points(results: Path) -> pl.DataFrame:
    """Operating points with their energy, name and operation."""
    return pl.read_parquet(results / "points.parquet").with_columns(
        energy_j=pl.sum_horizontal(f"{it}_value_j" for it in ("estimates", "listening", "idle")),
        name=pl.format("{}, {}, mode {} ({})", "method", "wake_up", "mode", "mode_name"),
    )


def compared(results: Path, row: Any, reference: Any) -> dict[str, Any]:
    """Differences of a point to a reference in pairs of drives, and whether it is equivalent."""
    of_both = [errors(results, it["variant"]) for it in (row, reference)]
    comparisons = operating_points(results)["variant"].n_unique() - 1
    delta_m, *ends_m = paired_difference(*of_both, 90.0)
    runs = len(of_both[0])
    wider = quantile(runs, comparisons) / quantile(runs, 1)
    delta = [delta_m, *(delta_m + wider * (it - delta_m) for it in ends_m)]
    delta_j = row["energy_j"] - reference["energy_j"]
    day_wh = [it["energy_j"] * 240 / 3600.0 + it["idle_value_w"] * 96.0 for it in (row, reference)]
    share = (day_wh[0] - day_wh[1]) / day_wh[1]
    shares = [ok_shares(results, it["variant"]) for it in (row, reference)]
    of_ok = difference(shares[0] - shares[1], comparisons)
    rank = [ORDER.index(it["judgement"]) for it in (row, reference)]
    is_accurate = (rank[0] <= rank[1] and rank[0] < 2) or delta[1] <= 0.0
    is_ok = of_ok[0] >= -0.01 or of_ok[2] >= 0.0
    return {
        "delta_m": delta,
        "delta_j": delta_j,
        "day_share": share,
        "ok_delta": of_ok,
        "is_equivalent": is_accurate and is_ok and share < 0.01,
    }


def test_the_recommended_point_has_the_fewest_changes_and_equals_the_best(
    results: Path, said: dict[str, Any], page: str
) -> None:
    points = operating_points(results)
    # The vehicle's own operation in its own mode, 0: a share of ok that is lower by more than one
    # percentage point excludes a point.
    own = ok_shares(results, "own operation").mean()
    kept = [
        bool(ok_shares(results, variant).mean() - own >= -0.01) for variant in points["variant"]
    ]
    assert True in kept
    assert not points.filter("on_front", ~pl.Series(kept)).height
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    points = points.filter(kept)
    for one in points.filter("on_front").iter_rows(named=True):
        better = points.filter(
            pl.col("energy_j") < one["energy_j"], pl.col("target_error_m") <= one["target_error_m"]
        )
        assert better.is_empty()
    best = points.row(by_predicate=pl.col("name") == said["recommended"]["best"], named=True)
    assert best["on_front"]
    for judgements in (["met"], ["met", "probably_met"]):
        meeting = points.filter("on_front", pl.col("judgement").is_in(judgements))
        if not meeting.is_empty():
            assert best["energy_j"] == meeting["energy_j"].min()
            break
    else:
        assert best["target_error_m"] == points["target_error_m"].min()
    for variant in ("own operation", best["variant"]):
        for mode in (0, best["mode"]):
            for it in points.filter(variant=variant, mode=mode).iter_rows(named=True):
                if compared(results, it, best)["is_equivalent"]:
                    assert it["name"] == chosen["name"] == said["recommended"]["name"]
                    assert said["recommended"]["best"] in page
                    return
    pytest.fail("the best point is equivalent to itself")


def test_costs_and_carbon_equal_the_sums_of_their_items(said: dict[str, Any], page: str) -> None:
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
    anchors = 3  # 35.4 m of road, one for each 15 m
    assert uwb["capital"]["central"] == pytest.approx((anchors * 400.0 + 6 * 100.0) * eur)
    kwh = (anchors * 2.0 + 6 * 0.2) * hours / 1000.0
    assert uwb["yearly"]["central"] == pytest.approx(kwh * 0.15 * eur)
    ours = ways["5G receivers, with existing computers"]
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


def test_tabulated_positions_lie_on_the_road(
    results: Path, said: dict[str, Any], page: str
) -> None:
    places = pl.read_csv(results / "places.csv")
    assert places["along_m"].to_list()[:3] == [0.5, 1.5, 2.5]
    assert (places["passes"] == (places["target_error_m"] <= 0.2)).all()
    worst = max(said["worst"], key=lambda it: it["error_m"])
    assert worst["error_m"] == pytest.approx(places["target_error_m"].max(), abs=1e-4)
    assert all(it["why"] for it in said["worst"])
    assert "These figures every 2 m" in page
    exact = pl.read_parquet(results / "places.parquet")
    for name in ("target_error_m", "median_error_m", "bound_m"):
        assert f"{exact[name][10]:.3f} m" in page
        assert np.allclose(places[name], exact[name], atol=1e-4)
    # Protection levels and reliability, computed again from the table of errors.
    route = along_route(Plant.from_toml(PLANT).scenario())
    rows = pl.read_parquet(results / "errors.parquet").filter(variant="unchanged")
    along_m = np.interp(rows["time_s"], route["time_s"], route["along_m"])
    near = rows.filter(pl.Series(np.abs(along_m - 10.5) <= 5.0))["protection_level_m"]
    at = places.row(10, named=True)
    assert at["reliable_share"] == pytest.approx(1.0 - near.null_count() / len(near), abs=1e-4)
    assert at["level_m"] == pytest.approx(near.quantile(0.5, "lower"), abs=1e-3)
    # On the straight before the first bend, distance and coordinates agree.
    straight = places.filter(pl.col("along_m") < 19.0)
    assert np.allclose(straight["x_m"], straight["along_m"], atol=1e-3)
    # One degree of both angles on a straight, by hand.
    at = places.row(5, named=True)
    heads = np.array([[10.0, 20.0], [60.0, 10.0]])
    away = heads - [at["x_m"], at["y_m"]]
    known = ((away[:, 1] / (away**2).sum(axis=1)) ** 2).sum()
    assert at["along_road_error_per_degree_m"] == pytest.approx(
        np.radians(1.0) / np.sqrt(known), rel=1e-3
    )


def test_variants_are_compared(results: Path, page: str) -> None:
    compared = pl.read_parquet(results / "compared.parquet").filter(percent=90.0)
    assert compared["variant"].to_list() == ["unchanged", "site.rician_k_db = 3"]
    first, second = compared["percentile_m"]
    assert first == pytest.approx(percentile(errors(results, "unchanged"), 90))
    assert compared["delta_m"].to_list() == [None, pytest.approx(second - first)]
    assert "site.rician_k_db = 3" in page


@pytest.mark.parametrize(
    ("file", "table"),
    [
        ("errors", "position_errors"),
        ("drives", "runs"),
        ("targets", "study_targets"),
        ("places", "positions"),
        ("points", "operating_points"),
        ("compared", "compared"),
        ("trajectories", "trajectories"),
    ],
)
def test_study_tables_have_the_documented_columns(results: Path, file: str, table: str) -> None:
    found = pl.read_parquet(results / f"{file}.parquet").columns
    assert tuple(found) == TABLES[table].of(f"`{file}.parquet`")


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


def test_each_target_is_evaluated_on_its_section_and_all_by_the_worst(
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
        assert mine["target"].to_list() == ["whole trip", "gate <i>", "3 to 12 m"]
        assert mine["from_m"].to_list()[1:] == [23.0, 3.0]
        assert mine["to_m"].to_list()[1:] == [33.0, 12.0]
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
    points = pl.read_parquet(results / "points.parquet")
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    sums = drives.filter(variant=chosen["variant"]).select(pl.sum(*steps)).row(0, named=True)
    of_chosen = sums["ok_steps"] / sum(sums.values())
    assert f"State ok: {of_chosen:.1%} of the time" in page
    assert said["recommended"]["ok_share"] == pytest.approx(of_chosen)
    pairs = ok_shares(results, chosen["variant"]) - ok_shares(results, "own operation")
    expected = difference(pairs)
    stated = [said["recommended"][f"ok_delta{end}"] for end in ("", "_low", "_high")]
    assert stated == pytest.approx(expected, abs=1e-9)
    ends = [re.sub(r"^[+-](0\.0)$", r"\1", f"{100.0 * it:+.1f}") for it in expected]
    assert f"{ends[0]} points ({ends[1]} to {ends[2]})" in page
    assert expected[0] >= -0.01
    assert "at most 1 percentage point below that of the vehicle's own operation" in page
    assert said["alert_limit_m"] == pytest.approx(0.4)
    assert "alert limit 0.4 m (twice the target’s 0.2 m)" in page


def test_run_accepts_the_recommended_point(
    results: Path, said: dict[str, Any], access_av: Callable[..., Any], tmp_path: Path
) -> None:
    file = results / "recommended.toml"
    done = access_av("run", file, "--runs", "1", "--out", tmp_path / "run")
    assert done.code == 0, done.err
    text = file.read_text("utf-8")
    assert "# Candidates: points whose share of time in state ok is at most 1 percentage" in text
    written = tomllib.loads(text)
    for key, value in said["recommended"]["settings"].items():
        held = written
        for name in key.split("."):
            held = held[name]
        expected = value if isinstance(value, dict) else {"": value}
        found = held if isinstance(value, dict) else {"": held}
        assert {name: found[name] for name in expected} == expected
    # Its drives are those of the study.
    points = pl.read_parquet(results / "points.parquet").filter("recommended")
    drives = pl.read_parquet(results / "drives.parquet").filter(variant=points["variant"][0])
    scenario = Scenario.load(str(file))
    again = simulate(scenario, runs=drives.height, seed=drives["seed"][0], errors_every=5)
    assert again.runs["aoa_estimates"].to_list() == drives["aoa_estimates"].to_list()
    assert again.errors_m is not None
    mine = errors(results, points["variant"][0])
    assert pytest.approx(mine, rel=1e-5) == np.hypot(*again.errors_m.T).T
    trip_j = said["recommended"]["trip_j"]
    assert trip_j["low"] <= again.runs["energy_j"].mean() <= trip_j["high"]


def test_rivals_are_compared_in_pairs_and_equivalence_is_reported(
    results: Path, said: dict[str, Any], page: str
) -> None:
    points = operating_points(results)
    chosen = points.row(by_predicate=pl.col("recommended"), named=True)
    for rival in said["rivals"]:
        row = points.row(by_predicate=pl.col("name") == rival["name"], named=True)
        expected = compared(results, row, chosen)
        for key in ("delta_m", "ok_delta"):
            name = key.removesuffix("_m")
            unit = key.removeprefix(name)
            found = [rival[f"{name}{end}{unit}"] for end in ("", "_low", "_high")]
            assert found == pytest.approx(expected[key], abs=1e-9)
        assert rival["delta_j"] == pytest.approx(expected["delta_j"])
        assert rival["day_share"] == pytest.approx(expected["day_share"])
        assert rival["is_equivalent"] == expected["is_equivalent"]
    # All other operations in the recommended mode, and the recommended one in all other modes.
    operation = ["method", "wake_up"]
    same = pl.all_horizontal(pl.col(key) == chosen[key] for key in operation)
    others = points.filter(~same, pl.col("mode") == chosen["mode"])
    modes = points.filter(same, ~pl.col("recommended"))
    assert {it["name"] for it in said["rivals"]} == {*others["name"], *modes["name"]}
    assert modes.height == 7
    assert others.height == 5
    names = {*others["name"]}
    equal = sum(it["is_equivalent"] for it in said["rivals"] if it["name"] in names)
    assert f"{equal} of 5 other operations are equivalent to the recommended point" in page
    assert said["recommended"]["name"] in page
