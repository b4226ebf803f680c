"""Drives as rosbag2 folders, written by the independent library `rosbags`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

STORE = get_typestore(Stores.ROS2_HUMBLE)
ODOMETRY, IMU = "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu"


def made(name: str, *values: Any) -> Any:
    """Returns a message with the given fields, in their order."""
    return STORE.types[name](*values)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return made("geometry_msgs/msg/Vector3", x, y, z)


def header(time_s: float) -> Any:
    whole, rest = divmod(round(time_s * 1e9), 10**9)
    return made("std_msgs/msg/Header", made("builtin_interfaces/msg/Time", whole, rest), "frame")


@dataclass
class Message:
    """Content of a message, and its log time."""

    topic: str
    type: str
    time_s: float
    data: bytes


def odometry(
    time_s: float,
    x_m: float,
    y_m: float,
    speed_mps: float,
    *,
    heading_rad: float | None = None,
    side_mps: float = 0.0,
    yaw_rate_radps: float = 0.0,
    quaternion: tuple[float, float, float, float] | None = None,
    topic: str = "/odom",
) -> Message:
    """One `nav_msgs/msg/Odometry`; without heading and quaternion, the orientation is not set."""
    if quaternion is None:
        half = 0.5 * (heading_rad or 0.0)
        quaternion = (0.0, 0.0, math.sin(half), math.cos(half))
        if heading_rad is None:
            quaternion = (0.0, 0.0, 0.0, 0.0)
    nothing = np.zeros(36)
    point = made("geometry_msgs/msg/Point", x_m, y_m, 0.0)
    turned = made("geometry_msgs/msg/Quaternion", *quaternion)
    twist = made("geometry_msgs/msg/Twist", vector(speed_mps, side_mps), vector(z=yaw_rate_radps))
    whole = made(
        ODOMETRY,
        header(time_s),
        "base_link",
        made(
            "geometry_msgs/msg/PoseWithCovariance",
            made("geometry_msgs/msg/Pose", point, turned),
            nothing,
        ),
        made("geometry_msgs/msg/TwistWithCovariance", twist, nothing),
    )
    return Message(topic, ODOMETRY, time_s, bytes(STORE.serialize_cdr(whole, ODOMETRY)))


def imu(
    time_s: float, yaw_rate_radps: float, *, known: bool = True, topic: str = "/imu/data"
) -> Message:
    """One `sensor_msgs/msg/Imu` without orientation; unknown quantities have a covariance of −1."""
    unknown = np.array([-1.0, *[0.0] * 8])
    whole = made(
        IMU,
        header(time_s),
        made("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 0.0),
        unknown,
        vector(z=yaw_rate_radps),
        np.zeros(9) if known else unknown,
        vector(z=9.81),
        np.zeros(9),
    )
    return Message(topic, IMU, time_s, bytes(STORE.serialize_cdr(whole, IMU)))


def write(
    folder: Path, messages: Iterable[Message], *, storage: StoragePlugin = StoragePlugin.MCAP
) -> Path:
    """Writes a folder with one file, in order of time."""
    with Writer(folder, version=9, storage_plugin=storage) as bag:
        connections: dict[str, Any] = {}
        for it in sorted(messages, key=lambda it: it.time_s):
            if it.topic not in connections:
                connections[it.topic] = bag.add_connection(it.topic, it.type, typestore=STORE)
            bag.write(connections[it.topic], round(it.time_s * 1e9), it.data)
    return folder


def file_of(folder: Path) -> Path:
    """Returns the only file of a bag."""
    (file,) = folder.glob("*.mcap")
    return file
