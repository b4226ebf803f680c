"""The benchmark of real drives with a small synthetic drive in the MRCLAM format."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from conftest import benchmark
from robot import HEADS_M, RATE_HZ, robot

if TYPE_CHECKING:
    from pathlib import Path

# Seconds since 1970, as in the data sets; barcodes are not the subjects' numbers.
EPOCH_S = 1.2488e9
BARCODE = {pci: 100 - pci for pci in HEADS_M}
ANOTHER_ROBOT, ITS_BARCODE = 2, 14
VIEW_RAD = 0.6


@pytest.fixture(scope="module")
def bench() -> Any:
    return benchmark("real_drives")


@pytest.fixture(scope="module")
def converted(bench: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Returns the robot's drive, written as Robot1 of a data set and converted."""
    driven, rng = robot(120.0), np.random.default_rng(5)
    dataset = tmp_path_factory.mktemp("MRCLAM_Dataset0")
    times = EPOCH_S + driven.odometry["time_s"].to_numpy()

    def write(name: str, *columns: Any) -> None:
        np.savetxt(dataset / name, np.column_stack(columns), fmt="%.6f", header="a comment")

    # A command is valid until the next one, so that the value of a step is that of its start.
    speed, yaw = (driven.odometry[name].to_numpy() for name in ("speed_mps", "yaw_rate_radps"))
    write("Robot1_Odometry.dat", times[:-1], speed[1:], yaw[1:])
    x, y, heading = (driven.truth[name].to_numpy() for name in ("x_m", "y_m", "heading_rad"))
    write("Robot1_Groundtruth.dat", times, x, y, heading)
    seen = []
    for k in range(0, times.size, 3):
        for pci, (head_x, head_y) in HEADS_M.items():
            dx, dy = head_x - x[k], head_y - y[k]
            bearing = (math.atan2(dy, dx) - heading[k] + math.pi) % (2 * math.pi) - math.pi
            if abs(bearing) < VIEW_RAD:
                late_s = times[k] + 0.04
                seen.append(
                    (late_s, BARCODE[pci], math.hypot(dx, dy), bearing + rng.normal(0, 0.02))
                )
        if k % 30 == 0:
            seen.append((times[k], ITS_BARCODE, 2.0, 0.1))
    write("Robot1_Measurement.dat", np.array(seen))
    heads = [(pci, *place, 0.0, 0.0) for pci, place in HEADS_M.items()]
    write("Landmark_Groundtruth.dat", np.array(heads))
    codes = [*BARCODE.items(), (ANOTHER_ROBOT, ITS_BARCODE)]
    write("Barcodes.dat", np.array(codes, dtype=float))
    out = tmp_path_factory.mktemp("drives") / "d0r1"
    bench.convert(dataset, 1, out)
    return out


def test_the_converted_drive_equals_the_original(bench: Any, converted: Path) -> None:
    drive, original = bench.read(converted), robot(120.0)
    assert drive["odometry"]["time_s"][0] == 0.0
    assert np.diff(drive["odometry"]["time_s"]) == pytest.approx(1 / bench.RATE_HZ, abs=1e-6)
    assert set(drive["bearings"][:, 1]) == set(HEADS_M)
    assert np.abs(drive["bearings"][:, 2]).max() < VIEW_RAD + 0.1
    assert drive["start"]["x_m"] == pytest.approx(original.start[0], abs=1e-3)
    driven = original.odometry["distance_m"].to_numpy()
    # One step at each end is excepted.
    assert drive["odometry"]["distance_m"][-1] == pytest.approx(driven[-1], abs=2 * 0.5 / RATE_HZ)
    assert drive["truth"][0, 0] == pytest.approx(0.0, abs=1e-4)


def test_the_table_ranks_tracking_above_dead_reckoning(
    bench: Any, converted: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.table(converted.parent, defaults=False)
    head, row = capsys.readouterr().out.splitlines()
    assert head.split()[:2] == ["RMS,", "m"]
    name, dead_reckoning, textbook, _, online, smoothed, _, beyond, _ = row.split()
    assert name == "d0r1"
    assert float(textbook) < float(dead_reckoning)
    assert float(online) < 0.5 * float(dead_reckoning)
    assert float(smoothed) < float(online) < 1.2 * float(textbook)
    assert float(beyond) < 0.03
