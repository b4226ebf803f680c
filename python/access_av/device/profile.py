"""Profiles this computer, and returns the measurements as a platform file."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone
from importlib.metadata import version
from time import sleep
from typing import TYPE_CHECKING, Any

from access_av import _core
from access_av.device import counters, power_modes
from access_av.device.counters import Counters, SensorError
from access_av.device.energy import Interval, Recording, TooShortError, Window, above_idle
from access_av.device.power_modes import Mode, ModeError
from access_av.device.workload import CHAIN, Timing, repeat, workloads
from access_av.errors import InputError
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


NO_SENSOR = "no power sensor on this machine (looked for INA3221, INA238, RAPL)"
# The radio is not measured: it has the assumed values of this platform, to be replaced by those of
# the device.
RADIO_OF = "generic-x86"
# Duration of each workload without energy measurement (s).
TIMING_S = 1.0


@dataclass(frozen=True)
class Measured:
    """One workload in one power mode.

    Attributes
    ----------
    energy_j
        Energy of one execution above idle; ``None`` if it was not measured.
    why_not
        Reason for a missing energy.
    idle, busy
        Windows of the measurement.
    """

    mode: Mode
    workload: str
    timing: Timing
    energy_j: Interval | None = None
    why_not: str | None = None
    idle: Window | None = None
    busy: Window | None = None

    def record(self) -> dict[str, Any]:
        """Returns the values for JSON."""
        windows = {"idle": self.idle, "busy": self.busy}
        return {
            "mode": self.mode.number,
            "workload": self.workload,
            **vars(self.timing),
            "energy_j": None if self.energy_j is None else _interval(self.energy_j),
            "not_measured": self.why_not,
            **{
                name: None
                if window is None
                else {
                    "start_s": window.start_s,
                    "duration_s": window.duration_s,
                    "energy_j": _interval(window.energy_j),
                }
                for name, window in windows.items()
            },
        }


@dataclass(frozen=True)
class Profile:
    """Measurements on a computer.

    Attributes
    ----------
    sensors
        Sensors of the energy; ``None`` without a sensor.
    warnings
        Missing measurements with reasons.
    """

    machine: str
    sensors: str | None
    measured: tuple[Measured, ...]
    warnings: tuple[str, ...]

    def platform(self, name: str) -> _core.Platform:
        """Returns the measurements as a platform.

        A base wake-up time is the sum of the 99th percentiles of the SSB chain and the method.
        Cycles are median CPU times multiplied by the clock of the fastest mode.

        Raises
        ------
        InputError
            No measurement.
        """
        if not self.measured:
            raise InputError("no power mode could be measured: " + "; ".join(self.warnings))
        source = (
            f"access-av design profile {version('access-av')} on {self.machine}, "
            f"{datetime.now(timezone.utc):%Y-%m-%d}"
        )
        modes = list(dict.fromkeys(each.mode for each in self.measured))
        fastest = max(modes, key=lambda mode: mode.cpu_mhz)
        cycles = {
            each.workload: {
                "value": each.timing.cpu_median_s * fastest.cpu_mhz * 1e6,
                "high": max(each.timing.cpu_p99_s, each.timing.cpu_median_s)
                * fastest.cpu_mhz
                * 1e6,
                "provenance": "measured",
                "source": f"{source}: median CPU time, to the 99th percentile",
            }
            for each in self._of(fastest)
        }
        energy = "not measured" if self.sensors is None else f"measured by {self.sensors}"
        settings: dict[str, Any] = {
            "name": name,
            "description": f"{self.machine}; energy above idle: {energy}",
            "receiver": as_dict(_core.Platform.load(RADIO_OF))["receiver"],
            "cpu": {"cycles_per_burst": cycles.pop(CHAIN), "cycles_per_execution": cycles},
            "modes": [self._mode(mode, source) for mode in modes],
        }
        bare = 'name = "bare"\nmodes = [{ mode = 0, name = "bare", cpu_mhz = 1.0, cores = 1 }]\n'
        return _core.Platform.from_toml(bare).with_overrides(settings)

    def _of(self, mode: Mode) -> list[Measured]:
        return [each for each in self.measured if each.mode == mode]

    def _mode(self, mode: Mode, source: str) -> dict[str, Any]:
        here = {each.workload: each for each in self._of(mode)}
        chain = here.pop(CHAIN)
        settings: dict[str, Any] = {
            "mode": mode.number,
            "name": mode.name,
            "cpu_mhz": mode.cpu_mhz,
            "cores": mode.cores,
            "base_wake_up_ms": {
                method: 1e3 * (chain.timing.p99_s + each.timing.p99_s)
                for method, each in here.items()
            },
            "energy_per_execution_j": {
                method: _figure(each.energy_j, f"{source}: {self.sensors}", "marginal")
                for method, each in here.items()
                if each.energy_j is not None
            },
        }
        if chain.energy_j is not None and chain.idle is not None:
            core_w = chain.energy_j.scaled(1.0 / chain.timing.median_s)
            settings["core_power_w"] = _figure(core_w, f"{source}: {self.sensors}", "marginal")
            idle_w = chain.idle.power_w
            settings["idle_power_w"] = _figure(idle_w, f"{source}: {self.sensors}", "soc-rails")
        return settings


def profile(
    root: Path,
    *,
    modes: list[int] | None = None,
    window_s: float = 5.0,
    cpu_mhz: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Profile:
    """Measures every workload in every power mode.

    Parameters
    ----------
    root
        ``/``, or a folder with the layout of ``/`` or ``/sys``.
    modes
        Numbers of the power modes. Default: all.
    window_s
        Duration of each workload, and of the idle measurement before it, in seconds.
    cpu_mhz
        Clock in MHz, if the computer does not report it.

    Raises
    ------
    InputError
        Unknown folder or mode, or a window that is too short for the sensor.
    """
    if not root.is_dir():
        raise InputError(f"--sysfs-root {root}: no such directory")
    sysfs = root / "sys" if (root / "sys").is_dir() else root
    warnings: list[str] = []
    sensors: Counters | None = None
    try:
        sensors = counters.find(sysfs)
        if sensors is None:
            warnings.append(f"energy not measured: {NO_SENSOR}")
    except SensorError as error:
        warnings.append(f"energy not measured: {error}")
    board = power_modes.find(root, sysfs, cpu_mhz)
    asked = power_modes.chosen(board, modes)
    works = workloads()
    measured: list[Measured] = []
    with board.restored():
        for index, mode in enumerate(asked):
            try:
                board.switch(mode)
            except ModeError as error:
                warnings.append(str(error))
                continue
            for number, (name, work) in enumerate(works.items()):
                measured.append(_measure(mode, name, work, sensors, window_s))
                why_not = measured[-1].why_not
                if why_not is not None and sensors is not None:
                    warnings.append(f"mode {mode.number}, {name}: energy not measured: {why_not}")
                if progress is not None:
                    progress(index * len(works) + number + 1, len(asked) * len(works))
    return Profile(
        machine=_machine(root),
        sensors=None if sensors is None else sensors.name,
        measured=tuple(measured),
        warnings=tuple(warnings),
    )


def _measure(
    mode: Mode,
    name: str,
    work: Callable[[], object],
    sensors: Counters | None,
    window_s: float,
) -> Measured:
    if sensors is None:
        timing = repeat(work, min(window_s, TIMING_S))
        return Measured(mode, name, timing, why_not=NO_SENSOR)
    with Recording(sensors) as recording:
        sleep(window_s)
    with Recording(sensors) as working:
        timing = repeat(work, window_s)
    idle: Window | None = None
    busy: Window | None = None
    try:
        idle, busy = recording.window(), working.window()
        energy_j = above_idle(busy, idle).scaled(1.0 / timing.executions)
        if energy_j.low <= 0.0:
            raise SensorError(
                f"{energy_j.value:.3g} ± {energy_j.half_width:.3g} J "
                "does not differ from idle significantly"
            )
    except TooShortError:
        raise
    except SensorError as error:
        return Measured(mode, name, timing, None, str(error), idle, busy)
    return Measured(mode, name, timing, energy_j, None, idle, busy)


def _machine(root: Path) -> str:
    """Returns the name of the computer."""
    model = root / "proc/device-tree/model"
    if model.is_file():
        return model.read_text(encoding="utf-8", errors="replace").strip("\0 \n")
    cpuinfo = root / "proc/cpuinfo"
    text = cpuinfo.read_text(encoding="utf-8", errors="replace") if cpuinfo.is_file() else ""
    names = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return names[0] if names else "an unnamed machine"


def _interval(interval: Interval) -> dict[str, float]:
    return {"value": interval.value, "low": interval.low, "high": interval.high}


def _figure(interval: Interval, source: str, boundary: str) -> dict[str, Any]:
    return {
        **_interval(interval),
        "provenance": "measured",
        "source": source,
        "boundary": boundary,
    }
