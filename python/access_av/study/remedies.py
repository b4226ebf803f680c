"""Measures that could reduce a plant's error: changes of site or vehicle, and their prices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.radio.placement import Plan, plan
from access_av.run.error_bound import p90_m
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av import _core

# Standard deviations after the remedies.
SURVEYED_STD_M = 0.02  # m, in x and y: total station or RTK-GNSS
CALIBRATED_MOUNTING_STD_RAD = 0.002
CALIBRATED_PHASE_STD_RAD = 0.01
REMEMBERED_SCALE_STD = 0.0005  # daily change caused by tyres and load
SHORTEST_PERIOD_MS = 5.0  # TS 38.331, ssb-periodicityServingCell


@dataclass(frozen=True)
class Remedy:
    """One change of the plant.

    Attributes
    ----------
    settings
        Changed keys of the scenario, and their values.
    """

    name: str
    what: str
    settings: Mapping[str, Any]
    price: str
    units: int

    def applied(self, scenario: _core.Scenario) -> _core.Scenario:
        """Returns a scenario with this change."""
        return scenario.with_overrides(dict(self.settings))


def remedies(scenario: _core.Scenario, vehicles: int) -> list[Remedy]:
    """Returns the remedies that change a scenario, ordered from settings to purchases."""
    site, vehicle = (as_dict(part) for part in (scenario.site, scenario.vehicle))
    planned = plan(scenario)
    found = [
        _remember(vehicle),
        _more_ssbs(site),
        _calibrate(vehicle, vehicles),
        _survey(site),
        _odometer(vehicle, vehicles),
        _move(scenario, site, planned),
        _mast(planned),
    ]
    return [remedy for remedy in found if remedy is not None]


def _remember(vehicle: Mapping[str, Any]) -> Remedy | None:
    if vehicle["odometer"]["scale_std"] <= REMEMBERED_SCALE_STD:
        return None
    what = (
        "odometer scale kept from the last trip: standard deviation "
        f"{100.0 * REMEMBERED_SCALE_STD:g} % instead of "
        f"{100.0 * vehicle['odometer']['scale_std']:g} %"
    )
    settings = {"vehicle.odometer.scale_std": REMEMBERED_SCALE_STD}
    return Remedy("remember the odometer’s scale", what, settings, "vehicle_settings", 1)


def _more_ssbs(site: Mapping[str, Any]) -> Remedy | None:
    period_ms = site["ssb"]["period_ms"]
    if 0.5 * period_ms < SHORTEST_PERIOD_MS:
        return None
    what = f"SSBs every {0.5 * period_ms:g} ms instead of every {period_ms:g} ms"
    return Remedy(
        "SSBs twice as often", what, {"site.ssb.period_ms": 0.5 * period_ms}, "cell_settings", 1
    )


def _calibrate(vehicle: Mapping[str, Any], vehicles: int) -> Remedy | None:
    least = {
        "mounting_std_rad": CALIBRATED_MOUNTING_STD_RAD,
        "phase_std_rad": CALIBRATED_PHASE_STD_RAD,
    }
    settings = {
        f"vehicle.array.{key}": value
        for key, value in least.items()
        if vehicle["array"].get(key, 0.0) > value
    }
    if not settings:
        return None
    what = (
        f"mounting known to {1e3 * CALIBRATED_MOUNTING_STD_RAD:g} mrad and the antennas’ phases to "
        f"{1e3 * CALIBRATED_PHASE_STD_RAD:g} mrad"
    )
    return Remedy("calibrate the antennas", what, settings, "calibration", vehicles)


def _survey(site: Mapping[str, Any]) -> Remedy | None:
    heads = site["radio_heads"]
    settings = {
        f"site.radio_heads[{index}].position_std_m": SURVEYED_STD_M
        for index, head in enumerate(heads)
        if head["position_std_m"] > SURVEYED_STD_M
    }
    if not settings:
        return None
    what = f"positions of the radio heads known to {100.0 * SURVEYED_STD_M:g} cm (σ)"
    return Remedy("survey the radio heads", what, settings, "survey", len(settings))


def _odometer(vehicle: Mapping[str, Any], vehicles: int) -> Remedy | None:
    settings = {
        f"vehicle.odometer.{key}": 0.5 * vehicle["odometer"][key]
        for key in ("scale_std", "noise_m_per_sqrt_m", "noise_m_per_sqrt_s", "speed_noise_mps")
        if vehicle["odometer"][key] > 0.0
    }
    if not settings:
        return None
    return Remedy("a better odometer", "half the odometer’s errors", settings, "odometer", vehicles)


def _move(scenario: _core.Scenario, site: Mapping[str, Any], planned: Plan) -> Remedy | None:
    """Returns the radio head whose move to the best position near the weakest one helps most."""
    heads = site["radio_heads"]
    if len(heads) < 2:
        return None
    place = planned.ranking.row(0, named=True)
    position_m = [place["x_m"], place["y_m"], place["z_m"]]

    changes = [{f"site.radio_heads[{it}].position_m": position_m} for it in range(len(heads))]
    index = min(range(len(heads)), key=lambda it: p90_m(scenario.with_overrides(changes[it])))
    name = heads[index]["name"] or f"radio head {index + 1}"
    what = f"“{name}” moved to ({position_m[0]:g}, {position_m[1]:g}) m, {position_m[2]:g} m high"
    return Remedy("move a radio head", what, changes[index], "move_radio_head", 1)


def _mast(planned: Plan) -> Remedy | None:
    heads = as_dict(planned.scenario.site)["radio_heads"]
    heads[-1] |= {
        key: heads[0][key] for key in ("position_std_m", "eirp_std_db") if heads[0].get(key)
    }
    x_m, y_m, z_m = heads[-1]["position_m"]
    what = f"a further radio head at ({x_m:g}, {y_m:g}) m, {z_m:g} m high"
    return Remedy("add a mast", what, {"site.radio_heads": heads}, "radio_head", 1)
