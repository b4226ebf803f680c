"""Drives with ranges or pseudoranges: recordings of others, and a simulated car with blocked paths.

The recordings belong to libRSF (TU Chemnitz, https://github.com/TUC-ProAut/libRSF, folder
``datasets``, CC BY-SA 4.0): a robot among UWB anchors, a car with GNSS pseudoranges, and pose
graphs with simulated ranges. Convert ``*_Input.txt`` and ``*_GT.txt``, or simulate a car, and
locate:

    python benches/range_drives.py convert Indoor_UWB_Input.txt Indoor_UWB_GT.txt drives/uwb
    python benches/range_drives.py car drives/car-31 --seed 31 --kind one-way --blocked 0.2
    python benches/range_drives.py table drives/*

A drive is a folder with ``site.toml``, ``vehicle.toml``, ``odometry.csv``, ``ranges.csv``,
``start.csv`` and ``truth.tum``. Satellites are replaced by transmitters at 2 km in the same
directions; the pseudoranges keep their errors.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path

import numpy as np

SPEED_OF_LIGHT_MPS = 299792458.0
EARTH_RATE_RADPS = 7.2921151467e-5
EARTH_ECCENTRICITY_SQUARED = 6.69438e-3
SATELLITE_M = 2000.0
# Time between the poses of a graph: a robot that turns by π needs it.
POSE_S = 4.0

ROBOT = """name = "robot"
drive = "differential"
[start]
position_std_m = 0.1
heading_std_rad = 0.1
[ranging]
position_m = [0.0, 0.0, 0.0]
"""
CAR = """name = "car"
top_speed_kmh = 70.0
[start]
position_std_m = 1.0
heading_std_rad = 0.1
[integrity]
alert_limit_m = {alert_limit_m}
[ranging]
kind = "{kind}"
"""
# Errors of the simulated odometry.
ODOMETRY = """position_m = [0.0, 0.0, 0.0]
[odometer]
scale_std = 0.01
noise_m_per_sqrt_m = 0.02
[gyroscope]
noise_rad_per_sqrt_s = 0.001
bias_std_radps = 0.001
"""
CLOCK = "clock_group = 1\nclock_offset_std_ns = 10.0\n"
VEHICLE_COLUMNS = "time_s,distance_m,speed_mps,yaw_rate_radps"


def write(file: Path, header: str, rows) -> None:
    with file.open("w", encoding="utf-8", newline="") as out:
        lines = csv.writer(out)
        lines.writerow(header.split(","))
        lines.writerows([f"{value:.9g}" for value in row] for row in rows)


def write_drive(out: Path, drive: dict) -> None:
    """Writes the files of a drive. A range is a row of time, radio head, value and σ in metres."""
    out.mkdir(parents=True, exist_ok=True)
    is_one_way = "one-way" in drive["vehicle"]
    site = f'name = "{out.name}"\n'
    for pci, place in drive["heads"].items():
        numbers = ", ".join(f"{float(value)!r}" for value in place)
        site += f"[[radio_heads]]\npci = {pci}\nposition_m = [{numbers}]\n"
        site += CLOCK if is_one_way else ""
    (out / "site.toml").write_text(site, encoding="utf-8")
    (out / "vehicle.toml").write_text(drive["vehicle"], encoding="utf-8")
    write(out / "odometry.csv", drive["columns"], drive["odometry"])
    named = "delay_ns,delay_sigma_ns" if is_one_way else "range_m,sigma_m"
    unit = 1e9 / SPEED_OF_LIGHT_MPS if is_one_way else 1.0
    rows = [(time, pci, unit * value, unit * sigma) for time, pci, value, sigma in drive["ranges"]]
    write(out / "ranges.csv", f"time_s,pci,{named}", rows)
    write(out / "start.csv", "x_m,y_m,heading_rad", [drive["start"]])
    with (out / "truth.tum").open("w", encoding="utf-8") as file:
        for time, x, y in drive["truth"]:
            file.write(f"{time:.4f} {x:.5f} {y:.5f} 0 0 0 0 1\n")


def first_heading_rad(path: np.ndarray, travelled_m: float) -> float:
    """Direction of the first distance driven."""
    away = path[:, 1:3] - path[0, 1:3]
    first = away[np.argmax(np.hypot(*away.T) > travelled_m)]
    return math.atan2(first[1], first[0])


def convert(file: Path, truth_file: Path, out: Path) -> None:
    """Converts measurements and truth of libRSF."""
    rows: dict[str, list] = {}
    for name in (file, truth_file):
        for line in name.read_text(encoding="utf-8").splitlines():
            kind, *values = line.split()
            rows.setdefault(kind, []).append([float(value) for value in values])
    table = {kind: np.array(values) for kind, values in rows.items()}
    kinds = {"pseudorange3": satellites, "odom2diff": two_wheels, "odom2": pose_graph}
    write_drive(out, next(of for kind, of in kinds.items() if kind in table)(table))


def to_local(origin: np.ndarray) -> np.ndarray:
    """Rotation from earth-centred coordinates to east, north and up."""
    longitude = math.atan2(origin[1], origin[0])
    horizontal_m = math.hypot(origin[0], origin[1])
    latitude = math.atan2(origin[2], horizontal_m * (1 - EARTH_ECCENTRICITY_SQUARED))
    sine, cosine = math.sin(longitude), math.cos(longitude)
    north, up = math.sin(latitude), math.cos(latitude)
    return np.array(
        [
            [-sine, cosine, 0],
            [-north * cosine, -north * sine, up],
            [up * cosine, up * sine, north],
        ]
    )


def satellites(table: dict[str, np.ndarray]) -> dict:
    """A car with pseudoranges: satellites become transmitters at 2 km."""
    truth, moved = table["point3"], table["odom3"]
    origin = truth[0, 1:4]
    rotation = to_local(origin)
    path = np.column_stack([truth[:, 0], (truth[:, 1:4] - origin) @ rotation.T])
    path[:, 3] = 0.0
    earth_rate_per_m = EARTH_RATE_RADPS / SPEED_OF_LIGHT_MPS
    heads: dict[int, np.ndarray] = {}
    numbers: dict[int, int] = {}
    ranges = []
    for time, value, variance, *satellite, identity, _, _, _ in table["pseudorange3"]:
        place = np.array([np.interp(time, truth[:, 0], truth[:, axis]) for axis in (1, 2, 3)])
        sight = np.array(satellite) - place
        # The earth turns while the signal arrives.
        turned_m = earth_rate_per_m * (satellite[0] * place[1] - satellite[1] * place[0])
        error_m = value - np.hypot.reduce(sight) - turned_m
        pci = numbers.setdefault(int(identity), len(numbers) + 1)
        direction = rotation @ sight / np.hypot.reduce(sight)
        head = heads.setdefault(pci, SATELLITE_M * direction)
        here = np.array([np.interp(time, path[:, 0], path[:, axis]) for axis in (1, 2, 3)])
        ranges.append((time, pci, np.hypot.reduce(head - here) + error_m, math.sqrt(variance)))
    clock_m = np.median([it[2] for it in ranges if it[0] < 1.0]) - SATELLITE_M
    distance = np.concatenate([[0.0], np.cumsum(moved[1:, 1] * np.diff(moved[:, 0]))])
    return {
        "heads": heads,
        "vehicle": CAR.format(alert_limit_m=20.0, kind="one-way"),
        "columns": VEHICLE_COLUMNS,
        "odometry": np.column_stack([moved[:, 0], distance, moved[:, 1], moved[:, 6]]),
        "ranges": [(time, pci, value - clock_m, sigma) for time, pci, value, sigma in ranges],
        "start": (*path[0, 1:3], first_heading_rad(path, 5.0)),
        "truth": path[:, :3],
    }


def two_wheels(table: dict[str, np.ndarray]) -> dict:
    """A robot with two wheels. The left wheel comes first, contrary to the description."""
    path, measured, moved = table["point2"][:, :3], table["range2"], table["odom2diff"]
    steps = np.diff(moved[:, 0], prepend=moved[0, 0])
    left, right = (np.cumsum(moved[:, column] * steps) for column in (1, 2))
    return {
        "heads": {int(row[5]): (row[3], row[4], 0.0) for row in measured},
        "vehicle": f"{ROBOT}[odometer]\ntrack_width_m = {2 * moved[0, 4]:g}\n",
        "columns": "time_s,left_m,right_m",
        "odometry": np.column_stack([moved[:, 0], left, right]),
        "ranges": [(row[0], row[5], row[1], math.sqrt(row[2])) for row in measured],
        "start": (*path[0, 1:], first_heading_rad(path, 0.1)),
        "truth": path,
    }


def pose_graph(table: dict[str, np.ndarray]) -> dict:
    """A robot that drives along the heading of the previous pose, and then turns."""
    truth, measured, moved = table["point2"], table["range2"], table["odom2"]
    # A negative speed with the heading reversed is a forward motion.
    backwards = np.median(moved[:, 1]) < 0
    steps = -moved[:, 1] if backwards else moved[:, 1]
    heading = table["angle"][0, 1] + (math.pi if backwards else 0.0)
    parts = np.arange(1, 21) / 20
    rows = [(0.0, 0.0, 0.0, 0.0)]
    driven = np.cumsum(steps) - steps
    for time, distance, step, turn in zip(moved[:, 0], driven, steps, moved[:, 3], strict=True):
        for part in parts:
            at_s = POSE_S * (time - 1 + part / 2)
            rows.append((at_s, distance + part * step, 2 * step / POSE_S, 0.0))
        for part in parts:
            at_s = POSE_S * (time - 0.5 + part / 2)
            rows.append((at_s, distance + step, 0.0, 2 * turn / POSE_S))
    noise_m, noise_rad = math.sqrt(moved[0, 4]), math.sqrt(moved[0, 6] / POSE_S)
    return {
        "heads": {int(row[5]): (row[3], row[4], 0.0) for row in measured},
        "vehicle": f"{ROBOT}[odometer]\nscale_std = 0.01\nnoise_m_per_sqrt_m = {noise_m:.3f}\n"
        f"[gyroscope]\nnoise_rad_per_sqrt_s = {noise_rad:.3f}\n",
        "columns": VEHICLE_COLUMNS,
        "odometry": rows,
        "ranges": [(POSE_S * row[0], row[5], row[1], math.sqrt(row[2])) for row in measured],
        "start": (*truth[0, 1:3], math.remainder(heading, math.tau)),
        "truth": [
            (POSE_S * (time - before), x, y)
            for time, x, y in truth[:, :3]
            for before in (0.5, 0.0)
            if time >= before
        ],
    }


# The simulated car: step of its odometry, steps between ranges, side of the area.
STEP_S = 0.05
RANGE_STEPS = 4
SIDE_M = 800.0
RANGE_STD_M = 3.0
# Steps for which a path keeps its state, and mean additional distance of a blocked one.
PATH_STEPS = 200
LATE_M = 15.0


def motion(random: np.random.Generator, times: np.ndarray) -> tuple[np.ndarray, list]:
    """Poses of the car, and its odometry with errors."""
    pose = np.array([SIDE_M / 2, SIDE_M / 2, random.uniform(-math.pi, math.pi)])
    speed, turn, driven = 10.0, 0.0, 0.0
    poses, odometry = [], []
    scale = 1 + 0.01 * random.standard_normal()
    bias = 1e-3 * random.standard_normal()
    root_s = math.sqrt(STEP_S)
    for time in times:
        speed = np.clip(speed + 0.5 * root_s * random.standard_normal(), 6.0, 14.0)
        wish = 0.0
        if np.hypot(*(pose[:2] - SIDE_M / 2)) > 0.4 * SIDE_M:
            centre = math.atan2(SIDE_M / 2 - pose[1], SIDE_M / 2 - pose[0])
            wish = 0.3 * math.copysign(1.0, math.remainder(centre - pose[2], math.tau))
        turn += STEP_S * (wish - turn) + 0.05 * root_s * random.standard_normal()
        length, angle = speed * STEP_S, turn * STEP_S
        middle = pose[2] + angle / 2
        pose = pose + np.array([length * math.cos(middle), length * math.sin(middle), angle])
        driven += scale * length + 0.02 * math.sqrt(length) * random.standard_normal()
        yaw_rate = turn + bias + 1e-3 / root_s * random.standard_normal()
        poses.append(pose)
        odometry.append((time, driven, scale * speed, yaw_rate))
    return np.array(poses), odometry


def car(out: Path, given: argparse.Namespace) -> None:
    """Simulates a car among radio heads whose paths are blocked from time to time."""
    random = np.random.default_rng(given.seed)
    times = np.arange(0.0, given.duration_s, STEP_S)
    poses, odometry = motion(random, times)
    heads = range(given.heads)
    angles = math.tau * (np.arange(given.heads) + random.uniform(0, 1, given.heads)) / given.heads
    distances_m = SIDE_M / 2 * random.uniform(0.6, 1.2, (given.heads, 1))
    places = SIDE_M / 2 + distances_m * np.column_stack([np.cos(angles), np.sin(angles)])
    offsets_m = 3.0 * random.standard_normal(given.heads)
    metres_per_ns = 1e-9 * SPEED_OF_LIGHT_MPS
    phases = RANGE_STEPS * random.integers(0, PATH_STEPS // RANGE_STEPS, given.heads)
    clock_m, late_m, ranges = 0.0, np.zeros(given.heads), []
    range_s = RANGE_STEPS * STEP_S
    for number in range(0, len(times), RANGE_STEPS):
        time = times[number]
        walk_ns = given.clock_ns * math.sqrt(range_s) * random.standard_normal()
        clock_m += metres_per_ns * (50.0 * range_s + walk_ns)
        for head in heads:
            if (number + phases[head]) % PATH_STEPS == 0:
                is_blocked = random.random() < given.blocked
                late_m[head] = random.exponential(LATE_M) if is_blocked else 0.0
        step_ns = 100.0 * (time > 150) - 60.0 * (time > 280) if given.steps else 0.0
        for head in heads:
            value = np.hypot(*(places[head] - poses[number, :2])) + offsets_m[head] + late_m[head]
            value += RANGE_STD_M * random.standard_normal()
            if given.kind == "one-way":
                value += clock_m + metres_per_ns * step_ns
            ranges.append((time, head + 1, value, RANGE_STD_M))
    heading = math.remainder(poses[0, 2] + given.turned_rad, math.tau)
    drive = {
        "heads": {head + 1: (*places[head], 0.0) for head in heads},
        "vehicle": CAR.format(alert_limit_m=5.0, kind=given.kind) + ODOMETRY,
        "columns": VEHICLE_COLUMNS,
        "odometry": odometry,
        "ranges": ranges,
        "start": (*poses[0, :2], heading),
        "truth": np.column_stack([times, poses[:, :2]]),
    }
    write_drive(out, drive)


def table(folders: list[Path], settings: str) -> None:
    """Locates each drive and prints its errors."""
    import access_av
    from access_av import drives

    columns = {
        "RMS, m": "rms_error_m",
        "90 %, m": "p90_error_m",
        "NEES/2": "nees_per_axis",
        "ok": "ok_share",
        "beyond": "beyond_while_ok",
    }
    print(f"{'drive':24}" + "".join(f"{name:>10}" for name in columns))
    for folder in folders:
        rows = list(csv.reader((folder / "start.csv").read_text(encoding="utf-8").splitlines()))
        vehicle = (folder / "vehicle.toml").read_text(encoding="utf-8") + settings
        located = drives.locate(
            access_av.Site.from_toml((folder / "site.toml").read_text(encoding="utf-8")),
            folder / "odometry.csv",
            folder / "ranges.csv",
            vehicle=access_av.Vehicle.from_toml(vehicle),
            start=tuple(float(value) for value in rows[1]),
        )
        found = drives.summary(located, folder / "truth.tum")
        values = [found.get(key, math.nan) for key in columns.values()]
        print(f"{folder.name:24}" + "".join(f"{it:10.3g}" for it in values), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    converted = commands.add_parser("convert", help="measurements and truth of libRSF to a drive")
    converted.add_argument("file", type=Path)
    converted.add_argument("truth", type=Path)
    converted.add_argument("out", type=Path)
    simulated = commands.add_parser("car", help="simulate a car with blocked paths")
    simulated.add_argument("out", type=Path)
    simulated.add_argument("--seed", type=int, default=1)
    simulated.add_argument("--duration-s", type=float, default=400.0)
    simulated.add_argument("--kind", choices=("one-way", "two-way"), default="one-way")
    simulated.add_argument("--heads", type=int, default=8)
    simulated.add_argument("--blocked", type=float, default=0.2, help="probability of each 10 s")
    simulated.add_argument("--clock-ns", type=float, default=1.0, help="random walk, ns/√s")
    simulated.add_argument("--steps", action="store_true", help="clock steps at 150 and 280 s")
    simulated.add_argument("--turned-rad", type=float, default=0.0, help="start heading error")
    tabled = commands.add_parser("table", help="locate drives and print their errors")
    tabled.add_argument("folders", type=Path, nargs="+")
    tabled.add_argument("--vehicle", default="", help="TOML text to append to vehicle.toml")
    given = parser.parse_args()
    if given.command == "convert":
        convert(given.file, given.truth, given.out)
    elif given.command == "car":
        car(given.out, given)
    else:
        table(given.folders, given.vehicle)


if __name__ == "__main__":
    main()
