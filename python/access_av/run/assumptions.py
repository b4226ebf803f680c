"""What a scenario takes as exact or leaves out, so that its figures look better than a plant's."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from access_av.device.platform import BOUNDARIES, Platform

if TYPE_CHECKING:
    from access_av import _core


def flattering(scenario: _core.Scenario) -> list[str]:
    """What flatters the figures of a scenario, in words; each with the key that says otherwise.

    Examples
    --------
    >>> from access_av import _core
    >>> flattering(_core.Scenario.load("yard"))
    []
    >>> exact = {"vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0}}
    >>> flattering(_core.Scenario.load("yard").with_overrides(exact))
    ['exact start (vehicle.start)']
    """
    site, vehicle = (json.loads(it.to_json()) for it in (scenario.site, scenario.vehicle))
    array, odometer, start = (vehicle[key] for key in ("array", "odometer", "start"))
    tracks = vehicle["localizer"]["kind"] == "tracker"
    heads = site["radio_heads"]
    found = {
        f"angles of {len(heads)} radio heads, each taken as exact by dead reckoning": (
            not tracks and len(heads) > 1
        ),
        "dead reckoning, which knows no error of its own, so no protection level"
        " (vehicle.localizer.kind)": not tracks,
        "no integrity monitor, so no protection level (vehicle.integrity.enabled)": tracks
        and not vehicle.get("integrity", {"enabled": True})["enabled"],
        "exact start (vehicle.start)": start["known"]
        and not (start["position_std_m"] or start["heading_std_rad"]),
        "exact odometer (vehicle.odometer)": not any(
            value for key, value in odometer.items() if "noise" in key or key == "scale_std"
        ),
        "exact array (vehicle.array.mounting_std_rad, phase_std_rad)": not (
            array.get("mounting_std_rad") or array.get("phase_std_rad")
        ),
        "exact places of the radio heads (site.radio_heads.all.position_std_m)": not any(
            head["position_std_m"] for head in heads
        ),
        "nothing drawn from what is stated (truth.draw)": json.loads(scenario.to_json())
        .get("truth", {})
        .get("draw")
        == "none",
        "energy not counted, for which the platform has no figure (vehicle.platform.name)": (
            energy_boundary(scenario) is None
        ),
    }
    return [what for what, holds in found.items() if holds]


def energy_boundary(scenario: _core.Scenario) -> str | None:
    """What the joules of a scenario count, in words; ``None`` where its platform has no figure.

    Examples
    --------
    >>> from access_av import _core
    >>> energy_boundary(_core.Scenario.load("yard"))
    'what is drawn above idle'
    """
    settings = json.loads(scenario.vehicle.to_json())["platform"]
    platform = Platform.load(settings["name"]).core
    energy_j = platform.energy_j(scenario.vehicle, 1, 1, 1.0)
    return None if energy_j is None else BOUNDARIES[energy_j[-1]]


def in_words(assumed: list[str]) -> str:
    """One sentence of what flatters; empty where nothing does.

    Examples
    --------
    >>> in_words(["exact start (vehicle.start)"])
    'Assumed, and better than a plant is: exact start (vehicle.start).'
    """
    return f"Assumed, and better than a plant is: {'; '.join(assumed)}." if assumed else ""
