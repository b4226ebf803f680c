"""Real drives: the localizer compared with dead reckoning, a textbook filter and GTSAM.

The drives are third-party recordings of wheel odometry, bearings to landmarks and motion-capture
truth: the UTIAS multi-robot data sets (MRCLAM; Leung et al., IJRR 2011,
http://asrl.utias.utoronto.ca/datasets/mrclam/), for education and research. Download and unpack
one, convert a robot's drive and compare:

    python benches/real_drives.py convert MRCLAM_Dataset6 3 drives/d6r3
    python benches/real_drives.py table drives

``table`` reads any folder of drives in this form, one folder each: ``odometry.csv`` (time_s,
distance_m, speed_mps, yaw_rate_radps), ``angles.csv`` (time_s, pci, phase_rad, phase_sigma_rad),
``landmarks.csv`` (pci, x_m, y_m), ``start.csv`` (x_m, y_m, heading_rad, mounting_angle_rad) and
``truth.tum``. The default folder is ``$ACCESS_AV_DATA/drives``. A ``vehicle.toml`` in the folder of
a drive is its data sheet; without it, MRCLAM's data sheet (measured against truth) is used, or the
defaults with ``--defaults``. GTSAM is compared if it is installed.
"""

from __future__ import annotations

import argparse
import csv
import math
import os
import sys
from pathlib import Path

import numpy as np

RATE_HZ = 50.0
WAVELENGTHS = 0.5
BEARING_STD_RAD = 0.02
ANGLE_TIME_OFFSET_S = 0.04
DATA_SHEET = """
[odometer]
scale_std = 0.08
noise_m_per_sqrt_m = 0.05
[gyroscope]
noise_rad_per_sqrt_s = 0.04
bias_std_radps = 0.005
"""


def wrap(angle):
    """Wraps an angle to -π..π."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def columns(file: Path) -> dict[str, np.ndarray]:
    with file.open(encoding="utf-8") as lines:
        names, *rows = csv.reader(lines)
    values = np.array(rows, dtype=float)
    return {name: values[:, index] for index, name in enumerate(names)}


def numbers(file: Path) -> np.ndarray:
    """Reads rows of numbers; ``#`` begins a comment."""
    return np.loadtxt(file, comments="#", ndmin=2)


