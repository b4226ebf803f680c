"""Exchanged radio heads: detection by the SNR of the SSBs, compared with the integrity monitor.

    python benches/power_checks.py SCENARIO CHANNEL SEED[,SEED…] [--shadowing-db 8]
                                   [--offset-db 0] [--excess-per-decade-db 0]

Each seed is a drive with correct radio heads, and a drive in which two radio heads have exchanged
their positions. The statistic is the log-likelihood ratio of the best exchange of two radio heads
and the site file. An alarm is a ratio above 7. ``beyond`` is the share of the ``ok`` epochs whose
error exceeds the protection level, and ``until alarm`` the part of it without an alarm.

Model of the SNR in dB: EIRP of the site file, minus 20 dB per decade of distance, plus a gain that
is common to all radio heads (σ 40 dB), an offset of each radio head (σ of the site file, at least
1 dB), shadowing (Gauss–Markov over 10 m) and fading (σ 2 dB). Distances are those of the estimated
positions, and one SSB of each radio head is used every 2 m. The last two options add errors of the
model to the measured values: random constant offsets of the radio heads, and additional path loss.
"""

from __future__ import annotations

import argparse
import json
import warnings
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av import Scenario, simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

STEP_M = 2.0
CORRELATION_M = 10.0
FADING_DB = 2.0
GAIN_STD_DB = 40.0
ALARM = 7.0


class PowerModel:
    """Kalman filter of gain, shadowing and offsets with the log-likelihood of the measured SNRs."""

    def __init__(self, heads: int, shadowing_db: float, offset_db: float) -> None:
        deviations = [GAIN_STD_DB, *[shadowing_db] * heads, *[offset_db] * heads]
        self.heads, self.shadowing_db = heads, shadowing_db
        self.mean = np.zeros(len(deviations))
        self.covariance = np.diag(np.square(deviations))
        self.log_likelihood = 0.0

    def move(self, distance_m: float) -> None:
        kept = np.ones(len(self.mean))
        shadowing = np.arange(1, 1 + self.heads)
        kept[shadowing] = np.exp(-distance_m / CORRELATION_M)
        self.mean *= kept
        self.covariance *= np.outer(kept, kept)
        fresh = self.shadowing_db**2 * (1.0 - kept[shadowing] ** 2)
        self.covariance[shadowing, shadowing] += fresh

    def update(self, head: int, excess_db: float) -> None:
        states = [0, 1 + head, 1 + self.heads + head]
        innovation = excess_db - self.mean[states].sum()
        cross = self.covariance[:, states].sum(axis=1)
        variance = cross[states].sum() + FADING_DB**2
        self.log_likelihood -= 0.5 * (innovation**2 / variance + np.log(variance))
        self.mean += cross * (innovation / variance)
        self.covariance -= np.outer(cross, cross) / variance


def drive(scenario: Scenario, seed: int) -> tuple[Any, Any]:
    found = simulate(scenario, seed=seed, keep_trajectories=True)
    return found.trajectories, found.aoa_estimates


