"""Unspecified parameters of the paper, as a space of interpretations.

Each dimension has a range and a rule by which it changes the paper's scenario. Dimensions of the
*environment* change every campaign; those of the *controller* change adaptive MUSIC only. Points
are coordinates from 0 to 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from access_av.designs import space
from access_av.paper.statements import paper_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.paper.outcome import Numbers

WEIGHT_VELOCITY = float(paper_numbers()["wake_up"]["weight_velocity"])
# SNR in the middle of the track at the shipped radiated power, in dB.
MIDDLE_SNR_DB, SHIPPED_EIRP_DBM = 5.0, -17.3


@dataclass(frozen=True)
class Dimension(space.Dimension):
    """Parameter that the paper does not specify."""

    digits: ClassVar[int] = 4


WORLD = (
    Dimension("eirp_dbm", "radiated power / dBm", -23.3, -11.3),
    Dimension("rician_k_db", "Rician K / dB", 5.0, 45.0),
    Dimension("scatter", "scatter", choices=("per-antenna", "rays")),
    Dimension("correlation_m", "correlation of shadowing / m", 0.05, 20.0, is_log=True),
    Dimension("heading", "heading between estimates", choices=("held", "mean")),
    Dimension("snapshots", "snapshots", 10.0, 40.0),
)
# Additional parameters of the sensitivity analysis: also the power of a real radio head.
OPEN_WORLD = (
    Dimension("eirp_dbm", "radiated power / dBm", -23.3, 10.0),
    *WORLD[1:],
    Dimension("axis", "array axis", choices=("along", "across")),
    Dimension("odometer", "odometer", choices=("exact", "real")),
    Dimension("grid_deg", "MUSIC grid / degrees", choices=("none", "0.5", "1")),
    # The SSB selection also applies to fixed intervals.
    Dimension("ssb_selection", "SSB for a wake-up time", choices=("first-after", "last-before")),
)
# Environment of the shipped scenario; its shadowing has a shorter correlation than the range
# permits.
SHIPPED_WORLD = (0.5, 0.875, 0.25, 0.0, 0.75, 1.0 / 3.0)
CONTROLLER = (
    Dimension("link_error_db", "error of the link budget / dB", -6.0, 6.0),
    Dimension("set_point", "set point", choices=("expected", "absolute")),
    Dimension("offset_db", "set point / dB", -3.0, 12.0),
    Dimension("scale_db", "SNR scale / dB", 2.0, 20.0, is_log=True),
    Dimension("clamp", "integral clamp", 0.05, 50.0, is_log=True),
    Dimension("u_unit_ms", "unit of u / ms", 20.0, 1000.0, is_log=True),
    Dimension("delta_t", "unit of Δt", choices=("seconds", "steps")),
    Dimension("sensing", "computed at", choices=("every-ssb", "wake-up")),
)
OPEN_CONTROLLER = (
    *CONTROLLER,
    Dimension("velocity", "velocity error counts", 0.0, 2.0),
)
GATE = Dimension("gate", "gate", choices=("none", "within t_max", "without bound"))


def world_changes(point: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the overrides of a point of :data:`WORLD` or :data:`OPEN_WORLD`."""
    changes = {
        "site.radio_heads[0].eirp_dbm": point["eirp_dbm"],
        "site.rician_k_db": point["rician_k_db"],
        "channel.scatter": point["scatter"],
        "channel.shadowing_correlation_m": point["correlation_m"],
        "vehicle.localizer.heading_between": point["heading"],
        "vehicle.receiver.snapshots": round(point["snapshots"]),
    }
    if point.get("axis") == "across":
        # An array to the right, so that its axis is perpendicular to the direction of driving.
        changes["vehicle.array.mounting_rad"] = -0.5 * math.pi
    if point.get("odometer") == "real":
        changes["vehicle.odometer.scale_std"] = 0.003
        changes["vehicle.odometer.noise_m_per_sqrt_m"] = 0.01
    if point.get("grid_deg", "none") != "none":
        changes["vehicle.estimator.music_grid_deg"] = float(point["grid_deg"])
    return changes


def controller_changes(point: Mapping[str, Any], world: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the overrides of a point of :data:`CONTROLLER` and of a gate.

    The nominal link budget of the vehicle differs from the true one, which is unchanged.
    """
    eirp_dbm = world["eirp_dbm"]
    if point["set_point"] == "expected":
        set_point = {"kind": "expected", "offset_db": point["offset_db"]}
    else:
        middle_db = MIDDLE_SNR_DB + eirp_dbm - SHIPPED_EIRP_DBM
        set_point = {"kind": "absolute", "snr_db": round(middle_db + point["offset_db"], 3)}
    pid = {
        "policy": "pid",
        "snr_set_point": set_point,
        "snr_scale_db": point["scale_db"],
        "integral_clamp": point["clamp"],
        "u_unit_ms": point["u_unit_ms"],
        "delta_t": point["delta_t"],
        "sensing": point["sensing"],
        "ssb_selection": world.get("ssb_selection", "first-after"),
        "weight_velocity": WEIGHT_VELOCITY * point.get("velocity", 1.0),
    }
    gate = point.get("gate", "none")
    bound = {"t_max_ms": 240.0} if gate == "within t_max" else {}
    gated = {"policy": "gated", "snr_set_point": set_point, "trigger": pid, **bound}
    return {
        "vehicle.wake_up": pid if gate == "none" else gated,
        "site.radio_heads[0].eirp_dbm": round(eirp_dbm + point["link_error_db"], 4),
        "truth.site": {"radio_heads": {"roadside": {"eirp_dbm": eirp_dbm}}},
    }


def latin_hypercube(count: int, dimensions: int, seed: int) -> Numbers:
    """Returns points from 0 to 1 that cover every dimension evenly.

    Examples
    --------
    >>> points = latin_hypercube(4, 2, seed=1)
    >>> sorted((points[:, 0] * 4).astype(int).tolist())
    [0, 1, 2, 3]
    """
    rng = np.random.default_rng(seed)
    strata = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    return np.asarray((strata + rng.random((count, dimensions))) / count)
