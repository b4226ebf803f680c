"""Every figure and verdict of the evaluation, computed again from its tables.

This file uses NumPy, polars and ``paper.toml`` alone: none of the project's statistics or rules.
"""

from __future__ import annotations

import html
import json
import math
import re
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av.tables.toml import tomllib
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

METHODS = ("music", "esprit", "root_music")
MODES = range(8)
STATED = tomllib.loads((ROOT / "python/access_av/paper/paper.toml").read_text(encoding="utf-8"))
CLAIMS: dict[str, Any] = STATED["claims"]
DAY_S = 86_400.0
# Claims that follow from settings or from other figures of the paper. They are checked by
# `test_arithmetic_claims_are_recomputed`.
WITHOUT_TABLES = {
    *("x1", "x2", "x3", "x4", "x5", "x6", "x7", "x8"),
    *("e9", "e10", "c1", "c2", "c4"),
}


class Tables:
    """The files of one evaluation."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.claims = json.loads((path / "claims.json").read_text(encoding="utf-8"))
        self.page = (path / "report.html").read_text(encoding="utf-8")
        self.manifest = json.loads((path / "manifest.json").read_text(encoding="utf-8"))

    def table(self, name: str) -> pl.DataFrame:
        return pl.read_parquet(self.path / f"{name}.parquet")

    @cached_property
    def points(self) -> pl.DataFrame:
        return self.table("operating_points")

    @cached_property
    def errors(self) -> pl.DataFrame:
        return self.table("errors")

    @cached_property
    def runs(self) -> pl.DataFrame:
        return self.table("evaluation_runs")

    @cached_property
    def resamples(self) -> pl.DataFrame:
        return self.table("resamples")

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Bootstrap weights: 200 draws of whole runs, seed 0, after the sample itself."""
        runs = self.manifest["runs"]
        drawn = np.random.default_rng(0).multinomial(runs, np.full(runs, 1 / runs), size=200)
        return np.vstack([np.full(runs, 1 / runs), drawn / runs])


class Interpretation:
    """One interpretation: its figures as arrays over the sample (first) and its resamples."""

    def __init__(self, tables: Tables, name: str) -> None:
        self.tables, self.name = tables, name
        self.points = tables.points.filter(interpretation=name)
        self.errors = tables.errors.filter(interpretation=name)
        self.runs = tables.runs.filter(interpretation=name)
        self.trip_s = float(self.errors["time_s"].max())  # type: ignore[arg-type]

    def point(self, campaign: str, method: str, mode: int | None = None) -> dict[str, Any]:
        rows = self.points.filter(campaign=campaign, method=method)
        rows = rows.filter(pl.col("mode").is_null() if mode is None else pl.col("mode") == mode)
        return rows.row(0, named=True)

    def series(self, campaign: str, method: str, mode: int | None = None) -> pl.DataFrame:
        point = self.point(campaign, method, mode)
        keys = ("method", "adaptive", "base_wake_up_ms")
        return self.errors.filter(*(pl.col(key) == point[key] for key in keys)).sort("time_s")

    def of_runs(self, campaign: str, method: str, mode: int | None = None) -> pl.DataFrame:
        rows = self.runs.filter(campaign=campaign, method=method, variant="")
        rows = rows.filter(pl.col("mode").is_null() if mode is None else pl.col("mode") == mode)
        return rows.sort("run")

    def drawn(self, campaign: str, method: str, mode: int | None = None) -> pl.DataFrame:
        rows = self.tables.resamples.filter(
            interpretation=self.name, campaign=campaign, method=method
        )
        rows = rows.filter(pl.col("mode").is_null() if mode is None else pl.col("mode") == mode)
        return rows.sort("resample").filter(pl.col("resample") > 0)

    def worst(self, axis: str, *case: Any) -> NDArray[np.float64]:
        sample = self.series(*case)[f"mean_abs_error_{axis}_m"].max()
        return np.concatenate([[sample], self.drawn(*case)[f"worst_error_{axis}_m"]])

    def worst_of_both(self, *case: Any) -> NDArray[np.float64]:
        return np.maximum(self.worst("x", *case), self.worst("y", *case))

    def mean_of_runs(self, column: str, *case: Any) -> NDArray[np.float64]:
        return self.tables.weights @ self.of_runs(*case)[column].to_numpy()

    def rms_m(self, *case: Any) -> NDArray[np.float64]:
        square_m2 = self.of_runs(*case)["rms_error_m"].to_numpy() ** 2
        return np.sqrt(self.tables.weights @ square_m2)

    def energy_j(self, campaign: str, method: str, mode: int) -> NDArray[np.float64]:
        per_estimate_j = self.point(campaign, method, mode)["energy_per_execution_j"]
        return per_estimate_j * self.mean_of_runs("aoa_estimates", campaign, method, mode)

    def horizontal_m(self, *case: Any) -> NDArray[np.float64]:
        series = self.series(*case)
        return np.hypot(*(series[f"mean_abs_error_{axis}_m"].to_numpy() for axis in "xy"))

    def saving(self, mode: int, method: str) -> NDArray[np.float64]:
        adaptive_j = self.energy_j("R", "music", mode)
        return 100.0 - 100.0 * adaptive_j / self.energy_j("Q", method, mode)

    def fixed_worst(self, method: str) -> NDArray[np.float64]:
        return np.max([self.worst_of_both("Q", method, mode) for mode in MODES], axis=0)