def convert(dataset: Path, robot: int, out: Path) -> None:
    """Converts a robot's drive of an MRCLAM data set to CSV files and a TUM trajectory."""
    commands = numbers(dataset / f"Robot{robot}_Odometry.dat")
    seen = numbers(dataset / f"Robot{robot}_Measurement.dat")
    truth = numbers(dataset / f"Robot{robot}_Groundtruth.dat")
    landmarks = {int(row[0]): row[1:3] for row in numbers(dataset / "Landmark_Groundtruth.dat")}
    subjects = {int(code): int(subject) for subject, code in numbers(dataset / "Barcodes.dat")}
    first_s = max(commands[0, 0], truth[0, 0])
    last_s = min(commands[-1, 0], truth[-1, 0])
    out.mkdir(parents=True, exist_ok=True)

    times = np.arange(0.0, last_s - first_s, 1 / RATE_HZ)
    held = np.searchsorted(commands[:, 0], first_s + times, side="right") - 1
    speed, rate = commands[held, 1], commands[held, 2]
    distance = np.concatenate([[0.0], np.cumsum(speed[1:] / RATE_HZ)])
    with (out / "odometry.csv").open("w", encoding="utf-8") as file:
        file.write("time_s,distance_m,speed_mps,yaw_rate_radps\n")
        for row in zip(times, distance, speed, rate, strict=True):
            file.write("{:.3f},{:.6f},{:.6f},{:.6f}\n".format(*row))

    slope = 2 * math.pi * WAVELENGTHS
    with (out / "angles.csv").open("w", encoding="utf-8") as file:
        file.write("time_s,pci,phase_rad,phase_sigma_rad\n")
        for time_s, code, _, bearing in seen:
            subject = subjects.get(int(code))
            if subject in landmarks and first_s <= time_s <= last_s:
                # The array's axis points to the left, so that bearings ahead are unambiguous.
                phase = slope * math.cos(bearing - math.pi / 2)
                sigma = slope * abs(math.sin(bearing - math.pi / 2)) * BEARING_STD_RAD
                file.write(f"{time_s - first_s:.3f},{subject},{phase:.6f},{sigma:.6f}\n")
    with (out / "landmarks.csv").open("w", encoding="utf-8") as file:
        file.write("pci,x_m,y_m\n")
        for subject, (x, y) in landmarks.items():
            file.write(f"{subject},{x},{y}\n")
    with (out / "truth.tum").open("w", encoding="utf-8") as file:
        file.write("# time_s x_m y_m z_m qx qy qz qw\n")
        for time_s, x, y, heading in truth[:: max(1, len(truth) // (10 * int(last_s - first_s)))]:
            qz, qw = math.sin(heading / 2), math.cos(heading / 2)
            file.write(f"{time_s - first_s:.4f} {x:.5f} {y:.5f} 0 0 0 {qz:.7f} {qw:.7f}\n")
    begin = truth[np.searchsorted(truth[:, 0], first_s)]
    with (out / "start.csv").open("w", encoding="utf-8") as file:
        file.write("x_m,y_m,heading_rad,mounting_angle_rad\n")
        file.write(f"{begin[1]:.4f},{begin[2]:.4f},{begin[3]:.4f},{math.pi / 2:.12f}\n")


def read(folder: Path) -> dict:
    """Reads a drive; its electrical angles become bearings."""
    start = {name: float(values[0]) for name, values in columns(folder / "start.csv").items()}
    angles = columns(folder / "angles.csv")
    slope = 2 * math.pi * WAVELENGTHS
    cosine = np.clip(angles["phase_rad"] / slope, -1, 1)
    bearing = start["mounting_angle_rad"] - np.arccos(cosine)
    sigma = angles["phase_sigma_rad"] / (slope * np.maximum(np.sqrt(1 - cosine**2), 0.05))
    landmarks = columns(folder / "landmarks.csv")
    return {
        "name": folder.name,
        "folder": folder,
        "odometry": columns(folder / "odometry.csv"),
        "bearings": np.column_stack([angles["time_s"], angles["pci"], bearing, sigma]),
        "landmarks": {
            int(pci): (x, y)
            for pci, x, y in zip(*(landmarks[name] for name in ("pci", "x_m", "y_m")), strict=True)
        },
        "start": start,
        "truth": numbers(folder / "truth.tum"),
    }


def dead_reckoning(drive: dict) -> np.ndarray:
    """Odometry alone: time, x, y."""
    odometry, start = drive["odometry"], drive["start"]
    steps = np.diff(odometry["distance_m"])
    turns = odometry["yaw_rate_radps"][1:] * np.diff(odometry["time_s"])
    after = start["heading_rad"] + np.cumsum(turns)
    middle = after - turns / 2
    x = start["x_m"] + np.cumsum(steps * np.cos(middle))
    y = start["y_m"] + np.cumsum(steps * np.sin(middle))
    return np.column_stack([odometry["time_s"][1:], x, y])


def textbook_filter(drive: dict, sheet: dict[str, float]) -> np.ndarray:
    """Extended Kalman filter over x, y, heading, odometer scale, yaw-rate bias and mounting."""
    odometry, start = drive["odometry"], drive["start"]
    state = np.array([start["x_m"], start["y_m"], start["heading_rad"], 1.0, 0.0, 0.0])
    covariance = np.diag([0.05, 0.05, 0.05, sheet["scale"], sheet["bias"], sheet["mounting"]]) ** 2
    bearings = drive["bearings"][np.argsort(drive["bearings"][:, 0], kind="stable")]
    heard, path = 0, []
    time = odometry["time_s"]
    for k in range(1, len(time)):
        dt = time[k] - time[k - 1]
        length = (odometry["distance_m"][k] - odometry["distance_m"][k - 1]) / state[3]
        turn = (odometry["yaw_rate_radps"][k] - state[4]) * dt
        c, s = math.cos(state[2] + turn / 2), math.sin(state[2] + turn / 2)
        f = np.eye(6)
        f[0, 2], f[1, 2] = -length * s, length * c
        f[0, 3], f[1, 3] = -length * c / state[3], -length * s / state[3]
        f[2, 4] = -dt
        state[:3] += length * c, length * s, turn
        covariance = f @ covariance @ f.T
        along = sheet["distance_noise"] ** 2 * abs(length)
        covariance[0, 0] += along * c * c
        covariance[1, 1] += along * s * s
        covariance[0, 1] += along * c * s
        covariance[1, 0] += along * c * s
        covariance[2, 2] += sheet["yaw_noise"] ** 2 * dt
        while heard < len(bearings) and bearings[heard, 0] - sheet["angle_time_offset"] <= time[k]:
            _, pci, bearing, sigma = bearings[heard]
            heard += 1
            dx = drive["landmarks"][int(pci)][0] - state[0]
            dy = drive["landmarks"][int(pci)][1] - state[1]
            square = dx * dx + dy * dy
            row = np.array([dy / square, -dx / square, -1.0, 0.0, 0.0, -1.0])
            residual = wrap(bearing - (math.atan2(dy, dx) - state[2] - state[5]))
            variance = row @ covariance @ row + sigma**2
            if residual**2 / variance < 15.0:
                gain = covariance @ row / variance
                state += gain * residual
                keep = np.eye(6) - np.outer(gain, row)
                covariance = keep @ covariance @ keep.T + np.outer(gain, gain) * sigma**2
        path.append((time[k], state[0], state[1]))
    return np.array(path)


def smoothing_and_mapping(drive: dict, sheet: dict[str, float]) -> np.ndarray | None:
    """GTSAM's iSAM2 with robust bearings, one pose each 0.2 s; `None` if not installed."""
    try:
        import gtsam
    except ImportError:
        return None
    odometry, start = drive["odometry"], drive["start"]
    isam, keys = gtsam.ISAM2(), gtsam.symbol
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    pose = gtsam.Pose2(start["x_m"], start["y_m"], start["heading_rad"])
    exact = gtsam.noiseModel.Isotropic.Sigma(2, 1e-3)
    graph.add(gtsam.PriorFactorPose2(keys("x", 0), pose, gtsam.noiseModel.Isotropic.Sigma(3, 0.05)))
    values.insert(keys("x", 0), pose)
    for pci, place in drive["landmarks"].items():
        graph.add(gtsam.PriorFactorPoint2(keys("l", pci), gtsam.Point2(*place), exact))
        values.insert(keys("l", pci), gtsam.Point2(*place))
    bearings = drive["bearings"][np.argsort(drive["bearings"][:, 0], kind="stable")]
    heard, path, number = 0, [], 0
    moved, since = gtsam.Pose2(), odometry["time_s"][0]
    huber = gtsam.noiseModel.mEstimator.Huber.Create(1.345)
    for k in range(1, len(odometry["time_s"])):
        time = odometry["time_s"][k]
        turn = odometry["yaw_rate_radps"][k] * (time - odometry["time_s"][k - 1])
        length = odometry["distance_m"][k] - odometry["distance_m"][k - 1]
        step = gtsam.Pose2(length * math.cos(turn / 2), length * math.sin(turn / 2), turn)
        moved = moved.compose(step)
        if time - since < 0.2:
            continue
        number += 1
        along = max(
            1e-3, sheet["distance_noise"] * math.sqrt(abs(moved.x())) + 0.02 * abs(moved.x())
        )
        noise = gtsam.noiseModel.Diagonal.Sigmas(
            np.array([along, 2e-3, sheet["yaw_noise"] * math.sqrt(time - since)])
        )
        here, before = keys("x", number), keys("x", number - 1)
        graph.add(gtsam.BetweenFactorPose2(before, here, moved, noise))
        pose = pose.compose(moved)
        values.insert(here, pose)
        while heard < len(bearings) and bearings[heard, 0] - sheet["angle_time_offset"] <= time:
            _, pci, bearing, sigma = bearings[heard]
            heard += 1
            model = gtsam.noiseModel.Robust.Create(
                huber, gtsam.noiseModel.Isotropic.Sigma(1, sigma)
            )
            graph.add(gtsam.BearingFactor2D(here, keys("l", int(pci)), gtsam.Rot2(bearing), model))
        isam.update(graph, values)
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        pose = isam.calculateEstimatePose2(here)
        path.append((time, pose.x(), pose.y()))
        moved, since = gtsam.Pose2(), time
    return np.array(path)


def rms_m(drive: dict, path: np.ndarray) -> float:
    """Root mean square distance (m) from the truth, at the times of the truth."""
    truth = drive["truth"]
    inside = truth[(truth[:, 0] >= path[0, 0]) & (truth[:, 0] <= path[-1, 0])]
    x = np.interp(inside[:, 0], path[:, 0], path[:, 1])
    y = np.interp(inside[:, 0], path[:, 0], path[:, 2])
    return float(np.sqrt(np.mean((x - inside[:, 1]) ** 2 + (y - inside[:, 2]) ** 2)))


def ours(drive: dict, sheet: str) -> dict[str, float] | None:
    """Runs the localizer, online and smoothed, with its integrity; `None` if not installed."""
    try:
        import access_av
        from access_av import drives
    except ImportError:
        return None
    start = drive["start"]
    site = 'name = "hall"\n' + "".join(
        f"[[radio_heads]]\npci = {pci}\nposition_m = [{x}, {y}, 0.0]\n"
        for pci, (x, y) in drive["landmarks"].items()
    )
    vehicle = (
        'name = "robot"\ndrive = "differential"\n[integrity]\n'
        "[start]\nposition_std_m = 0.05\nheading_std_rad = 0.05\n"
        f"[array]\nmounting_rad = {start['mounting_angle_rad']}\n{sheet}"
    )
    located = drives.locate(
        access_av.Site.from_toml(site),
        drive["folder"] / "odometry.csv",
        drive["folder"] / "angles.csv",
        vehicle=access_av.Vehicle.from_toml(vehicle),
        start=(start["x_m"], start["y_m"], start["heading_rad"]),
        smooth=True,
    )
    return drives.summary(located, drive["folder"] / "truth.tum")


def sheet_of(drive: dict, defaults: bool) -> str:
    own = drive["folder"] / "vehicle.toml"
    if own.exists():
        return own.read_text(encoding="utf-8")
    if defaults:
        return ""
    receiver = f"[receiver]\nangle_time_offset_s = {ANGLE_TIME_OFFSET_S}"
    return f"mounting_std_rad = 0.02\n{receiver}\n{DATA_SHEET}"


PEERS = {
    "scale": 0.08,
    "bias": 0.005,
    "mounting": 0.02,
    "distance_noise": 0.05,
    "yaw_noise": 0.04,
    "angle_time_offset": ANGLE_TIME_OFFSET_S,
}


def table(folder: Path, defaults: bool) -> None:
    names = ["dead reckoning", "textbook", "iSAM2", "online", "smoothed"]
    numbers_of = ["ok", "beyond", "nees/2"]
    print(f"{'RMS, m':12}" + "".join(f"{name:>15}" for name in names + numbers_of))
    for place in sorted(it for it in folder.iterdir() if (it / "odometry.csv").exists()):
        drive = read(place)
        row = [rms_m(drive, dead_reckoning(drive)), rms_m(drive, textbook_filter(drive, PEERS))]
        mapped = smoothing_and_mapping(drive, PEERS)
        row.append(math.nan if mapped is None else rms_m(drive, mapped))
        found = ours(drive, sheet_of(drive, defaults)) or {}
        keys = (
            "rms_error_m",
            "smoothed_rms_error_m",
            "ok_share",
            "beyond_while_ok",
            "nees_per_axis",
        )
        row += [found.get(key, math.nan) for key in keys]
        print(f"{drive['name']:12}" + "".join(f"{value:15.3f}" for value in row), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    convert_it = commands.add_parser("convert", help="an MRCLAM drive to CSV and TUM")
    convert_it.add_argument("dataset", type=Path)
    convert_it.add_argument("robot", type=int)
    convert_it.add_argument("out", type=Path)
    table_it = commands.add_parser("table", help="every drive of a folder, and every peer")
    data = os.environ.get("ACCESS_AV_DATA", "../shared/data")
    table_it.add_argument("folder", type=Path, nargs="?", default=Path(data) / "drives")
    table_it.add_argument("--defaults", action="store_true", help="no data sheet")
    given = parser.parse_args()
    if given.command == "convert":
        convert(given.dataset, given.robot, given.out)
    elif given.folder.is_dir():
        table(given.folder, given.defaults)
    else:
        sys.exit(f"skipped: no drives in {given.folder} (set ACCESS_AV_DATA)")


if __name__ == "__main__":
    main()
