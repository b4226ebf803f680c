"""Report section on the design space."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any

import altair as alt
import polars as pl

from access_av.designs.query import Query, explore
from access_av.paper.statements import ADAPTIVE_LABEL, of_claim
from access_av.report.chart import finish
from access_av.report.labels import domain, layers, placed
from access_av.report.paper.lines import COLOURS, NAMES, by_mode, scale
from access_av.report.parts import figure, table

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation
    from access_av.report.chart import Spec

# Heights of the plots (px).
PROJECTION_PX, SPACE_PX = 260, 420


def design(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Returns the section with energy against X, Y and RMS error."""
    for axis in "xy":
        specs[f"design-{axis}"] = _projection(evaluation, axis)
    specs["design-space"] = _chart(evaluation)
    projections = "".join(
        figure(f"design-{axis}", title=f"Adaptive: worst error in {axis.upper()} against energy")
        for axis in "xy"
    )
    return f'<div class="charts">{projections}</div>' + figure(
        "design-space", title="All operating points: RMS error against energy"
    )


def _projection(evaluation: Evaluation, axis: str) -> Spec:
    """Returns the chart of energy against one error axis, for the adaptive points of all modes."""
    points = evaluation.campaign("R").filter(pl.col("energy_j").is_not_null())
    columns = ("mode", "energy_j", "worst_error_x_m", "worst_error_y_m")
    rows = points.select(columns).with_columns(pl.col(pl.Float64).round(4))
    error = f"worst_error_{axis}_m"
    x_domain, y_domain = domain([*rows["energy_j"]] or [0.0]), domain([0.0, *rows[error]])
    axes = ("energy_j", x_domain, False), (error, y_domain, False)
    base = alt.Chart(placed(rows, "mode", *axes, PROJECTION_PX)).encode(
        x=_axis(alt.X, "energy_j", "energy of a trip / J", x_domain),
        y=_axis(alt.Y, error, f"worst error in {axis.upper()} / m", y_domain),
        tooltip=[
            alt.Tooltip("mode:O", title="power mode"),
            alt.Tooltip("energy_j:Q", title="energy / J", format=".1f"),
            alt.Tooltip("worst_error_x_m:Q", title="worst X / m", format=".3f"),
            alt.Tooltip("worst_error_y_m:Q", title="worst Y / m", format=".3f"),
        ],
    )
    dots = base.mark_circle(size=90, color=COLOURS[ADAPTIVE_LABEL])
    lines, numbers = layers(base)
    return finish(
        lines + dots + numbers,
        height=PROJECTION_PX,
        description=f"Worst error in {axis.upper()} against energy of the adaptive points by mode",
    )


def _axis(channel: Any, column: str, title: str, ends: list[float]) -> Any:
    """Returns an axis whose domain is that of the label positions."""
    return channel(f"{column}:Q", title=title, scale=alt.Scale(domain=ends, nice=False))


def queries(evaluation: Evaluation) -> str:
    """Returns the table of the paper's requirements and the operating points that meet them."""
    rows = []
    for query in _asked():
        found = explore(evaluation.campaign("R"), query)
        modes = ", ".join(map(str, found["mode"])) or "none"
        best = "–"
        if not found.is_empty():
            first = found.row(0, named=True)
            best = (
                f"mode {first['mode']}: {first['energy_j']:.1f} J, RMS {first['rms_error_m']:.3f} m"
            )
        rows.append((escape(str(query)), modes, best))
    return table(("Query (adaptive)", "Modes that meet the query", "Minimum energy"), rows)


def _asked() -> list[Query]:
    """Returns the requirements of the paper, each with the points that meet it."""
    asked = [
        Query(**of_claim(claim, "query"))
        for claim in ("d1_budget_210_j", "d2_budget_260_j_rms_015_m")
    ]
    return [*asked, Query(max_worst_m=of_claim("a1_adaptive_worst_m"))]


def _chart(evaluation: Evaluation) -> Spec:
    """Returns the chart of error against energy; two sliders set the limits."""
    table = by_mode(evaluation).select(
        "mode",
        "mode_name",
        "line",
        pl.col(
            "energy_j", "rms_error_m", "worst_error_x_m", "worst_error_y_m", "aoa_estimates"
        ).round(4),
    )
    table = table.filter(pl.col("energy_j").is_not_null())
    most_j, most_m = (
        step * math.ceil(float(table.select(pl.col(name).max().fill_null(step)).item()) / step)
        for name, step in (("energy_j", 10.0), ("rms_error_m", 0.1))
    )
    wide_j = float(of_claim("d2_budget_260_j_rms_015_m", "query")["max_energy_j"])
    budget = alt.param(
        name="max_energy_j",
        value=min(wide_j, most_j),
        bind=alt.binding_range(min=150, max=most_j, step=5, name="energy at most / J "),
    )
    bound = alt.param(
        name="max_rms_m",
        value=round(most_m, 2),
        bind=alt.binding_range(min=0.05, max=round(most_m, 2), step=0.01, name="RMS at most / m "),
    )
    meets = f"datum.energy_j <= {budget.name} && datum.rms_error_m <= {bound.name}"
    x_domain = domain([*table["energy_j"]] or [0.0])
    y_domain = domain([0.0, most_m, *table["rms_error_m"]])
    axes = ("energy_j", x_domain, False), ("rms_error_m", y_domain, False)
    base = alt.Chart(placed(table, "mode", *axes, SPACE_PX, group="line")).encode(
        x=_axis(alt.X, "energy_j", "energy of a trip / J", x_domain),
        y=_axis(alt.Y, "rms_error_m", "RMS error / m", y_domain),
        opacity=alt.condition(meets, alt.value(1.0), alt.value(0.18)),
    )
    dots = (
        base.mark_circle(size=70)
        .encode(
            color=alt.Color("line:N", scale=scale(NAMES), legend=alt.Legend(title=None)),
            tooltip=[
                alt.Tooltip("mode:O", title="power mode"),
                alt.Tooltip("mode_name:N", title="name"),
                alt.Tooltip("line:N", title="method"),
                alt.Tooltip("energy_j:Q", title="energy / J", format=".1f"),
                alt.Tooltip("rms_error_m:Q", title="RMS error / m", format=".3f"),
                alt.Tooltip("worst_error_x_m:Q", title="worst X / m", format=".3f"),
                alt.Tooltip("worst_error_y_m:Q", title="worst Y / m", format=".3f"),
                alt.Tooltip("aoa_estimates:Q", title="angle estimates", format=".0f"),
            ],
        )
        .add_params(budget, bound)
    )
    lines, numbers = layers(base)
    limits = alt.Chart(pl.DataFrame({"any": [0]})).mark_rule(strokeDash=[4, 3])
    vertical = limits.transform_calculate(limit=budget.name).encode(
        x=_axis(alt.X, "limit", "energy of a trip / J", x_domain)
    )
    horizontal = limits.transform_calculate(limit=bound.name).encode(
        y=_axis(alt.Y, "limit", "RMS error / m", y_domain)
    )
    return finish(
        vertical + horizontal + lines + dots + numbers,
        height=SPACE_PX,
        description="RMS error against energy of each operating point; the number is the mode",
    )
