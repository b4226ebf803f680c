"""Site, vehicle, scenario, plant and platform as plain data."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from access_av._core import Site, Vehicle


class Settings(Protocol):
    """Settings that can be written as JSON: site, vehicle, scenario, plant, platform."""

    def to_json(self) -> str:
        """Returns the settings with all default values, as JSON."""


def as_dict(settings: Settings) -> dict[str, Any]:
    """Returns the keys of settings with all default values; a new dictionary for each call.

    Examples
    --------
    >>> from access_av import Site
    >>> as_dict(Site.load("yard"))["ssb"]["period_ms"]
    20.0
    """
    found: dict[str, Any] = json.loads(settings.to_json())
    return found


def ssb_period_s(site: Site) -> float:
    """Returns the period of the SSB bursts of a site, in seconds.

    Examples
    --------
    >>> from access_av import Site
    >>> ssb_period_s(Site.load("yard"))
    0.02
    """
    return float(as_dict(site)["ssb"]["period_ms"]) * 1e-3


def platform_name(vehicle: Vehicle) -> str:
    """Returns the platform of a vehicle: name of a shipped file, or path.

    Examples
    --------
    >>> from access_av import Vehicle
    >>> platform_name(Vehicle.load("tugger"))
    'jetson-agx-xavier-engine'
    """
    return str(as_dict(vehicle)["platform"]["name"])
