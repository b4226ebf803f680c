"""Simulated log files of a drive through a hall, from docs/locate.md only; a textbook filter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

HEADS_M = {21: (35.0, -12.0, 6.0), 22: (125.0, 30.0, 6.0), 23: (55.0, 92.0, 6.0)}
LEGS_M_RAD = [(100.0, 0.0), (25.0, math.pi / 2), (50.0, 0.0), (25.0, math.pi / 2), (100.0, 0.0)]
STEP_S, EVERY, LAP_S = 0.02, 10, 105.0
SIGMA_RAD, MOUNTING_STD_RAD = 0.05, 0.01
SCALE_STD, NOISE_M, TURN_NOISE_RAD, BIAS_STD_RADPS = 0.01, 0.02, 0.003, 0.002
LANE_RMS_M, LANE_WAVE_M = 0.06, 25.0
START_STD = (0.3, 0.05)  # metres, radians


@dataclass
class World:
    """Simulated conditions; ``stays``: correlation of half of the angle variance (s or m)."""

    seed: int = 1
    outliers: float = 0.03
    stays_s: float = 0.0
    stays_m: float = 0.0
    late_s: float = 0.0
    start_off: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass
class HallDrive:
    """Columns of the files; angles are rows of time, radio head and electrical angle."""

    time_s: np.ndarray
    truth: np.ndarray
    distance_m: np.ndarray
    yaw_radps: np.ndarray
    angles: np.ndarray
    start: np.ndarray


def phase_rad(pose: np.ndarray, head: tuple[float, float, float]) -> float:
    """Electrical angle (rad) of an array along the vehicle's axis, at height 0."""
    dx, dy = head[0] - pose[0], head[1] - pose[1]
    along = dx * math.cos(pose[2]) + dy * math.sin(pose[2])
    return math.pi * along / math.hypot(dx, dy, head[2])


def simulate(world: World) -> HallDrive:
    """One drive through the hall: two bends, a stop, lane keeping within decimetres."""
    rng = np.random.default_rng(world.seed)
    time_s = np.arange(0.0, LAP_S, STEP_S)
    speed = 3.0 + 0.5 * np.sin(0.2 * time_s) - 3.0 * np.exp(-(((time_s - 45.0) / 3.0) ** 4))
    speed = np.maximum(speed, 0.0) * np.minimum(time_s / 3.0, 1.0)
    along = np.cumsum(speed) * STEP_S  # along the centre line of the road
    ends = np.cumsum([0.0, *(length for length, _ in LEGS_M_RAD)])
    turns = np.cumsum([0.0, *(turn for _, turn in LEGS_M_RAD)])
    fine = np.arange(0.0, along[-1] + 1.0, 1e-3)
    middle = np.interp(fine + 5e-4, ends, turns)
    road = np.cumsum(np.stack([np.cos(middle), np.sin(middle)]) * 1e-3, axis=1)
    swing = 2 * math.pi * along / LANE_WAVE_M + rng.uniform(0, 2 * math.pi)
    aside = math.sqrt(2) * LANE_RMS_M * np.array([1, 2 * math.pi / LANE_WAVE_M])
    lane, aside = np.interp(along, ends, turns), aside * np.stack([np.sin(swing), np.cos(swing)]).T
    xy = np.stack([np.interp(along, fine + 1e-3, axis) for axis in road])
    xy += np.stack([-np.sin(lane), np.cos(lane)]) * aside[:, 0]
    heading = lane + np.arctan(aside[:, 1])
    rate = np.diff(heading, prepend=heading[0]) / STEP_S
    truth, moved = np.column_stack([xy.T, heading]), np.hypot(*np.diff(xy, prepend=xy[:, :1]))
    steps = moved + NOISE_M * np.sqrt(moved) * rng.normal(size=speed.size)
    distance = np.cumsum(steps) * (1 + SCALE_STD * rng.normal())
    noise = TURN_NOISE_RAD / math.sqrt(STEP_S) * rng.normal(size=speed.size)
    yaw = rate + BIAS_STD_RADPS * rng.normal() + noise
    mounting, stays = MOUNTING_STD_RAD * rng.normal(), {pci: rng.normal() for pci in HEADS_M}
    share = 0.5 if world.stays_s or world.stays_m else 0.0
    angles, late, last = [], round(world.late_s / STEP_S), 0.0
    for k in range(max(EVERY, -late), time_s.size - max(late, 0), EVERY):
        passed = EVERY * STEP_S / world.stays_s if world.stays_s else 0.0
        passed += (along[k] - last) / world.stays_m if world.stays_m else 0.0
        kept, last = math.exp(-passed), along[k]
        for pci, head in HEADS_M.items():
            stays[pci] = kept * stays[pci] + math.sqrt(1 - kept**2) * rng.normal()
            error = math.sqrt(share) * stays[pci] + math.sqrt(1 - share) * rng.normal()
            phase = phase_rad(truth[k] + np.array([0.0, 0.0, mounting]), head) + SIGMA_RAD * error
            if rng.random() < world.outliers:
                phase = rng.uniform(-math.pi, math.pi)
            angles.append((time_s[k + late], pci, math.remainder(phase, 2 * math.pi)))
    draw = rng.normal(size=3) * (START_STD[0], START_STD[0], START_STD[1])
    start = truth[0] + draw + world.start_off
    return HallDrive(time_s, truth, distance, yaw, np.array(angles), start)