def ratios(
    trajectory: Any,
    received: Any,
    heads: Sequence[dict[str, Any]],
    asked: argparse.Namespace,
    rng: np.random.Generator,
) -> tuple[Numbers, Numbers]:
    """Returns times and log-likelihood ratios, one column for each exchange of two radio heads."""
    count = len(heads)
    orders = [list(range(count))]
    for one, other in combinations(range(count), 2):
        order = list(range(count))
        order[one], order[other] = other, one
        orders.append(order)
    offset_db = max(1.0, *(head.get("eirp_std_db") or 0.0 for head in heads))
    models = [PowerModel(count, asked.shadowing_db, offset_db) for _ in orders]
    positions = np.array([head["position_m"] for head in heads])
    time_s = trajectory["time_s"].to_numpy()
    place = trajectory.select("x_m", "y_m").to_numpy()
    true = trajectory.select("true_x_m", "true_y_m").to_numpy()
    steps_m = np.hypot(*np.diff(true, axis=0).T)
    along_m = np.concatenate([[0.0], np.cumsum(steps_m)])
    step = np.searchsorted(time_s, received["time_s"].to_numpy() + 1e-6) - 1
    number = {head["pci"]: index for index, head in enumerate(heads)}
    own = np.array([number[pci] for pci in received["pci"]])
    errors_db = asked.offset_db * rng.normal(size=count)
    at_m = np.hypot(*(true[step] - positions[own, :2]).T).clip(1.0)
    snr_db = received["snr_db"].to_numpy() + errors_db[own]
    snr_db = snr_db - asked.excess_per_decade_db * np.log10(at_m)
    times: list[float] = []
    values: list[list[float]] = []
    last_m = -np.inf
    for here in np.unique(step):
        if along_m[here] - last_m < STEP_M:
            continue
        moved_m = 0.0 if not times else along_m[here] - last_m
        last_m = along_m[here]
        for model, order in zip(models, orders, strict=True):
            model.move(moved_m)
            for index in np.flatnonzero(step == here):
                head = own[index]
                towards = positions[order[head]] - [*place[here], 0.0]
                loss_db = 20.0 * np.log10(max(1.0, float(np.linalg.norm(towards))))
                model.update(head, snr_db[index] - heads[head]["eirp_dbm"] + loss_db)
        times.append(time_s[here])
        values.append([it.log_likelihood - models[0].log_likelihood for it in models[1:]])
    return np.array(times), np.array(values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario")
    parser.add_argument("channel")
    parser.add_argument("seeds")
    parser.add_argument("--shadowing-db", type=float, default=8.0)
    parser.add_argument("--offset-db", type=float, default=0.0)
    parser.add_argument("--excess-per-decade-db", type=float, default=0.0)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    changed: dict[str, Any] = {
        "vehicle.integrity.enabled": True,
        "vehicle.wake_up": {"policy": "fixed", "interval_ms": 100.0},
        "motion.stops": [],
    }
    if asked.channel != "nominal":
        changed["channel"] = {"model": asked.channel}
    correct = Scenario.load(asked.scenario).with_overrides(changed)
    heads = json.loads(correct.site.to_json())["radio_heads"]
    pairs = list(combinations(range(len(heads)), 2))
    print("seed  correct: max ratio  exchanged: alarm (s)  not ok (s)  beyond  until alarm")
    for seed in map(int, asked.seeds.split(",")):
        rng = np.random.default_rng(seed)
        largest = ratios(*drive(correct, seed), heads, asked, rng)[1].max()
        one, other = (heads[index] for index in pairs[seed % len(pairs)])
        moved = {
            one["name"]: {"position_m": other["position_m"]},
            other["name"]: {"position_m": one["position_m"]},
        }
        exchanged = correct.with_overrides({"truth.site.radio_heads": moved})
        trajectory, received = drive(exchanged, seed)
        times, values = ratios(trajectory, received, heads, asked, rng)
        time_s = trajectory["time_s"].to_numpy()
        is_ok = trajectory["integrity"].to_numpy() == "ok"
        estimated = trajectory.select("x_m", "y_m").to_numpy()
        true = trajectory.select("true_x_m", "true_y_m").to_numpy()
        error_m = np.hypot(*(estimated - true).T)
        is_beyond = is_ok & (error_m > trajectory["protection_level_m"].to_numpy())
        is_quiet = np.interp(time_s, times, values.max(axis=1)) <= ALARM
        alarms = times[values.max(axis=1) > ALARM]
        print(
            f"{seed:4}  {largest:18.1f}  {alarms[0] if len(alarms) else np.nan:20.1f}  "
            f"{time_s[~is_ok][0] if not is_ok.all() else np.nan:10.1f}  "
            f"{is_beyond.sum() / max(1, is_ok.sum()):6.3f}  "
            f"{(is_beyond & is_quiet).sum() / max(1, is_ok.sum()):6.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
