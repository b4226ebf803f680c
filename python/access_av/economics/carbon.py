"""Greenhouse gas of equipment: production (embodied) and use separately, as ranges, by grid.

Every number has a source (``carbon.toml``); none was measured by this project.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Mapping

KWH_IN_J = 3.6e6


@dataclass(frozen=True)
class Range:
    """A quantity with its low, central and high value."""

    low: float
    central: float
    high: float

    @property
    def ends(self) -> tuple[float, float, float]:
        """Low, central and high value."""
        return self.low, self.central, self.high

    @classmethod
    def read(cls, entry: Mapping[str, float]) -> Range:
        """Returns the range of an entry of the file."""
        central = entry["central"] if "central" in entry else entry["value"]
        return cls(float(entry["low"]), float(central), float(entry["high"]))

    def scaled(self, factor: float) -> Range:
        """Returns all three values multiplied by a factor."""
        return Range(self.low * factor, self.central * factor, self.high * factor)

    def plus(self, other: Range) -> Range:
        """Returns the sum of low, central and high values."""
        return Range(self.low + other.low, self.central + other.central, self.high + other.high)

    def minus(self, other: Range) -> Range:
        """Returns the difference; its low end is low minus high, its high end is high minus low."""
        return Range(self.low - other.high, self.central - other.central, self.high - other.low)

    def times(self, other: Range) -> Range:
        """Returns the product of low, central and high values."""
        return Range(self.low * other.low, self.central * other.central, self.high * other.high)


@dataclass(frozen=True)
class Footprint:
    """Emissions of equipment over its lifetime, in kgCO2e."""

    embodied_kg: Range
    use_kg: Range
    source: str


def grids() -> dict[str, float]:
    """Returns the carbon intensity of electricity by region, in gCO2e per kWh, lowest first."""
    table = {k: float(v) for k, v in _facts()["grid"].items() if k != "source"}
    return dict(sorted(table.items(), key=lambda item: item[1]))


def footprint(thing: str, units: int, grid: str) -> Footprint:
    """Returns the lifetime footprint of devices: ``"roadside_unit"`` or ``"onboard_box"``.

    Raises
    ------
    KeyError
        If the device is unknown, or the grid is not one of :func:`grids`.

    Examples
    --------
    >>> round(footprint("onboard_box", 1, "germany").use_kg.central, 1)
    133.5
    """
    entry = _facts()["things"][thing]
    embodied_kg, embodied_source = published(entry["embodied"])
    power_w, power_source = (
        published(entry["power"])
        if "power" in entry
        else (Range.read(entry["power_w"]), entry["power_source"])
    )
    use_wh = power_w.times(Range.read(entry["lifetime_h"]))
    return Footprint(
        embodied_kg=embodied_kg.scaled(units),
        use_kg=use_wh.scaled(units * grids()[grid] / 1e6),
        source=(
            f"Embodied: {embodied_source}. Power: {power_source}. "
            f"Lifetime: {entry['lifetime_source']}."
        ),
    )


def published(name: str) -> tuple[Range, str]:
    """Returns a figure of ``prices.toml`` and its source."""
    entry = shipped("economics", "prices.toml")[name]
    return Range.read(entry), str(entry["source"])


def use_kg_per_year(energy_j_per_day: float, grid: str) -> float:
    """Returns the emissions of one year in kgCO2e, given the energy per day.

    Examples
    --------
    >>> use_kg_per_year(KWH_IN_J, "germany")
    139.065
    """
    return energy_j_per_day * 365.0 / KWH_IN_J * grids()[grid] / 1e3


def grid_source() -> str:
    """Returns the source of the values of :func:`grids`."""
    return str(_facts()["grid"]["source"])


def _facts() -> dict[str, Any]:
    return shipped("economics", "carbon.toml")