def textbook(drive: HallDrive) -> tuple[np.ndarray, np.ndarray]:
    """Kalman filter over pose, odometer scale, bias and mounting: poses and covariances."""
    state = np.array([*drive.start, 1.0, 0.0, 0.0])
    stds = [START_STD[0], START_STD[0], START_STD[1], SCALE_STD, BIAS_STD_RADPS, MOUNTING_STD_RAD]
    covariance, received = np.diag(stds) ** 2, 0
    poses, covariances = [state[:3].copy()], [covariance[:2, :2].copy()]
    for k in range(1, drive.time_s.size):
        length = (drive.distance_m[k] - drive.distance_m[k - 1]) / state[3]
        turn = (drive.yaw_radps[k] - state[4]) * STEP_S
        c, s = math.cos(state[2] + turn / 2), math.sin(state[2] + turn / 2)
        f = np.eye(6)
        f[0, 2:5] = -length * s, -length * c / state[3], 0.5 * length * s * STEP_S
        f[1, 2:5] = length * c, -length * s / state[3], -0.5 * length * c * STEP_S
        f[2, 4] = -STEP_S
        state[:3] += length * c, length * s, turn
        along, turned = np.array([c, s, 0.0]), np.array([-0.5 * length * s, 0.5 * length * c, 1.0])
        covariance = f @ covariance @ f.T
        covariance[:3, :3] += NOISE_M**2 * abs(length) * np.outer(along, along)
        covariance[:3, :3] += TURN_NOISE_RAD**2 * STEP_S * np.outer(turned, turned)
        while received < len(drive.angles) and drive.angles[received, 0] <= drive.time_s[k] + 1e-9:
            _, pci, measured = drive.angles[received]
            received += 1
            head, at = HEADS_M[int(pci)], state[:3] + np.array([0.0, 0.0, state[5]])
            dx, dy, square = head[0] - at[0], head[1] - at[1], 0.0
            square = dx * dx + dy * dy + head[2] ** 2
            along_m = dx * math.cos(at[2]) + dy * math.sin(at[2])
            across_m = dy * math.cos(at[2]) - dx * math.sin(at[2])
            row = np.zeros(6)
            row[0] = along_m * dx / square - math.cos(at[2])
            row[1] = along_m * dy / square - math.sin(at[2])
            row[2] = row[5] = across_m
            row *= math.pi / math.sqrt(square)
            residual = math.remainder(measured - phase_rad(at, head), 2 * math.pi)
            variance = row @ covariance @ row + SIGMA_RAD**2
            if residual**2 < 15.0 * variance:
                gain = covariance @ row / variance
                state = state + gain * residual
                covariance = covariance - np.outer(gain, gain) * variance
        poses.append(state[:3].copy())
        covariances.append(covariance[:2, :2].copy())
    return np.array(poses), np.array(covariances)
