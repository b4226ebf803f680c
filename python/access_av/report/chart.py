"""Common functions of the Vega-Lite charts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import altair as alt
import polars as pl

if TYPE_CHECKING:
    from collections.abc import Mapping

# Colours of Okabe and Ito: distinct on light and dark, in print and for colour-blind readers.
BLUE, ORANGE, GREEN, GREY, PURPLE = "#2f7ed8", "#d55e00", "#009e73", "#8a8f98", "#b48ead"
POINTS_PER_LINE = 160
# Minimum drawn error (m).
LEAST_M = 1e-3
# Size of a map on a wide screen.
MAP_WIDTH_PX, LEAST_HEIGHT_PX = 1000.0, 220.0

Spec = dict[str, Any]


def thinned(series: pl.DataFrame, points: int = POINTS_PER_LINE) -> pl.DataFrame:
    """Reduces a line to the points and digits that a screen can show."""
    step = max(1, series.height // points)
    return series.gather_every(step).with_columns(pl.col(pl.Float64).round(4))


def to_scale(
    x_m: tuple[float, float], y_m: tuple[float, float], tallest_px: float
) -> tuple[list[float], list[float], int]:
    """Returns the domains of a map's axes and its height, with equal scales on a wide screen.

    Remaining space shows more of the surroundings.

    Parameters
    ----------
    x_m, y_m
        Minimum range of each axis.
    tallest_px
        Maximum height of the map.

    Examples
    --------
    >>> to_scale((0.0, 100.0), (0.0, 50.0), 700.0)
    ([0.0, 100.0], [0.0, 50.0], 500)
    >>> to_scale((0.0, 10.0), (0.0, 14.0), 700.0)
    ([-5.0, 15.0], [0.0, 14.0], 700)
    """
    across_m, upward_m = x_m[1] - x_m[0], y_m[1] - y_m[0]
    metre_px = min(MAP_WIDTH_PX / across_m, tallest_px / upward_m)
    height_px = max(LEAST_HEIGHT_PX, metre_px * upward_m)
    more_m = MAP_WIDTH_PX / metre_px - across_m, height_px / metre_px - upward_m
    x, y = (
        [low - 0.5 * more, high + 0.5 * more]
        for (low, high), more in zip((x_m, y_m), more_m, strict=True)
    )
    return x, y, round(height_px)


def tips(*entries: tuple[str, ...]) -> list[alt.Tooltip]:
    """Returns tooltips; an entry is a field with an optional title and number format."""
    made = []
    for field, *texts in entries:
        more: dict[str, Any] = dict(zip(("title", "format"), texts, strict=False))
        made.append(alt.Tooltip(field, **more))
    return made


def colours(field: str, by_name: Mapping[str, str], **legend: Any) -> alt.Color:
    """Returns the colour scale of named values, in the order of the legend."""
    scale = alt.Scale(domain=list(by_name), range=list(by_name.values()))
    return alt.Color(field, scale=scale, legend=alt.Legend(**{"title": None, **legend}))


def dashed(channel: str, field: str, value: float, **mark: Any) -> alt.Chart:
    """Returns a dashed line at a value of the channel ``x`` or ``y``."""
    rule = alt.Chart(pl.DataFrame({field: [value]})).mark_rule(
        strokeDash=[5, 4], strokeWidth=1.5, **mark
    )
    chart: alt.Chart = rule.encode(**{channel: f"{field}:Q"})
    return chart


def lines_of(table: pl.DataFrame, x: str, names: Mapping[str, str], value: str) -> pl.DataFrame:
    """Returns columns with their names as rows ``line`` and ``value``, thinned, against ``x``."""
    rows = thinned(table.select(x, *names)).rename(dict(names))
    return rows.unpivot(index=x, variable_name="line", value_name=value)


def line_chart(
    rows: pl.DataFrame,
    by_name: Mapping[str, str],
    x: alt.X,
    y: alt.Y,
    tooltip: list[alt.Tooltip],
    **legend: Any,
) -> alt.Chart:
    """Returns a chart of lines: column ``line``, with the colour of each line."""
    colour = colours("line:N", by_name, **legend)
    marks = alt.Chart(rows).mark_line(strokeWidth=1.8)
    chart: alt.Chart = marks.encode(x=x, y=y, color=colour, tooltip=tooltip)
    return chart


def time_axis() -> alt.X:
    """Returns a time axis from the first to the last time, because clocks may count from 1970."""
    return alt.X("time_s:Q", title="time / s", scale=alt.Scale(zero=False, nice=False))


def finish(chart: alt.Chart | alt.LayerChart, *, height: int, description: str) -> Spec:
    """Returns the chart as Vega-Lite, with the width of its container."""
    # A fine map has more points than the default limit of Altair.
    with alt.data_transformers.disable_max_rows():
        spec: Spec = chart.properties(width="container", height=height).to_dict()
    spec["description"] = description
    spec["autosize"] = {"type": "fit-x", "contains": "padding"}
    return spec
