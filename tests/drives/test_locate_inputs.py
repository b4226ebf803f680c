"""Times, counters and truths of users: located, or rejected with the cause."""

from __future__ import annotations

import math
import re
import time
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import InputError, RecordingError, Site, Vehicle, drives
from access_av.drives.recorded import truth_doubt
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
    # The angle log is read first, and no drive takes 1.7e9 s.
    of_angles = f"angles.csv: .* probably in {unit}"
    with pytest.raises(RecordingError, match=f"odometry: `time_s` is in {unit}|{of_angles}"):
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
def test_counter_jumps_cause_no_speed(tmp_path: Path, kind: str) -> None:
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
def test_a_jump_of_a_wheel_counter_causes_no_turn(tmp_path: Path, wheel: str) -> None:
    whole = robot(45.0)
    wheels(whole)
    as_given = whole.locate(tmp_path)
    as_given_m = whole.rms_error_m(as_given)
    whole.odometry = whole.odometry.with_columns((pl.col(wheel) - AFTER * 65.536).alias(wheel))
    drive = whole.locate(tmp_path)
    assert any(f"line 402: {wheel} jumps by -65.5" in it for it in drive.remarks)
    assert whole.rms_error_m(drive) < as_given_m + 0.02


def test_coarse_counters_are_used_as_they_are(tmp_path: Path) -> None:
    """Ticks of 0.2 m: most samples contain no tick."""
    whole = robot(45.0)
    whole.odometry = whole.odometry.with_columns((DISTANCE / 0.2).round() * 0.2).drop("speed_mps")
    assert not any("jumps" in it for it in whole.locate(tmp_path).remarks)


@pytest.mark.parametrize("columns", [["distance_m", "speed_mps"], ["distance_m"], ["speed_mps"]])
def test_an_odometer_that_counts_upwards_in_reverse_is_named(
    tmp_path: Path, columns: list[str]
) -> None:
    """The robot stops before and after it reverses."""

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


@pytest.mark.parametrize("every", [1, 4], ids=["20 Hz", "5 Hz"])
def test_a_reversal_without_a_sampled_standstill_is_named(tmp_path: Path, every: int) -> None:
    """The direction changes between two samples of an odometer that counts upwards."""

    def speed_mps(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where((time_s > 25.0) & (time_s < 29.0), -0.4, 0.5)

    whole = robot(50.0, speed_mps=speed_mps)
    assert not any("upwards" in it for it in whole.locate(tmp_path).diagnoses)
    counted = whole.odometry.with_columns(
        distance_m=(SPEED.abs() * 0.05).cum_sum(), speed_mps=SPEED.abs()
    )
    whole.odometry = counted.gather_every(every)
    drive = whole.locate(tmp_path)
    [named] = [it for it in drive.diagnoses if "distances count upwards in reverse" in it]
    found_s = re.search(r"from ([\d.]+) to ([\d.]+) s", named)
    assert found_s is not None
    # The angles of half a second determine a change of direction.
    assert float(found_s[1]) == pytest.approx(25.0, abs=0.75)
    assert float(found_s[2]) == pytest.approx(29.0, abs=0.75)
    assert not drive.is_reliable


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


SPIKE = pl.int_range(pl.len()) == 200
# Class, change of the truth's positions, and the cause.
WRONG_POSITIONS = {
    "millimetres": (1e3 * pl.col("x_m"), 1e3 * pl.col("y_m"), r"\(millimetres\?\)"),
    "centimetres": (1e2 * pl.col("x_m"), 1e2 * pl.col("y_m"), r"\(centimetres\?\)"),
    "kilometres": (1e-3 * pl.col("x_m"), 1e-3 * pl.col("y_m"), r"\(kilometres\?\)"),
    "constant": (0.0 * pl.col("x_m"), 0.0 * pl.col("y_m"), "extend over 0, those of the drive"),
    "spike": (pl.col("x_m") + SPIKE * 500.0, pl.col("y_m"), r"jumps by 500 m in 0.05 s at 10.0"),
    "huge": (pl.col("x_m") + SPIKE * 1e30, pl.col("y_m"), r"jumps by 1e\+30 m in 0.05 s at 10.0"),
}


@pytest.mark.parametrize("kind", WRONG_POSITIONS)
def test_a_truth_with_impossible_positions_is_rejected(
    located: tuple[Robot, drives.Drive], kind: str
) -> None:
    whole, drive = located
    x_m, y_m, says = WRONG_POSITIONS[kind]
    with pytest.raises(InputError, match=says):
        drives.error_m(drive.poses, whole.truth.with_columns(x_m=x_m, y_m=y_m))


@pytest.mark.parametrize(
    ("x_m", "y_m", "says"),
    [
        (pl.col("x_m") + 500.0, pl.col("y_m") - 80.0, "turned by -?0.0"),
        (-pl.col("y_m"), pl.col("x_m"), "turned by -1.5"),
        (pl.col("y_m"), pl.col("x_m"), "turned by 1.5.*with y reversed before"),
    ],
)
def test_a_truth_in_another_frame_nearby_is_reported(
    located: tuple[Robot, drives.Drive], x_m: pl.Expr, y_m: pl.Expr, says: str
) -> None:
    whole, drive = located
    assert truth_doubt(drive, whole.truth) is None
    doubt = truth_doubt(drive, whole.truth.with_columns(x_m=x_m, y_m=y_m))
    assert doubt is not None
    assert re.search(says, doubt), doubt


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x1f\x8b\0", "is compressed"),
        (b"\x89MCAP0\r\n", "is MCAP, not TUM"),
        (b"0,1,2,0,0,0,0,1\n", "separated by blanks, with decimal points"),
        (b"0 1e256 2 0 0 0 0 1\n", "x and y must be within 1e8 m"),
    ],
)
def test_files_other_than_trajectories_are_rejected(
    tmp_path: Path, content: bytes, says: str
) -> None:
    file = tmp_path / "truth.tum"
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        drives.read_tum(file)
    file.write_bytes("0 1 2 0 0 0 0 1\n".encode("utf-16"))
    assert drives.read_tum(file)["x_m"].to_list() == [1.0]


