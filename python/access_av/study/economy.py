"""Energy, money and carbon of a plant's localization, and of its alternatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.economics import balance
from access_av.economics.carbon import Range
from access_av.run.error_bound import along_route
from access_av.settings import as_dict
from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av import _core
    from access_av.economics.balance import Way
    from access_av.study.points import Point

OURS, WITH_COMPUTER, LIDAR, ROADSIDE, UWB = (
    "5G receivers, with existing computers",
    "5G receivers, each with a computer",
    "LiDARs, each with a computer",
    "roadside units",
    "UWB anchors and tags",
)
# Suffixes of the figures in prices.toml that are not money.
NO_MONEY = ("_g_per_kwh", "_power_w", "_embodied_kg", "_spacing_m")


@dataclass(frozen=True)
class Prices:
    """Prices of a plant: its own figures, otherwise published ones.

    Attributes
    ----------
    ranges, sources
        Values by the keys of ``[prices]`` and ``economics/prices.toml``; money in ``currency``.
    published
        Keys with published figures, because the plant file does not contain them.
    """

    currency: str
    ranges: Mapping[str, Range]
    sources: Mapping[str, str]
    published: tuple[str, ...]

    @classmethod
    def of(cls, plant: _core.Plant) -> Prices:
        """Returns the prices of a plant, completed by published figures."""
        own: dict[str, Any] = as_dict(plant).get("prices", {})
        facts = dict(shipped("economics", "prices.toml"))
        of_currencies = facts.pop("currency")
        currency = str(own.get("currency", of_currencies["name"]))
        rate = own.get("currency_per_usd") or of_currencies["per_usd"][currency]
        ranges, sources = {}, {}
        for name, fact in facts.items():
            figure = own.get(name, fact)
            ranges[name], sources[name] = Range.read(figure), str(figure["source"])
            if name not in own and not name.endswith(NO_MONEY) and currency != "USD":
                ranges[name] = ranges[name].times(Range.read(rate))
                sources[name] += f"; {rate['value']:g} {currency} per USD: {rate['source']}"
        return cls(currency, ranges, sources, tuple(sorted(facts.keys() - own.keys())))


@dataclass(frozen=True)
class Day:
    """Energy of a fleet's day, in Wh, low to high.

    Attributes
    ----------
    trips_wh
        Additional energy of localization, for the trips of all vehicles.
    idle_wh
        Idle energy of the computers while the vehicles are switched on; ``None`` without a figure.
    """

    trips_wh: Range
    idle_wh: Range | None

    @property
    def idle_share(self) -> float | None:
        """Returns the share of the idle energy in the total, by the central values."""
        if self.idle_wh is None:
            return None
        return self.idle_wh.central / (self.idle_wh.central + self.trips_wh.central)


def day(plant: _core.Plant, point: Point) -> Day:
    """Returns the energy of a day of the fleet at an operating point."""
    fleet = as_dict(plant)["fleet"]
    trips = fleet["vehicles"] * fleet["trips_per_day"]
    switched_on_h = fleet["vehicles"] * fleet["hours_per_day"]
    return Day(
        trips_wh=trip_j(point).scaled(trips / 3600.0),
        idle_wh=None if point.idle_w is None else point.idle_w.scaled(switched_on_h),
    )


def trip_j(point: Point) -> Range:
    """Returns the energy of a trip in joules, low to high, without the idle energy of the board."""
    return point.energy.estimates_j.plus(point.energy.listening_j)


def composition(point: Point, day_of: Day, fleet: Mapping[str, Any]) -> dict[str, float]:
    """Returns the energy of the fleet's day by part, in Wh at the central values.

    Keys: ``estimates``, ``receiver``, and ``idle`` if the platform has a figure.
    """
    trips = fleet["vehicles"] * fleet["trips_per_day"]
    parts = {
        "estimates": point.energy.estimates_j.central * trips / 3600.0,
        "receiver": point.energy.listening_j.central * trips / 3600.0,
    }
    return parts if day_of.idle_wh is None else {**parts, "idle": day_of.idle_wh.central}


def anchors(prices: Prices, road_m: float) -> Range:
    """Returns the number of UWB anchors along a road, low to high."""
    spacing = prices.ranges["uwb_anchor_spacing_m"]
    ends = (spacing.high, spacing.central, spacing.low)
    return Range(*(float(math.ceil(road_m / it)) for it in ends))


def ways(plant: _core.Plant, point: Point, prices: Prices) -> dict[str, Way]:
    """Returns money, energy and carbon of each localization system, by its name.

    The cells of the network exist already and are not counted. Vehicles and infrastructure are on
    during the hours of the fleet. Every computer is counted with its price, production and idle
    power.
    """
    written = as_dict(plant)
    road_m = along_route(plant.scenario())["along_m"].to_list()
    fleet, heads = written["fleet"], len(written["site"]["radio_heads"])
    common = {
        "currency": prices.currency,
        **{key: prices.ranges[key] for key in ("grid_g_per_kwh", "electricity_per_kwh")},
        "fleet": {
            **fleet,
            "infrastructure_hours_per_day": fleet["hours_per_day"],
            "infrastructure_days_per_year": fleet["days_per_year"],
        },
    }
    computer = _item(prices, "computer", embodied="computer_embodied_kg")
    if point.idle_w is not None:
        computer["power_w"] = point.idle_w
    receiver = _item(prices, "receiver", embodied="receiver_embodied_kg")
    ours = {"onboard": [receiver], "energy_j_per_trip": trip_j(point)}
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
        WITH_COMPUTER: {**ours, "onboard": [receiver, computer]},
        LIDAR: {"onboard": [lidar, computer], "energy_j_per_trip": 0.0},
        ROADSIDE: {"infrastructure": [roadside], "energy_j_per_trip": 0.0},
        UWB: {
            "infrastructure": [
                _item(
                    prices,
                    "uwb_anchor",
                    units=anchors(prices, road_m[-1] - road_m[0]),
                    power="uwb_anchor_power_w",
                    embodied="uwb_anchor_embodied_kg",
                )
            ],
            "onboard": [
                _item(prices, "uwb_tag", power="uwb_tag_power_w", embodied="uwb_tag_embodied_kg")
            ],
            "energy_j_per_trip": 0.0,
        },
    }
    return balance.ways({**common, **found}, found)[1]


def total(way: Way, years: float) -> Range:
    """Returns the money over the years, without discounting."""
    return way.capital.plus(way.yearly.scaled(years))


def total_kg(way: Way, years: float) -> Range:
    """Returns the CO2 equivalents over the years, production and use."""
    return way.embodied_kg.plus(way.use_kg_per_year.scaled(years))


def _item(
    prices: Prices,
    name: str,
    *,
    units: int | Range = 1,
    yearly: str = "",
    power: str = "",
    embodied: str = "",
) -> dict[str, Any]:
    keys = {"price": name, "yearly": yearly, "power_w": power, "embodied_kg": embodied}
    ranges = {what: prices.ranges[key] if key else 0.0 for what, key in keys.items()}
    return {"name": name, "units": units, **ranges, "source": prices.sources[name]}
