"""Report sections on the controller's contribution and on the proposed method."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.paper import summary
from access_av.report.chart import BLUE, GREEN, GREY, ORANGE, PURPLE, Spec, colours, finish
from access_av.report.parts import badge, figure, folded, records
from access_av.tables.numbers import number, unsigned_zero

if TYPE_CHECKING:
    from access_av.paper.study import Study

FIXED, INTERPRETATION, CONSTANT, OURS = NAMES = (
    "fixed interval", "interpretation", "constant instead", "ours",
)  # fmt: skip
# Effects of Algorithm 1: the value of ``matters`` is -1, 0 or 1.
EFFECTS = (("harms", "no"), ("no difference", "fit"), ("helps", "yes"))


def contribution(study: Study, specs: dict[str, Spec]) -> str:
    """Returns the section that compares each controller with a constant, and fixed intervals."""
    specs["ablation"] = _gain_chart(study)
    specs["front"] = _front_chart(study)
    titles = {each.interpretation.name: each.interpretation.title for each in study.evaluations}
    rows = [
        {
            "Interpretation": titles[each.interpretation],
            "Mode": str(each.mode),
            "Angle estimates": f"{each.aoa_estimates:.0f}",
            "Constant: angle estimates": f"{each.constant_aoa_estimates:.0f} at "
            f"{each.constant_ms:.0f} ms",
            "RMS / m": number(each.rms_error_m),
            "Constant: RMS / m": number(each.constant_rms_m),
            "Gain / m (95 %)": _signed(each.gain_m, each.gain_low_m, each.gain_high_m),
            "Algorithm 1": badge(*EFFECTS[each.matters + 1]),
        }
        for each in study.ablations
    ]
    every = folded("Every interpretation and mode as a table", records(rows, numbers=(1, 2, 4, 5)))
    return (
        '<div class="charts">'
        + figure("ablation", "RMS error with the constant minus RMS error with Algorithm 1, "
                 "equal runs; positive: Algorithm 1 helps. Lines are paired 95 % intervals.",
                 "Algorithm 1 compared with a constant with as many angle estimates")
        + figure("front", "Points further down and left are better. The line is MUSIC at fixed "
        "intervals.",
                 "Error against angle estimates")
        + f"</div>{every}"
    )  # fmt: skip


def fair(study: Study) -> str:
    """Returns the section that compares both methods with equal information."""
    names = {
        "paper": "the paper's interpretation",
        "ours": "proposed method",
        "one angle": "proposed method with one angle, at the start",
        "bound": "lower bound of the tracker’s model, with an angle at every SSB",
    }
    rows = [
        {
            "Odometer": "0.3 %, 1 cm/√m; start 0.1 m, 0.02 rad"
            if each.real_odometer
            else "exact, exact start",
            "Road": "known" if each.map else "not known",
            "Who": names[each.who],
            "Angle estimates": f"{each.aoa_estimates:.0f}",
            "RMS / m": number(each.rms_error_m, 4 if each.rms_error_m < 0.01 else 3),
            "95 %": "–" if each.who == "bound" else f"{each.rms_low_m:.3f} … {each.rms_high_m:.3f}",
            "Worst / m": number(each.worst_error_m),
        }
        for each in study.equal_information
    ]
    note = (
        "Without a road map, the bound is the mean over all roads of the tracker’s curvature "
        "prior. On this nearly straight road, the error of a localizer can be smaller."
    )
    text = f"<p>{escape(summary.fair_text(study))} {note}</p>"
    return text + records(rows, numbers=(3, 4, 6))


def ours(study: Study) -> str:
    """Returns the section on the proposed method and the paper's adaptive point in each mode."""
    rows = [
        {
            "Mode": str(each.mode) if each.map else f"{each.mode}, road unknown",
            "Angle estimates, proposed / paper's": f"{each.aoa_estimates:.0f} / "
            f"{each.papers_aoa_estimates:.0f}",
            "Energy / J": f"{number(each.energy_j, 1)} / {number(each.papers_energy_j, 1)}",
            "Worst error / m": f"{each.worst_error_m:.3f} / {each.papers_worst_m:.3f}",
            "RMS / m": f"{each.rms_error_m:.3f} / {each.papers_rms_m:.3f}",
            "RMS error reduction / m (95 %)": _signed(
                each.rms_error_reduction_m,
                each.rms_error_reduction_low_m,
                each.rms_error_reduction_high_m,
            ),
            "Ours": badge("better in both", "yes")
            if each.is_better
            else badge("not in both", "no"),
        }
        for each in study.proposed_vs_paper
    ]
    return f"<p>{escape(summary.ours_text(study))}</p>" + records(rows)


