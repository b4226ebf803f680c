"""Drives through a hall (``benches/off_the_road.py``): comparison with a textbook filter, and time
offsets."""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import numpy as np
import pytest

import hall_drive
from conftest import ROOT
from hall_drive import World, simulate

sys.path.insert(0, str(ROOT / "benches"))
from off_the_road import Case, locate

# Standard deviation of the time offset that one lap determines (s): with a road, only turns do.
ANGLE_TIME_OFFSET_STD_S = {False: 0.02, True: 0.035}


def test_the_textbook_filter_is_consistent() -> None:
    nees = []
    for seed in range(1, 21):
        drive = simulate(World(seed=seed, outliers=0.0))
        poses, covariances = hall_drive.textbook(drive)
        error = (poses - drive.truth)[1:, :2]
        nees.append(np.einsum("ki,kij,kj->k", error, np.linalg.inv(covariances[1:]), error).mean())
    # Errors of a drive are correlated; twenty drives count as twenty independent errors.
    assert 0.6 < np.mean(nees) / 2 < 1.5


@cache
def located_in_time(road: bool) -> dict[str, Any]:
    return dict(locate(Case("late", "in time", {}, road), 101, []))


@pytest.mark.parametrize("road", [False, True])
@pytest.mark.parametrize("late_s", [0.3, 1.0, -0.3])
def test_a_time_offset_of_the_angles_is_estimated_reported_and_corrected(
    road: bool, late_s: float
) -> None:
    located = locate(Case("late", "late", {"late_s": late_s}, road), 101, [])
    assert located["exit_named"]
    assert abs(located["late_s"] - late_s) < 3.0 * ANGLE_TIME_OFFSET_STD_S[road]
    in_time = located_in_time(road)
    assert not in_time["exit_named"]
    assert in_time["late_s"] == 0.0
    assert located["square"] < 1.3**2 * in_time["square"]


def test_no_time_offset_is_reported_for_clocks_configured_as_equal() -> None:
    case = Case("late", "late", {"late_s": 1.0})
    located = locate(case, 101, ["receiver.angle_time_offset_std_s=0.0"])
    assert not located["exit_named"]
