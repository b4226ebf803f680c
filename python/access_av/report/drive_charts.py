"""Charts of a scenario's runs and of its error bound."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.report.chart import (
    BLUE,
    GREEN,
    LEAST_M,
    ORANGE,
    Spec,
    finish,
    line_chart,
    lines_of,
    thinned,
    tips,
)
from access_av.report.played import played, received_of, steps_of
from access_av.report.site_map import Frame, heads_of
from access_av.statistics.consistency import horizontal_error_m

if TYPE_CHECKING:
    from access_av._core import Scenario
    from access_av.run.error_bound import ErrorBound
    from access_av.run.simulation import Simulation

# Bins of the Stanford diagram per decade: 12 % wide.
BINS_PER_DECADE = 20
TALLEST_MAP_PX = 900.0
ROAD_STEP_M = 2.0
POINTS_PER_WAY = 800
MARGIN_M = 25.0


def error_against_time(steps: pl.DataFrame) -> Spec:
    """Returns the chart of error quantiles over the runs against time."""
    names = {"p50_error_m": "median", "p90_error_m": "90th percentile", "rms_error_m": "RMS"}
    x, y = ("time_s", "time / s"), ("error_m", "horizontal error / m")
    chart = _lines(steps, names, "over the runs", x, y)
    return finish(chart, height=240, description="Horizontal error against time, over the runs")


def aoa_estimates_against_time(aoa_estimates: pl.DataFrame, runs: int, duration_s: float) -> Spec:
    """Returns the chart of angle estimates per second (mean over the runs), by radio head."""
    bar_s = max(1.0, math.ceil(duration_s / 80.0))
    rates = (
        aoa_estimates.group_by(
            start_s=(pl.col("time_s") / bar_s).floor() * bar_s,
            head=pl.format("PCI {}, SSB {}", "pci", "ssb_index"),
        )
        .agg((pl.len() / (runs * bar_s)).round(3).alias("per_second"))
        .sort("start_s", "head")
        .with_columns(end_s=pl.col("start_s") + bar_s)
    )
    chart = (
        alt.Chart(rates)
        .mark_bar()
        .encode(
            x=alt.X(
                "start_s:Q",
                title="time / s",
                bin="binned",
                scale=alt.Scale(domain=[0.0, math.ceil(duration_s / bar_s) * bar_s]),
            ),
            x2="end_s:Q",
            y=alt.Y("per_second:Q", title="angle estimates per second"),
            color=alt.Color("head:N", legend=alt.Legend(title=None)),
            tooltip=tips(
                ("head:N", "radio head"), ("start_s:Q", "from / s"), ("per_second:Q", "per second")
            ),
        )
    )
    return finish(chart, height=200, description="Angle estimates per second against time")


def stanford(trajectories: pl.DataFrame, alert_limit_m: float) -> Spec:
    """Returns the Stanford diagram: counts of error and protection level."""
    bins = (
        trajectories.filter(pl.col("protection_level_m").is_not_null())
        .select(error=_bin(horizontal_error_m()), level=_bin(pl.col("protection_level_m")))
        .group_by("error", "level")
        .agg(pl.len().alias("epochs"))
        .sort("error", "level")
    )
    edges = {
        f"{name}_{end}_m": (10.0 ** ((pl.col(name) + shift) / BINS_PER_DECADE)).round(6)
        for name in ("error", "level")
        for end, shift in (("from", 0), ("to", 1))
    }
    counted = bins.select("epochs", **edges)
    low = counted.select(pl.min_horizontal("error_from_m", "level_from_m").min()).item()
    high = counted.select(pl.max_horizontal("error_to_m", "level_to_m").max()).item()
    low, high = min(low, alert_limit_m), max(high, alert_limit_m * 1.25)
    scale = alt.Scale(type="log", domain=[low, high], nice=False)
    cells = (
        alt.Chart(counted)
        .mark_rect()
        .encode(
            x=alt.X("error_from_m:Q", title="horizontal error / m", scale=scale),
            x2="error_to_m:Q",
            y=alt.Y("level_from_m:Q", title="protection level / m", scale=scale),
            y2="level_to_m:Q",
            color=alt.Color(
                "epochs:Q",
                scale=alt.Scale(type="log", scheme="viridis"),
                legend=alt.Legend(title="epochs"),
            ),
            tooltip=tips(
                ("error_from_m:Q", "error from / m", ".3f"),
                ("level_from_m:Q", "level from / m", ".3f"),
                ("epochs:Q",),
            ),
        )
    )
    diagonal = (
        alt.Chart(pl.DataFrame({"at_m": [low, high]}))
        .mark_line(color=ORANGE, strokeWidth=2)
        .encode(x=alt.X("at_m:Q", scale=scale), y=alt.Y("at_m:Q", scale=scale))
    )
    limit = alt.Chart(pl.DataFrame({"at_m": [alert_limit_m]}))
    rule = limit.mark_rule(strokeDash=[5, 4], strokeWidth=1.5)
    limits = rule.encode(x=alt.X("at_m:Q", scale=scale))
    limits += rule.encode(y=alt.Y("at_m:Q", scale=scale))
    return finish(
        cells + diagonal + limits,
        height=420,
        description="Stanford diagram: protection level against horizontal error",
    )


def _bin(length_m: pl.Expr) -> pl.Expr:
    return (length_m.clip(LEAST_M).log10() * BINS_PER_DECADE).floor().cast(pl.Int32)


def bound_along_route(route: pl.DataFrame) -> Spec:
    """Returns the chart of the bound along the road, with its components."""
    names = {"bound_m": "horizontal", "along_std_m": "along the road", "across_std_m": "across it"}
    x, y = ("along_m", "along the road / m"), ("bound_m", "least RMS error / m")
    chart = _lines(route, names, "error", x, y)
    return finish(chart, height=260, description="Lower bound of the RMS error along the route")


def bound_over_site(bound: ErrorBound) -> Spec:
    """Returns the map of the bound, with road and radio heads."""
    step_m = bound.map_step_m
    squares = bound.site.drop_nulls("bound_m").select(
        left_m=(pl.col("x_m") - 0.5 * step_m).round(2),
        right_m=(pl.col("x_m") + 0.5 * step_m).round(2),
        low_m=(pl.col("y_m") - 0.5 * step_m).round(2),
        high_m=(pl.col("y_m") + 0.5 * step_m).round(2),
        bound_m=pl.col("bound_m").round(4),
    )
    places, half = bound.site.select("x_m", "y_m").to_numpy(), 0.5 * step_m
    left_m, low_m = (places.min(axis=0) - half).tolist()
    right_m, high_m = (places.max(axis=0) + half).tolist()
    frame = Frame.between((left_m, right_m), (low_m, high_m), TALLEST_MAP_PX)
    heat = (
        alt.Chart(squares)
        .mark_rect()
        .encode(
            x=alt.X("left_m:Q", title="x / m", scale=frame.across),
            x2="right_m:Q",
            y=alt.Y("low_m:Q", title="y / m", scale=frame.upward),
            y2="high_m:Q",
            color=alt.Color(
                "bound_m:Q",
                scale=alt.Scale(type="log", scheme="viridis", reverse=True),
                legend=alt.Legend(title="least RMS error / m", gradientLength=240),
            ),
            tooltip=tips(("bound_m:Q", "bound / m", ".3f")),
        )
    )
    road = alt.Chart(_road(bound.route)).mark_line(
        color="#ffffff", stroke="#11161d", strokeWidth=2.5
    )
    layers = [
        *([] if squares.is_empty() else [heat]),
        *frame.beneath(bound.scenario.site),
        frame.put(road, order="along_m:Q"),
        *frame.masts(bound.heads.select("name", "pci", "x_m", "y_m"), ORANGE),
    ]
    return finish(
        alt.LayerChart(layer=layers),
        height=frame.height_px,
        description="Map of the lower bound of the RMS error, with road and radio heads",
    )


def drive_on_map(scenario: Scenario, result: Simulation) -> Spec:
    """Returns the animated map of the first run."""
    site = scenario.site
    heads, steps = heads_of(site), steps_of(result)
    way = thinned(steps.select("time_s", "x_m", "y_m"), POINTS_PER_WAY)
    frame = Frame.about([way, heads], MARGIN_M, TALLEST_MAP_PX)
    line = alt.Chart(way).mark_line(color=BLUE, strokeWidth=2.5)
    layers = [*frame.beneath(site), frame.put(line, order="time_s:Q"), *frame.masts(heads)]
    return finish(
        played(frame, alt.LayerChart(layer=layers), steps, received_of(result), heads),
        height=frame.height_px,
        description="Map of a drive, with the radio heads",
    )


def _road(route: pl.DataFrame) -> pl.DataFrame:
    """Returns points of the road at intervals of ``ROAD_STEP_M``, which show its bends."""
    moved = (pl.col("along_m") / ROAD_STEP_M).floor()
    return route.filter(moved.diff().fill_null(1.0) > 0.0).select(
        pl.col("x_m", "y_m", "along_m").round(2)
    )


def _lines(
    table: pl.DataFrame, names: dict[str, str], line: str, x: tuple[str, str], y: tuple[str, str]
) -> alt.Chart:
    """Returns one line per column of ``names``; ``x`` and ``y`` are columns with titles."""
    (across, x_title), (upward, y_title) = x, y
    return line_chart(
        lines_of(table, across, names, upward),
        dict(zip(names.values(), (BLUE, ORANGE, GREEN), strict=True)),
        alt.X(f"{across}:Q", title=x_title),
        alt.Y(f"{upward}:Q", title=y_title),
        tips(("line:N", line), (f"{across}:Q", x_title, ".1f"), (f"{upward}:Q", y_title, ".3f")),
    )
