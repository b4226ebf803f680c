"""Simulated log files of a small differential-drive robot among six radio heads."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

import access_av
from access_av import drives

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

RATE_HZ = 20.0
TRACK_M = 0.4
MOUNTING_RAD = math.pi / 2
SIGMA_RAD = 0.04
HEADS_M = {
    11: (6.0, 1.0), 12: (3.5, 5.5), 13: (-2.0, 6.0),
    14: (-6.5, -1.0), 15: (-1.0, -5.0), 16: (4.0, -4.5),
}  # fmt: skip
SHEET = """
name = "robot"
drive = "differential"
odometer = { scale_std = 0.02, noise_m_per_sqrt_m = 0.01 }
gyroscope = { noise_rad_per_sqrt_s = 0.01, bias_std_radps = 0.002 }
start = { position_std_m = 0.05, heading_std_rad = 0.05 }
"""


@dataclass
class Robot:
    """Contents of the files of a drive; tests change them before they locate the drive."""

    odometry: pl.DataFrame
    angles: pl.DataFrame
    truth: pl.DataFrame
    start: tuple[float, float, float]
    heads_m: dict[int, tuple[float, float]] = field(default_factory=lambda: dict(HEADS_M))
    mounting_rad: float = MOUNTING_RAD
    sheet: str = SHEET

    def site(self) -> str:
        heads = (
            f"[[radio_heads]]\npci = {pci}\nposition_m = [{x}, {y}, 0.0]\n"
            for pci, (x, y) in self.heads_m.items()
        )
        return 'name = "hall"\n' + "".join(heads)

    def vehicle(self) -> str:
        return f"{self.sheet}[array]\nmounting_rad = {self.mounting_rad}\nmounting_std_rad = 0.02\n"

    def write(self, place: Path) -> list[object]:
        """Writes the files; returns the arguments of ``locate``."""
        self.odometry.write_csv(place / "odometry.csv")
        self.angles.write_csv(place / "angles.csv")
        (place / "site.toml").write_text(self.site())
        (place / "vehicle.toml").write_text(self.vehicle())
        lines = (
            f"{t:.6f} {x:.6f} {y:.6f} 0 0 0 {math.sin(h / 2):.9f} {math.cos(h / 2):.9f}\n"
            for t, x, y, h in self.truth.iter_rows()
        )
        (place / "truth.tum").write_text("# time x y z qx qy qz qw\n" + "".join(lines))
        return [
            "record", "locate", "--recording", place / "angles.csv",
            "--odometry", place / "odometry.csv",
            "--site", place / "site.toml", "--vehicle", place / "vehicle.toml",
            "--start", ",".join(map(str, self.start)), "--out", place / "out",
        ]  # fmt: skip

    def locate(self, place: Path, *, smooth: bool = False) -> drives.Drive:
        """Locates the drive from its files."""
        self.write(place)
        return drives.locate(
            access_av.Site.from_toml(self.site()),
            place / "odometry.csv",
            place / "angles.csv",
            vehicle=access_av.Vehicle.from_toml(self.vehicle()),
            start=self.start,
            smooth=smooth,
        )

    def rms_error_m(self, drive: drives.Drive) -> float:
        error = drives.error_m(drive.poses, self.truth)["error_m"]
        return float((error**2).mean() ** 0.5)  # type: ignore[operator]


def robot(
    duration_s: float = 90.0,
    seed: int = 1,
    speed_mps: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
    epoch_s: float = 0.0,
) -> Robot:
    """A drive through the hall, forwards and backwards, with turns on the spot.

    ``speed_mps`` replaces the default speed; it is a function of the time (s). ``epoch_s`` is the
    time of the start.
    """
    rng = np.random.default_rng(seed)
    step_s = 1 / RATE_HZ
    time_s = np.arange(0.0, duration_s, step_s)
    speed = np.where(time_s % 30.0 > 27.0, 0.0, np.where(time_s % 45.0 > 40.0, -0.3, 0.5))
    if speed_mps is not None:
        speed = speed_mps(time_s)
    yaw = np.where(speed == 0.0, 0.8, 0.25 * np.sin(0.35 * time_s) + 0.1)
    speed[0] = yaw[0] = 0.0
    distance = np.cumsum(speed) * step_s
    heading = 0.3 + np.cumsum(yaw) * step_s
    middle = heading - 0.5 * yaw * step_s
    x = -1.0 + np.cumsum(speed * np.cos(middle)) * step_s
    y = -2.0 + np.cumsum(speed * np.sin(middle)) * step_s
    read_yaw = yaw + np.where(yaw == 0.0, 0.0, rng.normal(0.0, 0.005 * RATE_HZ**0.5, time_s.size))
    odometry = pl.DataFrame(
        {"time_s": time_s, "distance_m": distance, "speed_mps": speed, "yaw_rate_radps": read_yaw}
    )
    rows = []
    for k in range(0, time_s.size, 4):
        for pci, (head_x, head_y) in HEADS_M.items():
            if rng.random() < 0.4:
                bearing = math.atan2(head_y - y[k], head_x - x[k]) - heading[k]
                phase = math.pi * math.cos(bearing - MOUNTING_RAD) + rng.normal(0.0, SIGMA_RAD)
                rows.append((time_s[k], pci, phase, SIGMA_RAD))
    angles = pl.DataFrame(
        rows, schema=["time_s", "pci", "phase_rad", "phase_sigma_rad"], orient="row"
    )
    truth = pl.DataFrame({"time_s": time_s, "x_m": x, "y_m": y, "heading_rad": heading})
    tables = [it.with_columns(it["time_s"] + epoch_s) for it in (odometry, angles, truth)]
    return Robot(*tables, (float(x[0]), float(y[0]), float(heading[0])))
