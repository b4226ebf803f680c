"""Charts as Vega-Lite: what all of them share."""

from __future__ import annotations

from typing import Any

import altair as alt
import polars as pl

# Okabe and Ito's colours: told apart on light and dark, in print and by colour-blind readers.
BLUE, ORANGE, GREEN, GREY, PURPLE = "#2f7ed8", "#d55e00", "#009e73", "#8a8f98", "#b48ead"
POINTS_PER_LINE = 160

Spec = dict[str, Any]


def thinned(series: pl.DataFrame, points: int = POINTS_PER_LINE) -> pl.DataFrame:
    """Enough points for a line on a screen, rounded to what can be seen."""
    step = max(1, series.height // points)
    return series.gather_every(step).with_columns(pl.col(pl.Float64).round(4))


def finish(chart: alt.Chart | alt.LayerChart, *, height: int, description: str) -> Spec:
    """The chart as Vega-Lite, as wide as its place."""
    # A fine map has more points than Altair takes by default.
    with alt.data_transformers.disable_max_rows():
        spec: Spec = chart.properties(width="container", height=height).to_dict()
    spec["description"] = description
    spec["autosize"] = {"type": "fit-x", "contains": "padding"}
    return spec
