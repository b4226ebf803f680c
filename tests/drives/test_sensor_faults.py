"""Faults of sensors in a replay: a remark when one begins or ends, a diagnosis at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

import access_av
from access_av import drives

if TYPE_CHECKING:
    from pathlib import Path

# Time at which the odometry stops, while the vehicle drives on (s).
STOPS_S = 26.0


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("drive")
    changes = {"vehicle.receiver.angle_time_offset_std_s": 0.0, "vehicle.acceleration_mps2": 2.0}
    scenario = access_av.Scenario.load("yard").with_overrides(changes)
    drives.log_angles(scenario, directory, duration_s=30.0)
    return directory


def located(drive: Path, odometry: Path) -> drives.Drive:
    site, vehicle = drive / "site.toml", drive / "vehicle.toml"
    (angles,) = drive.glob("angles.*")
    return drives.locate(site, odometry, angles, vehicle=vehicle)


def test_a_drive_without_faults_has_no_diagnosis(drive: Path) -> None:
    found = located(drive, drive / "odometry.csv")
    assert not any("fault " in it for it in found.remarks), found.remarks
    assert found.diagnoses == []


def test_a_lasting_fault_causes_a_remark_and_a_diagnosis(drive: Path, tmp_path: Path) -> None:
    log = pl.read_csv(drive / "odometry.csv")
    before = log.filter(pl.col("time_s") < STOPS_S)
    stops = pl.col("time_s") >= STOPS_S
    frozen = log.with_columns(
        distance_m=pl.when(stops).then(before["distance_m"][-1]).otherwise(pl.col("distance_m")),
        speed_mps=pl.when(stops).then(0.0).otherwise(pl.col("speed_mps")),
    )
    frozen.write_csv(tmp_path / "odometry.csv")
    found = located(drive, tmp_path / "odometry.csv")
    begun = [it for it in found.remarks if it.startswith("fault odometry_frozen at")]
    assert begun, found.remarks
    assert float(begun[0].split()[3]) == pytest.approx(STOPS_S, abs=2.0)
    (diagnosis,) = found.diagnoses
    # The diagnosis contains start time, fault and remedy.
    assert any(f"since {second}." in diagnosis for second in (26, 27)), diagnosis
    assert "the odometry is frozen" in diagnosis
    assert "check the odometer" in diagnosis


def test_an_ended_fault_causes_no_diagnosis(drive: Path, tmp_path: Path) -> None:
    log = pl.read_csv(drive / "odometry.csv")
    stops = pl.col("time_s").is_between(5.0, 6.0)
    before = log.filter(pl.col("time_s") < 5.0)
    after = log.filter(pl.col("time_s") > 6.0)
    lost_m = after["distance_m"][0] - before["distance_m"][-1]
    changed = log.with_columns(
        distance_m=pl.when(stops)
        .then(before["distance_m"][-1])
        .when(pl.col("time_s") > 6.0)
        .then(pl.col("distance_m") - lost_m)
        .otherwise(pl.col("distance_m")),
        speed_mps=pl.when(stops).then(0.0).otherwise(pl.col("speed_mps")),
    )
    changed.write_csv(tmp_path / "odometry.csv")
    found = located(drive, tmp_path / "odometry.csv")
    faults = [it for it in found.remarks if it.startswith("fault odometry_frozen")]
    assert any("it has ended" in it for it in faults), found.remarks
    assert not any("the odometry is frozen" in it for it in found.diagnoses), found.diagnoses
