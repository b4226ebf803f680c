"""The report's sections on signal and accuracy."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.methods import label
from access_av.paper.methods import METHODS
from access_av.paper.report.lines import EVERY_SSB, scale
from access_av.report.chart import BLUE, finish, thinned
from access_av.report.parts import figure, number, table

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation
    from access_av.report.chart import Spec


def signal(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """SNR along the track."""
    specs["snr"] = _snr_chart(evaluation)
    highest = evaluation.snr.sort("mean_true_snr_db").row(-1, named=True)
    return figure(
        "snr", f"Highest {highest['mean_true_snr_db']:.1f} dB at {highest['time_s']:.1f} s."
    )


def accuracy(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Errors against time: a pair of charts for every SSB and for each base wake-up time."""
    every_ssb = evaluation.campaign("P")
    panels = [("Every SSB (20 ms), what the radio would allow", every_ssb)]
    reference = every_ssb.filter(pl.col("method") == "music")
    by_mode = pl.concat([evaluation.campaign("Q"), evaluation.campaign("R")])
    groups: dict[tuple[float, ...], list[int]] = {}
    for mode in evaluation.campaign("R")["mode"]:
        times = tuple(by_mode.filter(pl.col("mode") == mode)["base_wake_up_ms"])
        groups.setdefault(times, []).append(mode)
    for times, modes in groups.items():
        name = "Mode" if len(modes) == 1 else "Modes"
        intervals = " / ".join(f"{time:g}" for time in times[: len(METHODS)])
        rows = pl.concat([by_mode.filter(pl.col("mode") == modes[0]), reference])
        panels.append((f"{name} {', '.join(map(str, modes))}: {intervals} ms", rows))
    parts = []
    for index, (title, rows) in enumerate(panels):
        for axis in ("x", "y"):
            chart_id = f"error-{axis}-{index}"
            specs[chart_id] = _error_chart(evaluation, rows, axis)
            parts.append(figure(chart_id, title=f"{title}, error in {axis.upper()}"))
    return f'<div class="charts">{"".join(parts)}</div>'


def accuracy_table(evaluation: Evaluation) -> str:
    """Worst and RMS errors of every operating point."""
    rows = []
    for point in evaluation.points.unique(
        ["campaign", "method", "adaptive", "base_wake_up_ms"], maintain_order=True
    ).iter_rows(named=True):
        modes = evaluation.points.filter(
            *(
                pl.col(key) == point[key]
                for key in ("campaign", "method", "adaptive", "base_wake_up_ms")
            )
        )["mode"]
        rows.append(
            (
                escape(label(point["method"], adaptive=point["adaptive"])),
                "every SSB" if point["campaign"] == "P" else ", ".join(map(str, modes)),
                f"{point['base_wake_up_ms']:g}",
                number(point["worst_error_x_m"]),
                number(point["worst_error_y_m"]),
                number(point["rms_error_m"]),
            )
        )
    head = ("Method", "Modes", "Wake-up / ms", "Worst X / m", "Worst Y / m", "RMS / m")
    worst = table(head, rows, numbers=(2, 3, 4, 5))
    return f"<details><summary>Worst and RMS errors as a table</summary>{worst}</details>"


def _snr_chart(evaluation: Evaluation) -> Spec:
    """SNR along the track (the paper's SNR figure)."""
    line = (
        alt.Chart(thinned(evaluation.snr))
        .mark_line(color=BLUE, strokeWidth=2)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("mean_true_snr_db:Q", title="SNR / dB"),
            tooltip=[
                alt.Tooltip("time_s:Q", title="time / s", format=".1f"),
                alt.Tooltip("mean_true_snr_db:Q", title="SNR / dB", format=".2f"),
            ],
        )
    )
    return finish(
        line, height=220, description="Signal-to-noise ratio against time along the track"
    )


def _error_chart(evaluation: Evaluation, points: pl.DataFrame, axis: str) -> Spec:
    """Error in one direction against time, one line per operating point in ``points``.

    ``axis`` is ``"x"`` or ``"y"``.
    """
    names = _line_names(points)
    lines = pl.concat(
        thinned(evaluation.series(point)).select(
            pl.col("time_s"),
            pl.col(f"mean_abs_error_{axis}_m").alias("error_m"),
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
            color=alt.Color("line:N", scale=scale(names), legend=alt.Legend(title=None)),
            strokeDash=alt.StrokeDash(
                "line:N",
                scale=alt.Scale(
                    domain=names, range=[[4, 3] if name == EVERY_SSB else [1, 0] for name in names]
                ),
                legend=alt.Legend(title=None),
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
