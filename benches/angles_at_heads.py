"""Angles measured at radio heads: a robot's real drive between four access points with arrays.

The drive is recorded Wi-Fi: angles of arrival at four access points (WiROS, UCSD), with the robot's
true position. Wheel odometry is generated from the truth: a scale error of 1 %, noise of 2 cm/√m,
and the yaw rate of a gyroscope.

    python benches/angles_at_heads.py $ACCESS_AV_DATA/arrays/wiros [--seeds 5]

prints position RMS and NEES/2 (1 if the covariance is right) of every seed of the odometry.
"""

from __future__ import annotations

import argparse
import gzip
from pathlib import Path

import numpy as np
import polars as pl

import access_av
from access_av import drives

RATE_HZ = 10.0
SCALE_ERROR = 0.01
NOISE_M_PER_SQRT_M = 0.02
# Angle random walk of a gyroscope (3.4 degrees per root of an hour). Its scale error is that of
# the odometer.
YAW_NOISE_RAD_PER_SQRT_S = 0.001
# Standard deviation of the motion's smoothing (s), and speed below which it has no direction (m/s).
SMOOTHING_S = 0.3
LEAST_SPEED_MPS = 0.03
# The RMS error of the angles is 0.25 to 0.58 rad, because of reflections and because a signal near
# the axis of an array appears on the other side. The errors are correlated over metres.
SIGMA_RAD = 0.25
CORRELATION_M = 3.0
# Angles are taken this far apart (s): the recording holds each value.
PERIOD_S = 0.5
VEHICLE = f"""
name = "robot"
drive = "differential"
gyroscope = {{ noise_rad_per_sqrt_s = {YAW_NOISE_RAD_PER_SQRT_S}, bias_std_radps = 1e-4 }}
start = {{ position_std_m = 0.05, heading_std_rad = 0.02 }}
[odometer]
rate_hz = {RATE_HZ}
scale_std = {SCALE_ERROR}
noise_m_per_sqrt_m = {NOISE_M_PER_SQRT_M}
noise_m_per_sqrt_s = 0.001
[receiver]
angle_time_offset_std_s = 1e-3
correlated_noise_fraction = 1.0
noise_correlation_distance_m = {CORRELATION_M}
"""


def motion(time_s, x_m, y_m):
    """Times at `RATE_HZ`, position, distance driven and direction of motion."""
    times = np.arange(time_s[0], time_s[-1], 1 / RATE_HZ)
    taps = np.arange(-10, 11) / RATE_HZ
    kernel = np.exp(-0.5 * (taps / SMOOTHING_S) ** 2)
    kernel /= kernel.sum()

    def smoothed(values):
        padded = np.pad(np.interp(times, time_s, values), len(taps) // 2, mode="edge")
        return np.convolve(padded, kernel, mode="valid")

    x, y = smoothed(x_m), smoothed(y_m)
    dx, dy = np.gradient(x) * RATE_HZ, np.gradient(y) * RATE_HZ
    moving = np.hypot(dx, dy) > LEAST_SPEED_MPS
    heading = np.unwrap(np.arctan2(dy, dx)[moving])
    heading = np.interp(times, times[moving], heading)
    distance = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return times, x, y, distance, heading


def convert(source: Path, out: Path, seed: int) -> tuple[float, float, float]:
    """Write the files of ``locate``; gives the start."""
    out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    with gzip.open(source / "drive.csv.gz", "rb") as file:
        drive = pl.read_csv(file.read())
    points = pl.read_csv(source / "access_points.csv")
    times, x, y, distance, heading = motion(
        *(drive[it].to_numpy() for it in ("time_s", "x_m", "y_m"))
    )
    steps = np.diff(distance, prepend=0.0)
    read = steps * (1 + SCALE_ERROR) + rng.normal(size=len(steps)) * NOISE_M_PER_SQRT_M * np.sqrt(
        steps
    )
    yaw = np.diff(heading, prepend=heading[0]) * RATE_HZ
    yaw = yaw * (1 + SCALE_ERROR) + rng.normal(size=len(yaw)) * YAW_NOISE_RAD_PER_SQRT_S * np.sqrt(
        RATE_HZ
    )
    pl.DataFrame(
        {
            "time_s": times,
            "distance_m": np.cumsum(read),
            "speed_mps": read * RATE_HZ,
            "yaw_rate_radps": yaw,
        }
    ).write_csv(out / "odometry.csv")
    angles, heads = [], []
    for number, point in enumerate(points.iter_rows(named=True)):
        measured = drive.select("time_s", angle_rad=f"aoa_{point['ap']}_rad").drop_nulls()
        new = measured.group_by(
            (pl.col("time_s") // PERIOD_S).alias("period"), maintain_order=True
        ).last()
        new = new.drop("period")
        angles.append(new.with_columns(pci=number, angle_sigma_rad=SIGMA_RAD, at_head=1))
        heads.append(
            f'[[radio_heads]]\nname = "{point["ap"]}"\npci = {number}\n'
            f"position_m = [{point['x_m']}, {point['y_m']}, 0.0]\n"
            f"array = {{ mounting_rad = {point['yaw_rad']} }}\n"
        )
    pl.concat(angles).sort("time_s").write_csv(out / "angles.csv")
    (out / "site.toml").write_text('name = "lab"\ncarrier_mhz = 5200.0\n' + "".join(heads))
    (out / "vehicle.toml").write_text(VEHICLE)
    pl.DataFrame({"time_s": times, "x_m": x, "y_m": y, "heading_rad": heading}).write_csv(
        out / "truth.csv"
    )
    return float(x[0]), float(y[0]), float(heading[0])


def quality(place: Path, start: tuple[float, float, float]) -> tuple[float, float]:
    """Position RMS (m) and NEES/2 of the drive in a folder."""
    drive = drives.locate(
        access_av.Site.load(str(place / "site.toml")),
        place / "odometry.csv",
        place / "angles.csv",
        vehicle=access_av.Vehicle.load(str(place / "vehicle.toml")),
        start=start,
    )
    errors = drives.error_m(drive.poses, pl.read_csv(place / "truth.csv"))
    both = errors.join(drive.poses, on="time_s")
    e = both.select("error_x_m", "error_y_m").to_numpy()
    xx, xy, yy = (
        both[it].to_numpy() for it in ("covariance_xx_m2", "covariance_xy_m2", "covariance_yy_m2")
    )
    covariance = np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -2)
    nees = np.einsum("ki,ki->k", e, np.linalg.solve(covariance, e[:, :, None])[:, :, 0])
    return float(np.sqrt(np.mean(np.sum(e**2, axis=1)))), float(np.mean(nees) / 2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path)
    parser.add_argument("--out", type=Path, default=Path("results/angles-at-heads"))
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    for seed in range(arguments.seeds):
        start = convert(arguments.source, arguments.out / str(seed), seed)
        rms_m, nees = quality(arguments.out / str(seed), start)
        print(f"seed {seed}: RMS {rms_m:.3f} m, NEES/2 {nees:.2f}", flush=True)


if __name__ == "__main__":
    main()
