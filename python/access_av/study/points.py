"""Operating points: estimator, wake-up and power mode, what no other beats, and which to take."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.designs.front import not_beaten
from access_av.device.platform import Platform
from access_av.study.trips import EXTENTS, Driven, Energy, platform_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av import _core

# Wake-ups that are tried beside the vehicle's own, by what a table calls them.
FIXED_MS = (200.0, 500.0, 1000.0)
# An estimator that takes raw snapshots is tried where the vehicle knows the pilots.
METHODS = ("root-music", "esprit", "music")


@dataclass(frozen=True)
class Point:
    """One way to operate the vehicle.

    Attributes
    ----------
    driven
        Its drives; any power mode makes the same ones.
    method, wake_up
        In words.
    mode, mode_name
        The power mode.
    energy
        Of a trip by ``low``, ``value`` and ``high``.
    idle_w
        What the board draws in the mode whether or not it estimates; ``None`` without a figure.
    error_m
        The target's percentile of the horizontal error.
    """

    driven: Driven
    method: str
    wake_up: str
    mode: int
    mode_name: str
    energy: Mapping[str, Energy]
    idle_w: Mapping[str, float] | None
    error_m: float

    @property
    def name(self) -> str:
        """Method, wake-up and mode."""
        return f"{self.method}, {self.wake_up}, mode {self.mode} ({self.mode_name})"


def tried(scenario: _core.Scenario) -> dict[str, tuple[str, str, dict[str, Any]]]:
    """Ways to operate, without power modes: by name, method and wake-up, and their settings.

    The vehicle's own comes first, under the name ``as it is``.
    """
    vehicle = json.loads(scenario.resolved().vehicle.to_json())
    method, own = vehicle["estimator"]["method"], in_words(vehicle["wake_up"])
    found: dict[str, tuple[str, str, dict[str, Any]]] = {"as it is": (method, own, {})}
    period_ms = json.loads(scenario.site.to_json())["ssb"]["period_ms"]
    for interval_ms in FIXED_MS:
        wake_up = {"policy": "fixed", "interval_ms": interval_ms}
        if interval_ms >= period_ms and in_words(wake_up) != own:
            name = in_words(wake_up)
            found[name] = (method, name, {"vehicle.wake_up": wake_up})
    if own != in_words({"policy": "uncertainty"}):
        name = in_words({"policy": "uncertainty"})
        found[name] = (method, name, {"vehicle.wake_up": {"policy": "uncertainty"}})
    for other in METHODS:
        if other != method:
            settings = {"vehicle.estimator.method": other, "vehicle.receiver.pilots": "blind"}
            found[other] = (other, own, settings)
    return found


def in_words(wake_up: Mapping[str, Any]) -> str:
    """When a vehicle wakes up, in words."""
    if wake_up["policy"] == "fixed":
        interval_ms = wake_up.get("interval_ms")
        return "as fast as it can" if interval_ms is None else f"every {interval_ms:g} ms"
    named = {
        "uncertainty": "when its own error asks for it",
        "pid": "by Algorithm 1",
        "gated": "gated by SNR",
    }
    policy = str(wake_up["policy"])
    return named.get(policy, policy)


def points(drives: Sequence[tuple[str, str, Driven]], percent: float) -> list[Point]:
    """Every driven way in every power mode that has a figure for it.

    A mode in which an estimate takes longer than from one SSB to the next would drive otherwise,
    and is left out.

    Parameters
    ----------
    drives
        Method, wake-up and drives of each.
    percent
        The target's percentile.
    """
    found = []
    for method, wake_up, driven in drives:
        error_m = driven.percentile(percent).value
        scenario = driven.scenario
        platform = Platform.load(platform_name(scenario))
        period_s = json.loads(scenario.site.to_json())["ssb"]["period_ms"] * 1e-3
        for mode in platform.modes:
            in_mode = scenario.with_overrides({"vehicle.platform.mode": mode.number})
            energy = _with(driven, in_mode).energy(platform)
            if energy is None or platform.core.base_wake_up_s(in_mode.vehicle) > period_s:
                continue
            found.append(
                Point(
                    driven=driven,
                    method=method,
                    wake_up=wake_up,
                    mode=mode.number,
                    mode_name=mode.name,
                    energy=energy,
                    idle_w=idle_w(platform, mode.number),
                    error_m=error_m,
                )
            )
    return found


def _with(driven: Driven, scenario: _core.Scenario) -> Driven:
    return replace(driven, scenario=scenario)


def idle_w(platform: Platform, number: int) -> dict[str, float] | None:
    """What a board draws in a mode whether or not anything is estimated, low to high, in watts."""
    written = json.loads(platform.core.to_json())
    [mode] = [mode for mode in written["modes"] if mode["mode"] == number]
    figure = mode.get("idle_power_w") or written.get("idle", {}).get("power_w")
    if figure is None:
        return None
    value = float(figure["value"])
    stated = {extent: figure.get(extent) for extent in EXTENTS}
    return {extent: value if end is None else float(end) for extent, end in stated.items()}


def front(found: Sequence[Point]) -> list[int]:
    """Places of the points that no other beats in energy and error, by energy."""
    if not found:
        return []
    energy_j = np.array([point.energy["value"].total_j for point in found])
    error_m = np.array([point.error_m for point in found])
    return [int(place) for place in not_beaten(energy_j, error_m) if np.isfinite(error_m[place])]


def recommended(found: Sequence[Point], error_m: float) -> int | None:
    """Of the front the one of least energy that keeps the target; where none does, the best one."""
    on_front = front(found)
    if not on_front:
        return None
    keeping = [place for place in on_front if found[place].error_m <= error_m]
    return keeping[0] if keeping else min(on_front, key=lambda place: found[place].error_m)
