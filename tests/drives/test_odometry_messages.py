"""Odometry messages of different drivers: the motion is determined, or the invalid field is
reported."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import pytest

import bag
from access_av import RecordingError, Site, Vehicle, drives
from robot import Robot, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

DURATION_S = 50.0  # reverses from 40 s on
EPOCH_S = 1.7e9
# Maximum difference (m) between the RMS errors of one drive with two correct odometries: a fifth of
# the error, which is below 0.1 m.
SAME_M = 0.02


@dataclass
class Fields:
    """The fields of one message that a driver fills."""

    time_s: float
    x_m: float
    y_m: float
    heading_rad: float | None
    speed_mps: float
    side_mps: float
    yaw_rate_radps: float

    def message(self) -> bag.Message:
        return bag.odometry(
            self.time_s,
            self.x_m,
            self.y_m,
            self.speed_mps,
            side_mps=self.side_mps,
            heading_rad=self.heading_rad,
            yaw_rate_radps=self.yaw_rate_radps,
        )


@pytest.fixture(scope="module")
def driven() -> Robot:
    return robot(DURATION_S, epoch_s=EPOCH_S)


@pytest.fixture(scope="module")
def fields(driven: Robot) -> list[Fields]:
    rows = driven.truth.join(driven.odometry, on="time_s").iter_rows(named=True)
    names = ("time_s", "x_m", "y_m", "heading_rad", "speed_mps", "yaw_rate_radps")
    return [Fields(side_mps=0.0, **{name: row[name] for name in names}) for row in rows]


@pytest.fixture(scope="module")
def as_csv_m(driven: Robot, tmp_path_factory: pytest.TempPathFactory) -> float:
    """RMS error (m) with the odometry as CSV."""
    return driven.rms_error_m(driven.locate(tmp_path_factory.mktemp("csv")))


def locate(driven: Robot, place: Path, messages: list[Fields]) -> Any:
    driven.write(place)
    return drives.locate(
        Site.from_toml(driven.site()),
        bag.write(place / "bag", [it.message() for it in messages]),
        place / "angles.csv",
        vehicle=Vehicle.from_toml(driven.vehicle()),
        start=driven.start,
    )


def in_map(it: Fields) -> Fields:
    heading_rad = it.heading_rad or 0.0
    return replace(
        it,
        speed_mps=it.speed_mps * math.cos(heading_rad),
        side_mps=it.speed_mps * math.sin(heading_rad),
    )


def turned(it: Fields, by_rad: float) -> Fields:
    """Returns the drive in an odometry frame that is rotated against the site frame."""
    cos, sin = math.cos(by_rad), math.sin(by_rad)
    heading_rad = None if it.heading_rad is None else it.heading_rad + by_rad
    x_m, y_m = cos * it.x_m - sin * it.y_m, sin * it.x_m + cos * it.y_m
    return replace(it, x_m=x_m, y_m=y_m, heading_rad=heading_rad)


UNSIGNED = "twist.twist.linear.x has the wrong sign"
IN_MAP = "twist.twist.linear is in the frame of the pose"
TWIST_ALONE = "pose.pose.position never changes"
POSE_ALONE = "twist.twist.linear.x is not filled"

# Class, change of each message, and the report; the drive is located as by CSV.
FILLED: dict[str, tuple[Callable[[Fields], Fields], str | None]] = {
    "as they should be": (lambda it: it, None),
    "turned frame": (lambda it: turned(it, 2.0), None),
    "unsigned twist": (lambda it: replace(it, speed_mps=abs(it.speed_mps)), UNSIGNED),
    "unsigned twist, turned": (
        lambda it: turned(replace(it, speed_mps=abs(it.speed_mps)), -1.2), UNSIGNED,
    ),
    "opposite twist": (lambda it: replace(it, speed_mps=-it.speed_mps), UNSIGNED),
    "twist in the map": (in_map, IN_MAP),
    "twist in the map, turned by 90°": (lambda it: in_map(turned(it, math.pi / 2)), IN_MAP),
    "twist in the map, turned by 180°": (lambda it: in_map(turned(it, math.pi)), IN_MAP),
    "pose alone": (lambda it: replace(it, speed_mps=0.0), POSE_ALONE),
    "pose alone, twist NaN": (lambda it: replace(it, speed_mps=math.nan), POSE_ALONE),
    "twist alone": (lambda it: replace(it, x_m=0.0, y_m=0.0, heading_rad=0.0), TWIST_ALONE),
    "twist alone, pose NaN": (
        lambda it: replace(it, x_m=math.nan, y_m=math.nan, heading_rad=None), TWIST_ALONE,
    ),
    "twist alone, pose not at 0": (lambda it: replace(it, x_m=9.0, y_m=-4.0), TWIST_ALONE),
    "NaN in linear.y": (lambda it: replace(it, side_mps=math.nan), None),
}  # fmt: skip


@pytest.mark.parametrize("kind", FILLED)
def test_messages_of_different_drivers_are_read(
    driven: Robot, fields: list[Fields], as_csv_m: float, tmp_path: Path, kind: str
) -> None:
    change, says = FILLED[kind]
    drive = locate(driven, tmp_path, [change(it) for it in fields])
    remarks = [it for it in drive.remarks if "yaw_rate" not in it]
    assert driven.rms_error_m(drive) < as_csv_m + SAME_M, remarks
    assert drive.is_reliable
    if says is None:
        assert remarks == []
    else:
        assert any(says in it for it in remarks), remarks


@pytest.mark.parametrize(
    ("x_m", "field"),
    [(1.0001644e256, "x is 1.0001644e256"), (-3e13, "x is -3e13"), (math.inf, "x is missing")],
)
def test_an_invalid_position_is_omitted(
    driven: Robot, fields: list[Fields], as_csv_m: float, tmp_path: Path, x_m: float, field: str
) -> None:
    spoilt = list(fields)
    spoilt[300] = replace(spoilt[300], x_m=x_m)
    drive = locate(driven, tmp_path, spoilt)
    assert any(f"message 301: left out, pose.pose.position.{field}" in it for it in drive.remarks)
    assert all(len(it) < 300 for it in drive.remarks)
    assert drive.is_reliable
    assert driven.rms_error_m(drive) < as_csv_m + SAME_M


# Change of one message, and the report; the value is replaced by the messages next to it.
SPIKES: dict[str, tuple[Callable[[Fields], Fields], str]] = {
    "speed 1e256": (lambda it: replace(it, speed_mps=1e256), "twist.twist.linear.x is 1e256, far"),
    "speed 60": (lambda it: replace(it, speed_mps=60.0), "twist.twist.linear.x is 60.000, far"),
    "side 1e256": (lambda it: replace(it, side_mps=1e256), "twist.twist.linear.y is 1e256, far"),
    "yaw rate 1e256": (
        lambda it: replace(it, yaw_rate_radps=1e256), "twist.twist.angular.z is 1e256, far",
    ),
    "position 5e7": (lambda it: replace(it, x_m=5e7), "pose.pose.position jumps by"),
    "speed alone 60": (
        lambda it: replace(it, x_m=0.0, y_m=0.0, heading_rad=0.0, speed_mps=60.0),
        "twist.twist.linear.x is 60.000, far",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", SPIKES)
def test_one_impossible_value_does_not_move_the_vehicle(
    driven: Robot, fields: list[Fields], as_csv_m: float, tmp_path: Path, kind: str
) -> None:
    change, says = SPIKES[kind]
    is_twist = "alone" in kind
    spoilt = [replace(it, x_m=0.0, y_m=0.0, heading_rad=0.0) if is_twist else it for it in fields]
    spoilt[300] = change(spoilt[300])
    drive = locate(driven, tmp_path, spoilt)
    assert any(f"message 301: {says}" in it for it in drive.remarks), drive.remarks
    assert all(len(it) < 300 for it in drive.remarks)
    assert drive.is_reliable
    assert driven.rms_error_m(drive) < as_csv_m + SAME_M


@pytest.mark.parametrize("value", [0.0, math.nan])
def test_messages_without_motion_are_rejected(
    driven: Robot, fields: list[Fields], tmp_path: Path, value: float
) -> None:
    empty = [replace(it, x_m=value, y_m=value, speed_mps=value) for it in fields]
    drive = locate(driven, tmp_path, empty)
    assert not drive.is_reliable
    assert any("pose.pose.position never changes" in it for it in drive.diagnoses), drive.diagnoses


def test_a_late_first_usable_message_is_reported(
    driven: Robot, fields: list[Fields], tmp_path: Path
) -> None:
    late = [replace(it, x_m=math.nan) if k < 100 else it for k, it in enumerate(fields)]
    drive = locate(driven, tmp_path, late)
    assert any("its first 5.0 s are not usable" in it for it in drive.remarks)
    assert not drive.is_reliable


@pytest.mark.parametrize("stamps_s", [[0.0], [0.0, 0.0, 0.0], [0.0, 0.1, 0.2], [12.5, 12.6]])
def test_stamps_before_the_clock_was_set_are_left_out(
    driven: Robot, fields: list[Fields], as_csv_m: float, tmp_path: Path, stamps_s: list[float]
) -> None:
    early = [replace(fields[0], time_s=time_s) for time_s in stamps_s]
    drive = locate(driven, tmp_path, [*early, *fields])
    said = f"message 1: left out, header.stamp is {stamps_s[0]:g} s, before the clock was set"
    assert any(said in it for it in drive.remarks), drive.remarks
    assert drive.poses["time_s"][0] == pytest.approx(EPOCH_S)
    assert drive.is_reliable
    assert driven.rms_error_m(drive) < as_csv_m + SAME_M


def test_the_recorder_time_replaces_a_missing_stamp(
    driven: Robot, fields: list[Fields], as_csv_m: float, tmp_path: Path
) -> None:
    messages = [it.message() for it in fields]
    for k in range(30):
        recorded_s = messages[k].time_s
        messages[k] = replace(fields[k], time_s=0.0).message()
        messages[k].time_s = recorded_s
    driven.write(tmp_path)
    drive = drives.locate(
        Site.from_toml(driven.site()),
        bag.write(tmp_path / "bag", messages),
        tmp_path / "angles.csv",
        vehicle=Vehicle.from_toml(driven.vehicle()),
        start=driven.start,
    )
    (said,) = [it for it in drive.remarks if "before the clock was set" in it]
    assert "the time at which it was recorded is used instead (and 29 more like this)" in said
    assert drive.poses.height == len(fields)
    assert driven.rms_error_m(drive) < as_csv_m + SAME_M


def test_lateral_motion_is_reported_if_it_causes_an_error(
    driven: Robot, fields: list[Fields], tmp_path: Path
) -> None:
    """A vehicle that slides by 6 m differs from the position of its odometer."""
    sliding = [replace(it, side_mps=0.4 if k > 600 else 0.0) for k, it in enumerate(fields)]
    drive = locate(driven, tmp_path, sliding)
    assert any("twist.twist.linear.y is not 0" in it for it in drive.remarks)


def test_fields_and_topics_have_the_names_of_the_file(
    access_av: Cli, driven: Robot, fields: list[Fields], tmp_path: Path
) -> None:
    *given, _ = driven.write(tmp_path)
    folder = bag.write(tmp_path / "bag", [it.message() for it in fields[:40]])
    given[given.index("--odometry") + 1] = folder
    done = access_av(*given, tmp_path / "out", "--topic", "odom")
    assert done.code == 2
    assert "`odom` is missing; nav_msgs/msg/Odometry in CDR is on /odom" in " ".join(
        done.err.split()
    )
    unfilled = [replace(it, x_m=0.0, y_m=0.0, speed_mps=0.1) for it in fields[:40]]
    unfilled[7] = replace(unfilled[7], speed_mps=math.nan)
    again = tmp_path / "again"
    again.mkdir()
    remarks = locate(driven, again, unfilled).remarks
    assert any("message 8: left out, twist.twist.linear.x is missing" in it for it in remarks)
    assert not any("speed_mps" in it for it in remarks)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("drive.mcap.zst", b"\x28\xb5\x2f\xfd\0\0", "zstd -d"),
        ("drive.bag", b"#ROSBAG V2.0\n\0\0", "rosbags-convert"),
        ("drive.parquet", b"PAR1\0\0", "is Parquet, not CSV"),
        ("drive.csv.gz", b"\x1f\x8b\0\0", "gunzip"),
        ("drive.xlsx", b"PK\x03\x04\0\0", "write the table as CSV"),
        ("metadata.yaml", b"rosbag2_bagfile_information:\n", "give the rosbag2 folder"),
        ("numbers.csv", b"0.0,1.0\n0.1,1.1\n", "no header"),
        ("wide.csv", "time_s,speed_mps\n0,1\n".encode("utf-16-le"), "UTF-16"),
    ],
)
def test_other_formats_are_reported(
    driven: Robot, tmp_path: Path, name: str, content: bytes, says: str
) -> None:
    driven.write(tmp_path)
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(RecordingError, match=says) as error:
        drives.locate(
            Site.from_toml(driven.site()), file, tmp_path / "angles.csv", start=driven.start
        )
    assert name in str(error.value)
    assert str(error.value).isprintable()


def test_utf_16_is_read(driven: Robot, tmp_path: Path) -> None:
    plain = driven.locate(tmp_path)
    text = (tmp_path / "odometry.csv").read_text()
    wide = tmp_path / "wide.csv"
    wide.write_bytes(text.encode("utf-16"))
    drive = drives.locate(
        Site.from_toml(driven.site()),
        wide,
        tmp_path / "angles.csv",
        vehicle=Vehicle.from_toml(driven.vehicle()),
        start=driven.start,
    )
    assert drive.poses.equals(plain.poses)
