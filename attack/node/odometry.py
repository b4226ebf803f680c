"""Odometry source: wheel speed and distance with a scale error and noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from attack.node.message import Message

if TYPE_CHECKING:
    import numpy as np

    from attack.node.environment import Motion

# Samples per second.
RATE_HZ = 50.0
# Standard deviation of the scale; the vehicle file states 0.003.
SCALE_STD = 0.002
# Standard deviation of the distance after 1 m (m); the vehicle file states 0.01.
NOISE_M_PER_SQRT_M = 0.007
# Time from a sample to its arrival at the node (s).
LATENCY_S = 0.002


def messages(motion: Motion, duration_s: float, random: np.random.Generator) -> list[Message]:
    """Odometry of a whole run, in drive time."""
    scale = 1.0 + random.normal(0.0, SCALE_STD)
    made, distance_m, driven_m = [], 0.0, 0.0
    for number in range(round(duration_s * RATE_HZ)):
        time_s = number / RATE_HZ
        step_m = motion.distance_m(time_s) - driven_m
        driven_m += step_m
        read_m = scale * step_m + random.normal(0.0, NOISE_M_PER_SQRT_M) * step_m**0.5
        distance_m += read_m
        sample = {
            "type": "odometry",
            "time_s": time_s,
            "speed_mps": read_m * RATE_HZ,
            "distance_m": distance_m,
        }
        made.append(Message(time_s + LATENCY_S, sample))
    return made
