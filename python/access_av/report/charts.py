"""The report's charts: each of the paper's figures as an Altair chart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import altair as alt
import polars as pl

from access_av import cost, facts
from access_av.methods import ADAPTIVE_LABEL, LABELS, label

if TYPE_CHECKING:
    from access_av.carbon import Footprint
    from access_av.evaluate import Evaluation

EVERY_SSB = "MUSIC, 20 ms"
# Okabe and Ito's colours: told apart on light and dark, in print and by colour-blind readers.
COLOURS = {
    LABELS["music"]: "#8a8f98",
    LABELS["esprit"]: "#d55e00",
    LABELS["root_music"]: "#009e73",
    ADAPTIVE_LABEL: "#2f7ed8",
    EVERY_SSB: "#b48ead",
}
POINTS_PER_LINE = 160

Spec = dict[str, Any]


def _scale(names: list[str]) -> alt.Scale:
    return alt.Scale(domain=names, range=[COLOURS[name] for name in names])


def thinned(series: pl.DataFrame) -> pl.DataFrame:
    """Enough points for a line on a screen, rounded to what can be seen."""
    step = max(1, series.height // POINTS_PER_LINE)
    return series.gather_every(step).with_columns(pl.col(pl.Float64).round(4))


def finish(chart: alt.Chart | alt.LayerChart, *, height: int, description: str) -> Spec:
    """The chart as Vega-Lite, as wide as its place."""
    spec: Spec = chart.properties(width="container", height=height).to_dict()
    spec["description"] = description
    spec["autosize"] = {"type": "fit-x", "contains": "padding"}
    return spec


def snr(evaluation: Evaluation) -> Spec:
    """SNR along the track (the paper's SNR figure)."""
    line = (
        alt.Chart(thinned(evaluation.snr))
        .mark_line(color=COLOURS[ADAPTIVE_LABEL], strokeWidth=2)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("snr_db:Q", title="SNR / dB"),
            tooltip=[
                alt.Tooltip("time_s:Q", title="time / s", format=".1f"),
                alt.Tooltip("snr_db:Q", title="SNR / dB", format=".2f"),
            ],
        )
    )
    return finish(
        line, height=220, description="Signal-to-noise ratio against time along the track"
    )


def errors(evaluation: Evaluation, points: pl.DataFrame, axis: str) -> Spec:
    """Error in one direction against time, one line per operating point in ``points``.

    ``axis`` is ``"x"`` or ``"y"``.
    """
    names = _line_names(points)
    lines = pl.concat(
        thinned(evaluation.series(point)).select(
            pl.col("time_s"),
            pl.col(f"error_{axis}_m").alias("error_m"),
            pl.lit(name).alias("line"),
        )
        for name, point in zip(names, points.iter_rows(named=True), strict=True)
    )
    picked = alt.selection_point(fields=["line"], bind="legend")
    chart = (
        alt.Chart(lines)
        .mark_line(strokeWidth=1.8, interpolate="monotone")
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("error_m:Q", title=f"error in {axis.upper()} / m"),
            color=alt.Color("line:N", scale=_scale(names), legend=alt.Legend(title=None)),
            strokeDash=alt.StrokeDash(
                "line:N",
                scale=alt.Scale(
                    domain=names, range=[[4, 3] if name == EVERY_SSB else [1, 0] for name in names]
                ),
                legend=None,
            ),
            opacity=alt.condition(picked, alt.value(1.0), alt.value(0.15)),
            tooltip=[
                alt.Tooltip("line:N", title="method"),
                alt.Tooltip("time_s:Q", title="time / s", format=".1f"),
                alt.Tooltip("error_m:Q", title="error / m", format=".3f"),
            ],
        )
        .add_params(picked)
    )
    return finish(
        chart,
        height=190,
        description=f"Mean absolute error in {axis.upper()} against time for {', '.join(names)}",
    )


def _line_names(points: pl.DataFrame) -> list[str]:
    """Names for a legend; MUSIC at every SSB has its own where it stands beside the others."""
    mixed = points["campaign"].n_unique() > 1
    return [
        EVERY_SSB
        if mixed and point["campaign"] == "P"
        else label(point["method"], adaptive=point["adaptive"])
        for point in points.iter_rows(named=True)
    ]


