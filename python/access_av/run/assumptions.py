"""Optimistic assumptions of a scenario: exact or omitted error sources."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.device.platform import BOUNDARIES, Platform
from access_av.settings import as_dict

if TYPE_CHECKING:
    from access_av import _core


def optimistic_assumptions(scenario: _core.Scenario) -> list[str]:
    """Returns the optimistic assumptions of a scenario as text, each with its key.

    Examples
    --------
    >>> from access_av import _core
    >>> optimistic_assumptions(_core.Scenario.load("yard"))
    []
    >>> exact = {"vehicle.start": {"position_std_m": 0.0, "heading_std_rad": 0.0}}
    >>> optimistic_assumptions(_core.Scenario.load("yard").with_overrides(exact))
    ['exact start (vehicle.start)']
    """
    site, vehicle = (as_dict(it) for it in (scenario.site, scenario.vehicle))
    array, odometer, start = (vehicle[key] for key in ("array", "odometer", "start"))
    tracks = vehicle["localizer"]["kind"] == "tracker"
    heads = site["radio_heads"]
    monitored = vehicle.get("integrity", {"enabled": True})["enabled"]
    odometer_errors = [it for key, it in odometer.items() if "noise" in key or key == "scale_std"]
    std_factor = as_dict(scenario).get("truth", {}).get("std_factor")
    many = f"angles of {len(heads)} radio heads, assumed exact by dead reckoning"
    found = [
        (many, not tracks and len(heads) > 1),
        ("dead reckoning without protection level (vehicle.localizer.kind)", not tracks),
        (
            "no integrity monitor and protection level (vehicle.integrity.enabled)",
            tracks and not monitored,
        ),
        (
            "exact start (vehicle.start)",
            start["known"] and not (start["position_std_m"] or start["heading_std_rad"]),
        ),
        ("exact odometer (vehicle.odometer)", not any(odometer_errors)),
        (
            "exact array (vehicle.array.mounting_std_rad, phase_std_rad)",
            not (array.get("mounting_std_rad") or array.get("phase_std_rad")),
        ),
        (
            "exact positions of the radio heads (site.radio_heads.all.position_std_m)",
            not any(head["position_std_m"] for head in heads),
        ),
        ("truth equal to the nominal model (truth.std_factor)", std_factor == 0.0),
        (
            "no energy, because the platform has no value for the method (vehicle.platform.name)",
            energy_boundary(scenario) is None,
        ),
    ]
    return [what for what, holds in found if holds]


def energy_boundary(scenario: _core.Scenario) -> str | None:
    """Returns the boundary of the energy as text; ``None`` if the platform has no energy.

    Examples
    --------
    >>> from access_av import _core
    >>> energy_boundary(_core.Scenario.load("yard"))
    'above idle'
    """
    settings = as_dict(scenario.vehicle)["platform"]
    platform = Platform.load(settings["name"]).core
    energy_j = platform.energy_j(scenario.vehicle, 1, 1, 1.0)
    return None if energy_j is None else BOUNDARIES[energy_j[-1]]


def in_words(assumed: list[str]) -> str:
    """Returns the optimistic assumptions as a sentence; empty without any.

    Examples
    --------
    >>> in_words(["exact start (vehicle.start)"])
    'Optimistic assumptions: exact start (vehicle.start).'
    """
    return f"Optimistic assumptions: {'; '.join(assumed)}." if assumed else ""
