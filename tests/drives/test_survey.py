"""A survey of site and array by ordinary drives."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import (
    InputError,
    Scenario,
    SettingsError,
    Site,
    Vehicle,
    __version__,
    columns,
    drives,
    survey,
)
from access_av.drives.self_survey import read_drive

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

GATE_OFF_M = (1.2, -1.6)
MOUNTING_OFF_RAD = 0.0175
# 99.99 % quantile of χ² with ten degrees of freedom.
CHI2_10 = 35.56


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two drives of 40 s past the yard's first radio head, whose nominal position is wrong."""
    scenario = Scenario.load("yard").with_overrides(
        {
            # The surveyed quantities have no σ, and all other quantities are exact.
            **{f"site.radio_heads[{head}].position_std_m": 0.0 for head in range(4)},
            "vehicle.array": {},
            "vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0},
            "vehicle.integrity.enabled": False,
            "truth.site.radio_heads.gate.position_m": [
                -40.0 + GATE_OFF_M[0],
                45.0 + GATE_OFF_M[1],
                8.0,
            ],
            "truth.vehicle.array.mounting_rad": MOUNTING_OFF_RAD,
        }
    )
    folder = tmp_path_factory.mktemp("drives")
    for run in range(2):
        drives.log_angles(scenario, folder / str(run), run=run, duration_s=40.0)
    return folder


def test_displaced_radio_head_and_array_are_estimated(logged: Path) -> None:
    found = survey(
        str(logged / "0/site.toml"), str(logged / "0/vehicle.toml"), [logged / "0", logged / "1"]
    )
    by_key = {it.key: it for it in found.parameters}
    truth = np.array([it.before for it in found.parameters])
    for key, off in (
        ("radio_heads[0].position_m[0]", GATE_OFF_M[0]),
        ("radio_heads[0].position_m[1]", GATE_OFF_M[1]),
        ("array.mounting_rad", MOUNTING_OFF_RAD),
    ):
        truth[list(by_key).index(key)] += off
        assert by_key[key].is_learnt
    error = np.array([it.found for it in found.parameters]) - truth
    assert error @ np.linalg.solve(found.covariance, error) < CHI2_10
    assert by_key["radio_heads[0].position_m[0]"].std < 0.6
    # The dock is 300 m away: the drives do not determine its position, which is unchanged.
    assert not by_key["radio_heads[2].position_m[0]"].is_learnt
    heads = json.loads(found.site.to_json())["radio_heads"]
    assert heads[2]["position_m"] == [310.0, 85.0, 7.0]
    assert heads[0]["position_m"][0] == by_key["radio_heads[0].position_m[0]"].found
    # The specified noise is conservative, and dependent angles have increased variances.
    assert 0.3 < found.nis < 1.1
    # The plan is displaced with a lower probability than before (0.01). The vehicle file has it.
    assert found.site_frame_offset is not None
    assert 0.0 < found.site_frame_offset < 0.01
    faults = json.loads(found.vehicle.to_json())["integrity"]["fault_probability"]
    assert faults["site_frame_offset"] == found.site_frame_offset
    assert found.origin.version == __version__


