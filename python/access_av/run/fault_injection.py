"""Differences between truth and nominal model: overrides of a scenario, by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Iterable

    from access_av import _core

Overrides = dict[str, Any]

# Multiples of the specified standard deviations.
SIZES = (1, 3, 10)

# Default standard deviations: typical survey, calibration and data sheet.
PLACE_STD_M = 0.1
ROAD_STD_M = 0.03
MOUNTING_STD_RAD = 0.01
PHASE_STD_RAD = 0.03
SCALE_STD = 0.003
GAIN_STD_DB = 0.5
LATE_S = 0.01
# Maximum time offset of an angle that the settings permit (s).
LATEST_S = 0.4
# Error of an electrical angle from a hidden radio head (rad).
HIDDEN_RAD = 0.05

# Time in which slip, phase drift and gain drift reach their size (s).
GROWS_S = 300.0
DRIFTS_M = 1000.0

# Duration of a blockage and time between two blockages (s).
HIDDEN_S = 5.0
HIDDEN_EVERY_S = 20.0
LONGEST_S = 600.0


def mismatches(scenario: _core.Scenario) -> dict[str, Overrides]:
    """Returns the differences between truth and nominal model by name: overrides of the scenario.

    Every other quantity is drawn from its specified standard deviation.

    Examples
    --------
    >>> from access_av import _core
    >>> found = mismatches(_core.Scenario.load("yard"))
    >>> found["array 1 degree off"]
    {'truth.vehicle.array.mounting_rad': 0.0175}
    """
    site = as_dict(scenario.site)
    vehicle = as_dict(scenario.vehicle)
    heads, odometer = site["radio_heads"], vehicle["odometer"]

    def moved(count: int) -> Overrides:
        return _moved(heads[:count], [[2.0, 0.0, 0.0]] * count)

    def whole_drive(what: Overrides) -> Overrides:
        return {"from_s": 20.0, "until_s": 1e6, "what": what}

    def hidden(count: int) -> Overrides:
        what = {"kind": "non-line-of-sight", "bias_rad": 0.15}
        return {
            "faults": [whole_drive({**what, "radio_head": head}) for head in range(count)],
        }

    mounting_rad, phase_rad = vehicle["array"]["mounting_rad"], vehicle["array"]["phase_rad"]
    cases = {
        "none": {},
        "array 1 degree off": {"truth.vehicle.array.mounting_rad": mounting_rad + 0.0175},
        "phases 0.05 rad off": {"truth.vehicle.array.phase_rad": phase_rad + 0.05},
        "odometer noise x 3": {
            "truth.vehicle.odometer.noise_m_per_sqrt_m": 3.0 * odometer["noise_m_per_sqrt_m"]
        },
        "odometer scale x 3": {
            "truth.vehicle.odometer.scale": odometer["scale"] + 3.0 * odometer["scale_std"]
        },
        "odometer slips 2 %": {
            "faults": [whole_drive({"kind": "odometer-slip", "scale": 1.02})],
        },
        "all heads 2 m off": moved(len(heads)),
        "two heads 2 m off": moved(2),
        "one head hidden": hidden(1),
        "three heads hidden": hidden(min(3, len(heads))),
    }
    return {name: case for name, case in cases.items() if case or name == "none"}


def hypotheses(scenario: _core.Scenario, scales: Iterable[float] = SIZES) -> dict[str, Overrides]:
    """Returns fault hypotheses of a site at ``scales`` times the specified standard deviation.

    The default standard deviation is that of a typical survey, calibration or data sheet.
    Every other quantity is drawn from its specified standard deviation.

    Examples
    --------
    >>> from access_av import _core
    >>> found = hypotheses(_core.Scenario.load("yard"))
    >>> found["array mounting x 3"]
    {'truth.vehicle.array.mounting_rad': 0.03}
    """
    site = as_dict(scenario.site)
    vehicle = as_dict(scenario.vehicle)
    found: dict[str, Overrides] = {}
    for scale in scales:
        for name, case in _of_size(site, vehicle, scale).items():
            found[f"{name} x {scale:g}"] = case
    swapped = _swapped(site["radio_heads"])
    return found | ({"two cells swapped": swapped} if swapped else {})


def _of_size(site: Overrides, vehicle: Overrides, size: float) -> dict[str, Overrides]:
    heads, array, odometer = site["radio_heads"], vehicle["array"], vehicle["odometer"]
    receiver = vehicle["receiver"]
    late_s = receiver["angle_time_offset_s"] + size * (
        receiver.get("angle_time_offset_std_s") or LATE_S
    )
    scale = size * (odometer["scale_std"] or SCALE_STD)
    mounting = size * (array.get("mounting_std_rad") or MOUNTING_STD_RAD)
    phase = size * (array.get("phase_std_rad") or PHASE_STD_RAD)
    noise = size * odometer["noise_m_per_sqrt_m"]
    one = heads[len(heads) // 2 :][:1]

    def off(some: list[Overrides], axes: tuple[int, int, int]) -> Overrides:
        return _moved(
            some,
            [
                size * (head["position_std_m"] or PLACE_STD_M) * np.asarray(axes, dtype=np.float64)
                for head in some
            ],
        )

    turned = {"truth.vehicle.array.mounting_rad": array["mounting_rad"] + mounting}
    cases = {
        "head place": off(one, (1, -1, 0)),
        "head height": off(one, (0, 0, 1)),
        "all heads": off(heads, (1, -1, 0)) if len(heads) > 1 else {},
        "array mounting": turned,
        "array phase": {"truth.vehicle.array.phase_rad": array["phase_rad"] + phase},
        "phase drift": {
            "truth.vehicle.array.phase_drift_rad_per_sqrt_m": phase / DRIFTS_M**0.5,
        },
        "gain drift": {
            "truth.vehicle.array.gain_drift_db_per_sqrt_m": size * GAIN_STD_DB / DRIFTS_M**0.5,
        },
        "clock late": {"truth.vehicle.receiver.angle_time_offset_s": min(late_s, LATEST_S)},
        "odometer scale": {"truth.vehicle.odometer.scale": odometer["scale"] + scale},
        "odometer noise": {"truth.vehicle.odometer.noise_m_per_sqrt_m": noise} if noise else {},
        "growing slip": {"faults": list(_growing_slip(scale))},
        "map shape": _bent(site, size),
        "one head hidden in bursts": _hidden_in_bursts(1, size),
        "two heads hidden in bursts": _hidden_in_bursts(2, size) if len(heads) > 1 else {},
        "most heads hidden in bursts": _hidden_in_bursts(len(heads) - 1, size)
        if len(heads) > 3
        else {},
        "head place and array mounting": {**off(one, (1, -1, 0)), **turned},
    }
    return {name: case for name, case in cases.items() if case}


def _moved(heads: list[Overrides], by_m: Iterable[Any]) -> Overrides:
    """Returns the overrides of displaced radio heads; empty if their names are not unique."""
    names = [head["name"] for head in heads]
    if not all(names) or len(set(names)) < len(names):
        return {}
    return {
        "truth.site.radio_heads": {
            name: {"position_m": np.add(head["position_m"], by).tolist()}
            for name, head, by in zip(names, heads, by_m, strict=True)
        }
    }


def _swapped(heads: list[Overrides]) -> Overrides:
    """Returns radio heads of which the first two have exchanged cells."""
    if len(heads) < 2 or not _moved(heads[:2], np.zeros((2, 3))):
        return {}
    first, second = heads[:2]
    sends = ("pci", "ssb_index")
    return {
        "truth.site.radio_heads": {
            first["name"]: {key: second[key] for key in sends},
            second["name"]: {key: first[key] for key in sends},
        }
    }


def _bent(site: Overrides, size: float) -> Overrides:
    """Returns a road with corners displaced alternately to both sides."""
    road = site.get("road") or {}
    if not road.get("polyline_m"):
        return {}
    points = np.asarray(road["polyline_m"])
    by_m = size * (road["position_std_m"] or ROAD_STD_M)
    signs = np.where(np.arange(len(points)) % 2, 1.0, -1.0)
    return {"truth.site.road.polyline_m": (points + by_m * signs[:, None]).tolist()}


def _growing_slip(scale: float) -> Iterable[Overrides]:
    steps = 30
    ends = [*np.linspace(0.0, GROWS_S, steps + 1)[1:-1].tolist(), LONGEST_S]
    for step, (from_s, until_s) in enumerate(zip([0.0, *ends], ends, strict=False), 1):
        what = {"kind": "odometer-slip", "scale": 1.0 + scale * step / steps}
        yield {"from_s": from_s, "until_s": until_s, "what": what}


def _hidden_in_bursts(count: int, size: float) -> Overrides:
    return {
        "faults": [
            {
                "from_s": from_s,
                "until_s": from_s + HIDDEN_S,
                "what": {
                    "kind": "non-line-of-sight",
                    "radio_head": head,
                    "bias_rad": size * HIDDEN_RAD,
                },
            }
            for from_s in np.arange(HIDDEN_EVERY_S, LONGEST_S, HIDDEN_EVERY_S).tolist()
            for head in range(count)
        ]
    }
