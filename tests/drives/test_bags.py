"""rosbag2 folders: odometry, and yaw rates from all sources."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

import bag
from access_av import RecordingError
from robot import RATE_HZ, Robot, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

DURATION_S = 40.0
EPOCH_S = 1.7e9
IMU_HZ = 100.0


@pytest.fixture(scope="module")
def driven() -> Robot:
    """Times since 1970, as in a robot's log."""
    return robot(DURATION_S, epoch_s=EPOCH_S)


def odometry(driven: Robot, *, yaw: bool = False, heading: bool = False) -> list[bag.Message]:
    poses = driven.truth.join(driven.odometry, on="time_s")
    return [
        bag.odometry(
            row["time_s"],
            row["x_m"],
            row["y_m"],
            row["speed_mps"],
            yaw_rate_radps=row["yaw_rate_radps"] if yaw else 0.0,
            heading_rad=row["heading_rad"] if heading else None,
        )
        for row in poses.iter_rows(named=True)
    ]


def imu(
    driven: Robot, *, late_s: float = 0.0, turned: float = 1.0, **how: Any
) -> list[bag.Message]:
    """A gyroscope with its own sample times; the rate is constant between odometry samples."""
    time_s = driven.odometry["time_s"].to_numpy()
    rate = driven.odometry["yaw_rate_radps"].to_numpy()
    ticks_s = EPOCH_S + np.arange(0.0013, DURATION_S, 1.0 / IMU_HZ)
    at = np.minimum(np.searchsorted(time_s, ticks_s), rate.size - 1)
    return [
        bag.imu(float(tick_s) + late_s, turned * float(rate[k]), **how)
        for tick_s, k in zip(ticks_s, at, strict=True)
    ]


def locate(driven: Robot, place: Path, odometry: Path, **how: Any) -> Any:
    from access_av import Site, Vehicle, drives

    driven.write(place)
    return drives.locate(
        Site.from_toml(driven.site()),
        odometry,
        place / "angles.csv",
        vehicle=Vehicle.from_toml(driven.vehicle()),
        start=driven.start,
        **how,
    )


def source(drive: Any) -> str:
    (said,) = [it for it in drive.remarks if "yaw_rate_radps is taken from" in it]
    return str(said).split("taken from ")[1]


def test_the_source_of_the_yaw_rate_is_reported(driven: Robot, tmp_path: Path) -> None:
    """Yaw rates of an IMU, of the orientation and of the odometry give similar positions."""
    unchanged = locate(driven, tmp_path, tmp_path / "odometry.csv")
    unchanged_m = driven.rms_error_m(unchanged)
    cases = {
        "angular_velocity.z of /imu/data, whose z axis is assumed to point up": [
            *odometry(driven, heading=True),
            *imu(driven),
        ],
        "pose.orientation of /odom": odometry(driven, heading=True),
        "twist.angular.z of /odom; --imu-topic selects that of /imu/data": [
            *odometry(driven, yaw=True),
            *imu(driven, turned=-1.0),
        ],
    }
    for number, (said, messages) in enumerate(cases.items()):
        folder = bag.write(tmp_path / f"bag{number}", messages)
        drive = locate(driven, tmp_path, folder)
        assert source(drive) == said
        assert drive.poses.height == round(DURATION_S * RATE_HZ)
        assert drive.is_reliable
        # Heading differences do not contain the noise of the gyroscope.
        assert driven.rms_error_m(drive) < unchanged_m + 0.02, said
    silent = locate(driven, tmp_path, bag.write(tmp_path / "silent", odometry(driven)))
    assert not any("taken from" in it for it in silent.remarks)
    assert any("a differential drive has no source of the yaw rate" in it for it in silent.remarks)
    assert driven.rms_error_m(silent) > unchanged_m + 0.02


def test_an_unusable_imu_is_reported(driven: Robot, tmp_path: Path) -> None:
    turning = odometry(driven, heading=True)
    cases = {
        "without an angular velocity that is known": imu(driven, known=False),
        "zero in every angular velocity": imu(driven, turned=0.0),
        "stamped 1700001000.001 to 1700001039": imu(driven, late_s=1000.0),
    }
    for number, (why, messages) in enumerate(cases.items()):
        folder = bag.write(tmp_path / f"bag{number}", [*turning, *messages])
        drive = locate(driven, tmp_path, folder)
        assert source(drive) == "pose.orientation of /odom"
        (unused,) = [it for it in drive.remarks if "is not used" in it]
        assert why in unused
        with pytest.raises(RecordingError, match=why):
            locate(driven, tmp_path, folder, imu_topic="/imu/data")