# Class, change of the text of a table, and the cause; `None`: it is read as the table itself.
NOTATIONS: dict[str, tuple[Callable[[str], str | bytes], str | None]] = {
    "sep=": (lambda it: "sep=;\r\n" + it.replace(",", ";"), None),
    "byte order mark, comment": (lambda it: "\ufeff# note\n" + it, None),
    "indented comment": (lambda it: "  # note\n" + it, None),
    "decimal commas": (lambda it: it.replace(",", ";").replace(".", ","), None),
    "UTF-32": (lambda it: it.encode("utf-32"), "is UTF-32"),
    "commented header": (lambda it: "#" + it, "the header must not begin with #"),
    "capitals": (lambda it: it.replace("time_s", "TIME_S"), "write time_s instead of TIME_S"),
    "unit": (
        lambda it: it.replace("time_s", "time_s [s]"),
        r"write time_s instead of time_s \[s\]",
    ),
    "bars": (lambda it: it.replace(",", "|"), "separate the columns by commas"),
    "blanks": (lambda it: it.replace(",", "  "), "separate the columns by commas"),
}


@pytest.mark.parametrize("table", ["odometry.csv", "angles.csv"])
@pytest.mark.parametrize("kind", NOTATIONS)
def test_tables_are_read_or_rejected_with_the_notation(
    tmp_path: Path, kind: str, table: str
) -> None:
    change, says = NOTATIONS[kind]
    short = robot(4.0)
    short.write(tmp_path)
    files = [tmp_path / name for name in ("odometry.csv", "angles.csv")]
    site, vehicle = Site.from_toml(short.site()), Vehicle.from_toml(short.vehicle())

    def located() -> drives.Drive:
        return drives.locate(site, *files, vehicle=vehicle, start=short.start)

    as_given = located()
    changed = change((tmp_path / table).read_text())
    (tmp_path / table).write_bytes(changed if isinstance(changed, bytes) else changed.encode())
    if says is None:
        assert located().poses.equals(as_given.poses)
    else:
        with pytest.raises(RecordingError, match=f"{table}.*{says}"):
            located()


def test_angles_are_sorted_and_repeated_ones_are_left_out(tmp_path: Path) -> None:
    whole = robot(20.0)
    as_given = whole.locate(tmp_path)
    given = whole.angles
    whole.angles = given.sample(fraction=1.0, shuffle=True, seed=1)
    drive = whole.locate(tmp_path)
    assert any("the angles were sorted by time" in it for it in drive.remarks)
    assert whole.rms_error_m(drive) < whole.rms_error_m(as_given) + 0.02
    whole.angles = pl.concat([given, given])
    drive = whole.locate(tmp_path)
    assert any("has the same angle at" in it for it in drive.remarks)
    assert drive.poses.equals(as_given.poses)


def test_a_single_row_of_odometry_is_reported_as_the_cause(tmp_path: Path) -> None:
    whole = robot(10.0)
    whole.odometry = whole.odometry.head(1)
    with pytest.raises(
        RecordingError, match=r"odometry\.csv: the odometry contains fewer than two"
    ):
        whole.locate(tmp_path)


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


def test_a_truth_of_a_part_of_the_drive_is_reported(access_av: Cli, tmp_path: Path) -> None:
    whole = robot(20.0)
    arguments = whole.write(tmp_path)
    # The orientation of a truth is not used: it may be anything.
    lines = (tmp_path / "truth.tum").read_text().splitlines()
    cut = [" ".join([*line.split()[:4], "0 0 0 0"]) for line in lines[1:301]]
    (tmp_path / "truth.tum").write_text("\n".join(cut))
    done = access_av(*arguments, "--truth", tmp_path / "truth.tum")
    assert done.code == 0
    assert "over 75% of the drive" in " ".join(done.out.split())


def test_an_unavailable_drive_is_not_reliable(tmp_path: Path) -> None:
    """Contradictory radio heads cause an exit code, independent of the diagnosis."""
    whole = robot(40.0)
    rng = pl.Series([math.tau * ((k * 0.618) % 1.0) for k in range(whole.angles.height)])
    whole.angles = whole.angles.with_columns(phase_rad=rng - math.pi)
    drive = whole.locate(tmp_path)
    assert drive.unavailable_share > 0.2
    assert not drive.is_reliable
