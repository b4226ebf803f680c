"""Operating points (estimator, wake-up, power mode), and their Pareto front of energy and error."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.device.platform import Platform, PowerMode
from access_av.economics.carbon import Range
from access_av.run.runs import EXTENTS, Energy, Runs
from access_av.settings import as_dict, platform_name, ssb_period_s
from access_av.statistics.pareto import pareto_front
from access_av.verdicts import Judgement

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av import _core
    from access_av.study.targets import Targets

# Intervals of the fixed wake-ups that are simulated next to the vehicle's own wake-up, in ms.
FIXED_MS = (200.0, 500.0, 1000.0)
# Estimators that process raw snapshots are simulated without known pilots. MUSIC has the error of
# Root-MUSIC.
METHODS = ("root-music", "esprit")
MODE_KEY = "vehicle.platform.mode"
# Name of the vehicle's own operation.
OWN = "own operation"
# Relative difference of energies that does not matter: energy meters for billing have this accuracy
# (IEC 62053-21, class 1).
MATTERS_SHARE = 0.01
# A share of the time in state `ok` that is lower by at most this difference counts as equal: the
# shares of one operation in power modes with nearly equal wake-ups differ by as much.
OK_MARGIN = 0.01


@dataclass(frozen=True)
class Operation:
    """Estimator and wake-up of a vehicle.

    Attributes
    ----------
    settings
        Keys of the scenario that differ from the vehicle's own, and their values.
    """

    name: str
    method: str
    wake_up: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Point:
    """An operation in a power mode.

    Attributes
    ----------
    driven
        Runs in this mode or in another one of its group, see :func:`mode_groups`.
    energy
        Energy of a trip.
    idle_w
        Power of the idle board in this mode; ``None`` without a figure.
    error_m
        Percentile of the horizontal error that the target of the whole trip names.
    judgement
        Whether the drives meet all targets.
    ok_delta
        Paired difference of the share of time in state ``ok`` to the vehicle's own operation and
        mode, and the ends of its 95 % interval; ``None`` without a monitor.
    """

    driven: Runs
    operation: Operation
    mode: int
    mode_name: str
    energy: Energy
    idle_w: Range | None
    error_m: float
    judgement: Judgement
    ok_delta: tuple[float, float, float] | None

    @property
    def is_available(self) -> bool:
        """Whether its share of time in state ``ok`` is not below that of the vehicle's operation.

        The estimate decides, because a few pairs of runs rarely show a difference with 95 %
        confidence. Differences up to :data:`OK_MARGIN` do not count.
        """
        return self.ok_delta is None or self.ok_delta[0] >= -OK_MARGIN

    @property
    def name(self) -> str:
        """Method, wake-up and mode."""
        return (
            f"{self.operation.method}, {self.operation.wake_up}, mode {self.mode} "
            f"({self.mode_name})"
        )

    @property
    def settings(self) -> dict[str, Any]:
        """Keys of the scenario that select the operating point, with their values."""
        return {**self.operation.settings, MODE_KEY: self.mode}

    @property
    def energy_j(self) -> float:
        """Energy of a trip in joules, at the central values."""
        return self.energy.total_j.central


def operations(scenario: _core.Scenario) -> list[Operation]:
    """Returns the operations that a study simulates; that of the vehicle is the first."""
    vehicle = as_dict(scenario.resolved().vehicle)
    method, own = vehicle["estimator"]["method"], in_words(vehicle["wake_up"])
    found = [Operation(OWN, method, own, {})]
    period_ms = as_dict(scenario.site)["ssb"]["period_ms"]
    for interval_ms in FIXED_MS:
        wake_up: dict[str, Any] = {"policy": "fixed", "interval_ms": interval_ms}
        name = in_words(wake_up)
        if interval_ms >= period_ms and name != own:
            found.append(Operation(name, method, name, {"vehicle.wake_up": wake_up}))
    wake_up = {"policy": "uncertainty"}
    name = in_words(wake_up)
    if own != name:
        found.append(Operation(name, method, name, {"vehicle.wake_up": wake_up}))
    for other in METHODS:
        if other != method:
            settings = {"vehicle.estimator.method": other, "vehicle.receiver.pilots": "blind"}
            found.append(Operation(other, other, own, settings))
    return found


def in_words(wake_up: Mapping[str, Any]) -> str:
    """Returns the description of a wake-up policy."""
    if wake_up["policy"] == "fixed":
        interval_ms = wake_up.get("interval_ms")
        return "as often as possible" if interval_ms is None else f"every {interval_ms:g} ms"
    named = {
        "uncertainty": "when the estimated error requires it",
        "pid": "by Algorithm 1",
        "gated": "gated by SNR",
    }
    policy = str(wake_up["policy"])
    return named.get(policy, policy)


def mode_groups(scenario: _core.Scenario) -> list[list[PowerMode]]:
    """Returns the power modes of the vehicle's platform, in groups with equal runs.

    A mode affects the runs by default wake-up times, and by the energy c of a wake-up relative to
    an estimate: the wake-up policy divides the gain of k angles by (c + k)/(c + 1). In a group,
    this divisor differs by less than :data:`MATTERS_SHARE` for the angles of all radio heads.
    Modes without a figure for the method are left out, and modes in which an estimate takes longer
    than the period of the SSBs.
    """
    platform = Platform.load(platform_name(scenario.vehicle))
    period_s = ssb_period_s(scenario.site)
    heads = len(as_dict(scenario.site)["radio_heads"])
    found: list[tuple[str, float, list[PowerMode]]] = []
    for mode in platform.modes:
        vehicle = scenario.with_overrides({MODE_KEY: mode.number}).vehicle
        parts = platform.core.energy_j(vehicle, 1, 1, 1.0)
        if parts is None or platform.core.base_wake_up_s(vehicle) > period_s:
            continue
        resolved = as_dict(vehicle.resolved(platform.core))
        del resolved["platform"]["mode"]
        settings, divisor = json.dumps(resolved, sort_keys=True), 1.0
        if resolved["wake_up"]["policy"] == "uncertainty" and parts[0] > 0.0:
            cost = parts[1] / parts[0]
            divisor = (cost + heads) / (cost + 1.0)
        for its_settings, its_divisor, group in found:
            equal = abs(divisor / its_divisor - 1.0) < MATTERS_SHARE
            if settings == its_settings and equal:
                group.append(mode)
                break
        else:
            found.append((settings, divisor, [mode]))
    return [group for _, _, group in found]


def own_mode(scenario: _core.Scenario) -> int:
    """Returns the power mode of a scenario's vehicle."""
    return int(as_dict(scenario.vehicle)["platform"]["mode"])


