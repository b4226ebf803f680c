"""Random drives: roads, radio heads, noise, stops and gaps in plausible ranges."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from random import Random

    from attack.case import Case

DRIVE = """\
import access_av
found = access_av.simulate("scenario.toml", seed={seed}, threads=1, keep_trajectories=True)
found.trajectories.write_parquet("trajectories.parquet")
found.aoa_estimates.write_parquet("aoa_estimates.parquet")
found.steps.write_parquet("steps.parquet")
found.runs.write_parquet("runs.parquet")
"""


def drive(random: Random, case: Case) -> list[str]:
    """One drive of a random scenario with the tracker, usually with integrity monitoring."""
    case.write("scenario.toml", scenario(random))
    return case.python(DRIVE.format(seed=random.randrange(2**32)))


def scenario(random: Random) -> dict[str, Any]:
    """Returns a random plant and vehicle, with each value in its usual range."""
    road, length_m = _road(random)
    heads = [_head(random, pci, length_m) for pci in range(random.choice((1, 2, 3, 3, 4, 6)))]
    made: dict[str, Any] = {
        "name": "random",
        "site": {
            "name": "random",
            "rician_k_db": random.uniform(3.0, 20.0),
            "ssb": {"period_ms": random.choice((20.0, 40.0, 80.0, 160.0))},
            "road": road,
            "radio_heads": heads,
        },
        "vehicle": _vehicle(random),
        "motion": {
            "stops": [
                {"at_m": share * length_m, "dwell_s": random.uniform(1.0, 20.0)}
                for share in sorted(random.uniform(0.05, 0.95) for _ in range(random.randrange(3)))
            ]
        },
        "channel": {
            "shadowing_std_db": random.uniform(0.0, 8.0),
            "shadowing_correlation_m": random.choice((0.0, 5.0, 20.0)),
            "scatter": random.choice(("per-antenna", "rays")),
        },
        "ssb_latency_ms": random.choice((0.0, 0.0, 50.0, 400.0)),
    }
    if random.random() < 0.3:
        made["faults"] = [_fault(random, len(heads))]
    return made


def _road(random: Random) -> tuple[dict[str, Any], float]:
    """Returns straights and arcs of 30 to 400 m in total, partly not surveyed."""
    segments = []
    for index in range(random.randrange(1, 5)):
        length_m = random.uniform(30.0, 100.0)
        turn_rad = random.choice((0.0, random.uniform(-math.pi / 2, math.pi / 2)))
        surveyed = turn_rad != 0.0 or index == 0 or random.random() < 0.7
        segments.append({"length_m": length_m, "turn_rad": turn_rad, "surveyed": surveyed})
    road = {"segments": segments, "position_std_m": random.choice((0.0, 0.02, 0.1))}
    return road, sum(it["length_m"] for it in segments)


def _head(random: Random, pci: int, length_m: float) -> dict[str, Any]:
    side = random.choice((-1.0, 1.0))
    return {
        "position_m": [
            random.uniform(-30.0, length_m + 30.0),
            side * random.uniform(length_m, length_m + 60.0)
            if random.random() < 0.3
            else side * random.uniform(12.0, 90.0),
            random.choice((0.0, random.uniform(1.0, 10.0))),
        ],
        "position_std_m": random.choice((0.0, 0.1, 0.5)),
        "eirp_dbm": random.uniform(0.0, 25.0),
        "pci": pci,
    }


def _vehicle(random: Random) -> dict[str, Any]:
    made: dict[str, Any] = {
        "name": "random",
        "top_speed_kmh": random.uniform(3.0, 25.0),
        "drive": random.choice(("road", "road", "differential")),
        "lane_keeping": {
            "rms_m": random.uniform(0.0, 0.5),
            "wavelength_m": 10.0 ** random.uniform(0.7, 2.3),
        },
        "array": {
            "elements": random.choice((2, 4, 4, 8)),
            "mounting_std_rad": random.choice((0.0, 0.005, 0.02)),
            "phase_std_rad": random.choice((0.0, 0.03)),
        },
        "odometer": {
            "rate_hz": random.choice((10.0, 50.0, 100.0)),
            "scale_std": random.choice((0.0, 0.003, 0.02)),
            "noise_m_per_sqrt_m": random.choice((0.001, 0.01, 0.05)),
            "speed_noise_mps": random.choice((0.0, 0.02)),
            "dropout_probability": random.choice((0.0, 0.0, 0.1)),
        },
        "estimator": {"method": "maximum-likelihood"},
        "receiver": {"pilots": "pss+sss"},
        "localizer": {"kind": "tracker"},
        "start": {
            "known": random.random() < 0.85,
            "position_std_m": random.choice((0.0, 0.1, 1.0)),
            "heading_std_rad": random.choice((0.0, 0.02)),
        },
        "wake_up": random.choice(
            (
                {"policy": "fixed", "interval_ms": 20.0},
                {"policy": "fixed", "interval_ms": 1000.0},
                {"policy": "uncertainty", "target_error_m": 0.5},
            )
        ),
    }
    if made["drive"] == "differential" or random.random() < 0.5:
        made["gyroscope"] = {
            "noise_rad_per_sqrt_s": random.choice((1e-4, 1e-3)),
            "bias_std_radps": random.choice((0.0, 1e-4, 1e-3)),
        }
    if random.random() < 0.7:
        made["integrity"] = {}
    return made


def _fault(random: Random, heads: int) -> dict[str, Any]:
    from_s = random.uniform(0.0, 40.0)
    head = random.randrange(heads)
    return {
        "from_s": from_s,
        "until_s": from_s + random.uniform(1.0, 40.0),
        "what": random.choice(
            (
                {
                    "kind": "non-line-of-sight",
                    "radio_head": head,
                    "bias_rad": random.uniform(-1, 1),
                },
                {"kind": "moved-head", "radio_head": head, "by_m": [random.uniform(-9, 9), 3.0]},
                {"kind": "odometer-slip", "scale": random.uniform(0.5, 1.5)},
                {"kind": "stuck-antenna", "antennas": [1]},
            )
        ),
    }
