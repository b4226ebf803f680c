"""Values that a plant shares with the template, and their effect on the reachable error."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from access_av import _core
from access_av.run.error_bound import p90_m
from access_av.settings import as_dict
from access_av.site_files.templates import new

if TYPE_CHECKING:
    from collections.abc import Mapping

ODOMETER = ("scale_std", "noise_m_per_sqrt_m")
ARRAY = ("mounting_std_rad", "phase_std_rad")
# Keys without an effect on the error that a new plant shares with the template, and their units.
OTHERS = {
    "target": "",
    "site.road.segments": "",
    "site.carrier_mhz": "MHz",
    "fleet.vehicles": "",
    "fleet.hours_per_day": "h",
    "fleet.trips_per_day": "",
    "fleet.days_per_year": "",
    "fleet.years": "",
}


@dataclass(frozen=True)
class Unverified:
    """A value that is equal to the template's or the default.

    Attributes
    ----------
    otherwise
        Description of a plausible alternative; empty without an effect on the error.
    effect
        Ratio of the error bounds (90th percentile along the road) with the alternative and with the
        value; ``None`` if the key has no effect.
    """

    key: str
    what: str
    otherwise: str
    effect: float | None


def unverified(plant: _core.Plant) -> list[Unverified]:
    """Returns the values equal to the template's or the default, by influence.

    The effect is the change of the posterior Cramér–Rao bound when one value is changed. A value
    that is omitted in the file is equal to a written default.
    """
    mine, template = as_dict(plant), _template()
    scenario = plant.scenario()
    before_m = p90_m(scenario)
    found = []
    for key, what, otherwise, settings in _candidates(mine["site"], mine["vehicle"]):
        if not _is_shared(mine, template, key):
            continue
        after_m = p90_m(scenario.with_overrides(settings))
        found.append(Unverified(key, what, otherwise, after_m / before_m))
    found.sort(key=lambda one: -(one.effect or 0.0))
    for key, unit in OTHERS.items():
        if _is_shared(mine, template, key):
            value = _at(mine, key)
            what = "as in the template"
            if not isinstance(value, list):
                what = f"{format(value, 'g') if isinstance(value, float) else value} {unit}".strip()
            found.append(Unverified(key, what, "", None))
    return found


@cache
def _template() -> Mapping[str, Any]:
    plant = _core.Plant.from_toml(new("plant", "template", "template"), "template")
    written: Mapping[str, Any] = as_dict(plant)
    return written


def _at(held: Any, key: str) -> Any:
    for name in key.split("."):
        held = held.get(name) if isinstance(held, dict) else None
    return held


def _is_shared(mine: Mapping[str, Any], template: Mapping[str, Any], key: str) -> bool:
    """Returns whether a plant (or one of its radio heads) has the template's value."""
    place, _, name = key.rpartition(".")
    if place == "site.radio_heads":
        values = {head[name] for head in template["site"]["radio_heads"]}
        return any(head[name] in values for head in mine["site"]["radio_heads"])
    if place == "vehicle":
        shared = {"odometer": ODOMETER, "array": ARRAY}[name]
        return all(_at(mine, f"{key}.{one}") == _at(template, f"{key}.{one}") for one in shared)
    value = _at(mine, key)
    return value is not None and value == _at(template, key)


def _candidates(
    site: Mapping[str, Any], vehicle: Mapping[str, Any]
) -> list[tuple[str, str, str, dict[str, Any]]]:
    """Returns the values with an effect on the error: key, description, alternative, settings."""
    heads, odometer, array = site["radio_heads"], vehicle["odometer"], vehicle["array"]
    found = [
        (
            "site.rician_k_db",
            f"Rician K {site['rician_k_db']:g} dB",
            f"{site['rician_k_db'] - 5.0:g} dB",
            {"site.rician_k_db": site["rician_k_db"] - 5.0},
        ),
        (
            "site.radio_heads.eirp_dbm",
            f"radio heads radiate {_span(heads, 'eirp_dbm')} dBm (EIRP)",
            "6 dB less",
            {
                f"site.radio_heads[{index}].eirp_dbm": head["eirp_dbm"] - 6.0
                for index, head in enumerate(heads)
            },
        ),
        (
            "site.radio_heads.position_std_m",
            f"positions of the radio heads known to {_span(heads, 'position_std_m')} m (σ)",
            "three times this value, at least 0.3 m",
            {
                f"site.radio_heads[{index}].position_std_m": max(0.3, 3.0 * head["position_std_m"])
                for index, head in enumerate(heads)
            },
        ),
        (
            "vehicle.odometer",
            f"scale of the odometer known to {100.0 * odometer['scale_std']:g} % (σ), noise of "
            f"{odometer['noise_m_per_sqrt_m']:g} m per √m",
            "twice this value",
            {f"vehicle.odometer.{key}": 2.0 * odometer[key] for key in ODOMETER},
        ),
        (
            "vehicle.array",
            f"mounting of the antennas known to {array.get('mounting_std_rad', 0.0):g} rad (σ), "
            f"phases to {array.get('phase_std_rad', 0.0):g} rad",
            "twice this value",
            {f"vehicle.array.{key}": 2.0 * array[key] for key in ARRAY if array.get(key)},
        ),
        (
            "site.ssb.period_ms",
            f"SSBs every {site['ssb']['period_ms']:g} ms",
            f"every {2.0 * site['ssb']['period_ms']:g} ms",
            {"site.ssb.period_ms": min(160.0, 2.0 * site["ssb"]["period_ms"])},
        ),
    ]
    return [each for each in found if each[3]]


def _span(heads: list[dict[str, Any]], key: str) -> str:
    values = sorted({head[key] for head in heads})
    return f"{values[0]:g}" if len(values) == 1 else f"{values[0]:g} to {values[-1]:g}"