def a1(it: Interpretation) -> Any:
    return np.max([it.worst_of_both("R", "music", mode) for mode in MODES], axis=0)


def a2(it: Interpretation) -> Any:
    found = []
    for mode in MODES:
        ours_m = it.horizontal_m("R", "music", mode)
        for method in METHODS:
            sample = np.mean(ours_m < it.horizontal_m("Q", method, mode))
            drawn = it.drawn("R", "music", mode)[f"share_below_{method}"]
            found.append(np.concatenate([[sample], drawn]))
    return np.min(found, axis=0)


def a3(it: Interpretation) -> Any:
    return np.mean([it.worst_of_both("P", method) for method in METHODS], axis=0)


def worst_y(method: str) -> Callable[[Interpretation], Any]:
    def found(it: Interpretation) -> Any:
        fixed = [it.worst("y", "Q", method, mode) for mode in MODES]
        return np.max([it.worst("y", "P", method), *fixed], axis=0)

    return found


def a6(it: Interpretation) -> Any:
    return np.max([it.worst_of_both("R", "music", mode) for mode in (1, 2, 3)], axis=0)


def a7(it: Interpretation) -> Any:
    found = []
    for mode in MODES:
        for method in METHODS:
            error_m = it.horizontal_m("Q", method, mode)
            quarter = len(error_m) // 4
            sample = error_m[-quarter:].mean() / error_m[:quarter].mean()
            found.append(np.concatenate([[sample], it.drawn("Q", method, mode)["late_to_early"]]))
    return np.min(found, axis=0)


def a8(it: Interpretation) -> Any:
    others = [it.fixed_worst("music"), it.fixed_worst("root_music"), a1(it)]
    return it.fixed_worst("esprit") / np.max(others, axis=0)


def e3(it: Interpretation) -> Any:
    means = [np.mean([it.saving(mode, method) for method in METHODS], axis=0) for mode in (6, 7)]
    return np.min(means, axis=0)


def e4(it: Interpretation) -> Any:
    return np.mean([it.saving(mode, method) for mode in MODES for method in METHODS], axis=0)


def e5(it: Interpretation) -> Any:
    saved_j = it.energy_j("Q", "music", 0) - it.energy_j("R", "music", 0)
    return saved_j * DAY_S / it.trip_s / 1e3


def e7(it: Interpretation) -> Any:
    return np.min([it.saving(mode, method) for mode in MODES for method in METHODS], axis=0)


def e8(it: Interpretation) -> Any:
    ratios = []
    for method in METHODS:
        others = np.max([it.energy_j("Q", method, mode) for mode in MODES if mode], axis=0)
        ratios.append(it.energy_j("Q", method, 0) / others)
    return np.min(ratios, axis=0)


def space(it: Interpretation) -> Any:
    case = ("R", "music")
    return {
        mode: {"energy_j": it.energy_j(*case, mode), "rms_m": it.rms_m(*case, mode)}
        for mode in MODES
    }


