"""Report sections on cost and carbon: equipment and energy that are not needed."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.economics import carbon, cost
from access_av.paper.findings import MissingFigureError, saving
from access_av.paper.statements import of_claim, paper_numbers
from access_av.report.chart import BLUE, GREEN, ORANGE, Spec, colours, finish
from access_av.report.parts import figure, table
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation

# Number of roadside units, and fleet size, of the paper.
UNITS_NOT_BUILT = 4
FLEET = paper_numbers()["day"]["fleet"]


def cost_text(evaluation: Evaluation) -> str:
    """Returns a paragraph on the cost of roadside units and the energy saved per day."""
    units = cost.roadside_units(UNITS_NOT_BUILT)
    mode = evaluation.platform.modes[0].number
    try:
        saved = saving(evaluation.outcome, mode)
    except MissingFigureError as error:
        return escape(str(error))
    outcome = evaluation.outcome
    return escape(
        f"{units.units} roadside units would cost {units.capital_low_usd:,.0f} to "
        f"{units.capital_high_usd:,.0f} USD and {units.yearly_usd:,.0f} USD a year "
        f"({units.source}). In mode {mode}, on trips of {outcome.trip_s:.1f} s driven "
        f"{outcome.duty:.0%} of the day, one vehicle saves {saved.per_day_kj:.1f} kJ a day "
        f"(paper: {of_claim('e5_mode0_saved_per_day_kj')}), a fleet of {FLEET} saves "
        f"{saved.fleet_per_day_mj(FLEET):.2f} MJ "
        f"(paper: {of_claim('e6_fleet_of_100_saved_per_day_mj')})."
    )


def cost_section(specs: dict[str, Spec]) -> str:
    """Returns the section on the cost of roadside units and sensors."""
    specs["rsu-cost"] = _roadside_unit_chart(UNITS_NOT_BUILT, years=10)
    specs["sensor-cost"] = _sensor_chart()
    return figure("rsu-cost", title=f"{UNITS_NOT_BUILT} roadside units over the years") + figure(
        "sensor-cost", cost.sensors()[0]["source"], title="One sensor"
    )


def carbon_section(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Returns the section on emissions: roadside units, computer, and saved energy."""
    avoided = {
        grid: carbon.footprint("roadside_unit", UNITS_NOT_BUILT, grid) for grid in carbon.grids()
    }
    onboard = {grid: carbon.footprint("onboard_box", 1, grid) for grid in carbon.grids()}
    specs["carbon-chart"] = _carbon_chart(avoided)
    mode = evaluation.platform.modes[0].number
    try:
        saved_j = FLEET * saving(evaluation.outcome, mode).per_day_kj * 1e3
    except MissingFigureError:
        saved_j = None

    def span(values: carbon.Range) -> str:
        return f"{values.central:,.0f} ({values.low:,.0f}–{values.high:,.0f})"

    units, box = next(iter(avoided.values())), next(iter(onboard.values()))
    values = [
        (
            _grid_name(grid),
            number(intensity, 0),
            span(avoided[grid].use_kg),
            span(onboard[grid].use_kg),
            number(None if saved_j is None else carbon.use_kg_per_year(saved_j, grid), 0),
        )
        for grid, intensity in carbon.grids().items()
    ]
    values.append(("Embodied", "–", span(units.embodied_kg), span(box.embodied_kg), "–"))
    head = (
        "Grid", "gCO2e/kWh", f"{UNITS_NOT_BUILT} roadside units, use over their life / kg",
        "Onboard computer, use over its life / kg",
        f"Saved by {FLEET} vehicles in a year, mode {mode} / kg",
    )  # fmt: skip
    sources = {"Roadside units": units.source, "Onboard computer": box.source,
               "Grid": f"{carbon.grid_source()}."}  # fmt: skip
    return (
        figure("carbon-chart", title=f"{UNITS_NOT_BUILT} avoided roadside units")
        + table(head, values, numbers=range(1, 5))
        + "".join(f'<p class="note">{name}. {escape(text)}</p>' for name, text in sources.items())
    )


def _roadside_unit_chart(units: int, years: int) -> Spec:
    """Returns the chart of the cost of the roadside units over the years."""
    entry = cost.roadside_units(units)
    rows = []
    for year in range(years + 1):
        low, high = entry.total_usd(year)
        rows.append({"year": year, "low": low / 1e3, "high": high / 1e3})
    band = (
        alt.Chart(pl.DataFrame(rows))
        .mark_area(opacity=0.6, color=ORANGE)
        .encode(
            x=alt.X("year:Q", title="years", axis=alt.Axis(tickMinStep=1)),
            y=alt.Y("low:Q", title="cost / 1000 USD", scale=alt.Scale(zero=True)),
            y2="high:Q",
            tooltip=["year:Q", "low:Q", "high:Q"],
        )
    )
    return finish(
        band, height=200, description=f"Cost of {units} roadside units over {years} years"
    )


def _sensor_chart() -> Spec:
    """Returns the chart of the sensor prices."""
    table = pl.DataFrame(cost.sensors()).sort("price_usd", descending=True)
    base = alt.Chart(table).encode(
        y=alt.Y("name:N", title=None, sort=table["name"].to_list(), axis=alt.Axis(labelLimit=170)),
        x=alt.X("price_usd:Q", title="price / USD", scale=alt.Scale(domainMax=4800)),
        tooltip=["name:N", "price_usd:Q", "source:N"],
    )
    bars = base.mark_bar(color=BLUE, cornerRadiusEnd=3, height=26)
    prices = base.mark_text(align="left", dx=6).encode(text=alt.Text("price_usd:Q", format=",.2f"))
    return finish(bars + prices, height=120, description="Price of a LiDAR and of a 5G adapter")


def _grid_name(grid: str) -> str:
    """Returns the display name of an electricity grid."""
    return grid.upper() if grid == "usa" else grid.capitalize()


def _carbon_chart(footprints: dict[str, carbon.Footprint]) -> Spec:
    """Returns the chart of lifetime emissions by grid (value and range), and of production."""
    rows = [
        {"what": f"use, {_grid_name(grid)}", **vars(one.use_kg), "kind": "use"}
        for grid, one in footprints.items()
    ]
    embodied_kg = next(iter(footprints.values())).embodied_kg
    rows.append({"what": "embodied, any grid", **vars(embodied_kg), "kind": "embodied"})
    base = alt.Chart(pl.DataFrame(rows)).encode(
        y=alt.Y("what:N", title=None, sort=[str(row["what"]) for row in rows]),
        color=colours("kind:N", {"use": ORANGE, "embodied": GREEN}),
        tooltip=[
            "what:N",
            *(alt.Tooltip(f"{c}:Q", format=",.0f") for c in ("low", "central", "high")),
        ],
    )
    axis = alt.X(
        "low:Q", title="kgCO2e over the lifetime (logarithmic)", scale=alt.Scale(type="log")
    )
    spans = base.mark_rule(strokeWidth=4, opacity=0.4).encode(x=axis, x2="high:Q")
    dots = base.mark_point(filled=True, size=80).encode(x="central:Q")
    return finish(
        spans + dots, height=230, description="Emissions of roadside units, embodied and in use"
    )
