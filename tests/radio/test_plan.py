"""Candidate masts, service levels, integrity campaigns."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import InputError, Scenario, bound, columns, plan, service_levels, simulate
from access_av.radio.upgrades import next_level
from access_av.run.campaign import Campaign, ResultCache
from access_av.run.fault_injection import SIZES, hypotheses, mismatches
from access_av.run.integrity_campaign import Case, drive
from access_av.verdicts import LevelResult

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

# Everything is exact except the odometer.
YARD = Scenario.load("yard").with_overrides(
    {
        "vehicle.array": {},
        "vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0},
        **{f"site.radio_heads[{head}].position_std_m": 0.0 for head in range(4)},
    }
)
SHORT = YARD.with_overrides(
    {"site.road.polyline_m": [[-140.0, 0.0], [-20.0, 0.0]], "motion.stops": []}
)
MASTS = pl.DataFrame(
    {
        "name": ["a", "b", "c", "d"],
        "x_m": [-120.0, -80.0, -60.0, -10.0],
        "y_m": [-30.0, 25.0, -60.0, 30.0],
        "z_m": [0.0, 0.0, 0.0, 0.0],
    }
)


def p90_m(names: list[str]) -> float:
    """Returns the bound with these masts, computed directly."""
    heads = json.loads(SHORT.site.to_json())["radio_heads"]
    chosen = MASTS.filter(pl.col("name").is_in(names))
    new = [
        {"position_m": [x_m, y_m, z_m], "pci": 500 + row}
        for row, (_, x_m, y_m, z_m) in enumerate(chosen.rows())
    ]
    equipped = SHORT.with_overrides({"site.radio_heads": [*heads, *new]})
    from access_av import _core

    return float(np.quantile(_core.Bound(equipped).along_route()["bound_m"], 0.9))


def test_the_first_mast_is_the_best_candidate() -> None:
    found = plan(SHORT, MASTS)
    alone = {name: p90_m([name]) for name in MASTS["name"]}
    assert found.chosen == [min(alone, key=alone.__getitem__)]
    assert math.isclose(found.after_m, min(alone.values()), rel_tol=1e-9)
    assert tuple(found.ranking.columns) == columns.TABLES["radio_heads"].of("`masts.parquet`")
    two = plan(SHORT, MASTS, add=2)
    pairs = [(a, b) for a in MASTS["name"] for b in MASTS["name"] if a < b]
    assert two.after_m <= 1.05 * min(p90_m(list(pair)) for pair in pairs)
    assert two.after_m < found.after_m < found.before_m


def test_new_radio_heads_use_free_ssb_indices() -> None:
    heads = json.loads(SHORT.site.to_json())["radio_heads"]
    two = SHORT.with_overrides({"site.radio_heads": heads[:2]})
    equipped = json.loads(plan(two, MASTS, add=2).scenario.site.to_json())["radio_heads"]
    assert [head["ssb_index"] for head in equipped] == [0, 1, 2, 3]


def test_the_suggested_upgrades_reach_the_next_service_level() -> None:
    planned = plan(YARD)
    found = next_level(YARD, planned)
    assert found is not None
    assert found.level.name == "6"
    assert 0.0 < found.short_share < 1.0
    assert found.cheapest is not None
    assert found.cheapest.what == "half the odometer's errors"
    odometer = json.loads(YARD.vehicle.to_json())["odometer"]
    better = {
        f"vehicle.odometer.{key}": 0.5 * odometer[key]
        for key in ("scale_std", "noise_m_per_sqrt_m", "noise_m_per_sqrt_s")
    }
    mended = bound(YARD.with_overrides(better)).verdicts
    levels = {verdict.level.name: verdict for verdict in mended}
    assert levels["6"].reached
    assert math.isclose(levels["6"].share, found.cheapest.share, rel_tol=1e-12)
    shares = {change.what: change.share for change in found.changes}
    assert all(found.share < share for share in shares.values())
    # The reached service levels are equal with the radio heads of the plan.
    shares_by_level = {it.level.name: it.share for it in bound(planned.scenario).verdicts}
    assert math.isclose(
        shares[f"a radio head at {planned.chosen[0]}"], shares_by_level["6"], rel_tol=1e-12
    )


def test_a_site_at_the_highest_level_has_no_next_one() -> None:
    exact = {"vehicle.odometer.scale_std": 0.0, "vehicle.odometer.noise_m_per_sqrt_m": 1e-4}
    best = SHORT.with_overrides(exact)
    assert next_level(best, plan(best)) is None


def test_the_command_plans_and_rejects_invalid_input(
    tmp_path: Path, access_av: Callable[..., Finished]
) -> None:
    masts = tmp_path / "masts.csv"
    MASTS.write_csv(masts)
    (tmp_path / "short.toml").write_text(SHORT.to_toml())
    done = access_av(
        "design",
        "plan",
        tmp_path / "short.toml",
        "--masts",
        masts,
        "--out",
        tmp_path / "plan",
        "--json",
    )
    assert done.code == 0, done.err
    record = json.loads(done.out)
    assert record["after_m"] < record["before_m"]
    assert len(record["service_levels"]) == len(service_levels.LEVELS)
    assert {"level", "share", "cheapest", "changes"} <= set(record["next_level"])
    planned = Scenario.load(str(tmp_path / "plan" / "scenario.toml"))
    assert len(json.loads(planned.site.to_json())["radio_heads"]) == 5
    for text, message in (
        ("name,x_m,y_m\na,1,2\n", "column z_m is missing"),
        ("name,x_m,y_m,z_m\na,1,nan,0\n", "y_m is 'nan' in line 2"),
        ("name,x_m,y_m,z_m\n,1,2,3\n", "name is empty in line 2"),
        ("name,x_m,y_m,z_m\n", "0 masts"),
        ("name,x_m,y_m,z_m\na,-100,0,0\n", "on the road"),
    ):
        masts.write_text(text)
        done = access_av("design", "plan", tmp_path / "short.toml", "--masts", masts)
        assert done.code == 2
        assert message in done.err, done.err
    with pytest.raises(InputError, match="only 4 candidate masts exist"):
        plan(SHORT, MASTS, add=5)


def test_the_probability_within_a_circle_agrees_with_random_samples() -> None:
    rng = np.random.default_rng(1)
    for first, second in ((0.1, 0.1), (0.3, 0.05), (0.2, 0.01)):
        drawn = np.hypot(
            first * rng.standard_normal(100_000), second * rng.standard_normal(100_000)
        )
        share = float(service_levels.within(first, second, 0.25)[0])
        assert abs(share - (drawn <= 0.25).mean()) < 0.006


def test_a_service_level_requires_enough_hours_of_driving() -> None:
    good = np.full((2, 1000), 0.01)
    assert service_levels.reached_in_words(service_levels.of_runs(good, 0.02)) == "no level"
    hours = service_levels.of_runs(np.full((20, 1000), 0.01), 20.0)
    assert all(verdict.reached for verdict in hours)
    # One of twenty runs is lost, so that no interval over runs permits 99 %.
    lost = np.full((20, 1000), 0.01)
    lost[3] = np.nan
    reached = [
        verdict.level.name for verdict in service_levels.of_runs(lost, 20.0) if verdict.reached
    ]
    assert reached == []
    found = simulate(SHORT, runs=2, keep_trajectories=True).service_levels
    assert found is not None
    assert found[0].share == 1.0
    # Half a minute is too short for level 2: neither reached nor missed.
    assert [found[0].result, found[1].result] == [LevelResult.TOO_FEW_RUNS] * 2


def test_integrity_cases_report_horizontal_errors() -> None:
    steps = pl.DataFrame(
        {
            "run": [0, 0],
            "time_s": [0.0, 1.0],
            "error_x_m": [3.0, -0.6],
            "error_y_m": [-4.0, 0.8],
            "protection_level_m": [6.0, 6.0],
            "integrity": ["ok", "ok"],
        }
    )
    case = Case("none", "as set", 2, 1e-3, SHORT, steps)
    assert case.errors("it").errors_m.tolist() == [[5.0, 1.0]]


def test_an_interrupted_integrity_campaign_is_continued(
    tmp_path: Path, access_av: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "short.toml").write_text(SHORT.to_toml())
    arguments = (
        "design", "integrity", tmp_path / "short.toml", "--runs", "2", "--fault", "none",
        "--fault", "array 1 degree off", "--num-heads", "2", "--num-heads", "4",
        "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    done = access_av(*arguments)
    assert done.code == 0, done.err
    record = json.loads(done.out)
    assert tuple(record["cases"][0]) == columns.TABLES["integrity_cases"].columns
    assert len(record["cases"]) == 4
    html = (tmp_path / "out" / "report.html").read_text()
    assert "array 1 degree off; as set; 2 radio heads" in html

    def driven_again(*_: object, **__: object) -> None:
        raise AssertionError("it was kept")

    monkeypatch.setattr("access_av.run.integrity_campaign.driven", driven_again)
    assert json.loads(access_av(*arguments).out)["cases"] == record["cases"]
    for wide, last in ((80, "risk/h   ≤"), (60, "beyond       ≤"), (120, "level/error")):
        shown = access_av(*arguments[:-1], columns=wide)
        lines = shown.out.splitlines()
        [head] = [line for line in lines if line.startswith(" truth")]
        assert head.rstrip().endswith(last)
        assert sum(line.startswith(" array 1 degree off ") for line in lines) == 2
        assert max(map(len, lines[1:-1])) <= wide


def test_cases_of_an_integrity_campaign_are_compared(
    tmp_path: Path, access_av: Callable[..., Finished]
) -> None:
    (tmp_path / "short.toml").write_text(SHORT.to_toml())
    done = access_av(
        "design", "integrity", tmp_path / "short.toml", "--runs", "2", "--fault", "none",
        "--fault", "array 1 degree off", "--sweep", "vehicle.integrity.risk_per_hour=1e-3",
        "--percentile", "90", "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    cases = json.loads(done.out)["cases"]
    varied = "vehicle.integrity.risk_per_hour = 0.001"
    assert [case["variant"] for case in cases] == ["unchanged"] * 2 + [varied] * 2
    compared = pl.read_parquet(tmp_path / "out" / "compared.parquet")
    assert tuple(compared.columns) == columns.TABLES["compared"].columns
    # Each case next to its counterpart.
    assert compared["variant"].to_list() == [
        f"{case}, as set, 4 radio heads: {variant}"
        for case in ("none", "array 1 degree off")
        for variant in ("unchanged", varied)
    ]
    as_it_is, other = (compared["percentile_m"].gather_every(2, at) for at in (0, 1))
    assert compared["delta_m"].to_list()[::2] == [None, None]
    assert compared["delta_m"].to_list()[1::2] == pytest.approx((other - as_it_is).to_list())
    page = (tmp_path / "out" / "report.html").read_text()
    assert f"array 1 degree off; {varied}; as set; 4 radio heads" in page
    assert "Comparison of variants" in page


def test_fault_cases_of_every_scale_can_be_simulated(tmp_path: Path) -> None:
    for name in ("yard", "paper", "campus-handover"):
        scenario = Scenario.load(name)
        found = hypotheses(scenario)
        truths = {scenario.with_overrides(case).to_toml() for case in found.values()}
        assert len(truths) == len(found), "each is another world"
        kinds = {key.rpartition(" x ")[0] for key in found} - {""}
        assert {f"{kind} x {size}" for kind in kinds for size in SIZES} <= found.keys()
    sized = [hypotheses(SHORT)[f"head height x {size}"] for size in SIZES]
    heights = [next(iter(it["truth.site.radio_heads"].values()))["position_m"][2] for it in sized]
    assert heights == pytest.approx([7.1, 7.3, 8.0])
    late = SHORT.with_overrides({"vehicle.receiver.angle_time_offset_std_s": 0.02})
    assert [
        next(iter(hypotheses(late)[f"clock late x {size}"].values())) for size in SIZES
    ] == pytest.approx([0.02, 0.06, 0.2])
    chosen = ["two cells swapped", "map shape x 10", "growing slip x 10", "phase drift x 10"]
    chosen += ["clock late x 10", "gain drift x 10"]
    cases = drive(Campaign(ResultCache(tmp_path)), SHORT, runs=1, only=chosen)
    assert cases is not None
    assert [case.mismatch for case in cases] == chosen


def test_the_protection_level_increases_with_a_smaller_risk(tmp_path: Path) -> None:
    cases = drive(
        Campaign(ResultCache(tmp_path)),
        SHORT,
        runs=2,
        only=["none"],
        risks_per_hour=[0.3, 1e-2, 1e-4],
    )
    assert cases is not None
    levels = [float(case.trajectories["protection_level_m"].median()) for case in cases]
    assert levels == sorted(levels)
    assert levels[2] > 1.3 * levels[0]
    # Quantiles of a Gaussian increase with the root of the logarithm, here by a factor of 1.45.
    # Slip is negligible relative to the larger risk, but not relative to the smaller one.
    assert levels[2] < 3.0 * levels[0]


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("risk_per_hour", "1e-5", "below integrity.risk_per_hour"),
        ("fault_probability.array", "0.4", "below integrity.risk_per_hour"),
        ("fault_probability.radio_head", "0.6", "between 0.000000001 and 0.5"),
        ("fault_probability.gate", "0.1", "site_frame_offset"),
        ("risk_per_hour", "0", "between 0.000000001 and 1"),
    ],
)
def test_unmonitored_faults_above_the_risk_are_rejected(
    access_av: Callable[..., Finished], key: str, value: str, expected: str
) -> None:
    less_risk = ["--set", "vehicle.integrity.risk_per_hour=0.3"]
    change = ["--set", f"vehicle.integrity.{key}={value}"]
    done = access_av("run", "yard", "--runs", "1", *less_risk, *change)
    assert done.code == 2
    assert "integrity" in done.err
    assert expected in done.err


def test_every_mismatch_can_be_simulated(tmp_path: Path) -> None:
    known = mismatches(SHORT)
    kept = Campaign(ResultCache(tmp_path))
    assert {"none", "all heads 2 m off", "three heads hidden"} <= known.keys()
    cases = drive(kept, SHORT, runs=1)
    assert cases is not None
    assert [case.mismatch for case in cases] == list(known)
    with pytest.raises(InputError, match="allowed are none"):
        drive(kept, SHORT, only=["nothing"])
    with pytest.raises(InputError, match="the site has 4"):
        drive(kept, SHORT, heads=[5])
    with pytest.raises(InputError, match="write K=5"):
        drive(kept, SHORT, channel_names=["K=x"])
