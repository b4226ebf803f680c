"""Angles measured by arrays at the radio heads: generated drives, and a real one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av import drives
from conftest import benchmark
from robot import HEADS_M, Robot, robot

if TYPE_CHECKING:
    from pathlib import Path

SIGMA_RAD = 0.05
# Direction of azimuth 0 of each radio head's array.
AZIMUTH_RAD = {pci: 1.1 * pci % (2 * math.pi) - math.pi for pci in HEADS_M}


class RobotSeenByHeads(Robot):
    """A robot whose angles are measured at the radio heads, with arrays in the site's file."""

    with_arrays = True

    def site(self) -> str:
        heads = (
            f"[[radio_heads]]\npci = {pci}\nposition_m = [{x}, {y}, 0.0]\n"
            + (f"array = {{ mounting_rad = {AZIMUTH_RAD[pci]} }}\n" if self.with_arrays else "")
            for pci, (x, y) in self.heads_m.items()
        )
        return 'name = "hall"\n' + "".join(heads)


def seen_by_heads(seed: int = 1, duration_s: float = 90.0) -> RobotSeenByHeads:
    drive, rng = robot(duration_s, seed), np.random.default_rng(seed + 100)
    rows = []
    for k in range(0, drive.truth.height, 4):
        time_s, x, y, _ = drive.truth.row(k)
        for pci, (head_x, head_y) in HEADS_M.items():
            if rng.random() < 0.4:
                azimuth = math.atan2(y - head_y, x - head_x) - AZIMUTH_RAD[pci]
                angle = math.remainder(azimuth + rng.normal(0.0, SIGMA_RAD), 2 * math.pi)
                rows.append((time_s, pci, angle, SIGMA_RAD, 1))
    names = ["time_s", "pci", "angle_rad", "angle_sigma_rad", "at_head"]
    drive.angles = pl.DataFrame(rows, schema=names, orient="row")
    # Mounting and phase of the vehicle's array have no influence, because it measures no angle.
    return RobotSeenByHeads(
        drive.odometry, drive.angles, drive.truth, drive.start, mounting_rad=0.7, sheet=drive.sheet
    )


def nees(found: drives.Drive, truth: pl.DataFrame) -> float:
    """Mean of the normalized squared error of the position, 2 if the covariance is right."""
    both = drives.error_m(found.poses, truth).join(found.poses, on="time_s")
    error = both.select("error_x_m", "error_y_m").to_numpy()
    xx, xy, yy = (both[f"covariance_{it}_m2"].to_numpy() for it in ("xx", "xy", "yy"))
    covariance = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
    solved = np.linalg.solve(covariance, error[:, :, None])[:, :, 0]
    return float(np.mean(np.sum(error * solved, axis=1)))


def test_a_drive_is_located_by_angles_measured_at_the_radio_heads(tmp_path: Path) -> None:
    errors, ratios = [], []
    for seed in (1, 2, 3):
        place = tmp_path / str(seed)
        place.mkdir()
        drive = seen_by_heads(seed)
        found = drive.locate(place)
        assert found.angles["accepted"].mean() > 0.97
        errors.append(drive.rms_error_m(found))
        ratios.append(nees(found, drive.truth) / 2)
    # 12 angles per second with 0.05 rad at 6 m give 0.3 m / sqrt(12) in a second, in which the
    # odometry is exact to some centimetres. The correlated share of the variance at most doubles
    # it.
    assert max(errors) < 0.2
    # The assumed correlation, which does not exist here, makes the covariance conservative.
    assert 0.3 < np.mean(ratios) < 1.5


def test_angles_of_heads_without_an_array_are_reported_and_not_used(tmp_path: Path) -> None:
    drive = seen_by_heads(duration_s=6.0)
    drive.with_arrays = False
    found = drive.locate(tmp_path)
    assert not found.angles["accepted"].any()
    remarks = "\n".join(found.remarks)
    assert "measured at the radio head (at_head is 1)" in remarks
    assert "radio_heads[0].array.mounting_rad" in remarks


def test_angles_of_vehicle_and_heads_are_used_together(tmp_path: Path) -> None:
    drive, other = seen_by_heads(duration_s=40.0), robot(40.0)
    drive.mounting_rad = other.mounting_rad
    at_head = drive.angles.select(
        "time_s", "pci", "at_head", phase_rad="angle_rad", phase_sigma_rad="angle_sigma_rad"
    )
    at_vehicle = other.angles.with_columns(at_head=pl.lit(0)).select(at_head.columns)
    drive.angles = pl.concat([at_head, at_vehicle.cast(at_head.schema)]).sort("time_s")
    found = drive.locate(tmp_path)
    assert found.angles["accepted"].mean() > 0.97
    assert drive.rms_error_m(found) < 0.2


def test_a_flag_that_is_neither_0_nor_1_is_left_out_with_its_line(tmp_path: Path) -> None:
    drive = seen_by_heads(duration_s=20.0)
    values = drive.angles["at_head"].to_list()
    values[4] = 2
    drive.angles = drive.angles.with_columns(pl.Series("at_head", values))
    found = drive.locate(tmp_path)
    remarks = "\n".join(found.remarks)
    assert "line 6: left out, at_head 2 is neither 1 nor 0" in remarks


@pytest.fixture(scope="module")
def bench() -> Any:
    return benchmark("angles_at_heads")


def test_a_real_robot_is_located_by_four_access_points(
    bench: Any, data: Path, tmp_path: Path
) -> None:
    start = bench.convert(data / "arrays" / "wiros", tmp_path, seed=0)
    rms_m, ratio = bench.quality(tmp_path, start)
    assert rms_m <= 0.5
    assert 0.7 <= ratio <= 1.5