def _by_mode(evaluation: Evaluation) -> pl.DataFrame:
    return evaluation.points.filter(pl.col("mode").is_not_null()).with_columns(
        pl.struct("method", "adaptive")
        .map_elements(
            lambda row: label(row["method"], adaptive=row["adaptive"]), return_dtype=pl.String
        )
        .alias("line")
    )


def _grouped_bars(evaluation: Evaluation, column: str, title: str, digits: str) -> alt.Chart:
    names = [*LABELS.values(), ADAPTIVE_LABEL]
    table = _by_mode(evaluation).select(
        "mode", "line", pl.col(column).round(4), "wake_up_ms", "energy_provenance"
    )
    bars: alt.Chart = (
        alt.Chart(table)
        .mark_bar(cornerRadiusTopLeft=2, cornerRadiusTopRight=2)
        .encode(
            x=alt.X("mode:O", title="power mode", axis=alt.Axis(labelAngle=0)),
            xOffset=alt.XOffset("line:N", sort=names),
            y=alt.Y(f"{column}:Q", title=title),
            color=alt.Color("line:N", scale=_scale(names), legend=alt.Legend(title=None)),
            tooltip=[
                alt.Tooltip("mode:O", title="power mode"),
                alt.Tooltip("line:N", title="method"),
                alt.Tooltip(f"{column}:Q", title=title, format=digits),
                alt.Tooltip("wake_up_ms:Q", title="base wake-up time / ms"),
                alt.Tooltip("energy_provenance:N", title="energy per execution"),
            ],
        )
    )
    return bars


def energy(evaluation: Evaluation) -> Spec:
    """Energy per mode (the paper's energy figure), with the values the paper states as diamonds."""
    names = [*LABELS.values(), ADAPTIVE_LABEL]
    paper = facts.load("paper")["energy_j"]
    stated = [
        {"mode": 0, "line": LABELS[method], "energy_j": value}
        for method, value in paper["fixed_mode_0"].items()
    ]
    stated += [
        {"mode": mode, "line": ADAPTIVE_LABEL, "energy_j": paper[f"adaptive_mode_{mode}"]}
        for mode in (0, 7)
    ]
    marks = (
        alt.Chart(pl.DataFrame(stated))
        .mark_point(
            shape="diamond", size=90, filled=True, color="#f5c518", stroke="#222", strokeWidth=1
        )
        .encode(
            x="mode:O",
            xOffset=alt.XOffset("line:N", sort=names),
            y="energy_j:Q",
            tooltip=[
                alt.Tooltip("line:N", title="the paper, method"),
                alt.Tooltip("energy_j:Q", title="energy / J"),
            ],
        )
    )
    bars = _grouped_bars(evaluation, "energy_j", "energy of a trip / J", ".1f")
    return finish(
        bars + marks, height=260, description="Energy of one trip per power mode and method"
    )


def executions(evaluation: Evaluation) -> Spec:
    """Angle estimates in a trip, per mode."""
    bars = _grouped_bars(evaluation, "executions", "executions in a trip", ".0f")
    return finish(
        bars, height=230, description="Angle estimates in one trip per power mode and method"
    )