def points(
    driven: Runs,
    operation: Operation,
    modes: Sequence[PowerMode],
    targets: Targets,
    baseline: Runs,
) -> list[Point]:
    """Returns the operating points of an operation in power modes with equal runs.

    ``baseline``: paired runs of the vehicle's own operation and mode.
    """
    error_m = driven.percentile(targets.each[0].percent).value
    judgement = targets.judgement(driven)
    ok_delta = driven.ok_delta(baseline)
    platform = Platform.load(platform_name(driven.scenario.vehicle))
    found = []
    for mode in modes:
        in_mode = driven.scenario.with_overrides({MODE_KEY: mode.number})
        energy = driven.energy(platform, in_mode.vehicle)
        if energy is None:  # such modes are in no group
            raise RuntimeError(f"mode {mode.number} has no energy in the platform file")
        found.append(
            Point(
                driven=driven,
                operation=operation,
                mode=mode.number,
                mode_name=mode.name,
                energy=energy,
                idle_w=idle_w(platform, mode.number),
                error_m=error_m,
                judgement=judgement,
                ok_delta=ok_delta,
            )
        )
    return found


def idle_w(platform: Platform, number: int) -> Range | None:
    """Returns the idle power of a board in watts, low to high; ``None`` if unknown."""
    written = as_dict(platform.core)
    [mode] = [mode for mode in written["modes"] if mode["mode"] == number]
    figure = mode.get("idle_power_w") or written.get("idle", {}).get("power_w")
    if figure is None:
        return None
    stated = {extent: end for extent, end in figure.items() if end is not None}
    return Range(*(float(stated.get(extent, figure["value"])) for extent in EXTENTS))


def front(found: Sequence[Point]) -> list[int]:
    """Returns the indices of the available points' Pareto front of energy and error, by energy."""
    kept = [place for place, point in enumerate(found) if point.is_available]
    on_front = pareto_front(
        [found[place].energy_j for place in kept], [found[place].error_m for place in kept]
    )
    return [kept[it] for it in on_front if np.isfinite(found[kept[it]].error_m)]


def best(found: Sequence[Point]) -> int | None:
    """Returns the index of the front's point with the least energy that meets all targets.

    All points of the front are available, see :attr:`Point.is_available`. Points that meet the
    targets with 95 % confidence are preferred to those that probably meet them. If no point does,
    it is the most accurate one of the front.
    """
    on_front = front(found)
    if not on_front:
        return None
    for judgements in ((Judgement.MET,), (Judgement.MET, Judgement.PROBABLY_MET)):
        holding = [place for place in on_front if found[place].judgement in judgements]
        if holding:
            return holding[0]
    return min(on_front, key=lambda place: found[place].error_m)
