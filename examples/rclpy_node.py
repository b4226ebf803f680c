"""A ROS 2 node in about fifty lines: odometry and angles in, pose and diagnostics out.

    python examples/rclpy_node.py site.toml vehicle.toml

`/odom` (nav_msgs/Odometry) gives the motion of the vehicle. `/angles` (std_msgs/String, JSON with
the arguments of `access_av.Live.angle`) gives the measurements. `/initialpose`
(PoseWithCovarianceStamped) sets the pose.
"""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING, Any

import access_av

if TYPE_CHECKING:
    from collections.abc import Callable

AXES = (0, 1, 5)  # x, y and yaw of a covariance of six axes


def seconds(stamp: Any) -> float:
    """Converts a ROS time stamp to seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec


def main(arguments: list[str]) -> None:
    """Runs the node of the given site and vehicle."""
    import rclpy
    from diagnostic_msgs.msg import DiagnosticStatus
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Odometry
    from std_msgs.msg import String

    site, vehicle = access_av.Site.load(arguments[0]), access_av.Vehicle.load(arguments[1])
    live = access_av.Live(site, vehicle)
    rclpy.init()
    node = rclpy.create_node("access_av")
    poses = node.create_publisher(PoseWithCovarianceStamped, "access_av/pose", 10)
    states = node.create_publisher(DiagnosticStatus, "access_av/status", 10)

    def taken(take: Callable[..., Any], *given: Any, **named: Any) -> None:
        try:
            take(*given, **named)
        except (TypeError, ValueError) as refused:  # the state of `live` is unchanged
            node.get_logger().warning(str(refused))

    def odometry(message: Any) -> None:
        twist = message.twist.twist
        time_s, yaw_rate_radps = seconds(message.header.stamp), twist.angular.z
        taken(live.odometry, time_s, twist.linear.x, yaw_rate_radps=yaw_rate_radps)

    def angle(message: Any) -> None:
        taken(lambda: live.angle(**json.loads(message.data)))

    def initial_pose(message: Any) -> None:
        pose, six = message.pose.pose, message.pose.covariance
        heading_rad = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        covariance = [[six[6 * row + column] for column in AXES] for row in AXES]
        place = (pose.position.x, pose.position.y, heading_rad)
        taken(live.set_pose, seconds(message.header.stamp), place, covariance)

    def tell() -> None:
        now = node.get_clock().now().to_msg()
        status = live.status(seconds(now))
        level = b"\x00" if status.state == "ok" else b"\x01" if status.is_localized else b"\x02"
        said = f"{status.state}: {status.reason}; {status.what_to_do}"
        states.publish(DiagnosticStatus(level=level, name="access_av", message=said))
        if status.pose is None or status.covariance is None or not status.is_localized:
            return
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = now, "map"
        message.pose.pose.position.x, message.pose.pose.position.y, heading_rad = status.pose
        message.pose.pose.orientation.z = math.sin(0.5 * heading_rad)
        message.pose.pose.orientation.w = math.cos(0.5 * heading_rad)
        for row, variances in zip(AXES, status.covariance, strict=True):
            for column, variance in zip(AXES, variances, strict=True):
                message.pose.covariance[6 * row + column] = variance
        poses.publish(message)

    node.create_subscription(Odometry, "odom", odometry, 50)
    node.create_subscription(String, "angles", angle, 50)
    node.create_subscription(PoseWithCovarianceStamped, "initialpose", initial_pose, 1)
    node.create_timer(0.1, tell)
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1:])