def design_space(evaluation: Evaluation) -> Spec:
    """Accuracy against energy; two sliders are the query."""
    table = _by_mode(evaluation).select(
        "mode",
        "mode_name",
        "line",
        pl.col("energy_j", "rms_error_m", "worst_error_x_m", "worst_error_y_m", "executions").round(
            4
        ),
    )
    names = [*LABELS.values(), ADAPTIVE_LABEL]
    most_j = 10.0 * float(table.select(pl.col("energy_j").max() / 10).item().__ceil__())
    most_m = 0.1 * float(table.select(pl.col("rms_error_m").max() * 10).item().__ceil__())
    budget = alt.param(
        name="max_energy_j",
        value=min(260.0, most_j),
        bind=alt.binding_range(min=150, max=most_j, step=5, name="energy at most / J "),
    )
    bound = alt.param(
        name="max_rms_m",
        value=round(most_m, 2),
        bind=alt.binding_range(min=0.05, max=round(most_m, 2), step=0.01, name="RMS at most / m "),
    )
    meets = f"datum.energy_j <= {budget.name} && datum.rms_error_m <= {bound.name}"
    base = alt.Chart(table).encode(
        x=alt.X("energy_j:Q", title="energy of a trip / J", scale=alt.Scale(zero=False)),
        y=alt.Y("rms_error_m:Q", title="RMS error / m", scale=alt.Scale(zero=True)),
        opacity=alt.condition(meets, alt.value(1.0), alt.value(0.18)),
    )
    dots = (
        base.mark_circle(size=110)
        .encode(
            color=alt.Color("line:N", scale=_scale(names), legend=alt.Legend(title=None)),
            tooltip=[
                alt.Tooltip("mode:O", title="power mode"),
                alt.Tooltip("mode_name:N", title="name"),
                alt.Tooltip("line:N", title="method"),
                alt.Tooltip("energy_j:Q", title="energy / J", format=".1f"),
                alt.Tooltip("rms_error_m:Q", title="RMS error / m", format=".3f"),
                alt.Tooltip("worst_error_x_m:Q", title="worst X / m", format=".3f"),
                alt.Tooltip("worst_error_y_m:Q", title="worst Y / m", format=".3f"),
                alt.Tooltip("executions:Q", title="executions", format=".0f"),
            ],
        )
        .add_params(budget, bound)
    )
    numbers = base.mark_text(dy=-11, fontSize=11).encode(text="mode:O")
    limits = alt.Chart(pl.DataFrame({"any": [0]})).mark_rule(strokeDash=[4, 3])
    vertical = limits.transform_calculate(limit=budget.name).encode(x="limit:Q")
    horizontal = limits.transform_calculate(limit=bound.name).encode(y="limit:Q")
    return finish(
        vertical + horizontal + dots + numbers,
        height=320,
        description="RMS error against energy of each operating point; the number is the mode",
    )


def roadside_unit_cost(units: int, years: int) -> Spec:
    """Cost over the years of the roadside units that are not needed."""
    entry = cost.roadside_units(units)
    rows = []
    for year in range(years + 1):
        low, high = entry.total_usd(year)
        rows.append({"year": year, "low": low / 1e3, "high": high / 1e3})
    band = (
        alt.Chart(pl.DataFrame(rows))
        .mark_area(opacity=0.6, color=COLOURS[LABELS["esprit"]])
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


def sensor_cost() -> Spec:
    """Price of the sensors."""
    table = pl.DataFrame(facts.load("cost")["sensor"])
    base = alt.Chart(table).encode(
        y=alt.Y("name:N", title=None, sort="-x", axis=alt.Axis(labelLimit=170)),
        x=alt.X("price_usd:Q", title="price / USD", scale=alt.Scale(domainMax=4800)),
        tooltip=["name:N", "price_usd:Q", "source:N"],
    )
    bars = base.mark_bar(color=COLOURS[ADAPTIVE_LABEL], cornerRadiusEnd=3, height=26)
    prices = base.mark_text(align="left", dx=6).encode(text=alt.Text("price_usd:Q", format=",.2f"))
    return finish(bars + prices, height=120, description="Price of a LiDAR and of a 5G adapter")


def grid_name(grid: str) -> str:
    """Region of an electricity grid as a reader sees it."""
    return grid.upper() if grid == "usa" else grid.capitalize()


def carbon(footprints: dict[str, Footprint]) -> Spec:
    """Lifetime emissions in use by grid, central value and range, embodied beside it."""
    any_one = next(iter(footprints.values()))
    rows = [
        {
            "what": f"use, {grid_name(grid)}",
            "low": one.use_kg.low,
            "central": one.use_kg.central,
            "high": one.use_kg.high,
            "kind": "use",
        }
        for grid, one in footprints.items()
    ]
    embodied = any_one.embodied_kg
    rows.append(
        {
            "what": "embodied, any grid",
            "low": embodied.low,
            "central": embodied.central,
            "high": embodied.high,
            "kind": "embodied",
        }
    )
    base = alt.Chart(pl.DataFrame(rows)).encode(
        y=alt.Y("what:N", title=None, sort=[str(row["what"]) for row in rows]),
        color=alt.Color(
            "kind:N",
            scale=alt.Scale(
                domain=["use", "embodied"],
                range=[COLOURS[LABELS["esprit"]], COLOURS[LABELS["root_music"]]],
            ),
            legend=alt.Legend(title=None),
        ),
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
