"""Power sensors and energy counters of the kernel, without double counting.

INA3221 by ``hwmon`` (JetPack 5 and later) or ``iio`` (JetPack 4), INA238 by ``hwmon`` (Thor), RAPL
by ``powercap`` (x86). If one sensor includes the others, as ``VDD_IN`` the rails and ``psys`` the
packages, only this sensor is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import sleep
from typing import TYPE_CHECKING

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

# Rails that include all others of their board.
TOTALS = ("VDD_IN", "POM_5V_IN", "VIN")
# INA3221, SBOS576: 13 bits, 40 µV at the shunt and 8 mV at the bus.
INA3221 = {"shunt_v": 40e-6, "bus_v": 8e-3}
# INA238, SBOSA20: 16 bits, 5 µV at the shunt and 3.125 mV at the bus.
INA238 = {"shunt_v": 5e-6, "bus_v": 3.125e-3}
# Default shunt of Jetson boards, if the file gives none: 5 mΩ.
USUAL_SHUNT_OHM = 5e-3
# Default rail voltage (V); only the resolution of the power depends on it.
USUAL_RAIL_V = 5.0
# Energy unit of RAPL, 2^-14 J (Intel SDM, MSR_RAPL_POWER_UNIT), and its update interval.
RAPL_UNIT_J = 2.0**-14
RAPL_PERIOD_S = 1e-3
# Number of read attempts of an empty file, at intervals of 1 ms.
READS = 500


class SensorError(InputError):
    """Unreadable sensor, or impossible value."""


@dataclass(frozen=True)
class Rail:
    """One channel of a power monitor.

    Attributes
    ----------
    voltage, current, power
        Files in mV, mA and ``power_unit_w``; voltage and current if both exist, otherwise power.
    bus_v, current_a
        Maximum rounding error: half a step of the converter plus the last digit of the file.
    period_s
        Time between two conversions, if the kernel reports it.
    """

    label: str
    chip: str
    voltage: Path | None
    current: Path | None
    power: Path | None
    power_unit_w: float
    bus_v: float
    current_a: float
    period_s: float | None

    def read_w(self) -> tuple[float, float]:
        """Returns the power and its maximum rounding error, in watts."""
        if self.voltage is not None and self.current is not None:
            volt, ampere = _number(self.voltage) * 1e-3, _number(self.current) * 1e-3
            return volt * ampere, self.bus_v * abs(ampere) + self.current_a * abs(volt)
        if self.power is None:
            raise SensorError(
                f"{self.label} of {self.chip}: the sensor has neither power nor voltage and current"
            )
        rounded_w = self.power_unit_w + self.current_a * USUAL_RAIL_V
        return _number(self.power) * self.power_unit_w, rounded_w


@dataclass(frozen=True)
class Zone:
    """One RAPL zone: a counter in µJ that wraps around at ``range_j``."""

    label: str
    energy: Path
    range_j: float

    def read_j(self) -> float:
        """Returns the counter value in joules."""
        return _number(self.energy) * 1e-6


@dataclass(frozen=True)
class Counters:
    """Sensors that are read together and added: either rails or zones.

    Attributes
    ----------
    name
        Display name of the sensors.
    """

    name: str
    rails: tuple[Rail, ...] = ()
    zones: tuple[Zone, ...] = ()

    @property
    def period_s(self) -> float | None:
        """Returns the time between two sensor values in seconds; ``None`` if it is unknown."""
        if self.zones:
            return RAPL_PERIOD_S
        known = [rail.period_s for rail in self.rails if rail.period_s is not None]
        return max(known, default=None)


def find(sysfs: Path) -> Counters | None:
    """Finds the sensors below a ``/sys`` folder; ``None`` if there are none.

    Raises
    ------
    SensorError
        Sensors without read permission.
    """
    found = _choose([*_hwmon(sysfs), *_iio(sysfs)])
    counters = found or _rapl(sysfs)
    if counters is not None:
        for rail in counters.rails:
            rail.read_w()
        for zone in counters.zones:
            zone.read_j()
    return counters


def _choose(rails: list[Rail]) -> Counters | None:
    """Returns the rail that includes all other rails; without such a rail, all rails."""
    total = [rail for rail in rails if rail.label in TOTALS]
    chosen = tuple(total[:1] or rails)
    if not chosen:
        return None
    chips = " and ".join(sorted({rail.chip for rail in chosen}))
    return Counters(f"{' + '.join(rail.label for rail in chosen)} ({chips})", rails=chosen)


def _hwmon(sysfs: Path) -> Iterator[Rail]:
    """Returns rails of INA3221 and INA238 by hwmon; channel 7 of an INA3221 is the sum."""
    for chip in _places(sysfs, "bus/i2c/devices/*/hwmon/hwmon*", "class/hwmon/hwmon*"):
        name = _text(chip / "name")
        if name == "ina238":
            label = _text(chip / "in1_label") or _text(chip / "label") or "VIN"
            ohm = _shunt_ohm(chip / "shunt_resistor")
            yield _rail(label, name, _hwmon_files(chip, 1), INA238, ohm)
        elif name in ("ina3221", None):
            for file in sorted(chip.glob("in*_label")):
                channel, rail = int(file.name[2:-6]), _text(file)
                if channel <= 3 and rail not in (None, "NC", ""):
                    ohm = _shunt_ohm(chip / f"shunt{channel}_resistor")
                    yield _rail(str(rail), "ina3221", _hwmon_files(chip, channel), INA3221, ohm)


def _hwmon_files(chip: Path, channel: int) -> list[Path]:
    return [chip / f"{what}{channel}_input" for what in ("in", "curr", "power")]


def _shunt_ohm(file: Path) -> float:
    micro_ohm = _text(file)
    return float(micro_ohm) * 1e-6 if micro_ohm and float(micro_ohm) > 0.0 else USUAL_SHUNT_OHM


def _rail(
    label: str,
    chip: str,
    files: list[Path],
    steps: dict[str, float],
    shunt_ohm: float = USUAL_SHUNT_OHM,
    power_unit_w: float = 1e-6,
) -> Rail:
    """Returns a rail with its files of voltage, current and power."""
    voltage, current, power = files
    period_ms = _text(voltage.parent / "update_interval")
    both = voltage.is_file() and current.is_file()
    return Rail(
        label=label,
        chip=chip,
        voltage=voltage if both or not power.is_file() else None,
        current=current if both or not power.is_file() else None,
        power=power if power.is_file() else None,
        power_unit_w=power_unit_w,
        bus_v=0.5 * steps["bus_v"] + 1e-3,
        current_a=0.5 * steps["shunt_v"] / shunt_ohm + 1e-3,
        period_s=float(period_ms) * 1e-3 if period_ms and float(period_ms) > 0.0 else None,
    )


def _iio(sysfs: Path) -> Iterator[Rail]:
    """Returns rails of INA3221 by iio (JetPack 4)."""
    for device in _places(
        sysfs,
        "bus/i2c/devices/*/iio:device*",
        "bus/i2c/drivers/ina3221x/*/iio:device*",
        "bus/iio/devices/iio:device*",
    ):
        for file in sorted(device.glob("rail_name_*")):
            number, label = file.name.removeprefix("rail_name_"), _text(file)
            if label in (None, "NC", ""):
                continue
            files = [device / f"in_{it}{number}_input" for it in ("voltage", "current", "power")]
            yield _rail(str(label), "ina3221", files, INA3221, power_unit_w=1e-3)


def _places(sysfs: Path, *patterns: str) -> list[Path]:
    """Returns the matching directories without duplicates."""
    found = {place.resolve(): place for pattern in patterns for place in sysfs.glob(pattern)}
    return [found[place] for place in sorted(found)]


def _rapl(sysfs: Path) -> Counters | None:
    """Returns the top zones of RAPL: the platform zone if it exists, otherwise the packages."""
    zones = []
    for zone in sorted(sysfs.glob("class/powercap/intel-rapl:*")):
        most = _text(zone / "max_energy_range_uj")
        # Skip sub-zones, whose names have a second number.
        if zone.name.count(":") == 1 and (zone / "energy_uj").is_file() and most is not None:
            zones.append(
                Zone(_text(zone / "name") or zone.name, zone / "energy_uj", float(most) * 1e-6)
            )
    platform = [zone for zone in zones if zone.label == "psys" and zone.read_j() > 0.0]
    chosen = tuple(platform or [zone for zone in zones if zone.label != "psys"])
    if not chosen:
        return None
    return Counters(f"{' + '.join(zone.label for zone in chosen)} (RAPL)", zones=chosen)


def _text(file: Path) -> str | None:
    try:
        return file.read_text(encoding="utf-8").strip()
    except OSError:
        return None


def _number(file: Path) -> float:
    text = ""
    try:
        text = file.read_text(encoding="utf-8")
        for _ in range(READS):
            if text.strip():
                break
            # Retry an empty file, because a simulated sensor may be writing it.
            sleep(1e-3)
            text = file.read_text(encoding="utf-8")
        return float(text)
    except PermissionError as error:
        raise SensorError(
            f"{file}: no permission to read; run as root, or change its permissions"
        ) from error
    except OSError as error:
        raise SensorError(f"{file}: the sensor stopped answering ({error.strerror})") from error
    except ValueError as error:
        raise SensorError(f"{file}: {text.strip()!r} is not a number") from error