def _signed(value: float, low: float, high: float) -> str:
    middle, least, most = (unsigned_zero(f"{it:+.3f}") for it in (value, low, high))
    return f"{middle} ({least} … {most})"


def _gain_chart(study: Study) -> Spec:
    titles = {each.interpretation.name: each.interpretation.title for each in study.evaluations}
    rows = pl.DataFrame(
        [
            {
                "interpretation": titles[each.interpretation],
                "mode": each.mode,
                "gain": each.gain_m,
                "low": each.gain_low_m,
                "high": each.gain_high_m,
                "what": EFFECTS[each.matters + 1][0],
            }
            for each in study.ablations
        ]
    ).with_columns(pl.col(pl.Float64).round(4))
    order = [each.interpretation.title for each in study.evaluations]
    base = alt.Chart(rows).encode(
        y=alt.Y("interpretation:N", sort=order, title=None, axis=alt.Axis(labelLimit=190)),
        yOffset=alt.YOffset("mode:N"),
        color=colours(
            "what:N", {"helps": GREEN, "no difference": GREY, "harms": ORANGE}, orient="top"
        ),
        tooltip=["interpretation:N", "mode:O", "gain:Q", "low:Q", "high:Q"],
    )
    scale = alt.Scale(type="symlog", constant=0.05)
    span = base.mark_rule(strokeWidth=2).encode(
        x=alt.X("low:Q", title="reduction of the RMS error / m", scale=scale), x2="high:Q"
    )
    dots = base.mark_circle(size=40).encode(x="gain:Q")
    zero = alt.Chart(pl.DataFrame({"zero": [0.0]})).mark_rule(strokeDash=[4, 3]).encode(x="zero:Q")
    return finish(
        zero + span + dots,
        height=34 * len(order) + 60,
        description="Reduction of the RMS error by Algorithm 1, compared with a constant, by "
        "interpretation and mode",
    )


def _front_chart(study: Study) -> Spec:
    shown = study.shown.interpretation.name
    rows = [
        (FIXED, float(drives.aoa_estimates[0]), float(drives.rms_error_m[0]), f"{interval_ms:g} ms")
        for interval_ms, drives in study.front
    ]
    rms_m = study.shown.outcome.every_ssb["music"].rms_error_m[0]
    rows += [
        (INTERPRETATION, float(drives.aoa_estimates[0]), float(drives.rms_error_m[0]),
         f"{each.interpretation.title}, mode {mode}")
        for each in study.evaluations
        if each.outcome.every_ssb["music"].rms_error_m[0] == rms_m  # in the same environment
        for mode, drives in each.outcome.adaptive.items()
    ]  # fmt: skip
    rows += [
        (CONSTANT, each.constant_aoa_estimates, each.constant_rms_m,
         f"constant {each.constant_ms:.0f} ms in {each.interpretation}")
        for each in study.ablations if each.interpretation == shown
    ]  # fmt: skip
    rows += [
        (OURS, each.aoa_estimates, each.rms_error_m,
         f"proposed, mode {each.mode}" + ("" if each.map else ", road unknown"))
        for each in study.proposed_vs_paper
    ]  # fmt: skip
    columns = ["what", "aoa_estimates", "rms", "name"]
    points = pl.DataFrame(rows, schema=columns, orient="row").with_columns(
        pl.col(pl.Float64).round(4)
    )
    x = alt.X("aoa_estimates:Q", title="angle estimates in a trip", scale=alt.Scale(type="log"))
    y = alt.Y("rms:Q", title="RMS error / m", scale=alt.Scale(type="log"))
    legend = alt.Legend(title=None, orient="top")
    dots = (
        alt.Chart(points)
        .mark_point(filled=True, size=60)
        .encode(
            x=x,
            y=y,
            color=colours(
                "what:N", dict(zip(NAMES, (GREY, BLUE, ORANGE, GREEN), strict=True)), orient="top"
            ),
            shape=alt.Shape("what:N", scale=alt.Scale(domain=list(NAMES)), legend=legend),
            tooltip=["name:N", "aoa_estimates:Q", "rms:Q"],
        )
    )
    line = (
        alt.Chart(points.filter(what=FIXED))
        .mark_line(color=PURPLE, strokeWidth=1)
        .encode(x=x, y=y, order="aoa_estimates:Q")
    )
    return finish(
        line + dots,
        height=320,
        description="RMS error against angle estimates: fixed intervals, interpretations, "
        "proposed method",
    )
