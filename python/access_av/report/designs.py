"""The page of ``access-av designs``: energy against error, and a design along the track."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

import altair as alt
import numpy as np
import polars as pl

from access_av.report.chart import GREEN, GREY, ORANGE, thinned
from access_av.report.page import sheet
from access_av.report.parts import figure, source, tile, warnings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av._core import Scenario
    from access_av.designs.drives import Driven
    from access_av.report.chart import Spec

# Designs that are drawn, and those of them along the track: the front first, then by energy.
MOST_DESIGNS, MOST_TRACKS, POINTS_PER_TRACK = 4000, 40, 60


def render_designs(scenario: Scenario, driven: Sequence[Driven], rows: pl.DataFrame) -> str:
    """The designs of a scenario as an HTML page that loads nothing."""
    known = rows.drop_nulls(["energy_j", "rms_error_m"])
    specs = {} if known.is_empty() else {"designs": _linked(driven, known)}
    drawn = figure("designs") if specs else "<p>No design has a known energy and error.</p>"
    return sheet(
        specs,
        title=f"ACCESS-AV designs: {escape(scenario.name)}",
        kicker="ACCESS-AV designs",
        headline=f"{rows['on_front'].sum()} of {rows.height} designs are not surely beaten",
        lead=escape(scenario.description),
        tiles=tile(str(rows.height), "designs driven to the end"),
        meta=escape(f"Scenario “{scenario.name}”, version {version('access-av')}."),
        sections=warnings(scenario.warnings())
        + (
            "<section><h2>Energy against error</h2><p>All designs saw the same runs. Orange: no "
            "other design is better with 95 %. Click one to see its error along the track.</p>"
            f"{drawn}</section><section><h2>Provenance</h2>"
            f"{source('Scenario, all defaults written out', scenario.to_toml())}</section>"
        ),
    )


def _linked(driven: Sequence[Driven], known: pl.DataFrame) -> Spec:
    """Energy against error, above the error along the track of what is clicked."""
    drawn = known.sort("on_front", "energy_j", descending=[True, False]).head(MOST_DESIGNS)
    nearest = drawn["design"].head(MOST_TRACKS).to_list()
    tracks = pl.concat(
        thinned(
            pl.DataFrame(
                {
                    "design": index,
                    "time_s": driven[index].track_s,
                    "rms_error_m": np.sqrt(driven[index].track_m2),
                }
            ),
            POINTS_PER_TRACK,
        )
        for index in nearest
    )
    clicked = alt.selection_point(fields=["design"], value=[{"design": nearest[0]}])
    kind = (
        alt.when(clicked)
        .then(alt.value(GREEN))
        .when("datum.on_front")
        .then(alt.value(ORANGE))
        .otherwise(alt.value(GREY))
    )
    points = (
        alt.Chart(drawn)
        .mark_circle(size=70)
        .encode(
            x=alt.X("energy_j:Q", title="energy of a trip / J", scale=alt.Scale(type="log")),
            y=alt.Y("rms_error_m:Q", title="RMS error / m"),
            color=kind,
            tooltip=["choice", "energy_j", "rms_error_m", "executions", "listened"],
        )
        .add_params(clicked)
        .properties(width=640, height=300)
    )
    track = (
        alt.Chart(tracks)
        .mark_line(color=GREEN)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("rms_error_m:Q", title="RMS error / m"),
        )
        .transform_filter(clicked)
        .properties(width=640, height=160)
    )
    spec: Spec = (points & track).to_dict()
    spec["description"] = "Energy against error of every design, and the error of one over time"
    return spec
