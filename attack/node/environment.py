"""Site, vehicle and true motion of a campaign run, independent of the product's simulator.

A hall of 110 m × 60 m with six radio heads. The road is a polyline with rounded corners; its
geometry is computed here, not by the product.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np

# Radio heads: PCI, x, y, z (m). The SSB index is the position in the table.
HEADS = (
    (21, -10.0, 20.0, 7.0),
    (22, 30.0, -12.0, 6.0),
    (23, 65.0, 16.0, 7.0),
    (24, 108.0, -8.0, 6.0),
    (25, 112.0, 58.0, 7.0),
    (26, 40.0, 64.0, 6.0),
)
# Corners of the road (m).
CORNERS_M = ((-20.0, 0.0), (95.0, 0.0), (95.0, 50.0), (-20.0, 50.0))
# Corner radius of the road (m).
RADIUS_M = 8.0
# Height of the antennas above the ground (m).
ANTENNA_HEIGHT_M = 1.8
# Period of the SSB bursts (s).
BURST_PERIOD_S = 0.04
# Alert limit of the vehicle (m): the default of the vehicle file.
ALERT_LIMIT_M = 1.5
# Acceleration and braking of the vehicle (m/s²).
ACCELERATION_MPS2 = 0.5
BRAKING_MPS2 = 1.0


class Pose(NamedTuple):
    """Position (m) and heading (rad) in the map frame."""

    x_m: float
    y_m: float
    heading_rad: float


class _Segment(NamedTuple):
    start: Pose
    length_m: float
    curvature_per_m: float


def _road() -> list[_Segment]:
    """Lines and arcs of the road, in the order of driving."""
    segments = []
    x_m, y_m = CORNERS_M[0]
    headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(CORNERS_M)]
    for index, heading in enumerate(headings):
        corner = CORNERS_M[index + 1]
        is_last = index + 1 == len(headings)
        turn = 0.0 if is_last else headings[index + 1] - heading
        turn = math.remainder(turn, math.tau)
        tangent_m = RADIUS_M * math.tan(0.5 * abs(turn))
        length_m = math.hypot(corner[0] - x_m, corner[1] - y_m) - tangent_m
        segments.append(_Segment(Pose(x_m, y_m, heading), length_m, 0.0))
        x_m, y_m = x_m + length_m * math.cos(heading), y_m + length_m * math.sin(heading)
        if not is_last:
            curvature = math.copysign(1.0 / RADIUS_M, turn)
            arc = _Segment(Pose(x_m, y_m, heading), RADIUS_M * abs(turn), curvature)
            segments.append(arc)
            x_m, y_m, _ = _along(arc, arc.length_m)
    return segments


def _along(segment: _Segment, distance_m: float) -> Pose:
    (x_m, y_m, heading), curvature = segment.start, segment.curvature_per_m
    if curvature == 0.0:
        dx_m, dy_m = distance_m * math.cos(heading), distance_m * math.sin(heading)
        return Pose(x_m + dx_m, y_m + dy_m, heading)
    end = heading + curvature * distance_m
    dx_m = (math.sin(end) - math.sin(heading)) / curvature
    dy_m = (math.cos(heading) - math.cos(end)) / curvature
    return Pose(x_m + dx_m, y_m + dy_m, math.remainder(end, math.tau))


ROAD = _road()


@dataclass(frozen=True)
class Motion:
    """True motion along the road, with a piecewise linear speed."""

    start_m: float
    # Times (s) and speeds (m/s) between which the speed is linear; constant after the last.
    times_s: tuple[float, ...]
    speeds_mps: tuple[float, ...]
    # Amplitude (m), wavelength (m) and phase (rad) of the offset from the middle of the road.
    offset_m: float
    wavelength_m: float
    phase_rad: float

    @classmethod
    def draw(cls, random: np.random.Generator, stop_s: tuple[float, float] | None = None) -> Motion:
        """Draws start, speed and lane keeping; the vehicle stands between the times of `stop_s`."""
        speed_mps = float(random.uniform(1.6, 2.4))
        times_s, speeds_mps = [0.0, speed_mps / ACCELERATION_MPS2], [0.0, speed_mps]
        if stop_s is not None:
            begin_s, end_s = stop_s
            times_s += [begin_s, begin_s + speed_mps / BRAKING_MPS2]
            times_s += [end_s, end_s + speed_mps / ACCELERATION_MPS2]
            speeds_mps += [speed_mps, 0.0, 0.0, speed_mps]
        return cls(
            start_m=random.uniform(25.0, 40.0),
            times_s=tuple(times_s),
            speeds_mps=tuple(speeds_mps),
            offset_m=random.uniform(0.02, 0.1),
            wavelength_m=random.uniform(40.0, 60.0),
            phase_rad=random.uniform(0.0, math.tau),
        )

    def distance_m(self, time_s: float) -> float:
        """Distance driven since the start (m)."""
        driven_m = 0.0
        knots = [*zip(self.times_s, self.speeds_mps, strict=True), (math.inf, self.speeds_mps[-1])]
        for (begin_s, before_mps), (end_s, after_mps) in pairwise(knots):
            if time_s <= begin_s:
                break
            within_s = min(time_s, end_s) - begin_s
            slope = 0.0 if math.isinf(end_s) else (after_mps - before_mps) / (end_s - begin_s)
            driven_m += (before_mps + 0.5 * slope * within_s) * within_s
        return driven_m

    def pose(self, time_s: float) -> Pose:
        """Pose of the reference point of the odometry."""
        along_m = self.start_m + self.distance_m(time_s)
        rest_m = along_m
        for segment in ROAD:
            if rest_m <= segment.length_m or segment is ROAD[-1]:
                break
            rest_m -= segment.length_m
        middle = _along(segment, rest_m)
        wave = math.tau / self.wavelength_m
        offset_m = self.offset_m * math.sin(wave * along_m + self.phase_rad)
        slope = self.offset_m * wave * math.cos(wave * along_m + self.phase_rad)
        return Pose(
            middle.x_m - offset_m * math.sin(middle.heading_rad),
            middle.y_m + offset_m * math.cos(middle.heading_rad),
            middle.heading_rad + math.atan(slope),
        )


def electrical_angle_rad(pose: Pose, head_m: tuple[float, float, float]) -> float:
    """Electrical angle π cos α of a head, α from the forward axis, half a wavelength of spacing."""
    dx_m, dy_m, dz_m = head_m[0] - pose.x_m, head_m[1] - pose.y_m, head_m[2] - ANTENNA_HEIGHT_M
    azimuth_rad = math.atan2(dy_m, dx_m) - pose.heading_rad
    elevation_rad = math.atan2(dz_m, math.hypot(dx_m, dy_m))
    return math.pi * math.cos(azimuth_rad) * math.cos(elevation_rad)


def site_toml() -> str:
    """Site file."""
    corners = ", ".join(f"[{x}, {y}]" for x, y in CORNERS_M)
    heads = "".join(
        f"[[radio_heads]]\nposition_m = [{x}, {y}, {z}]\nposition_std_m = 0.05\n"
        f"pci = {pci}\nssb_index = {index}\n"
        for index, (pci, x, y, z) in enumerate(HEADS)
    )
    return (
        f'name = "campaign"\nssb.period_ms = {1e3 * BURST_PERIOD_S}\n'
        f"[road]\nwidth_m = 4.0\ncorner_radius_m = {RADIUS_M}\npolyline_m = [{corners}]\n{heads}"
    )


def vehicle_toml(motion: Motion, random: np.random.Generator) -> str:
    """Vehicle file, with a start pose that has the stated errors."""
    x_m, y_m, heading_rad = motion.pose(0.0)
    x_m, y_m = x_m + random.normal(0.0, 0.2), y_m + random.normal(0.0, 0.2)
    heading_rad += random.normal(0.0, 0.02)
    return f"""\
extends = "tugger"
name = "campaign"
[start]
pose = {{ x_m = {x_m}, y_m = {y_m}, heading_rad = {heading_rad} }}
position_std_m = 0.3
heading_std_rad = 0.03
"""
