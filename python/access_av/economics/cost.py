"""Cost savings: roadside units, sensors, energy per day and per fleet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from access_av.economics.carbon import published
from access_av.tables.toml import shipped


@dataclass(frozen=True)
class RoadsideUnitCost:
    """Cost of roadside units that the 5G radio heads make unnecessary, in US dollars."""

    units: int
    capital_low_usd: float
    capital_high_usd: float
    yearly_usd: float
    source: str

    def total_usd(self, years: float) -> tuple[float, float]:
        """Returns the low and high cost over a number of years, without discounting."""
        running = self.yearly_usd * years
        return self.capital_low_usd + running, self.capital_high_usd + running


def roadside_units(units: int) -> RoadsideUnitCost:
    """Returns the cost of a number of roadside units.

    Examples
    --------
    >>> roadside_units(4).capital_low_usd
    52000.0
    """
    capital, source = published("roadside_unit")
    yearly, _ = published("roadside_unit_yearly")
    return RoadsideUnitCost(
        units=units,
        capital_low_usd=units * capital.low,
        capital_high_usd=units * capital.high,
        yearly_usd=units * yearly.central,
        source=source,
    )


def sensors() -> list[dict[str, Any]]:
    """Returns a LiDAR and a 5G adapter as ``name``, ``price_usd`` and ``source``."""
    return list(shipped("economics", "cost.toml")["sensor"])


def sensor_cost_ratio() -> float:
    """Returns the price of a LiDAR divided by that of a 5G adapter."""
    lidar, adapter = sensors()
    return float(lidar["price_usd"] / adapter["price_usd"])


@dataclass(frozen=True)
class Saving:
    """Energy saved by one configuration, compared with another one.

    Attributes
    ----------
    per_trip_j
        Energy saved in one trip.
    trip_s
        Duration of the trip.
    duty
        Share of the day in which the vehicle drives.

    Examples
    --------
    >>> round(Saving(per_trip_j=100.0, trip_s=86.4, duty=0.5).fleet_per_day_mj(vehicles=100), 9)
    5.0
    """

    per_trip_j: float
    trip_s: float
    duty: float = 1.0

    @property
    def trips_per_day(self) -> float:
        """Returns the number of trips of one vehicle in 24 hours."""
        return 86_400.0 * self.duty / self.trip_s

    @property
    def per_day_kj(self) -> float:
        """Returns the energy saved by one vehicle in 24 hours."""
        return self.per_trip_j * self.trips_per_day / 1e3

    def fleet_per_day_mj(self, vehicles: int) -> float:
        """Returns the energy saved by a fleet in 24 hours."""
        return self.per_day_kj * vehicles / 1e3
