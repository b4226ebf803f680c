"""First section of the report: the interpretations, and the claims under each."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.paper import summary
from access_av.paper.chosen import entries
from access_av.paper.claims import NO_EVIDENCE, NOT_REPRODUCED, REPRODUCED
from access_av.paper.margins import ROUNDED
from access_av.paper.statements import METHODS, of_claim, paper_numbers
from access_av.paper.statements import half as half_of
from access_av.report.chart import BLUE, GREEN, GREY, ORANGE, finish
from access_av.report.labels import domain, layers, placed
from access_av.report.parts import badge, figure, table
from access_av.signal.methods import label
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from access_av.paper.claims import Claim
    from access_av.paper.evaluation import Evaluation
    from access_av.paper.study import Study
    from access_av.report.chart import Spec

# Claims of the overview chart (maximum error, average saving), and its height (px).
OVERVIEW_PX = 300
PROMISED = (("accuracy", 0), ("energy", -1))


def interpretations(study: Study) -> str:
    """Returns the section on the interpretations and the claim groups that hold under each."""
    rows = []
    for index, half in enumerate(summary.halves(study), start=1):
        claims = study.of(half.interpretation.name)
        t_max = "kept" if half.keeps_t_max else "exceeded"
        if half.interpretation.keeps_t_max and not half.keeps_t_max:
            t_max = "claimed, and exceeded"
        rows.append(
            (
                f"<b>{index} {escape(half.interpretation.title)}</b>"
                f"<small>{escape(half.interpretation.scenario.description)} · "
                f"<code>{escape(half.interpretation.name)}</code></small>",
                _met(half.accuracy),
                _met(half.energy),
                f"{t_max}, {half.longest_gap_s:.2f} s",
                escape(summary.controller_text(half.controller)),
                escape(summary.counts_text(claims)),
            )
        )
    head = (
        "Interpretation",
        "Accuracy half",
        "Energy half",
        "t_max",
        "Algorithm 1",
        "Claims",
    )
    unusable = "".join(
        f'<p class="note">Not evaluated: {escape(name)}: {escape(why)}</p>'
        for name, why in study.unusable.items()
    )
    return table(head, rows) + unusable


def overview(study: Study, specs: dict[str, Spec]) -> str:
    """Returns the chart of maximum error and average saving of each interpretation."""
    rows = []
    for index, half in enumerate(summary.halves(study), start=1):
        by_id = {it.id: it.obtained for it in study.of(half.interpretation.name)}
        worst_m, saving = (by_id[half_of(name)[at]] for name, at in PROMISED)
        if worst_m is not None and saving is not None:
            rows.append(
                {
                    "number": str(index),
                    "interpretation": half.interpretation.title,
                    "worst": worst_m,
                    "saving": saving,
                    "keeps": ("neither", "accuracy", "saving", "both")[
                        half.accuracy + 2 * half.energy
                    ],
                }
            )
    if not rows:
        return ""
    bound_m, stated = (of_claim(half_of(name)[at]) for name, at in PROMISED)
    tolerance = of_claim(half_of("energy")[-1], "tolerance")
    y = {"low": stated * (1 - tolerance), "high": stated * (1 + tolerance)}
    table = pl.DataFrame(rows)
    least_m = min(0.1, *table["worst"])
    x_domain = domain([least_m, bound_m, *table["worst"]], log=True)
    y_domain = domain([*y.values(), *table["saving"]])
    x_axis = alt.X(
        "worst:Q",
        title="worst error of adaptive MUSIC, any mode / m",
        scale=alt.Scale(type="log", nice=False, domain=x_domain),
    )
    y_axis = alt.Y(
        "saving:Q",
        title="energy saved, average / %",
        scale=alt.Scale(zero=False, nice=False, domain=y_domain),
    )
    promised = (
        alt.Chart(pl.DataFrame([{"worst": x_domain[0], "right": bound_m,
                                 "saving": y["low"], "high": y["high"]}]))
        .mark_rect(opacity=0.18, color=GREEN)
        .encode(x=x_axis, x2="right:Q", y=y_axis, y2="high:Q")
    )  # fmt: skip
    axes = ("worst", x_domain, True), ("saving", y_domain, False)
    base = alt.Chart(placed(table, "number", *axes, OVERVIEW_PX)).encode(
        x=x_axis,
        y=y_axis,
        tooltip=["interpretation:N", alt.Tooltip("worst:Q", format=".3f"),
                 alt.Tooltip("saving:Q", format=".1f"), "keeps:N"],
    )  # fmt: skip
    kinds = ["neither", "accuracy", "saving", "both"]
    dots = base.mark_circle(size=90, opacity=1.0).encode(
        color=alt.Color(
            "keeps:N",
            scale=alt.Scale(domain=kinds, range=[GREY, BLUE, ORANGE, GREEN]),
            legend=alt.Legend(title="keeps", orient="top"),
        )
    )
    lines, numbers = layers(base)
    specs["overview"] = finish(
        promised + lines + dots + numbers,
        height=OVERVIEW_PX,
        description="Worst error and average saving of each interpretation, and the values that "
        "the paper claims",
    )
    return figure(
        "overview",
        "Each dot is an interpretation, with its number in the table below. In the green area, "
        "the worst error (a1) and the mean saving (e4) are as claimed. Accuracy and saving each "
        "require one further claim (a2, e3).",
    )


def chosen(study: Study) -> str:
    """Returns the table of assumptions, with the effects of alternatives."""
    head = ("Unspecified", "Chosen", "Why")
    if not study.effects:
        rows = [tuple(escape(it[key]) for key in ("what", "value", "why")) for it in entries()]
        return table(head, rows)
    driven = [
        (
            f"<b>{escape(each.what)}</b>" if each.is_shipped else "",
            escape(each.value) if each.is_shipped else f"instead {escape(each.value)}",
            escape(each.why) if each.is_shipped else "",
            f"{each.aoa_estimates:.0f}",
            f"{each.worst_error_m:.2f}",
            f"{each.rms_error_m:.3f} ± {each.rms_std_m:.3f}",
            f"{each.fixed_rms_m:.3f}",
            f"{each.every_ssb_rms_m:.3f}",
        )
        for each in study.effects
    ]
    results = (
        "Angle estimates",
        "Worst / m",
        "RMS / m",
        "Every 80 ms: RMS / m",
        "Every SSB: RMS / m",
    )
    return table((*head, *results), driven, numbers=(3, 4, 5, 6, 7))


def matrix(study: Study) -> str:
    """Returns the table of every claim under every interpretation."""
    columns = [study.of(each.interpretation.name) for each in study.evaluations]
    head = ("Claim", "Paper", *(str(index) for index in range(1, len(columns) + 1)))
    rows = [
        (
            f"<b>{escape(_short(claims[0]))}</b> <span>{escape(claims[0].statement)}</span>",
            f"<span>{_value(claims[0], claims[0].stated)}</span>",
            *(_cell(claim) for claim in claims),
        )
        for claims in zip(*columns, strict=True)
    ]
    return table(head, rows, kind="matrix")


def claims(study: Study) -> str:
    """Returns the table of claims under the shown interpretation, with interval and evidence."""
    rows = []
    for claim in study.of(study.shown.interpretation.name):
        turns = " " + badge("depends on the seed", "fit") if claim.seed_sensitive else ""
        if claim.seeds_met:
            turns += f"<small>met with {claim.seeds_met} seeds</small>"
        obtained = _value(claim, claim.obtained)
        if isinstance(claim.interval, list):
            low, high = (value_text(end) for end in claim.interval)
            obtained += f"<small>{low} … {high}</small>"
        if claim.deviation is not None and claim.tolerance is not None:
            obtained += f"<small>{_deviation_text(claim.deviation, claim.tolerance)}</small>"
        rows.append(
            (
                f"<b>{escape(claim.statement)}</b><small>{escape(claim.paper_section)} · "
                f"<code>{escape(claim.id)}</code></small><small>{escape(claim.note)}</small>",
                _value(claim, claim.stated),
                obtained,
                escape(claim.unit),
                escape(claim.evidence),
                _verdict(claim) + turns,
            )
        )
    return table(("Claim", "Paper", "Obtained", "Unit", "Evidence", "Verdict"), rows)


def tolerances() -> str:
    """Returns the reason for each tolerance."""
    return " ".join(f"{it['reason']}" for it in paper_numbers()["tolerances"].values())


def power_modes(evaluation: Evaluation) -> str:
    """Returns the power modes as a table: the paper's values, and those of the platform."""
    stated = {int(row[0]): row[1:] for row in of_claim("x2_power_modes")}
    rows = []
    for mode in evaluation.platform.modes:
        paper_mhz, *paper_ms = stated.get(mode.number, [None] * (1 + len(METHODS)))
        times = [mode.base_wake_up_ms[method] for method in METHODS]
        rows.append(
            (
                f"{mode.number} {escape(mode.name)}",
                _pair(paper_mhz, mode.cpu_hz / 1e6),
                *(_pair(*each) for each in zip(paper_ms, times, strict=True)),
            )
        )
    head = ("Mode", "Clock / MHz", *(f"{label(method)} / ms" for method in METHODS))
    return table(head, rows, numbers=range(1, 2 + len(METHODS)))


