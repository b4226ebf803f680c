"""Times, counters and truths as users have them: located, or rejected with the cause."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import InputError, RecordingError, drives
from robot import Robot, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from conftest import Finished

    Cli = Callable[..., Finished]

TIME, DISTANCE, SPEED = pl.col("time_s"), pl.col("distance_m"), pl.col("speed_mps")
UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
TRACK_M = 0.26
# Maximum time (s) in which a wrong unit is rejected; the limit is 1 s of computation, and the
# machine may be shared.
REJECTED_WITHIN_S = 5.0


def in_unit(it: Robot, unit: str, start_s: float, *, odometry: bool, angles: bool) -> None:
    if odometry:
        it.odometry = it.odometry.with_columns((TIME + start_s) * UNITS[unit])
    if angles:
        it.angles = it.angles.with_columns((TIME + start_s) * UNITS[unit])


@pytest.mark.parametrize("start_s", [0.0, 7.0, 1.7e9])
@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("columns", ["all", "distance", "speed"])
def test_times_in_another_unit_are_rejected(
    tmp_path: Path, unit: str, start_s: float, columns: str
) -> None:
    spoilt = robot(60.0)
    in_unit(spoilt, unit, start_s, odometry=True, angles=True)
    if columns != "all":
        dropped = {"distance": "speed_mps", "speed": "distance_m"}[columns]
        spoilt.odometry = spoilt.odometry.drop(dropped)
    begun_s = time.process_time()
    with pytest.raises(RecordingError, match=f"odometry: `time_s` is in {unit}"):
        spoilt.locate(tmp_path)
    assert time.process_time() - begun_s < REJECTED_WITHIN_S


@pytest.mark.parametrize("unit", UNITS)
def test_angles_in_another_unit_are_rejected(tmp_path: Path, unit: str) -> None:
    spoilt = robot(60.0)
    in_unit(spoilt, unit, 0.0, odometry=False, angles=True)
    with pytest.raises(RecordingError, match=f"angles: `time_s` is in {unit}"):
        spoilt.locate(tmp_path)


def wheels(it: Robot) -> None:
    """The counters of two wheels in place of distance, speed and yaw rate."""
    it.sheet = it.sheet.replace("odometer = {", f"odometer = {{ track_width_m = {TRACK_M},")
    turned_m = 0.5 * TRACK_M * (pl.col("yaw_rate_radps") * 0.05).cum_sum()
    it.odometry = it.odometry.select(
        "time_s", left_m=DISTANCE - turned_m, right_m=DISTANCE + turned_m
    )


AFTER = pl.int_range(pl.len()) >= 400
AT = pl.int_range(pl.len()) == 400
# Class, change of a counter, and its number of jumps.
JUMPS = {
    "16 bit of millimetres": (lambda it: it - AFTER * 65.536, 1),
    "8 bit of centimetres": (lambda it: it - AFTER * 2.56, 1),
    "reset": (lambda it: it - AFTER * it.get(400), 1),
    "spike": (lambda it: it + AT * 300.0, 2),
    "step of 4 m": (lambda it: it + AFTER * 4.0, 1),
}


@pytest.mark.parametrize("kind", JUMPS)
def test_counters_that_jump_give_no_speed(tmp_path: Path, kind: str) -> None:
    change, count = JUMPS[kind]
    whole = robot(45.0)
    whole.odometry = whole.odometry.drop("speed_mps")
    as_given_m = whole.rms_error_m(whole.locate(tmp_path))
    whole.odometry = whole.odometry.with_columns(distance_m=change(DISTANCE))
    drive = whole.locate(tmp_path)
    (said,) = [it for it in drive.remarks if "jumps by" in it]
    assert said.startswith("odometry line 402: distance_m jumps by")
    assert ("(and 1 more like this)" in said) == (count == 2)
    assert drive.poses["speed_mps"].abs().max() < 1.0  # type: ignore[operator]
    assert whole.rms_error_m(drive) < as_given_m + 0.01
    assert drive.is_reliable


@pytest.mark.parametrize("wheel", ["left_m", "right_m"])
def test_a_wheel_that_jumps_turns_nothing(tmp_path: Path, wheel: str) -> None:
    whole = robot(45.0)
    wheels(whole)
    as_given = whole.locate(tmp_path)
    as_given_m = whole.rms_error_m(as_given)
    whole.odometry = whole.odometry.with_columns((pl.col(wheel) - AFTER * 65.536).alias(wheel))
    drive = whole.locate(tmp_path)
    assert any(f"line 402: {wheel} jumps by -65.5" in it for it in drive.remarks)
    assert whole.rms_error_m(drive) < as_given_m + 0.02


def test_coarse_counters_are_used_as_they_are(tmp_path: Path) -> None:
    """Ticks of 0.2 m, of which most samples have none."""
    whole = robot(45.0)
    whole.odometry = whole.odometry.with_columns((DISTANCE / 0.2).round() * 0.2).drop("speed_mps")
    assert not any("jumps" in it for it in whole.locate(tmp_path).remarks)


@pytest.mark.parametrize("columns", [["distance_m", "speed_mps"], ["distance_m"], ["speed_mps"]])
def test_an_odometer_that_counts_upwards_in_reverse_is_named(
    tmp_path: Path, columns: list[str]
) -> None:
    """The robot stands before and after it reverses, as it must to change its direction."""

    def speed_mps(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        stands = (abs(time_s - 20.0) < 1.0) | (abs(time_s - 35.0) < 1.0)
        return np.where(stands, 0.0, np.where((time_s > 20.0) & (time_s < 35.0), -0.4, 0.5))

    whole = robot(60.0, speed_mps=speed_mps)
    counted = whole.odometry.with_columns(
        distance_m=(SPEED.abs() * 0.05).cum_sum(), speed_mps=SPEED.abs()
    )
    whole.odometry = counted.select("time_s", *columns, "yaw_rate_radps")
    drive = whole.locate(tmp_path)
    assert any("distances count upwards in reverse" in it for it in drive.diagnoses), drive.remarks


@pytest.fixture(scope="module")
def located(tmp_path_factory: pytest.TempPathFactory) -> tuple[Robot, drives.Drive]:
    whole = robot(40.0)
    return whole, whole.locate(tmp_path_factory.mktemp("drive"))


# Class, change of the truth's table, and the cause.
TRUTHS = {
    "nanoseconds": (pl.col("*").exclude("time_s"), TIME * 1e9, "times are in nanoseconds"),
    "microseconds": (pl.col("*").exclude("time_s"), TIME * 1e6, "times are in microseconds"),
    "milliseconds": (pl.col("*").exclude("time_s"), TIME * 1e3, "times are in milliseconds"),
    "another time": (pl.col("*").exclude("time_s"), TIME + 39.0, "it is from 39.000 to"),
    "a third": (pl.col("*").exclude("time_s"), TIME + 26.6, "covers 34% of the drive"),
}


@pytest.mark.parametrize("kind", TRUTHS)
def test_a_truth_of_another_time_is_rejected(
    located: tuple[Robot, drives.Drive], kind: str
) -> None:
    whole, drive = located
    others, times, says = TRUTHS[kind]
    with pytest.raises(InputError, match=says):
        drives.error_m(drive.poses, whole.truth.with_columns(others, times))


def test_a_slow_truth_is_rejected_with_the_gap_limit(located: tuple[Robot, drives.Drive]) -> None:
    whole, drive = located
    with pytest.raises(InputError, match=r"its poses are 2 s apart, and must be at most 1 s apart"):
        drives.error_m(drive.poses, whole.truth.gather_every(40))


def test_a_truth_of_another_frame_is_rejected(located: tuple[Robot, drives.Drive]) -> None:
    whole, drive = located
    utm = whole.truth.with_columns(pl.col("x_m") + 691e3, pl.col("y_m") + 5.334e6)
    with pytest.raises(InputError, match=r"5379 km from the drive \(UTM coordinates\?\)"):
        drives.error_m(drive.poses, utm)
    degrees = whole.truth.with_columns(
        x_m=11.6 + pl.col("x_m") / 74e3, y_m=48.1 + pl.col("y_m") / 111e3
    )
    with pytest.raises(InputError, match="longitude and latitude in degrees"):
        drives.error_m(drive.poses, degrees)


def test_a_truth_of_part_of_the_drive_says_so(access_av: Cli, tmp_path: Path) -> None:
    whole = robot(20.0)
    arguments = whole.write(tmp_path)
    # The orientation of a truth is not used: it may be anything.
    lines = (tmp_path / "truth.tum").read_text().splitlines()
    cut = [" ".join([*line.split()[:4], "0 0 0 0"]) for line in lines[1:301]]
    (tmp_path / "truth.tum").write_text("\n".join(cut))
    done = access_av(*arguments, "--truth", tmp_path / "truth.tum")
    assert done.code == 0
    assert "over 75% of the drive" in " ".join(done.out.split())


def test_a_drive_that_is_unavailable_is_not_relied_on(tmp_path: Path) -> None:
    """Radio heads that contradict each other are an exit code, whatever the diagnosis says."""
    whole = robot(40.0)
    rng = pl.Series([math.tau * ((k * 0.618) % 1.0) for k in range(whole.angles.height)])
    whole.angles = whole.angles.with_columns(phase_rad=rng - math.pi)
    drive = whole.locate(tmp_path)
    assert drive.unavailable_share > 0.2
    assert not drive.is_reliable
