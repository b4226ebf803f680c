"""What a plant's way of localizing draws, costs and emits, beside a LiDAR and roadside units."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.economics.balance import balance
from access_av.economics.carbon import Range
from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av import _core
    from access_av.economics.balance import Way
    from access_av.study.points import Point

OURS, WITH_IDLE, LIDAR, ROADSIDE = (
    "5G receivers",
    "5G receivers, each with a computer for this alone",
    "a LiDAR on each vehicle",
    "roadside units",
)


@dataclass(frozen=True)
class Prices:
    """What things cost at a plant: its own figures, else published ones.

    Attributes
    ----------
    currency
        What money is counted in.
    ranges, sources
        By the keys of ``[prices]`` and of ``economics/prices.toml``.
    """

    currency: str
    ranges: Mapping[str, Range]
    sources: Mapping[str, str]

    @classmethod
    def of(cls, plant: _core.Plant) -> Prices:
        """The plant's, completed."""
        own: dict[str, Any] = json.loads(plant.to_json()).get("prices", {})
        facts = shipped("economics", "prices.toml")
        taken = {name: own.get(name, fact) for name, fact in facts.items() if name != "currency"}
        return cls(
            currency=str(own.get("currency", facts["currency"]["name"])),
            ranges={
                name: Range(float(it["low"]), float(it["value"]), float(it["high"]))
                for name, it in taken.items()
            },
            sources={name: str(it["source"]) for name, it in taken.items()},
        )


@dataclass(frozen=True)
class Day:
    """Energy of a fleet's day, in Wh, low to high.

    Attributes
    ----------
    trips_wh
        What localizing adds: trips, of all vehicles.
    idle_wh
        What the computers draw anyway while the vehicles are switched on; ``None`` without a
        figure.
    """

    trips_wh: Range
    idle_wh: Range | None

    @property
    def idle_share(self) -> float | None:
        """Share of idle in both together, by the central values."""
        if self.idle_wh is None:
            return None
        return self.idle_wh.central / (self.idle_wh.central + self.trips_wh.central)


def day(plant: _core.Plant, point: Point) -> Day:
    """A day of the fleet at an operating point."""
    fleet = json.loads(plant.to_json())["fleet"]
    trips = fleet["vehicles"] * fleet["trips_per_day"]
    switched_on_h = fleet["vehicles"] * fleet["hours_per_day"]
    return Day(
        trips_wh=trip_j(point).scaled(trips / 3600.0),
        idle_wh=None if point.idle_w is None else _range(point.idle_w).scaled(switched_on_h),
    )


def trip_j(point: Point) -> Range:
    """Energy of a trip in joules, low to high, without the board that would idle."""
    return _range(
        {extent: energy.estimates_j + energy.listening_j for extent, energy in point.energy.items()}
    )


def _range(ends: Mapping[str, float]) -> Range:
    return Range(ends["low"], ends["value"], ends["high"])


def ways(plant: _core.Plant, point: Point, prices: Prices) -> dict[str, Way]:
    """Money, energy and carbon of each way to localize the fleet, by its name.

    The cells are there anyway, and so is what any of them costs; a remedy's price is its own.
    """
    written = json.loads(plant.to_json())
    fleet, heads = written["fleet"], len(written["site"]["radio_heads"])
    common = {
        "currency": prices.currency,
        "grid_g_per_kwh": _ends(prices.ranges["grid_g_per_kwh"]),
        "electricity_per_kwh": _ends(prices.ranges["electricity_per_kwh"]),
        "fleet": dict(fleet),
    }
    receiver = _item(prices, "receiver", embodied="receiver_embodied_kg")
    ours = {"onboard": [receiver], "energy_j_per_trip": _ends(trip_j(point))}
    lidar = _item(prices, "lidar", power="lidar_power_w", embodied="lidar_embodied_kg")
    roadside = _item(
        prices,
        "roadside_unit",
        units=heads,
        yearly="roadside_unit_yearly",
        power="roadside_unit_power_w",
        embodied="roadside_unit_embodied_kg",
    )
    found = {
        OURS: ours,
        LIDAR: {"onboard": [lidar], "energy_j_per_trip": 0.0},
        ROADSIDE: {"infrastructure": [roadside], "energy_j_per_trip": 0.0},
    }
    if point.idle_w is not None:
        board = {
            **_item(prices, "receiver"),
            "name": "computer, idle",
            "price": 0.0,
            "power_w": _ends(_range(point.idle_w)),
        }
        found[WITH_IDLE] = {**ours, "onboard": [receiver, board]}
    return {
        name: balance({**common, "before": way, "after": way}).before for name, way in found.items()
    }


def total(way: Way, years: float) -> Range:
    """Money over the years, without discounting."""
    return way.capital.plus(way.yearly.scaled(years))


def total_kg(way: Way, years: float) -> Range:
    """CO2 equivalents over the years, production and use."""
    return way.embodied_kg.plus(way.use_kg_per_year.scaled(years))


def _ends(values: Range) -> dict[str, float]:
    return {"low": values.low, "central": values.central, "high": values.high}


def _item(
    prices: Prices,
    name: str,
    *,
    units: int = 1,
    yearly: str = "",
    power: str = "",
    embodied: str = "",
) -> dict[str, Any]:
    def range_of(key: str) -> Any:
        return _ends(prices.ranges[key]) if key else 0.0

    return {
        "name": name,
        "units": units,
        "price": range_of(name),
        "yearly": range_of(yearly),
        "power_w": range_of(power),
        "embodied_kg": range_of(embodied),
        "source": prices.sources[name],
    }
