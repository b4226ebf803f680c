"""Off the road: the localizer compared with a textbook filter that has the same inputs.

    python benches/off_the_road.py                 # every row, 20 drives each
    python benches/off_the_road.py white late --drives 5 --set receiver.angle_time_offset_std_s=0.1

The simulator and the filter (``tests/hall_drive.py``) depend on docs/locate.md only. The RMS is
over all drives; with an unknown or wrong start, the first half minute is excluded. The NEES is
halved, so that a consistent filter has 1. ``beyond`` is the fraction of ``ok`` epochs whose error
exceeds the protection level. ``dark`` is the time (s) with an error above the protection level in
any state, from three seconds after the tenth rejected angle on. ``distrust`` is the maximum time
(s) from the tenth rejected angle, or from the start if there are fewer, to the last epoch that is
``ok`` with an error above the alert limit.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import access_av
import hall_drive
from access_av import drives
from hall_drive import World, simulate

ALERT_LIMIT_M = 1.5
RECOVERY_S, DISTRUST_S, WRONG_M = 30.0, 3.0, 3.0
LAP_S = hall_drive.LAP_S


@dataclass(frozen=True)
class Case:
    """One row: the simulated conditions, and the content of the files."""

    group: str
    name: str
    world: dict[str, object]
    road: bool = False
    drive: str = "road"
    start_unknown: bool = False


def _turned(turn_rad: float) -> dict[str, object]:
    return {"start_off": (0.0, 0.0, turn_rad)}


CASES = [
    *(
        Case("white", f"white, {drive}{', on its road' * road}", {}, road, drive)
        for drive, road in [("road", False), ("differential", False), ("road", True)]
    ),
    *(
        Case("correlated", f"correlated over {name}{', on its road' * road}", world, road)
        for name, world in [
            ("1 s", {"stays_s": 1.0}), ("1 m", {"stays_m": 1.0}), ("10 m", {"stays_m": 10.0}),
        ]
        for road in (False, True)
    ),
    *(
        Case("unknown-start", f"unknown start, {drive}", {}, False, drive, start_unknown=True)
        for drive in ("road", "differential")
    ),
    *(
        Case("start", f"start {name}", world)
        for name, world in [
            ("+90°", _turned(math.pi / 2)), ("-90°", _turned(-math.pi / 2)),
            ("180°", _turned(math.pi)), ("mirrored", {"start_off": (0.0, 20.0, 0.0)}),
            ("10 m", {"start_off": (6.0, -8.0, 0.0)}),
        ]
    ),
    *(
        Case("late", f"late {late_s} s{', on its road' * road}", {"late_s": late_s}, road)
        for late_s in (0.0, 0.1, 0.3, 1.0)
        for road in (False, True)
    ),
]  # fmt: skip


def site_toml(road: bool) -> str:
    heads = (
        f"[[radio_heads]]\npci = {pci}\nposition_m = {list(place)}\n"
        for pci, place in hall_drive.HEADS_M.items()
    )
    legs = (f"{{ length_m = {m}, turn_rad = {rad} }}" for m, rad in hall_drive.LEGS_M_RAD)
    lane = f"[road]\nwidth_m = 4.0\nsegments = [{', '.join(legs)}]\n"
    return 'name = "hall"\n' + lane * road + "".join(heads)


def vehicle_toml(case: Case, settings: list[str]) -> str:
    tables: dict[str, list[str]] = {
        "array": [f"mounting_std_rad = {hall_drive.MOUNTING_STD_RAD}", "phase_std_rad = 0.0"],
        "odometer": [
            f"scale_std = {hall_drive.SCALE_STD}",
            f"noise_m_per_sqrt_m = {hall_drive.NOISE_M}",
        ],
        "gyroscope": [
            f"noise_rad_per_sqrt_s = {hall_drive.TURN_NOISE_RAD}",
            f"bias_std_radps = {hall_drive.BIAS_STD_RADPS}",
        ],
        "lane_keeping": [
            f"rms_m = {hall_drive.LANE_RMS_M}",
            f"wavelength_m = {hall_drive.LANE_WAVE_M}",
        ],
        "start": [
            f"position_std_m = {hall_drive.START_STD[0]}",
            f"heading_std_rad = {hall_drive.START_STD[1]}",
        ],
    }
    for setting in settings:
        key, value = setting.split("=", 1)
        table, name = key.split(".", 1)
        tables.setdefault(table, []).append(f"{name} = {value}")
    text = f'name = "tug"\ndrive = "{case.drive}"\n'
    return text + "".join(f"[{name}]\n" + "\n".join(keys) + "\n" for name, keys in tables.items())


def locate(case: Case, seed: int, settings: list[str]) -> dict[str, float]:
    """Locates one drive: squared errors, and figures of integrity."""
    drive = simulate(World(seed=seed, **case.world))  # type: ignore[arg-type]
    with tempfile.TemporaryDirectory() as folder:
        odometry, angles = Path(folder) / "odometry.csv", Path(folder) / "angles.csv"
        pl.DataFrame(
            {
                "time_s": drive.time_s,
                "distance_m": drive.distance_m,
                "yaw_rate_radps": drive.yaw_radps,
            }
        ).write_csv(odometry)
        time_s, pci, phase = drive.angles.T
        pl.DataFrame({"time_s": time_s, "pci": pci.astype(int), "phase_rad": phase}).with_columns(
            phase_sigma_rad=pl.lit(hall_drive.SIGMA_RAD)
        ).write_csv(angles)
        located = drives.locate(
            access_av.Site.from_toml(site_toml(case.road)),
            odometry,
            angles,
            vehicle=access_av.Vehicle.from_toml(vehicle_toml(case, settings)),
            start=None if case.start_unknown else tuple(map(float, drive.start)),
            start_unknown=case.start_unknown,
        )
    poses = located.poses
    at = np.clip(np.round(poses["time_s"].to_numpy() / hall_drive.STEP_S).astype(int), 0, None)
    off = poses.select("x_m", "y_m").to_numpy() - drive.truth[at, :2]
    error = np.hypot(*off.T)
    xx, xy, yy = (poses[f"covariance_{it}_m2"].to_numpy() for it in ("xx", "xy", "yy"))
    nees = yy * off[:, 0] ** 2 - 2 * xy * off[:, 0] * off[:, 1] + xx * off[:, 1] ** 2
    nees = 0.5 * nees / (xx * yy - xy * xy)
    level = poses["protection_level_m"].to_numpy()
    ok = (poses["integrity"] == "ok").to_numpy()
    drive.start -= case.world.get("start_off", (0.0, 0.0, 0.0))
    textbook = hall_drive.textbook(drive)[0] - drive.truth
    rows = located.angles.filter(pl.col("accepted").not_()).sort("time_s")["time_s"].to_list()
    tenth = rows[9] if len(rows) > 9 else math.inf
    late = located.findings.filter(pl.col("key") == "receiver.angle_time_offset_s")
    late_refused = min(tenth, LAP_S) + DISTRUST_S
    refused_s = rows[9] if len(rows) > 9 else 0.0
    wrong_ok = ok & (error > ALERT_LIMIT_M)
    dark = error > level  # exceeds the protection level, in any state
    time_s = poses["time_s"].to_numpy()
    settles = RECOVERY_S if case.group in ("start", "unknown-start") else 0.1
    settled, settled_of_truth = time_s >= settles, drive.time_s >= settles
    return {
        "square": float(np.mean(error[settled] ** 2)),
        "textbook": float(np.mean(np.sum(textbook[settled_of_truth, :2] ** 2, axis=1))),
        "nees": float(np.mean(nees[settled])),
        "ok": float(np.mean(ok)),
        "beyond": float(np.sum(ok & dark)),
        "all_ok": float(np.sum(ok)),
        "wrong_ok_s": hall_drive.STEP_S * float(np.sum(wrong_ok)),
        "dark_s": hall_drive.STEP_S * float(np.sum(dark & (time_s > late_refused))),
        "back": float(np.max(error[settled]) < WRONG_M),
        "distrusted_s": float(np.max(time_s[wrong_ok], initial=refused_s) - refused_s),
        "late_s": float(late["found"][-1]) if late.height else math.nan,
        "exit_named": float(any("late" in it for it in [*located.remarks, *located.diagnoses])),
    }


def table(cases: list[Case], drives_of_each: int, settings: list[str], jobs: int) -> None:
    heads = ("RMS, m", "ratio", "NEES/2", "ok %", "beyond", "wrong ok s", "dark s", "back %")
    heads += ("distrust s", "late off ms", "worst", "named %")
    print(f"{'':32}" + "".join(f"{name:>12}" for name in heads))
    with ProcessPoolExecutor(jobs) as pool:
        for case in cases:
            seeds = range(101, 101 + drives_of_each)
            jobs_of = [pool.submit(locate, case, seed, settings) for seed in seeds]
            all_of = [job.result() for job in jobs_of]
            of = {key: np.array([it[key] for it in all_of]) for key in all_of[0]}
            rms, reference = (math.sqrt(np.mean(of[key])) for key in ("square", "textbook"))
            late_off = 1e3 * (of["late_s"] - float(case.world.get("late_s", 0.0)))  # type: ignore[arg-type]
            row = [rms, rms / reference, np.mean(of["nees"]), 100 * np.mean(of["ok"])]
            row += [np.sum(of["beyond"]) / max(np.sum(of["all_ok"]), 1), np.sum(of["wrong_ok_s"])]
            row += [np.mean(of["dark_s"]), 100 * np.mean(of["back"]), np.max(of["distrusted_s"])]
            row += [np.mean(late_off), np.max(np.abs(late_off)), 100 * np.mean(of["exit_named"])]
            print(f"{case.name:32}" + "".join(f"{value:12.3g}" for value in row), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    groups = sorted({case.group for case in CASES})
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=", ".join(groups))
    parser.add_argument("--drives", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--set", action="append", default=[], metavar="TABLE.KEY=VALUE")
    given = parser.parse_args()
    unknown = set(given.groups) - set(groups)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: allowed are {', '.join(groups)}")
    cases = [case for case in CASES if not given.groups or case.group in given.groups]
    table(cases, given.drives, given.set, given.jobs)


if __name__ == "__main__":
    main()
