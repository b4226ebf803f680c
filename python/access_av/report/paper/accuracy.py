"""Report sections on signal and accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import altair as alt
import numpy as np
import polars as pl

from access_av.paper.statements import METHODS, paper_numbers
from access_av.report.chart import BLUE, Spec, finish, thinned, tips
from access_av.report.paper.lines import EVERY_SSB, coloured
from access_av.report.parts import figure, folded, records
from access_av.signal.methods import label
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation


# Trend: average over this number of SSBs, because the shadowing of each SSB is independent.
TREND_SSBS = 100


def signal(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Returns the section on the SNR along the track, with the trend of the paper's figure."""
    specs["snr"] = _snr_chart(evaluation)
    highest = _trend(evaluation).sort("mean_true_snr_db").row(-1, named=True)
    ends = evaluation.snr["mean_true_snr_db"].gather([0, evaluation.snr.height - 1])
    return figure(
        "snr",
        f"Mean over the runs and {TREND_SSBS * 20 / 1000:g} s. Highest "
        f"{highest['mean_true_snr_db']:.1f} dB at {highest['time_s']:.0f} s, the vehicle being "
        f"nearest to the radio head at {_nearest_s():.0f} s; {ends[0]:.1f} dB at the "
        f"start, {ends[1]:.1f} dB at the end.",
    )


def _trend(evaluation: Evaluation) -> pl.DataFrame:
    means = pl.col("mean_true_snr_db").rolling_mean(TREND_SSBS, center=True, min_samples=1)
    return evaluation.snr.with_columns(means)


def _nearest_s() -> float:
    """Returns the time at the radio head by the paper's numbers: an arc of constant curvature."""
    trip = paper_numbers()["trip"]
    length_m, turn_rad = trip["length_m"], np.radians(trip["bend_deg"])
    speed_mps, ramp_mps2 = trip["top_speed_kmh"] / 3.6, trip["acceleration_mps2"]
    along_m = np.linspace(0.0, length_m, 3001)
    turned, radius_m = along_m / length_m * turn_rad, length_m / turn_rad
    places_m = radius_m * np.array([np.sin(turned), 1.0 - np.cos(turned)])
    head_m = np.array(trip["radio_head_m"])[:, None]
    nearest_m = along_m[np.hypot(*(places_m - head_m)).argmin()]
    # The vehicle has its top speed there, after the acceleration.
    return float(nearest_m / speed_mps + 0.5 * speed_mps / ramp_mps2)


def accuracy(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Returns error charts over time, in x and y: for every SSB and for each base wake-up time."""
    every_ssb = evaluation.campaign("P")
    panels = [("Every SSB (20 ms): limit of the radio signal", every_ssb)]
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
        for axis in ("y", "x"):
            chart_id = f"error-{axis}-{index}"
            specs[chart_id] = _error_chart(evaluation, rows, axis)
            parts.append(figure(chart_id, title=f"{title}, error in {axis.upper()}"))
    return f'<div class="charts">{"".join(parts)}</div>'


def accuracy_table(evaluation: Evaluation) -> str:
    """Returns the table of maximum and RMS errors of every operating point."""
    keys = ["campaign", "method", "adaptive", "base_wake_up_ms"]
    rows = []
    for point in evaluation.points.unique(keys, maintain_order=True).iter_rows(named=True):
        modes = evaluation.points.filter(*(pl.col(key) == point[key] for key in keys))["mode"]
        rows.append(
            {
                "Method": label(point["method"], adaptive=point["adaptive"]),
                "Modes": "every SSB" if point["campaign"] == "P" else ", ".join(map(str, modes)),
                "Wake-up / ms": f"{point['base_wake_up_ms']:g}",
                "Worst X / m": number(point["worst_error_x_m"]),
                "Worst Y / m": number(point["worst_error_y_m"]),
                "RMS / m": number(point["rms_error_m"]),
            }
        )
    return folded("Worst and RMS errors as a table", records(rows, numbers=(2, 3, 4, 5)))


def _snr_chart(evaluation: Evaluation) -> Spec:
    """Returns the chart of the SNR along the track (the paper's SNR figure)."""
    line = (
        alt.Chart(thinned(_trend(evaluation)))
        .mark_line(color=BLUE, strokeWidth=2)
        .encode(
            x=alt.X("time_s:Q", title="time / s"),
            y=alt.Y("mean_true_snr_db:Q", title="SNR / dB"),
            tooltip=tips(
                ("time_s:Q", "time / s", ".1f"), ("mean_true_snr_db:Q", "SNR / dB", ".2f")
            ),
        )
    )
    return finish(
        line, height=220, description="Signal-to-noise ratio against time along the track"
    )


def _error_chart(evaluation: Evaluation, points: pl.DataFrame, axis: str) -> Spec:
    """Returns the chart of the error in one direction over time, one line per operating point.

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
            color=coloured(names),
            strokeDash=alt.StrokeDash(
                "line:N",
                scale=alt.Scale(
                    domain=names, range=[[4, 3] if name == EVERY_SSB else [1, 0] for name in names]
                ),
                # One legend for colours and symbols, because two legends could contradict each
                # other.
                legend=alt.Legend(title=None),
            ),
            opacity=alt.condition(picked, alt.value(1.0), alt.value(0.15)),
            tooltip=tips(
                ("line:N", "method"),
                ("time_s:Q", "time / s", ".1f"),
                ("error_m:Q", "error / m", ".3f"),
            ),
        )
        .add_params(picked)
    )
    return finish(
        chart,
        height=190,
        description=f"Mean absolute error in {axis.upper()} against time for {', '.join(names)}",
    )


def _line_names(points: pl.DataFrame) -> list[str]:
    """Returns the names of a legend; MUSIC at every SSB has its own name in a comparison."""
    mixed = points["campaign"].n_unique() > 1
    return [
        EVERY_SSB
        if mixed and point["campaign"] == "P"
        else label(point["method"], adaptive=point["adaptive"])
        for point in points.iter_rows(named=True)
    ]
