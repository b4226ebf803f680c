"""Drives located by ranges whose odometry or site has a mistake."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av import locate

if TYPE_CHECKING:
    from pathlib import Path

    from access_av import Drive

HEADS_M = np.array([[0.0, 0.0, 3.0], [40.0, -5.0, 3.0], [42.0, 28.0, 3.0], [-4.0, 30.0, 3.0]])
START = (5.0, 4.0, 0.4)
VEHICLE = """name = "robot"
drive = "differential"
odometer = { scale_std = 0.03, noise_m_per_sqrt_m = 0.03 }
gyroscope = { noise_rad_per_sqrt_s = 0.005, bias_std_radps = 0.005 }
start = { position_std_m = 0.3, heading_std_rad = 0.1 }
ranging = { kind = "two-way", sigma_m = 0.2 }
"""


def write_drive(
    folder: Path,
    *,
    yaw_factor: float = 1.0,
    xy_exchanged: bool = False,
    range_factor: float = 1.0,
    late_s: float = 0.0,
) -> np.ndarray:
    """Writes one minute of bends with ten ranges per second; returns time, x and y of the truth."""
    rng = np.random.default_rng(5)
    step_s = 0.02
    time_s = np.arange(0.0, 60.0, step_s)
    speed_mps = np.where(time_s < 2.0, 0.0, 1.2 + 0.3 * np.sin(time_s / 7.0))
    yaw_radps = np.where(time_s < 2.0, 0.0, 0.06 + 0.12 * np.sin(time_s / 9.0))
    heading_rad = START[2] + np.cumsum(yaw_radps) * step_s
    x_m = START[0] + np.cumsum(speed_mps * np.cos(heading_rad)) * step_s
    y_m = START[1] + np.cumsum(speed_mps * np.sin(heading_rad)) * step_s
    measured_radps = yaw_factor * (yaw_radps + 0.002 + 0.01 * rng.standard_normal(time_s.size))
    distance_m = 1.01 * np.cumsum(speed_mps) * step_s
    odometry = np.column_stack([time_s, distance_m, measured_radps])
    header = "time_s,distance_m,yaw_rate_radps"
    np.savetxt(folder / "odometry.csv", odometry, "%.6f", ",", header=header, comments="")

    at = np.arange(15, time_s.size - 15, 5)
    pci = np.arange(at.size) % len(HEADS_M)
    vehicle_m = np.column_stack([x_m, y_m, np.zeros_like(x_m)])[at]
    range_m = np.linalg.norm(HEADS_M[pci] - vehicle_m, axis=1)
    range_m += 0.15 * rng.standard_normal(at.size)
    rows = np.column_stack([time_s[at] + late_s, pci, range_factor * range_m])
    form = ["%.3f", "%d", "%.4f"]
    np.savetxt(folder / "ranges.csv", rows, form, ",", header="time_s,pci,range_m", comments="")

    order = [1, 0, 2] if xy_exchanged else [0, 1, 2]
    heads = "".join(
        f"[[radio_heads]]\npci = {number}\nposition_m = {place_m[order].tolist()}\n"
        for number, place_m in enumerate(HEADS_M)
    )
    (folder / "site.toml").write_text(f'name = "yard"\n{heads}')
    (folder / "vehicle.toml").write_text(VEHICLE)
    return np.column_stack([time_s, x_m, y_m])


def locate_in(folder: Path, start: tuple[float, float, float] = START) -> Drive:
    files = (str(folder / name) for name in ("site.toml", "odometry.csv", "ranges.csv"))
    return locate(*files, vehicle=str(folder / "vehicle.toml"), start=start)


@pytest.mark.parametrize("turned_rad", [0.0, np.pi])
def test_a_correct_drive_is_reliable_even_with_a_wrong_start_heading(
    tmp_path: Path, turned_rad: float
) -> None:
    truth = write_drive(tmp_path)
    drive = locate_in(tmp_path, (*START[:2], START[2] - turned_rad))
    last = drive.poses.row(-1, named=True)
    assert drive.is_reliable
    assert np.hypot(last["x_m"] - truth[-1, 1], last["y_m"] - truth[-1, 2]) < 1.0


@pytest.mark.parametrize(
    "mistake",
    [
        {"yaw_factor": -1.0},
        {"yaw_factor": float(np.degrees(1.0))},
        {"xy_exchanged": True},
        {"range_factor": 2.0},
    ],
    ids=[
        "clockwise yaw rate",
        "yaw rate in degrees",
        "x and y of the site exchanged",
        "round-trip ranges",
    ],
)
def test_a_drive_that_ranges_contradict_is_not_reliable(
    tmp_path: Path, mistake: dict[str, float | bool]
) -> None:
    write_drive(tmp_path, **mistake)  # type: ignore[arg-type]
    assert not locate_in(tmp_path).is_reliable


def test_late_ranges_are_shifted(tmp_path: Path) -> None:
    truth = write_drive(tmp_path, late_s=1.0)
    drive = locate_in(tmp_path)
    last = drive.poses.row(-1, named=True)
    assert drive.is_reliable
    assert any("the ranges are" in str(remark) for remark in drive.remarks)
    assert np.hypot(last["x_m"] - truth[-1, 1], last["y_m"] - truth[-1, 2]) < 1.0
