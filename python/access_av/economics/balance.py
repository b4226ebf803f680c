"""Cost, energy and carbon of a fleet: comparison of two localization systems by given figures.

Every figure is a range of low, central and high. The low end of a difference is the low end of one
figure minus the high end of the other. Therefore the range of a difference contains every
combination of the figures.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any

from access_av.economics.carbon import KWH_IN_J, Range, grids
from access_av.errors import InputError
from access_av.tables import toml
from access_av.tables.toml import shipped

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

FLEET = ("vehicles", "hours_per_day", "days_per_year", "years")
# Alternative keys for the number of trips of a vehicle per day.
TRIPS = ("trips_per_day", "trip_s")
# Operating times of the infrastructure. Default: 24 hours on 365 days.
INFRASTRUCTURE = {"infrastructure_hours_per_day": 24.0, "infrastructure_days_per_year": 365.0}
ITEM = ("units", "price", "yearly", "power_w", "embodied_kg")


@dataclass(frozen=True)
class Way:
    """One localization technology for the fleet, for example LiDARs.

    Attributes
    ----------
    capital, yearly
        Purchase price, and cost of one year including electricity.
    energy_day_kj
        Energy of one vehicle on a working day: its equipment and its trips.
    fleet_day_mj
        Energy of the fleet and the infrastructure on a working day.
    embodied_kg, use_kg_per_year
        CO2 equivalents of production, and of the electricity of one year.
    """

    capital: Range
    yearly: Range
    energy_day_kj: Range
    fleet_day_mj: Range
    embodied_kg: Range
    use_kg_per_year: Range


@dataclass(frozen=True)
class Balance:
    """Comparison of two localization systems: savings of the second one.

    Attributes
    ----------
    saved
        Money saved over the years of use.
    saved_kg
        CO2 equivalents saved over the years of use.
    payback_years
        Time until the total cost of the second system is at most that of the first; ``None`` if
        this may never occur.
    """

    currency: str
    years: float
    before: Way
    after: Way
    saved: Range
    saved_kg: Range
    payback_years: Range | None


def read(file: Path | None) -> Mapping[str, Any]:
    """Reads the figures of a file; without a file, those of the example.

    Raises
    ------
    InputError
        If the file is not TOML.
    """
    return shipped("economics", "balance.toml") if file is None else toml.read(file)


def text() -> str:
    """Returns the text of the example file."""
    return resources.files("access_av").joinpath("economics", "balance.toml").read_text("utf-8")


def balance(figures: Mapping[str, Any]) -> Balance:
    """Computes cost, energy and carbon of both systems.

    Raises
    ------
    InputError
        If a figure is missing or invalid; the message contains key and allowed values.

    Examples
    --------
    >>> found = balance(read(None))
    >>> found.saved.low > 0.0, found.payback_years.high
    (True, 0.0)
    """
    years, found = ways(figures, ("before", "after"))
    before, after = found["before"], found["after"]
    saved = before.capital.minus(after.capital).plus(
        before.yearly.minus(after.yearly).scaled(years)
    )
    saved_kg = before.embodied_kg.minus(after.embodied_kg).plus(
        before.use_kg_per_year.minus(after.use_kg_per_year).scaled(years)
    )
    return Balance(
        currency=str(figures.get("currency", "USD")),
        years=years,
        before=before,
        after=after,
        saved=saved,
        saved_kg=saved_kg,
        payback_years=_payback(
            after.capital.minus(before.capital), before.yearly.minus(after.yearly)
        ),
    )


def ways(figures: Mapping[str, Any], names: Collection[str]) -> tuple[float, dict[str, Way]]:
    """Returns the years of use, and cost, energy and carbon of each named table of the figures.

    Raises
    ------
    InputError
        A figure is missing or invalid; the message names the key and what is allowed.
    """
    common = {"currency", "grid", "grid_g_per_kwh", "electricity_per_kwh", "fleet"}
    _only(figures, "", {*common, *names})
    fleet = figures.get("fleet", {})
    _only(fleet, "fleet.", {*FLEET, *TRIPS, *INFRASTRUCTURE})
    use = {name: _range(fleet, f"fleet.{name}").central for name in FLEET}
    for name, usual in INFRASTRUCTURE.items():
        use[name] = _range(fleet, f"fleet.{name}").central if name in fleet else usual
    if not 0.0 <= use["hours_per_day"] <= 24.0:
        raise InputError("fleet.hours_per_day: it must be from 0 to 24")
    use["trips"] = _trips(fleet, use["hours_per_day"])
    price = _range(figures, "electricity_per_kwh")
    grams = _grid(figures)
    return use["years"], {name: _way(figures, name, use, price, grams) for name in names}


def _trips(fleet: Mapping[str, Any], hours: float) -> float:
    """Returns the trips of one vehicle per working day: the given number, or continuous driving."""
    given = [name for name in TRIPS if name in fleet]
    if len(given) != 1:
        raise InputError("fleet: give either trips_per_day, or trip_s for trips without a pause")
    value = _range(fleet, f"fleet.{given[0]}").central
    if given == ["trips_per_day"]:
        return value
    if value <= 0.0:
        raise InputError("fleet.trip_s: it must be above 0")
    return hours * 3600.0 / value


def _payback(more: Range, saved_yearly: Range) -> Range | None:
    """Returns the years until a larger purchase price is saved; 0 if the price is not larger."""

    def years(capital: float, yearly: float) -> float | None:
        if capital <= 0.0:
            return 0.0
        return capital / yearly if yearly > 0.0 else None

    ends = (
        years(more.low, saved_yearly.high),
        years(more.central, saved_yearly.central),
        years(more.high, saved_yearly.low),
    )
    low, central, high = ends
    return None if low is None or central is None or high is None else Range(low, central, high)


def _way(
    figures: Mapping[str, Any], name: str, use: Mapping[str, float], price: Range, grams: Range
) -> Way:
    way = figures.get(name, {})
    _only(way, f"{name}.", {"infrastructure", "onboard", "energy_j_per_trip"})
    hours, days, vehicles = use["hours_per_day"], use["days_per_year"], use["vehicles"]
    none = Range(0.0, 0.0, 0.0)
    capital = yearly = embodied_kg = onboard_w = fixed_w = none
    for place, count in (("infrastructure", 1.0), ("onboard", vehicles)):
        items = way.get(place, [])
        if not isinstance(items, list):
            raise InputError(f"{name}.{place}: must be a list of tables")
        for index, item in enumerate(items):
            key = f"{name}.{place}[{index}]"
            _only(item, f"{key}.", {*ITEM, "name", "source"})
            if not item.get("source"):
                raise InputError(f"{key}.source: missing; write the source of the figures")
            units = _range(item, f"{key}.units").scaled(count)
            capital = capital.plus(units.times(_range(item, f"{key}.price")))
            yearly = yearly.plus(units.times(_range(item, f"{key}.yearly")))
            embodied_kg = embodied_kg.plus(units.times(_range(item, f"{key}.embodied_kg")))
            power_w = _range(item, f"{key}.units").times(_range(item, f"{key}.power_w"))
            if place == "onboard":
                onboard_w = onboard_w.plus(power_w)
            else:
                fixed_w = fixed_w.plus(power_w)
    vehicle_j = onboard_w.scaled(hours * 3600.0).plus(
        _range(way, f"{name}.energy_j_per_trip").scaled(use["trips"])
    )
    fixed_j = fixed_w.scaled(use["infrastructure_hours_per_day"] * 3600.0)
    kwh_per_year = (
        vehicle_j.scaled(vehicles * days)
        .plus(fixed_j.scaled(use["infrastructure_days_per_year"]))
        .scaled(1.0 / KWH_IN_J)
    )
    return Way(
        capital=capital,
        yearly=yearly.plus(kwh_per_year.times(price)),
        energy_day_kj=vehicle_j.scaled(1e-3),
        fleet_day_mj=vehicle_j.scaled(vehicles).plus(fixed_j).scaled(1e-6),
        embodied_kg=embodied_kg,
        use_kg_per_year=kwh_per_year.times(grams).scaled(1e-3),
    )


def _grid(figures: Mapping[str, Any]) -> Range:
    """Returns the carbon intensity of the electricity, in gCO2e per kWh."""
    if "grid_g_per_kwh" in figures:
        return _range(figures, "grid_g_per_kwh")
    name = figures.get("grid")
    if not isinstance(name, str) or name not in grids():
        there = ", ".join(grids())
        raise InputError(f"grid: {name!r}; allowed are {there}, or give grid_g_per_kwh")
    return Range(*[grids()[name]] * 3)


def _range(table: Mapping[str, Any], key: str) -> Range:
    """Reads one number, or a low, central and high value."""
    value = table.get(key.rpartition(".")[2])
    if isinstance(value, Range):
        return value
    try:
        ends: list[Any] = (
            [value[name] for name in ("low", "central", "high")]
            if isinstance(value, dict)
            else [value] * 3
        )
    except KeyError as error:
        raise InputError(f"{key}.{error.args[0]}: missing") from error
    if not all(isinstance(end, (int, float)) and not isinstance(end, bool) for end in ends):
        raise InputError(f"{key}: {value!r}; write a number, or low, central and high")
    if not 0.0 <= ends[0] <= ends[1] <= ends[2] < float("inf"):
        raise InputError(
            f"{key}: {value!r}; low, central and high must be ascending and at least 0"
        )
    return Range(*map(float, ends))


def _only(table: Any, path: str, allowed: set[str]) -> None:
    if not isinstance(table, dict):
        raise InputError(f"{path.rstrip('.')}: must be a table")
    if unknown := table.keys() - allowed:
        raise InputError(f"{path}{min(unknown)}: unknown; allowed are {', '.join(sorted(allowed))}")