def test_one_of_several_imus_is_selected(access_av: Cli, driven: Robot, tmp_path: Path) -> None:
    gyroscopes = [
        *imu(driven, topic="/imu/front"),
        *imu(driven, turned=-1.0, topic="/imu/back"),
    ]
    with_yaw = bag.write(tmp_path / "with_yaw", [*odometry(driven, yaw=True), *gyroscopes])
    without_yaw = bag.write(tmp_path / "without_yaw", [*odometry(driven), *gyroscopes])
    *given, _ = driven.write(tmp_path)

    def located(name: str, odometry: Path, *more: str) -> tuple[int, str]:
        given[given.index("--odometry") + 1] = odometry
        done = access_av(*given, tmp_path / name, *more)
        return done.code, " ".join(done.err.split())

    assert located("twist", with_yaw)[0] == 0
    code, said = located("front", with_yaw, "--imu-topic", "/imu/front")
    assert code == 0
    assert "taken from angular_velocity.z of /imu/front" in said
    # The diagnosis of the drive reports a reversed yaw rate.
    assert located("back", with_yaw, "--imu-topic", "/imu/back")[0] == 3
    code, said = located("left", with_yaw, "--imu-topic", "/imu/left")
    assert code == 2
    assert "`/imu/left` is missing" in said
    code, said = located("several", without_yaw)
    assert code == 2
    assert "choose one of /imu/back, /imu/front" in said
    assert located("chosen", without_yaw, "--imu-topic", "/imu/front")[0] == 0
    code, said = located("table", tmp_path / "odometry.csv", "--imu-topic", "/imu/front")
    assert code == 2
    assert "only an MCAP file or a rosbag2 folder has topics" in said


def test_several_files_are_read_in_order_of_time(driven: Robot, tmp_path: Path) -> None:
    messages = odometry(driven, heading=True)
    whole = locate(driven, tmp_path, bag.write(tmp_path / "whole", messages))
    folder = tmp_path / "split"
    folder.mkdir()
    names = [f"drive_{number}.mcap" for number in (10, 9, 2)]
    for number, name in enumerate(names):
        part = messages[number * 300 : (number + 1) * 300]
        file = bag.file_of(bag.write(tmp_path / f"part{number}", part))
        shutil.copy(file, folder / name)
    split = locate(driven, tmp_path, folder)
    assert split.poses.equals(whole.poses)
    assert split.remarks == whole.remarks
    listed = "".join(f"    - split/{name}\n" for name in names)
    metadata = folder / "metadata.yaml"
    metadata.write_text(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{listed}")
    assert locate(driven, tmp_path, folder).poses.height == whole.poses.height
    (folder / names[1]).unlink()
    with pytest.raises(RecordingError, match=r"metadata.yaml: `drive_9.mcap` is missing"):
        locate(driven, tmp_path, folder)
    metadata.unlink()
    gap = locate(driven, tmp_path, folder)
    assert gap.poses.height == whole.poses.height - 300
    assert any("s after the one before" in it for it in gap.remarks)
    damaged = folder / names[0]
    # A killed recorder leaves a file without an end; its complete messages are read.
    content = damaged.read_bytes()
    damaged.write_bytes(content[: len(content) // 2])
    cut = locate(driven, tmp_path, folder)
    assert any("drive_10.mcap: the file was not closed" in it for it in cut.remarks)
    # A length of 2^63 in the first record.
    damaged.write_bytes(content[:9] + b"\xff" * 7 + b"\x7f" + content[17:])
    with pytest.raises(RecordingError, match=r"drive_10.mcap: not valid MCAP.*mcap recover"):
        locate(driven, tmp_path, folder)


def test_files_other_than_mcap_are_rejected_with_advice(driven: Robot, tmp_path: Path) -> None:
    old = bag.write(tmp_path / "old", odometry(driven), storage=StoragePlugin.SQLITE3)
    (file,) = old.glob("*.db3")
    for path in (old, file):
        with pytest.raises(RecordingError, match=r"\.db3: .*sqlite3.*ros2 bag convert"):
            locate(driven, tmp_path, path)
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(RecordingError, match=r"empty: `\*.mcap` is missing"):
        locate(driven, tmp_path, empty)
    (empty / "drive.mcap.zstd").write_bytes(b"")
    with pytest.raises(RecordingError, match=r"drive.mcap.zstd: .*zstd -d"):
        locate(driven, tmp_path, empty)


def test_invalid_messages_are_omitted(driven: Robot, tmp_path: Path) -> None:
    """Invalid quaternions give no yaw rate; truncated messages are reported or counted."""
    messages = odometry(driven, heading=True)
    for k, wrong in ((100, (0.0,) * 4), (200, (float("nan"),) * 4), (300, (1e300,) * 4)):
        row = driven.truth.row(k, named=True)
        speed_mps = driven.odometry["speed_mps"][k]
        messages[k] = bag.odometry(
            row["time_s"], row["x_m"], row["y_m"], speed_mps, quaternion=wrong
        )
    messages[400].data = messages[400].data[:300]
    messages[500].data = messages[500].data[:12] + b"\xff\xff\xff\xff" + messages[500].data[16:]
    drive = locate(driven, tmp_path, bag.write(tmp_path / "bag", messages))
    assert drive.poses.height == driven.truth.height - 2
    assert sum("no complete nav_msgs/msg/Odometry" in it for it in drive.remarks) >= 1
    # An invalid quaternion leaves the steps before and after it without a yaw rate.
    assert any("twist.twist.angular.z is empty in 6 of 798 samples" in it for it in drive.remarks)
    gyroscope = imu(driven)
    gyroscope[7].data = gyroscope[7].data[:-8]
    gyroscope[8].data = gyroscope[8].data[:12] + b"\xff\xff\xff\x7f" + gyroscope[8].data[16:]
    gyroscope[9] = bag.imu(gyroscope[9].time_s, float("nan"))
    folder = bag.write(tmp_path / "cut", [*odometry(driven), *gyroscope])
    said = source(locate(driven, tmp_path, folder))
    assert said.endswith("assumed to point up; 3 of its messages are left out")
