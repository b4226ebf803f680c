from __future__ import annotations

import pytest

from access_av import carbon, cost
from access_av.paper.statements import paper_numbers


def test_the_cost_of_four_roadside_units_equals_the_papers() -> None:
    four = cost.roadside_units(4)
    assert (four.capital_low_usd, four.capital_high_usd, four.yearly_usd) == (52e3, 60e3, 9600)
    assert four.total_usd(years=10) == (148e3, 156e3)


def test_a_lidar_costs_more_than_130_adapters() -> None:
    assert cost.sensor_cost_ratio() == pytest.approx(4000 / 30.71)


def test_the_papers_saving_per_day_follows_from_its_saving_per_trip() -> None:
    saving = cost.Saving(per_trip_j=370.8, trip_s=paper_numbers()["trip"]["duration_s"])
    assert saving.per_day_kj == pytest.approx(398.84, rel=1e-3)
    assert saving.fleet_per_day_mj(100) == pytest.approx(39.884, rel=1e-3)


def test_the_daily_saving_uses_the_duration_and_duty_of_the_trip() -> None:
    long = cost.Saving(per_trip_j=370.8, trip_s=178.6, duty=0.5)
    assert long.trips_per_day == pytest.approx(43_200 / 178.6)
    assert long.per_day_kj == pytest.approx(398.84 * 80.33 / 178.6 / 2, rel=1e-3)


def test_ranges_are_ordered_and_embodied_does_not_depend_on_the_grid() -> None:
    footprints = [carbon.footprint("roadside_unit", 4, grid) for grid in carbon.grids()]
    for one in footprints:
        for values in (one.embodied_kg, one.use_kg):
            assert 0 < values.low <= values.central <= values.high
    assert len({one.embodied_kg for one in footprints}) == 1


def test_use_is_power_times_lifetime_times_grid() -> None:
    box = carbon.footprint("onboard_box", 2, "germany")
    assert box.use_kg.central == pytest.approx(2 * 10 * 35_040 * 381e-6)


def test_energy_per_year_is_365_times_energy_per_day() -> None:
    # 3 kWh a day at 381 g.
    assert carbon.use_kg_per_year(3 * 3.6e6, "germany") == pytest.approx(3 * 365 * 0.381)


def test_an_unknown_grid_is_rejected() -> None:
    with pytest.raises(KeyError, match="atlantis"):
        carbon.footprint("onboard_box", 1, "atlantis")
