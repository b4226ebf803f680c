"""Animation of one drive on a map: position, error, and received radio heads."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.report.chart import GREEN, ORANGE
from access_av.statistics.consistency import horizontal_error_m

if TYPE_CHECKING:
    from access_av.report.site_map import Frame
    from access_av.run.simulation import Simulation

MOST_STEPS = 300
# page.js animates the slider of this name.
SLIDER = "at_s"
DATA = "played"
CAPTION = (
    "Slider and button play one drive. Lines lead to the radio heads whose angles were estimated "
    "since the previous step. The vehicle is green in state ok."
)


def steps_of(result: Simulation) -> pl.DataFrame:
    """Returns the steps of the first simulated run for :func:`played` (needs trajectories)."""
    if result.trajectories is None:
        raise ValueError("the animation needs trajectories: set keep_trajectories=True")
    return result.trajectories.filter(run=0).select(
        "time_s",
        "searching",
        "integrity",
        "protection_level_m",
        x_m="true_x_m",
        y_m="true_y_m",
        error_m=horizontal_error_m(),
    )


def received_of(result: Simulation) -> pl.DataFrame:
    """Returns the angles of the first simulated run: ``time_s``, ``pci`` and ``ssb_index``."""
    if result.aoa_estimates is None:
        raise ValueError("the animation needs angle estimates: set keep_trajectories=True")
    return result.aoa_estimates.filter(run=0).select("time_s", "pci", "ssb_index")


def played(
    frame: Frame,
    base: alt.LayerChart,
    steps: pl.DataFrame,
    received: pl.DataFrame,
    heads: pl.DataFrame,
) -> alt.LayerChart:
    """Returns a map with one drive at the time of a slider.

    Parameters
    ----------
    frame, base
        Map.
    steps
        ``time_s``, ``x_m``, ``y_m``, ``searching``, ``integrity``, ``protection_level_m`` and
        ``error_m`` of a drive; unknown values of the last three are null.
    received
        ``time_s``, ``pci`` and ``ssb_index`` of each angle.
    heads
        Radio heads of :func:`access_av.report.site_map.heads_of`.
    """
    began_s, ended_s = float(steps["time_s"][0]), float(steps["time_s"][-1])
    step_s = max(0.1, math.ceil(10.0 * (ended_s - began_s) / MOST_STEPS) / 10.0)
    count = math.floor((ended_s - began_s) / step_s)
    times = pl.DataFrame({"step": range(count + 1)}).with_columns(
        time_s=began_s + step_s * pl.col("step")
    )
    shown = times.join_asof(steps.sort("time_s"), on="time_s", strategy="nearest").select(
        "step",
        pl.col("x_m", "y_m").round(1),
        ok=pl.col("integrity").fill_null("") == "ok",
        text=pl.struct(pl.exclude("step")).map_elements(
            lambda it: _text(it, began_s), return_dtype=pl.String
        ),
    )
    lines = (
        received.with_columns(
            step=((pl.col("time_s") - began_s) / step_s - 1e-6).ceil().cast(pl.Int64)
        )
        .select("step", "pci", "ssb_index")
        .unique()
        .join(heads.rename({"x_m": "x2_m", "y_m": "y2_m"}), on=["pci", "ssb_index"])
        .join(shown, on="step")
        .sort("step", "pci", "ssb_index")
        .select("step", "x_m", "y_m", pl.col("x2_m", "y2_m").round(1))
    )
    slider = alt.binding_range(
        min=0.0, max=round(count * step_s, 1), step=step_s, name="time of one drive / s"
    )
    at = alt.param(name=SLIDER, value=0.0, bind=slider)
    now = f"round({SLIDER} / {step_s:g})"
    is_now = f"datum.step == {now}"
    vehicle = (
        alt.Chart(alt.InlineData(values=shown.to_dicts(), name=DATA))
        .transform_filter(is_now)
        .mark_point(filled=True, size=260, stroke="#ffffff", strokeWidth=2, opacity=1.0)
    )
    colour = alt.condition("datum.ok", alt.value(GREEN), alt.value(ORANGE))
    layers = base
    if not lines.is_empty():
        rays = alt.Chart(lines).transform_filter(is_now).mark_rule(strokeDash=[4, 3])
        layers += frame.put(rays, ends=True)
    layers += frame.put(vehicle, color=colour)
    title = alt.Title(
        alt.expr(f"data('{DATA}')[{now}].text"), anchor="start", fontSize=13, fontWeight="normal"
    )
    return layers.add_params(at).properties(title=title)


def _text(step: dict[str, float | str | bool | None], began_s: float) -> str:
    """Returns the text of a step."""
    parts = []
    if step["searching"]:
        parts.append("searching")
    elif step["error_m"] is not None:
        parts.append(f"error {step['error_m']:.2f} m")
    level_m = step["protection_level_m"]
    if level_m is not None and not step["searching"]:
        parts.append(f"protection level {level_m:.2f} m")
    if step["integrity"] is not None:
        parts.append(str(step["integrity"]))
    time_s = step["time_s"]
    assert isinstance(time_s, float)
    return f"{time_s - began_s:.1f} s: {', '.join(parts)}"