def _pair(stated: float | None, used: float) -> str:
    """Returns one value if paper and platform agree, otherwise both."""
    if stated is not None and math.isclose(stated, used, rel_tol=ROUNDED):
        return f"{stated:g}"
    return f"{'–' if stated is None else f'{stated:g}'} (platform {used:g})"


def _value(claim: Claim, value: object) -> str:
    """Returns a stated or obtained value; a table of settings is shown once, above the claims."""
    if claim.id.startswith("x2_") and isinstance(value, list):
        return "table of power modes"
    return escape(summary.shown_value(value))


def _short(claim: Claim) -> str:
    number, *words = claim.id.split("_")
    # Two claims have the number e3: one about the saving, one about the angle estimates.
    return f"{number} {words[-1]}" if number == "e3" and words[-1] == "executions" else number


def _kind(claim: Claim) -> str:
    """Returns the badge of a claim; arithmetic and construction have separate badges."""
    if claim.evidence in NO_EVIDENCE and claim.is_judged:
        return claim.evidence.split()[-1]
    return {REPRODUCED: "yes", NOT_REPRODUCED: "no"}.get(claim.verdict, "fit")


def _verdict(claim: Claim) -> str:
    given = claim.evidence in NO_EVIDENCE and claim.is_judged
    text = f"{claim.evidence}: {claim.verdict}" if given else claim.verdict
    return badge(text, _kind(claim))


def _deviation_text(deviation: float, tolerance: float) -> str:
    return (
        f"deviation {deviation:.1%}, tolerance {tolerance:.3g}"
        if tolerance < 0.01
        else (f"deviation {deviation:.0%}, tolerance {tolerance:.0%}")
    )


def _met(held: bool) -> str:
    return badge("holds", "yes") if held else badge("does not", "no")


def _cell(claim: Claim) -> str:
    """Returns value and verdict of a claim as a small table cell."""
    if not claim.is_judged:
        return badge("–", "fit")
    sign = summary.SIGNS[claim.verdict]
    if claim.seed_sensitive:
        sign += f" {claim.seeds_met or '?'}"
    plain = isinstance(claim.obtained, (int, float))
    value = f"<small>{escape(summary.shown_value(claim.obtained))}</small>" if plain else ""
    return badge(sign, _kind(claim)) + value
