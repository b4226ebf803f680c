"""Covariances, protection levels and percentiles in the results of ``run``."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import Scenario, simulate
from access_av.errors import InputError
from access_av.report.drive import render_drive
from access_av.run.operation import Operation
from access_av.statistics import Integrity, horizontal_error_m

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from access_av import Simulation
    from conftest import Finished

GUARDED = Scenario.load("paper-real-odometry-2").with_overrides({"vehicle.integrity": {}})


@pytest.fixture(scope="module")
def guarded() -> Simulation:
    return simulate(GUARDED, runs=2, seed=4, keep_trajectories=True)


def test_a_monitored_tracker_reports_protection_levels(guarded: Simulation) -> None:
    table, integrity = guarded.trajectories, guarded.integrity
    assert table is not None
    assert integrity is not None
    for name in (
        "protection_level_m",
        "covariance_xx_m2",
        "covariance_yy_m2",
        "covariance_heading_rad2",
    ):
        assert table[name].null_count() == 0
        assert (table[name] >= 0.0).all()
    assert integrity.epochs == table.height
    assert abs(sum(integrity.state_shares.values()) - 1.0) < 1e-12
    assert integrity.median_level_over_error > 1.0
    # The specified risk of 1e-3 holds for many runs; two runs with correlated epochs permit a
    # coarse test only.
    assert integrity.exceedances < 0.05 * integrity.epochs


def test_dead_reckoning_has_no_protection_level() -> None:
    result = simulate("paper", runs=1, keep_trajectories=True)
    assert result.trajectories is not None
    for name in ("protection_level_m", "integrity", "covariance_xx_m2", "covariance_xy_m2"):
        assert result.trajectories[name].null_count() == result.trajectories.height
    assert result.trajectories.schema["integrity"] == pl.String
    assert result.integrity is None
    assert '"stanford"' not in render_drive(Scenario.load("paper"), result, seed=1)


def test_the_drive_report_has_every_chart_and_loads_nothing(guarded: Simulation) -> None:
    page = render_drive(GUARDED, guarded, seed=4)
    assert "Service levels" in page
    specs = json.loads(page.split("const charts = ")[1].split(";\n")[0])
    places = set(re.findall(r'class="chart" id="([^"]+)"', page))
    assert set(specs) == places == {"map", "error", "aoa_estimates", "stanford"}
    markup = re.sub(r"(<script>).*?(</script>)", r"\1\2", page, flags=re.DOTALL)
    assert not re.search(r"<(link|img|iframe|script)[^>]*\b(src|href)=", markup)
    assert not re.search(r"@import|url\(|https?:", markup)
    # The bars are stacked from zero.
    assert specs["aoa_estimates"]["encoding"]["x"]["bin"] == "binned"
    counted = specs["stanford"]["datasets"].values()
    assert guarded.trajectories is not None
    epochs = sum(row.get("epochs", 0) for rows in counted for row in rows)
    assert epochs == guarded.trajectories.height


def test_integrity_statistics_without_trajectories(guarded: Simulation) -> None:
    again = simulate(GUARDED, runs=2, seed=4)
    assert again.trajectories is None
    assert again.integrity is not None
    assert again.integrity == guarded.integrity
    # The table uses equal steps; its median is exact, the other one is that of a histogram.
    assert guarded.trajectories is not None
    counted = Integrity.of(guarded.trajectories)
    assert counted is not None
    assert counted.state_shares == pytest.approx(again.integrity.state_shares)
    assert counted.exceedances == again.integrity.exceedances
    assert counted.median_level_over_error == pytest.approx(
        again.integrity.median_level_over_error, rel=0.06
    )


def test_a_report_without_trajectories_is_rejected() -> None:
    with pytest.raises(InputError, match="keep_trajectories"):
        render_drive(Scenario.load("paper"), simulate("paper", runs=1), seed=1)


def test_run_prints_percentiles_and_integrity(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av(
        "run", "paper-real-odometry-2", "--set", "vehicle.integrity={}", "--out", tmp_path,
        columns=80,
    )  # fmt: skip
    assert done.code == 0, done.err
    # A terminal has 24 lines; one of them is the prompt.
    assert len(done.out.splitlines()) <= 23, done.out
    output = " ".join(done.out.split())
    for text in (
        "50th percentile of the error",
        "protection level / error",
        "The position is available",
    ):
        assert text in output
    page = (tmp_path / "report.html").read_text()
    assert "stanford" in page
    assert "The position is available" in page
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["repeat"] == "access-av run scenario.toml --runs 1 --seed 1"
    again = access_av("run", tmp_path / "scenario.toml", "--seed", "1", "--out", tmp_path / "again")
    assert again.code == 0, again.err
    name = "trajectories.parquet"
    assert (tmp_path / "again" / name).read_bytes() == (tmp_path / name).read_bytes()


def test_percentiles_are_those_of_the_trajectories() -> None:
    result = simulate("paper-real-odometry-4", runs=3, keep_trajectories=True)
    assert result.trajectories is not None
    assert result.percentiles is not None
    error_m = result.trajectories.select(horizontal_error_m()).to_series()
    for each in result.percentiles:
        share = (error_m <= each.value).mean()
        assert each.percent / 100.0 <= share <= each.percent / 100.0 + 1.0 / error_m.len()
    assert result.mean_error_m == pytest.approx(error_m.mean())


def test_a_simulation_has_a_one_line_representation_and_a_hash() -> None:
    result = simulate("paper", runs=2)
    assert len(repr(result)) < 100
    assert result == result
    assert len({result, result}) == 1
    assert "rms_error_m" in result._repr_html_()
    assert result.scenario == Scenario.load("paper")


def test_every_unavailable_time_has_one_reason() -> None:
    rng = np.random.default_rng(7)
    steps = pl.DataFrame(
        {
            "integrity": rng.choice(["ok", "degraded", "unavailable"], 1000),
            "protection_level_m": rng.uniform(0.1, 3.0, 1000),
            "searching": rng.random(1000) < 0.1,
        }
    )
    found = Operation.of(steps, 1.5)
    assert found is not None
    assert len(found.reasons) == 4
    assert found.reliable + sum(found.reasons.values()) == pytest.approx(1.0)
    ok = steps.filter(~pl.col("searching"), integrity="ok")
    assert found.reliable == pytest.approx(ok.height / 1000)
    assert found.level_m == ok["protection_level_m"].median()
    unwatched = steps.with_columns(integrity=pl.lit(None, dtype=pl.String))
    assert Operation.of(unwatched, 1.5) is None


def test_an_unknown_start_reports_the_time_until_the_first_pose(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    changes = {"vehicle.start.known": False, "motion.start_at_m": 200.0}
    done = access_av(
        "run", "paper-real-odometry-2", "--runs", "2", "--out", tmp_path,
        *(f"--set={key}={str(value).lower()}" for key, value in changes.items()),
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "runs with a successful search" in done.out
    assert "nan" not in done.out
    table = pl.read_parquet(tmp_path / "trajectories.parquet")
    known = table.filter(~pl.col("searching"), run=0)
    assert 0 < known.height < table.filter(run=0).height
    trajectory = (tmp_path / "trajectory.tum").read_text().splitlines()
    assert len(trajectory) == known.height
    assert "NaN" not in (tmp_path / "report.html").read_text().split("const charts = ")[1][:200_000]


def test_a_vehicle_without_position_has_no_error() -> None:
    # No SSB is received.
    silent = {f"site.radio_heads[{index}].eirp_dbm": -140.0 for index in (0, 1)}
    scenario = Scenario.load("paper-real-odometry-2").with_overrides(
        {"vehicle.start.known": False, "motion.start_at_m": 290.0, **silent}
    )
    result = simulate(scenario, keep_trajectories=True)
    assert result.runs["found_s"].null_count() == 1
    assert np.isnan(result.rms_error_m)
    assert "nan" in render_drive(scenario, result, seed=1)