def test_the_surveyed_files_reduce_the_error(
    access_av: Callable[..., Finished], logged: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    one, vehicle, plan = logged / "0", logged / "0/vehicle.toml", logged / "0/site.toml"
    done = access_av(
        "record", "survey", one, logged / "1", "--site", plan, "--vehicle", vehicle, "--out", out
    )
    assert done.code == 0, done.err
    rows = pl.read_parquet(out / "survey.parquet")
    assert tuple(rows.columns) == columns.TABLES["survey"].columns
    assert "not determined" in done.out

    def rms_m(site: str) -> float:
        start = vehicle.read_text()
        nominal = tmp_path / "vehicle.toml"
        nominal.write_text((out / "vehicle.toml").read_text() if site != str(plan) else start)
        drive = drives.locate(site, one / "odometry.csv", one / "angles.csv", vehicle=nominal)
        error_m = drives.error_m(drive.poses, one / "truth.tum")["error_m"]
        return float(np.sqrt(np.mean(error_m.to_numpy() ** 2)))

    assert rms_m(str(out / "site.toml")) < 0.5 * rms_m(str(plan))


def test_parameters_that_cannot_be_surveyed_are_reported(logged: Path, tmp_path: Path) -> None:
    plan, vehicle = str(logged / "0/site.toml"), str(logged / "0/vehicle.toml")
    with pytest.raises(InputError, match=r"neither odometry.csv nor odometry.mcap"):
        survey(plan, vehicle, [tmp_path])
    elsewhere = Site.load("yard").with_overrides(
        {f"radio_heads[{index}].pci": 900 + index for index in range(4)}
    )
    with pytest.raises(InputError, match="no angle belongs to a radio head of yard"):
        survey(elsewhere, vehicle, [logged / "0"])
    lost = tmp_path / "lost"
    lost.mkdir()
    for name in ("odometry.csv", "angles.csv"):
        (lost / name).write_bytes((logged / "0" / name).read_bytes())
    (lost / "vehicle.toml").write_text('extends = "tugger"\n')
    with pytest.raises(InputError, match=r"start.pose"):
        survey(plan, vehicle, [lost])
    noisy = Scenario.load("yard").with_overrides({"vehicle.receiver.snr_noise_db": 1.0})
    with pytest.raises(SettingsError, match="fidelity"):
        drives.log_angles(noisy, tmp_path / "noisy")


def test_the_command_reports_parameters_that_were_not_estimated_or_do_not_fit(
    access_av: Callable[..., Finished], logged: Path, tmp_path: Path
) -> None:
    short = tmp_path / "short"
    short.mkdir()
    for name in ("odometry.csv", "angles.csv", "vehicle.toml"):
        lines = (logged / "0" / name).read_text().splitlines(keepends=True)
        (short / name).write_text("".join(lines if name == "vehicle.toml" else lines[:80]))
    arguments = (
        "record",
        "survey",
        short,
        "--vehicle",
        short / "vehicle.toml",
        "--out",
        tmp_path / "out",
    )
    done = access_av(*arguments, "--site", "yard")
    assert done.code == 0, done.err
    rows = [line.split() for line in done.out.splitlines() if line.startswith(" radio_heads")]
    assert rows
    assert all(row[1] == "m" and row[3:] == ["–", "not", "determined"] for row in rows)
    twice = access_av(*arguments, short, "--site", "yard")
    assert (twice.code, "given twice" in twice.err) == (2, True)
    # A standing vehicle cannot distinguish a wrong mounting from a bias, but a drive can.
    turned = Vehicle.load(str(short / "vehicle.toml")).with_overrides(
        {"array.mounting_rad": 1.57, "array.mounting_std_rad": 0.01}
    )
    (tmp_path / "turned.toml").write_text(turned.to_toml())
    done = access_av(
        *("record", "survey", logged / "0", "--site", "yard"),
        *("--vehicle", tmp_path / "turned.toml"),
    )
    assert "are outliers and were not used" in done.err


def test_odometry_of_two_wheels_gives_equal_poses(logged: Path, tmp_path: Path) -> None:
    half_track_m = 0.3
    one = logged / "0"
    vehicle = Vehicle.load(str(one / "vehicle.toml"))
    paired = vehicle.with_overrides({"odometer.track_width_m": 2 * half_track_m})
    rates = pl.read_csv(one / "odometry.csv").with_columns(
        yaw_rate_radps=0.02 * pl.col("time_s").cos()
    )
    off_mps = half_track_m * pl.col("yaw_rate_radps")
    wheels = rates.select(
        "time_s",
        "distance_m",
        left_mps=pl.col("speed_mps") - off_mps,
        right_mps=pl.col("speed_mps") + off_mps,
    )
    residuals = []
    for name, rows in (("rates", rates), ("wheels", wheels)):
        folder = tmp_path / name
        folder.mkdir()
        rows.write_csv(folder / "odometry.csv")
        (folder / "angles.csv").write_bytes((one / "angles.csv").read_bytes())
        (folder / "vehicle.toml").write_text(paired.to_toml())
        residuals.append(read_drive(folder).log.innovations(Site.load("yard"), paired)[0])
    np.testing.assert_allclose(residuals[1], residuals[0], atol=1e-9)