def estimates(*modes: int) -> Callable[[Interpretation], Any]:
    def found(it: Interpretation) -> Any:
        base_ms = {
            method: max(it.point("Q", method, mode)["base_wake_up_ms"] for mode in modes)
            for method in METHODS
        }
        return {method: np.array([1e3 * it.trip_s / each]) for method, each in base_ms.items()}

    return found


FOUND: dict[str, Callable[[Interpretation], Any]] = {
    "a1_adaptive_worst_m": a1,
    "a2_adaptive_beats_fixed": a2,
    "a3_theoretical_20ms_worst_m": a3,
    "a4_esprit_worst_y_m": worst_y("esprit"),
    "a5_root_music_worst_y_m": worst_y("root_music"),
    "a6_modes_1_2_3_adaptive_worst_m": a6,
    "a7_fixed_errors_accumulate": a7,
    "a8_esprit_is_worst": a8,
    "a9_root_music_exceeds_0.3_m": lambda it: it.fixed_worst("root_music"),
    "e1_mode0_fixed_j": lambda it: {method: it.energy_j("Q", method, 0) for method in METHODS},
    "e2_mode0_executions": estimates(0),
    "e3_mode67_saving_percent": e3,
    "e3_mode67_executions": estimates(6, 7),
    "e4_average_saving_percent": e4,
    "e5_mode0_saved_per_day_kj": e5,
    "e6_fleet_of_100_saved_per_day_mj": lambda it: 0.1 * e5(it),
    "e7_saves_in_every_mode": e7,
    "e8_most_in_mode_0": e8,
    "d1_budget_210_j": space,
    "d2_budget_260_j_rms_015_m": space,
    "c3_accurate_and_saving": lambda it: {"worst_m": a1(it), "saving_percent": e4(it)},
}


def margin(entry: dict[str, Any], value: Any) -> NDArray[np.float64]:
    """Returns the margin of a value under its rule, relative to the stated value."""
    rule, stated = entry["rule"], entry["stated"]
    if rule in ("at_most", "above", "about"):
        pairs = (
            [(stated[key], value[key]) for key in stated]
            if isinstance(stated, dict)
            else [(stated, value)]
        )
        if rule == "at_most":
            found = [(bound - np.asarray(each)) / bound for bound, each in pairs]
        elif rule == "above":
            found = [(np.asarray(each) - bound) / (bound or 1.0) for bound, each in pairs]
        else:
            allowed = entry.get("tolerance", 0.0)
            found = [allowed - np.abs(np.asarray(each) - it) / it for it, each in pairs]
        return np.min(np.broadcast_arrays(*found), axis=0)
    if rule == "both":
        worst = 1.0 - value["worst_m"] / stated["worst_m"]
        saving = stated["saving_percent"]
        near = entry["tolerance"] - np.abs(value["saving_percent"] - saving) / saving
        return np.minimum(worst, near)
    query = entry["query"]
    if rule == "modes":
        energy = [1.0 - value[mode]["energy_j"] / query["max_energy_j"] for mode in stated]
        rms = [1.0 - value[mode]["rms_m"] / query["max_rms_m"] for mode in stated]
        return np.min([*energy, *rms], axis=0)
    assert rule == "query"
    best = value[stated["best_mode"]]
    rivals = [each for mode, each in value.items() if mode != stated["best_mode"]]
    return np.min(
        [
            1.0 - best["energy_j"] / query["max_energy_j"],
            *(each["energy_j"] / best["energy_j"] - 1.0 for each in rivals),
            entry["tolerance"] - np.abs(best["energy_j"] / stated["energy_j"] - 1.0),
            1.0 - best["rms_m"] / stated["rms_below_m"],
        ],
        axis=0,
    )


