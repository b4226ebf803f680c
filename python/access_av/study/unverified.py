"""What a study's figures hang on that nobody at the plant has stated, ranked by its effect."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from access_av.run.error_bound import along_route
from access_av.tables import toml

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av import _core


@dataclass(frozen=True)
class Unstated:
    """A value that the plant's own files do not state.

    Attributes
    ----------
    key
        Where to state it.
    what
        What is taken instead, in words.
    otherwise
        What it could be as well, in words.
    effect
        By what factor the bound of the error (90th percentile along the road) is then larger.
    """

    key: str
    what: str
    otherwise: str
    effect: float


def unstated(scenario: _core.Scenario, plant: str) -> list[Unstated]:
    """Every value taken from a shipped file or by default, the weightiest first.

    By the posterior Cramér-Rao bound, in which each is worse by itself: what is stated there has to
    be looked up first.

    Parameters
    ----------
    scenario
        A trip of the plant.
    plant
        Path of the plant's file; of a shipped one nothing is stated.
    """
    stated = _stated(Path(plant))
    before_m = _p90_m(scenario)
    found = []
    for key, what, otherwise, settings in _candidates(scenario):
        if not _has(stated, key):
            after_m = _p90_m(scenario.with_overrides(settings))
            found.append(Unstated(key, what, otherwise, after_m / before_m))
    return sorted(found, key=lambda one: -one.effect)


def _p90_m(scenario: _core.Scenario) -> float:
    return float(along_route(scenario)["bound_m"].quantile(0.9, "linear") or 0.0)


def _candidates(scenario: _core.Scenario) -> list[tuple[str, str, str, dict[str, Any]]]:
    site, vehicle = (json.loads(part.to_json()) for part in (scenario.site, scenario.vehicle))
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
            f"radio heads radiate {_span(heads, 'eirp_dbm')} dBm",
            "6 dB less",
            {
                f"site.radio_heads[{index}].eirp_dbm": head["eirp_dbm"] - 6.0
                for index, head in enumerate(heads)
            },
        ),
        (
            "site.radio_heads.position_std_m",
            f"radio heads’ places known to {_span(heads, 'position_std_m')} m",
            "three times worse, 0.3 m at least",
            {
                f"site.radio_heads[{index}].position_std_m": max(0.3, 3.0 * head["position_std_m"])
                for index, head in enumerate(heads)
            },
        ),
        (
            "vehicle.odometer",
            f"odometer’s scale known to {100.0 * odometer['scale_std']:g} %, noise of "
            f"{odometer['noise_m_per_sqrt_m']:g} m per root of a metre",
            "twice as large",
            {
                f"vehicle.odometer.{key}": 2.0 * odometer[key]
                for key in ("scale_std", "noise_m_per_sqrt_m")
            },
        ),
        (
            "vehicle.array",
            f"antennas’ mounting known to {array.get('mounting_std_rad', 0.0):g} rad, phases to "
            f"{array.get('phase_std_rad', 0.0):g} rad",
            "twice as large",
            {
                f"vehicle.array.{key}": 2.0 * array[key]
                for key in ("mounting_std_rad", "phase_std_rad")
                if array.get(key)
            },
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


def _stated(plant: Path) -> Mapping[str, Any]:
    """What the plant's own files state: the plant's, and those of its own that it names."""
    if not plant.is_file():
        return {}
    found = dict(toml.read(plant))
    for kind in ("site", "vehicle"):
        named = found.get(kind)
        if isinstance(named, str):
            beside = plant.parent / named
            found[kind] = toml.read(beside) if beside.is_file() else {}
    return found


def _has(stated: Any, key: str) -> bool:
    head, _, rest = key.partition(".")
    if isinstance(stated, list):
        return bool(stated) and all(_has(item, key) for item in stated)
    if not isinstance(stated, dict) or head not in stated:
        return False
    return _has(stated[head], rest) if rest else True
