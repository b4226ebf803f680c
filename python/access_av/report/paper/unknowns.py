"""Report section on the sensitivity of the claims."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.paper.open_choices import GATE, OPEN_CONTROLLER, OPEN_WORLD
from access_av.paper.unknowns import MATTERS, Unknowns
from access_av.report.chart import BLUE, GREY, Spec, finish
from access_av.report.parts import figure, folded, records

if TYPE_CHECKING:
    from access_av.paper.study import Study

DIMENSIONS = (*OPEN_WORLD, *OPEN_CONTROLLER, GATE)
# Minimum shown total index.
LEAST_TOTAL = 0.05
# Minimum width (px) of the chart of indices with numbers; below it they would overlap.
NUMBERS_PX = 500
SOBOL_CAPTION = (
    "Total Sobol index of each claim's margin. Narrow screens show the numbers in tooltips only."
)


def unknowns(study: Study, specs: dict[str, Spec]) -> str:
    """Returns the section with the Sobol indices of each claim, and the share in which it holds."""
    found = study.sensitivity
    if found is None:
        return (
            "<p>Not computed. <code>access-av paper evaluate --sensitivity</code> draws "
            "interpretations from the ranges of the unspecified parameters, and computes the "
            "sensitivity of each claim to each parameter.</p>"
        )
    specs["sobol"] = _index_chart(found)
    specs["share"] = _share_chart(found)
    ranges = [{"Unspecified parameter": it.label, "Range": it.range_text} for it in DIMENSIONS]
    matter = found.matter
    widest = matter.select(0.5 * (pl.col("total_high") - pl.col("total_low")).max()).item() or 0.0
    widths = (
        f"For claims that are neither by arithmetic nor by construction, {matter.height} total "
        f"indices are {MATTERS:g} or more; their 95 % intervals are at most ± {widest:.3f} wide."
    )
    return (
        f"<p>{len(found.sample.world)} interpretations of {found.runs} runs each, drawn from the "
        "ranges below. A total index of 0.6 means: 60 % of the variance of the claim's margin "
        "involves this parameter, alone or together with others. Cells below "
        f"{LEAST_TOTAL:.0%} are left empty; “unexplained” is the share of the variance that the "
        "expansion does not explain.</p>"
        + f"<p>{escape(widths)}</p>"
        + figure("sobol", SOBOL_CAPTION, "Sensitivity of the claims")
        + figure(
            "share",
            "Bars are 95 % intervals over environments.",
            "Share of the drawn interpretations in which each claim holds",
        )
        + folded("The ranges", records(ranges))
    )


def _short(claim: str) -> str:
    return claim.split("_")[0] + " " + " ".join(claim.split("_")[1:3])


def _index_chart(found: Unknowns) -> Spec:
    labels = {each.key: each.label for each in DIMENSIONS}
    rows = [
        {
            "claim": _short(each["claim"]),
            "dimension": labels[each["dimension"]],
            "total": round(each["total"], 3),
            "first": round(each["first"], 3),
            "interval": f"{each['total_low']:.2f} … {each['total_high']:.2f}",
        }
        for each in found.indices.iter_rows(named=True)
    ]
    explained = found.claims.select("claim", "explained_variance").drop_nulls()
    rows += [
        {"claim": _short(claim), "dimension": "unexplained", "total": round(1.0 - share, 3),
         "first": 0.0, "interval": ""}
        for claim, share in explained.iter_rows()
    ]  # fmt: skip
    table = pl.DataFrame(rows).filter(pl.col("total") >= LEAST_TOTAL)
    order = [*labels.values(), "unexplained"]
    base = alt.Chart(table).encode(
        y=alt.Y("dimension:N", sort=order, title=None, axis=alt.Axis(labelLimit=170)),
        x=alt.X("claim:N", title=None, sort=None, axis=alt.Axis(labelAngle=-40, labelLimit=130)),
        tooltip=["claim:N", "dimension:N", "first:Q", "total:Q", "interval:N"],
    )
    cells = base.mark_rect().encode(
        color=alt.Color(
            "total:Q",
            scale=alt.Scale(range=["#e6eef8", BLUE], domain=[0.0, 1.0]),
            legend=alt.Legend(title="total index"),
        )
    )
    visible = alt.ExprRef(f"width < {NUMBERS_PX} ? 0 : 1")
    numbers = base.mark_text(fontSize=10, opacity=visible).encode(
        text=alt.Text("total:Q", format=".2f"),
        color=alt.condition("datum.total > 0.5", alt.value("white"), alt.value("#16202c")),
    )
    return finish(
        cells + numbers, height=380, description="Total Sobol indices of the claims' margins"
    )


def _share_chart(found: Unknowns) -> Spec:
    rows = found.claims.select(
        pl.col("claim").map_elements(_short, return_dtype=pl.String),
        share=pl.col("share_met").round(4),
        low=pl.col("share_met_low").round(4),
        high=pl.col("share_met_high").round(4),
    )
    base = alt.Chart(rows).encode(
        y=alt.Y("claim:N", sort=None, title=None, axis=alt.Axis(labelLimit=170)),
        tooltip=["claim:N", "share:Q", "low:Q", "high:Q"],
    )
    bars = base.mark_bar(color=BLUE, cornerRadiusEnd=2).encode(
        x=alt.X("share:Q", title="share of the interpretations", scale=alt.Scale(domain=[0.0, 1.0]))
    )
    ends = base.mark_rule(color=GREY, strokeWidth=3).encode(x="low:Q", x2="high:Q")
    return finish(
        bars + ends, height=320, description="Share of interpretations in which a claim holds"
    )
