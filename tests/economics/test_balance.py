"""Cost, energy and carbon for given figures."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import pytest

from access_av.economics.balance import balance, read, text
from access_av.errors import InputError
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

ROUND = """
currency = "EUR"
grid_g_per_kwh = 500.0
electricity_per_kwh = 0.2
fleet = { vehicles = 10, hours_per_day = 10.0, days_per_year = 200.0, years = 4.0, trip_s = 100.0 }
[before]
energy_j_per_trip = 0.0
[[before.infrastructure]]
name = "mast"
units = 2
price = { low = 900.0, central = 1000.0, high = 1200.0 }
yearly = 50.0
power_w = 100.0
embodied_kg = 200.0
source = "test"
[after]
energy_j_per_trip = { low = 50.0, central = 100.0, high = 200.0 }
[[after.onboard]]
name = "box"
units = 1
price = 300.0
yearly = 0.0
power_w = 10.0
embodied_kg = 20.0
source = "test"
"""


def figures() -> dict[str, Any]:
    return copy.deepcopy(tomllib.loads(ROUND))


def test_the_balance_equals_a_calculation_by_hand() -> None:
    found = balance(figures())
    # Two masts of 100 W all year: 1752 kWh at 0.2, and 2 × 50 a year.
    assert found.before.capital.central == 2000.0
    assert found.before.yearly.central == pytest.approx(100.0 + 1752.0 * 0.2)
    assert found.before.use_kg_per_year.central == pytest.approx(876.0)
    assert found.before.fleet_day_mj.central == pytest.approx(17.28)
    # Ten boxes of 10 W for ten hours: 360 kJ a day each, and 360 trips of 100 J.
    assert found.after.capital.central == 3000.0
    assert found.after.energy_day_kj.central == pytest.approx(396.0)
    assert found.after.fleet_day_mj.central == pytest.approx(3.96)
    yearly = 3.96 * 200 / 3.6 * 0.2
    assert found.after.yearly.central == pytest.approx(yearly)
    assert found.after.embodied_kg.central == 200.0
    years = 1000.0 / (450.4 - yearly)
    assert found.payback_years is not None
    assert found.payback_years.central == pytest.approx(years)
    assert found.saved.central == pytest.approx(-1000.0 + 4.0 * (450.4 - yearly))


def test_the_number_of_trips_per_day_is_the_configured_one() -> None:
    stated = figures()
    del stated["fleet"]["trip_s"]
    stated["fleet"]["trips_per_day"] = 40
    # Ten boxes of 10 W for ten hours, and 40 trips of 100 J.
    assert balance(stated).after.energy_day_kj.central == pytest.approx(360.0 + 4.0)
    for wrong in ({**stated["fleet"], "trip_s": 100.0}, {"trip_s": 0.0}):
        bad = figures()
        bad["fleet"] |= wrong
        with pytest.raises(InputError, match="trip_s"):
            balance(bad)


def test_ranges_contain_every_combination_of_the_figures() -> None:
    wide = balance(figures())
    for price in (900.0, 1200.0):
        for energy_j in (50.0, 200.0):
            one = figures()
            one["before"]["infrastructure"][0]["price"] = price
            one["after"]["energy_j_per_trip"] = energy_j
            found = balance(one)
            assert wide.saved.low <= found.saved.central <= wide.saved.high
            assert wide.saved_kg.low <= found.saved_kg.central <= wide.saved_kg.high


def test_a_missing_payback_is_reported() -> None:
    dear = figures()
    dear["after"]["onboard"][0]["yearly"] = 1000.0
    assert balance(dear).payback_years is None


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("grid_g_per_kwh", -1.0, "grid_g_per_kwh: -1.0; low, central and high must be ascending"),
        ("electricity_per_kwh", {"low": 2.0, "central": 1.0, "high": 3.0}, "must be ascending"),
        ("electricity_per_kwh", {"low": 2.0, "high": 3.0}, "electricity_per_kwh.central: missing"),
        ("fleet", {"vehicles": 1}, "fleet.hours_per_day: None; write a number"),
        ("before", {"energy": 1}, "before.energy: unknown; allowed are"),
        ("before", {"onboard": 1.0}, "before.onboard: must be a list of tables"),
        ("vehicles", 1, "vehicles: unknown"),
    ],
)
def test_bad_figures_name_the_key(key: str, value: Any, message: str) -> None:
    bad = figures()
    bad[key] = value
    with pytest.raises(InputError, match=message):
        balance(bad)


def test_every_item_needs_a_source_and_every_grid_a_name() -> None:
    bad = figures()
    del bad["after"]["onboard"][0]["source"]
    with pytest.raises(InputError, match=r"after.onboard\[0\].source: missing"):
        balance(bad)
    bad = figures()
    del bad["grid_g_per_kwh"]
    bad["grid"] = "atlantis"
    with pytest.raises(InputError, match="'atlantis'; allowed are sweden"):
        balance(bad)


def test_the_example_file_is_valid(access_av: Callable[..., Finished], tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(text())
    assert balance(read(mine)) == balance(read(None))
    done = access_av("design", "balance", mine)
    assert (done.code, "Payback: 0 years" in done.out) == (0, True)
    mine.write_text("fleet = [")
    done = access_av("design", "balance", mine)
    assert (done.code, str(mine) in done.err.replace("\n", "")) == (2, True)
