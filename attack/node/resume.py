"""State after SIGKILL: the MCAP file is readable, and the last pose is resumed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

if TYPE_CHECKING:
    from pathlib import Path

    from attack.node.run import Recorded

# Maximum time between the last readable MCAP message and the kill (s).
LOST_S = 2.0
# 99.9 % quantile of χ² with 3 degrees of freedom.
LARGEST_NEES = 16.27


def last_message_s(file: Path) -> float | None:
    """Log time (s) of the last message that a reader without an index finds."""
    last_s = None
    with file.open("rb") as stream:
        try:
            for _, _, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
                last_s = max(last_s or 0.0, message.log_time * 1e-9)
        except (McapError, EOFError, ValueError):
            pass  # the end of a file that was not closed
    return last_s


def check(run: Recorded) -> list[str]:
    """Violations of the requirements after SIGKILL."""
    violations = []
    kill_s = run.epoch_s + run.window.begin_s
    files = sorted((run.folder / "disk").rglob("*.mcap"), key=lambda it: it.stat().st_mtime)
    last_s = last_message_s(files[0]) if files else None
    if last_s is None:
        violations.append("MCAP file of the killed process is unreadable")
    elif kill_s - last_s > LOST_S:
        violations.append(f"MCAP file ends {kill_s - last_s:.1f} s before the kill")
    start_s = run.epoch_s + run.window.end_s
    poses = [
        content
        for at_s, output, content in run.arrivals
        if output == "json"
        and at_s > start_s
        and content.get("type") == "pose"
        and content.get("covariance") is not None
    ]
    if not poses:
        return [*violations, "no pose after the restart"]
    first = poses[0]
    if first["state"] in ("waiting", "searching", "lost"):
        return [*violations, f"pose not resumed: {first['state']}"]
    truth = run.motion.pose(first["time_s"] - run.epoch_s)
    error = np.array(
        [
            first["x_m"] - truth.x_m,
            first["y_m"] - truth.y_m,
            math.remainder(first["heading_rad"] - truth.heading_rad, math.tau),
        ]
    )
    nees = float(error @ np.linalg.solve(np.array(first["covariance"]), error))
    if not 0.0 <= nees <= LARGEST_NEES:
        distance_m = math.hypot(error[0], error[1])
        violations.append(f"resumed pose outside its covariance: {distance_m:.1f} m")
    return violations
