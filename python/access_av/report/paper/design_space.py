"""Report section on the design space."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.designs.query import Query, explore
from access_av.paper.statements import ADAPTIVE_LABEL, of_claim
from access_av.report.chart import Spec, finish, tips
from access_av.report.labels import Axis, labelled
from access_av.report.paper.lines import COLOURS, NAMES, by_mode, coloured
from access_av.report.parts import figure, table

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation

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
    base, lines, numbers = labelled(
        rows,
        "mode",
        Axis("energy_j", "energy of a trip / J", [*rows["energy_j"]]),
        Axis(error, f"worst error in {axis.upper()} / m", [0.0, *rows[error]]),
        PROJECTION_PX,
        tooltip=tips(
            ("mode:O", "power mode"),
            ("energy_j:Q", "energy / J", ".1f"),
            ("worst_error_x_m:Q", "worst X / m", ".3f"),
            ("worst_error_y_m:Q", "worst Y / m", ".3f"),
        ),
    )
    dots = base.mark_circle(size=90, color=COLOURS[ADAPTIVE_LABEL])
    return finish(
        lines + dots + numbers,
        height=PROJECTION_PX,
        description=f"Worst error in {axis.upper()} against energy of the adaptive points by mode",
    )


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
        rows.append((str(query), modes, best))
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
    points = by_mode(evaluation).select(
        "mode",
        "mode_name",
        "line",
        pl.col(
            "energy_j", "rms_error_m", "worst_error_x_m", "worst_error_y_m", "aoa_estimates"
        ).round(4),
    )
    points = points.filter(pl.col("energy_j").is_not_null())
    most_j, most_m = (
        step * math.ceil(float(points.select(pl.col(name).max().fill_null(step)).item()) / step)
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
    x = Axis("energy_j", "energy of a trip / J", [*points["energy_j"]])
    y = Axis("rms_error_m", "RMS error / m", [0.0, most_m, *points["rms_error_m"]])
    base, lines, numbers = labelled(
        points,
        "mode",
        x,
        y,
        SPACE_PX,
        group="line",
        opacity=alt.condition(meets, alt.value(1.0), alt.value(0.18)),
    )
    dots = (
        base.mark_circle(size=70)
        .encode(
            color=coloured(NAMES),
            tooltip=tips(
                ("mode:O", "power mode"),
                ("mode_name:N", "name"),
                ("line:N", "method"),
                ("energy_j:Q", "energy / J", ".1f"),
                ("rms_error_m:Q", "RMS error / m", ".3f"),
                ("worst_error_x_m:Q", "worst X / m", ".3f"),
                ("worst_error_y_m:Q", "worst Y / m", ".3f"),
                ("aoa_estimates:Q", "angle estimates", ".0f"),
            ),
        )
        .add_params(budget, bound)
    )
    limits = alt.Chart(pl.DataFrame({"any": [0]})).mark_rule(strokeDash=[4, 3])
    vertical = limits.transform_calculate(limit=budget.name).encode(x=x.of(alt.X, "limit"))
    horizontal = limits.transform_calculate(limit=bound.name).encode(y=y.of(alt.Y, "limit"))
    return finish(
        vertical + horizontal + lines + dots + numbers,
        height=SPACE_PX,
        description="RMS error against energy of each operating point; the number is the mode",
    )
