"""Transmitter: angle messages of every radio head, from the geometry of `environment`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from attack.node.environment import BURST_PERIOD_S, HEADS, electrical_angle_rad
from attack.node.message import Message

if TYPE_CHECKING:
    import numpy as np

    from attack.node.environment import Motion

# Standard deviation of the electrical angle, as stated in each message (rad).
SIGMA_RAD = 0.02
SNR_DB = 20.0
# Time between SSBs of neighbouring index (s).
SSB_SPACING_S = 3e-4
# Time from an SSB to the arrival of its angle at the node (s).
LATENCY_S = 0.006


def messages(
    motion: Motion,
    duration_s: float,
    random: np.random.Generator,
    heads: tuple[tuple[int, float, float, float], ...] = HEADS,
    first_index: int = 0,
) -> list[Message]:
    """Angle messages of a whole run, in drive time."""
    made = []
    for burst in range(1, round(duration_s / BURST_PERIOD_S)):
        for number, (pci, *head_m) in enumerate(heads):
            index = first_index + number
            time_s = burst * BURST_PERIOD_S + index * SSB_SPACING_S
            x_m, y_m, z_m = head_m
            angle_rad = electrical_angle_rad(motion.pose(time_s), (x_m, y_m, z_m))
            angle = {
                "type": "angle",
                "time_s": time_s,
                "pci": pci,
                "ssb_index": index,
                "phase_rad": angle_rad + random.normal(0.0, SIGMA_RAD),
                "phase_sigma_rad": SIGMA_RAD,
                "snr_db": SNR_DB,
            }
            made.append(Message(time_s + LATENCY_S, angle))
    return made
