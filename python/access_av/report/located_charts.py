"""Charts of a located drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.report.chart import (
    BLUE,
    GREEN,
    GREY,
    LEAST_M,
    ORANGE,
    PURPLE,
    Spec,
    colours,
    dashed,
    finish,
    line_chart,
    thinned,
    time_axis,
    tips,
)
from access_av.report.played import played
from access_av.report.site_map import Frame, heads_of

if TYPE_CHECKING:
    from access_av._core import Site
    from access_av.drives.recorded import Drive

TALLEST_MAP_PX = 700.0
POINTS_PER_TRACK = 1500
# 90 % quantile of the absolute value of a standard normal variable.
P90_SIGMAS = 1.645

TRACKS = {"truth": GREY, "as driven": BLUE, "smoothed": GREEN}
ERRORS = {
    "error": BLUE,
    "error, smoothed": GREEN,
    "deviation": ORANGE,
    "protection level": PURPLE,
}


def track(drive: Drive, lines: dict[str, pl.DataFrame], site: Site, steps: pl.DataFrame) -> Spec:
    """Returns the animated map of the vehicle's track.

    ``lines`` are poses by their name in ``TRACKS``; ``steps`` those of
    :func:`access_av.report.played.played`.
    """
    heads = heads_of(site)
    table = _joined(
        {
            name: thinned(line.select("time_s", "x_m", "y_m"), POINTS_PER_TRACK)
            for name, line in lines.items()
        }
    )
    every = pl.concat([table.select("x_m", "y_m"), heads.select("x_m", "y_m")])
    across_m, upward_m = (every.max() - every.min()).row(0)
    margin_m = max(0.5, 0.05 * max(across_m, upward_m))
    frame = Frame.about([every], margin_m, TALLEST_MAP_PX)
    driven = frame.put(
        alt.Chart(table).mark_line(strokeWidth=1.6),
        order="time_s:Q",
        color=colours("line:N", _present(TRACKS, lines)),
    )
    layers = alt.LayerChart(layer=[*frame.beneath(site), driven, *frame.masts(heads, ORANGE)])
    received = drive.angles.filter("accepted").select("time_s", "pci", "ssb_index")
    return finish(
        played(frame, layers, steps, received, heads),
        height=frame.height_px,
        description="Track of the vehicle, with the radio heads",
    )


def error(lines: dict[str, pl.DataFrame]) -> Spec:
    """Returns the chart of error, standard deviation and protection level against time.

    ``lines`` are ``time_s`` and ``error_m`` by the line's name in ``ERRORS``.
    """
    drawn = {
        name: thinned(line.select("time_s", pl.col("error_m").clip(LEAST_M)).drop_nulls())
        for name, line in lines.items()
    }
    chart = line_chart(
        _joined(drawn),
        _present(ERRORS, lines),
        time_axis(),
        alt.Y("error_m:Q", title="horizontal / m", scale=alt.Scale(type="log")),
        tips(("line:N",), ("time_s:Q", "time / s", ".1f"), ("error_m:Q", "m", ".3f")),
    )
    return finish(chart, height=260, description="Error, deviation and level against time")


def _joined(lines: dict[str, pl.DataFrame]) -> pl.DataFrame:
    return pl.concat(rows.with_columns(line=pl.lit(name)) for name, rows in lines.items())


def _present(by_name: dict[str, str], lines: dict[str, pl.DataFrame]) -> dict[str, str]:
    return {name: colour for name, colour in by_name.items() if name in lines}


def angles(compared: pl.DataFrame) -> Spec:
    """Returns the chart of the normalised innovation of each angle against time."""
    dots = (
        alt.Chart(thinned(compared.select("time_s", "deviations", "verdict"), 2000))
        .mark_circle(size=16, opacity=0.6)
        .encode(
            x=time_axis(),
            y=alt.Y("deviations:Q", title="deviations", scale=alt.Scale(type="symlog")),
            color=colours("verdict:N", {"accepted": BLUE, "refused": ORANGE}),
        )
    )
    return finish(dots, height=220, description="Normalised innovation of each angle against time")


def heads(compared: pl.DataFrame) -> Spec:
    """Returns the chart of each radio head's 90th percentile of the normalised innovations."""
    order = compared.sort("pci", "ssb_index")["head"].unique(maintain_order=True).to_list()
    percentiles = compared.group_by("head", maintain_order=True).agg(
        pl.col("deviations").quantile(0.9, "linear").round(3), angles=pl.len()
    )
    bars = (
        alt.Chart(percentiles)
        .mark_bar(color=BLUE)
        .encode(
            x=alt.X(
                "head:N",
                title="radio head: PCI, or PCI/SSB index",
                sort=order,
                axis=alt.Axis(labelAngle=0, labelOverlap=True),
            ),
            y=alt.Y("deviations:Q", title="deviations, 90th percentile"),
            tooltip=["head:N", "deviations:Q", "angles:Q"],
        )
    )
    line = dashed("y", "at", P90_SIGMAS, color=ORANGE)
    return finish(bars + line, height=200, description="Innovations of each radio head")