def close(found: Any, expected: Any) -> None:
    """Reported figures are rounded to four decimals."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            close(found[key], value)
    elif expected is None or isinstance(expected, list):
        assert found == expected if expected is None else np.allclose(found, expected, atol=1e-4)
    else:
        assert found == pytest.approx(expected, abs=1.01e-4, rel=2e-6)


def interval(value: Any) -> Any:
    if isinstance(value, dict):
        if any(isinstance(each, dict) for each in value.values()):
            return None
        each = {key: interval(it) for key, it in value.items()}
        return each if any(each.values()) else None
    drawn = np.asarray(value)[1:]
    if len(drawn) < 2 or np.ptp(drawn) < 1e-9 * abs(drawn[0]):
        return None
    return [float(np.quantile(drawn, share)) for share in (0.025, 0.975)]


@pytest.fixture(scope="module")
def tables(quick_study: Path) -> Tables:
    return Tables(quick_study / "latest")


@pytest.fixture(scope="module", params=["every-ssb", "gate"])
def interpretation(request: pytest.FixtureRequest, tables: Tables) -> Interpretation:
    return Interpretation(tables, request.param)


def test_every_claim_has_a_recomputation() -> None:
    rest = {name for name in CLAIMS if name not in FOUND}
    assert {name.split("_")[0] for name in rest} == WITHOUT_TABLES


@pytest.mark.parametrize("name", FOUND)
def test_a_claim_is_recomputed_from_the_tables(name: str, interpretation: Interpretation) -> None:
    [claim] = [
        it
        for it in interpretation.tables.claims
        if (it["interpretation"], it["id"]) == (interpretation.name, name)
    ]
    entry, value = CLAIMS[name], FOUND[name](interpretation)
    by = np.atleast_1d(margin(entry, value))
    # Figures and bounds use the original sample.
    if entry["rule"] == "modes":
        within = [
            mode
            for mode, each in value.items()
            if each["energy_j"][0] <= entry["query"]["max_energy_j"]
            and each["rms_m"][0] <= entry["query"]["max_rms_m"]
        ]
        assert claim["obtained"] == within
    elif entry["rule"] == "query":
        budget_j = entry["query"]["max_energy_j"]
        within_j = {
            mode: each["energy_j"][0]
            for mode, each in value.items()
            if each["energy_j"][0] <= budget_j
        }
        best = min(within_j, key=lambda mode: within_j[mode])
        close(claim["obtained"]["energy_j"], within_j[best])
        close(claim["obtained"]["rms_m"], float(value[best]["rms_m"][0]))
        assert claim["obtained"]["best_mode"] == best
    elif isinstance(value, dict):
        close(claim["obtained"], {key: float(each[0]) for key, each in value.items()})
    else:
        close(claim["obtained"], float(value[0]))
    # Verdict, by the kind of evidence.
    given = claim["evidence"] in ("arithmetic", "by construction")
    words = ("agrees", "differs") if given else ("reproduced", "not reproduced")
    if abs(by[0]) > 1e-9:
        assert claim["verdict"] == words[0 if by[0] >= 0.0 else 1]
    # Interval and sensitivity to the seed: the resamples.
    close(claim["interval"], interval(value))
    spread = float(np.std(by[1:])) if len(by) > 2 else 0.0
    safe = 2.58 * math.sqrt(2.0) * spread
    if abs(abs(by[0]) - safe) > 1e-6:
        assert claim["seed_sensitive"] == (abs(by[0]) < safe)
    if claim["deviation"] is not None:
        assert claim["deviation"] == pytest.approx(
            abs(float(np.atleast_1d(margin({**entry, "tolerance": 0.0}, value))[0])), abs=1e-4
        )


def test_arithmetic_claims_are_recomputed(tables: Tables) -> None:
    claims = {it["id"].split("_")[0]: it for it in tables.claims if it["interpretation"] == "gate"}
    speed_mps = 15.0 / 3.6
    close(
        claims["x4"]["obtained"],
        {"speed_mps": speed_mps, "one_metre_ms": 1e3 / speed_mps, "two_metres_ms": 2e3 / speed_mps},
    )
    close(claims["e10"]["obtained"], 39.884 / 3.6 / STATED["day"]["refrigerator_kwh"])
    close(claims["c1"]["obtained"], 4000.0 / 30.71)
    close(
        claims["c2"]["obtained"],
        {"capital_low": 4 * 13e3, "capital_high": 4 * 15e3, "yearly": 4 * 2.4e3},
    )
    platform = tomllib.loads((tables.path / "platform.toml").read_text(encoding="utf-8"))
    modes = [
        [
            it["mode"],
            it["cpu_mhz"],
            *(it["base_wake_up_ms"][each.replace("_", "-")] for each in METHODS),
        ]
        for it in platform["modes"]
    ]
    assert np.allclose(claims["x2"]["obtained"], modes)
    assert np.allclose(claims["x2"]["stated"], modes, rtol=1e-3) == (
        claims["x2"]["verdict"] == "agrees"
    )
    fastest = [max(row[1] for row in modes), *(min(row[it] for row in modes) for it in (2, 3, 4))]
    assert np.allclose([*claims["e9"]["obtained"].values()], fastest)
    assert claims["x7"]["obtained"] == {"runs": tables.manifest["runs"]}


def test_operating_points_and_resamples_follow_from_the_runs(
    interpretation: Interpretation,
) -> None:
    for point in interpretation.points.iter_rows(named=True):
        case = (point["campaign"], point["method"], point["mode"])
        runs, drawn = interpretation.of_runs(*case), interpretation.drawn(*case)
        assert runs.height == interpretation.tables.manifest["runs"]
        assert point["aoa_estimates"] == pytest.approx(runs["aoa_estimates"].mean())
        assert point["rms_error_m"] == pytest.approx(interpretation.rms_m(*case)[0], rel=1e-5)
        assert np.allclose(drawn["rms_error_m"], interpretation.rms_m(*case)[1:], rtol=1e-5)
        aoa_estimates = interpretation.mean_of_runs("aoa_estimates", *case)
        assert np.allclose(drawn["aoa_estimates"], aoa_estimates[1:], rtol=1e-9)
        for axis in "xy":
            worst_m = interpretation.series(*case)[f"mean_abs_error_{axis}_m"].max()
            assert point[f"worst_error_{axis}_m"] == pytest.approx(worst_m)
            # A mean over runs does not exceed the maximum of the runs.
            assert worst_m <= runs[f"max_error_{axis}_m"].max() * (1.0 + 1e-5)
        if point["mode"] is None:
            assert runs["energy_j"].null_count() == runs.height
            continue
        energy_j = point["energy_per_execution_j"] * runs["aoa_estimates"].to_numpy()
        assert np.allclose(runs["energy_j"], energy_j, rtol=1e-9)
        assert point["energy_j"] == pytest.approx(float(energy_j.mean()))


def test_shares_of_single_trips_are_over_every_ssb(interpretation: Interpretation) -> None:
    [claim] = [
        it
        for it in interpretation.tables.claims
        if it["interpretation"] == interpretation.name and it["id"].startswith("a1_")
    ]
    trips = []
    for mode in MODES:
        runs = interpretation.of_runs("R", "music", mode)
        trips.append(runs.select(pl.max_horizontal("max_error_x_m", "max_error_y_m")).to_numpy())
    share = min(float(np.mean(worst_m <= 0.3)) for worst_m in trips)
    p99_m = max(float(np.quantile(worst_m, 0.99)) for worst_m in trips)
    close(claim["spread"]["share_of_trips_within_bound"], share)
    close(claim["spread"]["worst_error_of_a_trip_p99_m"], p99_m)


def test_the_maximum_of_a_run_is_over_every_ssb(interpretation: Interpretation) -> None:
    """One drive simulated again, with all its errors: the first run of mode 0."""
    import access_av
    from access_av.paper.interpretations import load

    scenario = load(interpretation.name).scenario.with_overrides(
        {"vehicle.platform.mode": 0, "vehicle.estimator.method": "music"}
    )
    found = access_av.simulate(
        scenario, runs=1, seed=interpretation.tables.manifest["seed"], keep_trajectories=True
    )
    assert found.trajectories is not None
    runs = interpretation.of_runs("R", "music", 0)
    for axis in "xy":
        error_m = (pl.col(f"{axis}_m") - pl.col(f"true_{axis}_m")).abs().max()
        worst_m = found.trajectories.select(error_m).item()
        assert runs[f"max_error_{axis}_m"][0] == pytest.approx(worst_m, rel=1e-5)


def test_comparisons_can_be_computed_from_the_runs(tables: Tables) -> None:
    def rms_m(rows: pl.DataFrame) -> NDArray[np.float64]:
        return np.sqrt(tables.weights @ rows.sort("run")["rms_error_m"].to_numpy() ** 2)

    def ends(values: NDArray[np.float64]) -> list[float]:
        return [float(np.quantile(values[1:], share)) for share in (0.025, 0.975)]

    ablations = tables.table("ablations")
    assert ablations.height == 8
    for row in ablations.iter_rows(named=True):
        key = {"interpretation": row["interpretation"], "mode": row["mode"]}
        mine = rms_m(tables.runs.filter(campaign="R", **key))
        constant = rms_m(tables.runs.filter(campaign="constant", **key))
        gain_m = constant - mine
        low_m, high_m = ends(gain_m)
        expected = [mine[0], constant[0], gain_m[0], low_m, high_m]
        names = ("rms_error_m", "constant_rms_m", "gain_m", "gain_low_m", "gain_high_m")
        assert np.allclose([row[name] for name in names], expected, rtol=1e-4, atol=1e-6)
        least_m = 0.05 * mine[0]
        assert row["matters"] == (1 if low_m > least_m else -1 if high_m < -least_m else 0)
    shown = {"interpretation": "gate"}
    for row in tables.table("proposed_vs_paper").iter_rows(named=True):
        papers = tables.runs.filter(campaign="R", mode=row["mode"], **shown)
        road = "road map" if row["map"] else "no road map"
        ours = tables.runs.filter(campaign="tracker", mode=row["mode"], variant=road, **shown)
        less_m = rms_m(papers) - rms_m(ours)
        names = ("rms_error_reduction_m", "rms_error_reduction_low_m", "rms_error_reduction_high_m")
        expected = [less_m[0], *ends(less_m)]
        assert np.allclose([row[name] for name in names], expected, rtol=1e-4, atol=1e-6)
        means = [float(it["aoa_estimates"].to_numpy().mean()) for it in (ours, papers)]
        assert np.allclose([row["aoa_estimates"], row["papers_aoa_estimates"]], means)
        assert row["energy_j"] == pytest.approx(float(ours["energy_j"].to_numpy().mean()))
    for row in (
        tables.table("equal_information").filter(pl.col("who") != "bound").iter_rows(named=True)
    ):
        odometer = "real odometer" if row["real_odometer"] else "exact odometer"
        road = "road map" if row["map"] else "no road map"
        variant = f"{odometer}, {road}, {row['who']}"
        found = rms_m(tables.runs.filter(campaign="equal", variant=variant))
        names = ("rms_error_m", "rms_low_m", "rms_high_m")
        assert np.allclose([row[name] for name in names], [found[0], *ends(found)], rtol=1e-4)
    for row in tables.table("fixed_front").iter_rows(named=True):
        runs = tables.runs.filter(campaign="front", base_wake_up_ms=row["base_wake_up_ms"])
        assert row["rms_error_m"] == pytest.approx(rms_m(runs)[0], rel=1e-4)
        assert row["aoa_estimates"] == pytest.approx(float(runs["aoa_estimates"].to_numpy().mean()))


def rows_of(page: str, head: str) -> list[list[str]]:
    """Cells of a table of the page as text, by the text of one of its head cells."""
    for table in re.findall(r"<table.*?</table>", page, re.S):
        heads = [plain(it) for it in re.findall(r"<th[^>]*>(.*?)</th>", table, re.S)]
        if head in heads:
            body = table.split("<tbody>")[1]
            return [
                [plain(it) for it in re.findall(r"<td[^>]*>(.*?)</td>", row, re.S)]
                for row in re.findall(r"<tr>(.*?)</tr>", body, re.S)
            ]
    raise AssertionError(head)


def plain(cell: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", cell)).split())


def test_the_report_shows_the_values_of_its_tables(tables: Tables) -> None:
    gate = [it for it in tables.claims if it["interpretation"] == "gate"]
    # Claims: verdict, kind of evidence and deviation.
    shown = rows_of(tables.page, "Verdict")
    assert len(shown) == len(gate)
    for claim, cells in zip(gate, shown, strict=True):
        assert claim["id"] in cells[0]
        given = claim["evidence"] in ("arithmetic", "by construction")
        words = f"{claim['evidence']}: {claim['verdict']}" if given else claim["verdict"]
        assert cells[5].startswith(words)
        assert ("depends on the seed" in cells[5]) == claim["seed_sensitive"]
        if claim["tolerance"] is not None and claim["tolerance"] >= 0.01:
            percent = f"deviation {100 * claim['deviation']:.0f}%"
            assert percent in cells[2]
        if isinstance(claim["obtained"], float):
            figure = float(cells[2].split()[0].replace(",", ""))
            assert figure == pytest.approx(claim["obtained"], rel=1e-2, abs=5e-4)
    # Tiles: claims by kind of evidence, those without evidence not counted as reproduced.
    tiles = re.findall(r'<div class="tile"><b>(.*?)</b><span>(.*?)</span>', tables.page)
    for kind, words in (
        ("calibrated", "calibrated claims reproduced"),
        ("by construction", "claims agree by construction, not counted as reproduced"),
        ("arithmetic", "claims agree by arithmetic, not counted as reproduced"),
    ):
        judged = [it for it in gate if it["evidence"] == kind and it["verdict"] != "not judged"]
        met = sum(it["verdict"] in ("reproduced", "agrees") for it in judged)
        [tile] = [value for value, text in tiles if html.unescape(text).startswith(words)]
        assert tile == f"{met} of {len(judged)}"
    # Power modes.
    modes = rows_of(tables.page, "Clock / MHz")
    for row, cells in zip(CLAIMS["x2_power_modes"]["stated"], modes, strict=True):
        assert [float(it.split()[0]) for it in cells[1:]] == [float(each) for each in row[1:]]
    # Errors and energies.
    points = tables.points.filter(interpretation="gate")
    for cells in rows_of(tables.page, "Worst X / m"):
        method, adaptive = cells[0].removeprefix("Adaptive "), cells[0].startswith("Adaptive")
        label = {"MUSIC": "music", "ESPRIT": "esprit", "Root-MUSIC": "root_music"}[method]
        mode = None if cells[1] == "every SSB" else int(cells[1].split(",")[0])
        row = points.filter(method=label, adaptive=adaptive)
        chosen = pl.col("mode").is_null() if mode is None else pl.col("mode") == mode
        row = row.filter(chosen)
        names = ("worst_error_x_m", "worst_error_y_m", "rms_error_m")
        assert np.allclose([float(it) for it in cells[3:]], row.select(names).row(0), atol=6e-4)
    for mode, cells in enumerate(rows_of(tables.page, "Saved / %")):
        fixed = points.filter(campaign="Q", mode=mode)["energy_j"].to_list()
        adaptive_j = points.filter(campaign="R", mode=mode)["energy_j"].item()
        saved = np.mean([100.0 - 100.0 * adaptive_j / each for each in fixed])
        figures = [float(it.split()[0]) for it in cells[1:6]]
        assert np.allclose(figures, [*fixed, adaptive_j, saved], atol=0.051)
    assert "The source of the paper contains no figures" in tables.page


def test_claim_groups_follow_from_the_verdicts(tables: Tables) -> None:
    for cells, name in zip(
        rows_of(tables.page, "Accuracy claims"), tables.manifest["interpretations"], strict=True
    ):
        met = {
            it["id"]
            for it in tables.claims
            if it["interpretation"] == name and it["verdict"] in ("reproduced", "agrees")
        }
        accuracy = met >= {"a1_adaptive_worst_m", "a2_adaptive_beats_fixed"}
        energy = met >= {"e3_mode67_saving_percent", "e4_average_saving_percent"}
        assert [cells[1] == "hold", cells[2] == "hold"] == [accuracy, energy]
        adaptive = tables.runs.filter(interpretation=name, campaign="R")
        assert cells[3].endswith(f"{adaptive['longest_gap_s'].max():.2f} s")


def test_claim_counts_of_each_fit_are_recomputed(tables: Tables) -> None:
    """The row of the shipped fit has the numbers of the listed claims."""
    gate = [it for it in tables.claims if it["interpretation"] == "gate"]
    counts = [
        sum(it["verdict"] == "reproduced" for it in gate),
        sum(it["verdict"] == "agrees" and it["evidence"] == "by construction" for it in gate),
        sum(it["verdict"] == "agrees" and it["evidence"] == "arithmetic" for it in gate),
    ]
    row = tables.table("fit_degrees_of_freedom").row(2, named=True)
    names = ("claims_reproduced", "agree_by_construction", "agree_by_arithmetic")
    assert [row[name] for name in names] == counts
    [e4] = [it["obtained"] for it in gate if it["id"] == "e4_average_saving_percent"]
    close(row["average_saving_percent"], e4)


def test_cost_and_carbon_of_the_report_are_recomputed(tables: Tables) -> None:
    """Roadside units, saved energy and emissions, from the shipped prices and emission factors."""
    folder = ROOT / "python/access_av/economics"
    prices, carbon = (
        tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8"))
        for name in ("prices", "carbon")
    )
    units, fleet = 4, STATED["day"]["fleet"]
    # Energy saved in mode 0: fixed minus adaptive MUSIC, for continuous trips.
    gate = Interpretation(tables, "gate")
    trip_j = float((gate.energy_j("Q", "music", 0) - gate.energy_j("R", "music", 0))[0])
    words = plain(tables.page)
    found = re.search(
        r"4 roadside units would cost ([\d,]+) to ([\d,]+) USD and ([\d,]+) USD a year .*?"
        r"trips of ([\d.]+) s driven (\d+)% of the day, one vehicle saves ([\d.]+) kJ a day .*?"
        r"saves ([\d.]+) MJ",
        words,
    )
    assert found is not None
    low, high, yearly, trip_s, duty, vehicle_kj, fleet_mj = (
        float(it.replace(",", "")) for it in found.groups()
    )
    assert low == units * prices["roadside_unit"]["low"]
    assert high == units * prices["roadside_unit"]["high"]
    assert yearly == units * prices["roadside_unit_yearly"]["value"]
    assert trip_s == pytest.approx(gate.trip_s, abs=0.1)
    day_j = trip_j * DAY_S * (duty / 100.0) / trip_s
    # The page rounds the trip to 0.1 s and the share of the day to 1 %.
    assert vehicle_kj == pytest.approx(day_j / 1e3, rel=0.01)
    assert fleet_mj == pytest.approx(vehicle_kj * fleet / 1e3, rel=0.01)
    # Emissions, low to high: power times lifetime times intensity of the grid.
    grids = {name: it for name, it in carbon["grid"].items() if name != "source"}
    things = carbon["things"]
    rows = {cells[0].lower(): cells for cells in rows_of(tables.page, "gCO2e/kWh")}
    assert rows.keys() == {*grids, "embodied"}

    def spans(cell: str) -> list[float]:
        central, ends = cell.replace(",", "").rstrip(")").split(" (")
        least, most = ends.split("–")
        return [float(it) for it in (least, central, most)]

    def figure(key: str) -> dict[str, float]:
        found = prices[key]
        return {"low": found["low"], "central": found["value"], "high": found["high"]}

    for name, intensity in grids.items():
        cells = rows[name]
        assert float(cells[1]) == intensity
        for cell, thing, count in (
            (cells[2], "roadside_unit", units),
            (cells[3], "onboard_box", 1),
        ):
            life_h = things[thing]["lifetime_h"]
            watts = things[thing].get("power_w") or figure(things[thing]["power"])
            kg = [
                count * watts[it] * life_h[it] * intensity / 1e6
                for it in ("low", "central", "high")
            ]
            assert np.allclose(spans(cell), kg, atol=0.51)
        saved_kg = fleet_mj / 3.6 * 365.0 * intensity / 1e3
        assert float(cells[4].replace(",", "")) == pytest.approx(saved_kg, rel=0.01, abs=0.51)
    for cell, thing, count in zip(
        rows["embodied"][2:4], ("roadside_unit", "onboard_box"), (units, 1), strict=True
    ):
        made = figure(things[thing]["embodied"])
        kg = [count * made[it] for it in ("low", "central", "high")]
        assert np.allclose(spans(cell), kg, atol=0.51)
