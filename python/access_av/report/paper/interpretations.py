"""First section of the report: the interpretations, and the claims under each."""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.paper import summary
from access_av.paper.chosen import entries
from access_av.paper.claims import NO_EVIDENCE, NOT_REPRODUCED, REPRODUCED, ROUNDED, Claim
from access_av.paper.statements import METHODS, claim_group, of_claim, paper_numbers
from access_av.report.chart import BLUE, GREEN, GREY, ORANGE, Spec, colours, finish
from access_av.report.labels import Axis, labelled
from access_av.report.parts import Html, badge, code, figure, records, small, table
from access_av.signal.methods import label
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation
    from access_av.paper.study import Study

# Claims of the overview chart (maximum error, average saving), and its height (px).
OVERVIEW_PX = 300
PROMISED = (("accuracy", 0), ("energy", -1))


def interpretations(study: Study) -> str:
    """Returns the section on the interpretations and the claim groups that hold under each."""
    rows = []
    for index, group in enumerate(summary.claim_groups(study), start=1):
        claims = study.of(group.interpretation.name)
        t_max = "kept" if group.keeps_t_max else "exceeded"
        if group.interpretation.keeps_t_max and not group.keeps_t_max:
            t_max = "claimed, and exceeded"
        shown = group.interpretation
        rows.append(
            {
                "Interpretation": Html(
                    f"<b>{index} {escape(shown.title)}</b>"
                    f"<small>{escape(shown.scenario.description)} · {code(shown.name)}</small>"
                ),
                "Accuracy claims": _met(group.accuracy),
                "Energy claims": _met(group.energy),
                "t_max": f"{t_max}, {group.longest_gap_s:.2f} s",
                "Algorithm 1": summary.controller_text(group.controller),
                "Claims": summary.counts_text(claims),
            }
        )
    unusable = "".join(
        f'<p class="note">Not evaluated: {escape(name)}: {escape(why)}</p>'
        for name, why in study.unusable.items()
    )
    return records(rows) + unusable


def overview(study: Study, specs: dict[str, Spec]) -> str:
    """Returns the chart of maximum error and average saving of each interpretation."""
    kinds = {"neither": GREY, "accuracy": BLUE, "energy": ORANGE, "both": GREEN}
    rows = []
    for index, group in enumerate(summary.claim_groups(study), start=1):
        by_id = {it.id: it.obtained for it in study.of(group.interpretation.name)}
        worst_m, saving = (by_id[claim_group(name)[at]] for name, at in PROMISED)
        if worst_m is not None and saving is not None:
            rows.append(
                {
                    "number": str(index),
                    "interpretation": group.interpretation.title,
                    "worst": worst_m,
                    "saving": saving,
                    "claims": list(kinds)[group.accuracy + 2 * group.energy],
                }
            )
    if not rows:
        return ""
    bound_m, stated = (of_claim(claim_group(name)[at]) for name, at in PROMISED)
    tolerance = of_claim(claim_group("energy")[-1], "tolerance")
    low, high = stated * (1 - tolerance), stated * (1 + tolerance)
    table = pl.DataFrame(rows)
    least_m = min(0.1, *table["worst"])
    x = Axis(
        "worst",
        "maximum error of adaptive MUSIC over all modes / m",
        [least_m, bound_m, *table["worst"]],
        log=True,
    )
    y = Axis("saving", "mean energy saving / %", [low, high, *table["saving"]])
    field = {"worst": x.domain[0], "right": bound_m, "saving": low, "high": high}
    promised = (
        alt.Chart(pl.DataFrame([field]))
        .mark_rect(opacity=0.18, color=GREEN)
        .encode(x=x.of(alt.X), x2="right:Q", y=y.of(alt.Y), y2="high:Q")
    )
    base, lines, numbers = labelled(
        table,
        "number",
        x,
        y,
        OVERVIEW_PX,
        tooltip=["interpretation:N", alt.Tooltip("worst:Q", format=".3f"),
                 alt.Tooltip("saving:Q", format=".1f"), "claims:N"],
    )  # fmt: skip
    dots = base.mark_circle(size=90, opacity=1.0).encode(
        color=colours("claims:N", kinds, title="claims met", orient="top")
    )
    specs["overview"] = finish(
        promised + lines + dots + numbers,
        height=OVERVIEW_PX,
        description="Maximum error and mean saving of each interpretation and of the paper",
    )
    return figure(
        "overview",
        "Each point is an interpretation, with its number in the table below. In the green field, "
        "maximum error (a1) and mean saving (e4) agree with the paper. The colour also considers "
        "the other claim of each group (a2, e3).",
    )


def chosen(study: Study) -> str:
    """Returns the table of assumptions, with the effects of alternatives."""
    if not study.effects:
        return records(
            [
                {"Unspecified": it["what"], "Chosen": it["value"], "Why": it["why"]}
                for it in entries()
            ]
        )
    driven = [
        {
            "Unspecified": Html(f"<b>{escape(each.what)}</b>") if each.is_shipped else "",
            "Chosen": each.value if each.is_shipped else f"instead {each.value}",
            "Why": each.why if each.is_shipped else "",
            "Angle estimates": f"{each.aoa_estimates:.0f}",
            "Worst / m": f"{each.worst_error_m:.2f}",
            "RMS / m": f"{each.rms_error_m:.3f} ± {each.rms_std_m:.3f}",
            "Every 80 ms: RMS / m": f"{each.fixed_rms_m:.3f}",
            "Every SSB: RMS / m": f"{each.every_ssb_rms_m:.3f}",
        }
        for each in study.effects
    ]
    return records(driven, numbers=(3, 4, 5, 6, 7))


def matrix(study: Study) -> str:
    """Returns the table of every claim under every interpretation."""
    columns = [study.of(each.interpretation.name) for each in study.evaluations]
    head = ("Claim", "Paper", *(str(index) for index in range(1, len(columns) + 1)))
    rows = [
        (
            Html(f"<b>{escape(_short(of[0]))}</b> <span>{escape(of[0].statement)}</span>"),
            Html(f"<span>{escape(_value(of[0], of[0].stated))}</span>"),
            *map(_cell, of),
        )
        for of in zip(*columns, strict=True)
    ]
    return table(head, rows, kind="matrix")


def claims(study: Study) -> str:
    """Returns the table of claims under the shown interpretation, with interval and evidence."""
    rows = []
    for claim in study.of(study.shown.interpretation.name):
        turns = [badge("depends on the seed", "fit")] if claim.seed_sensitive else []
        verdict = small(Html(" ".join([_verdict(claim), *turns])))
        if claim.seeds_met:
            verdict = small(verdict, f"met with {claim.seeds_met} seeds")
        below = []
        if isinstance(claim.interval, list):
            below.append(" … ".join(map(value_text, claim.interval)))
        if claim.deviation is not None and claim.tolerance is not None:
            below.append(_deviation_text(claim.deviation, claim.tolerance))
        where = Html(f"{escape(claim.paper_section)} · {code(claim.id)}")
        rows.append(
            {
                "Claim": small(Html(f"<b>{escape(claim.statement)}</b>"), where, claim.note),
                "Paper": _value(claim, claim.stated),
                "Obtained": small(_value(claim, claim.obtained), *below),
                "Unit": claim.unit,
                "Evidence": claim.evidence,
                "Verdict": verdict,
            }
        )
    return records(rows)


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
                f"{mode.number} {mode.name}",
                _pair(paper_mhz, mode.cpu_hz / 1e6),
                *(_pair(*each) for each in zip(paper_ms, times, strict=True)),
            )
        )
    head = ("Mode", "Clock / MHz", *(f"{label(method)} / ms" for method in METHODS))
    return table(head, rows, numbers=range(1, 2 + len(METHODS)))


def _pair(stated: float | None, used: float) -> str:
    """Returns the value of paper and platform as text: one if they agree, otherwise both."""
    if stated is not None and math.isclose(stated, used, rel_tol=ROUNDED):
        return f"{stated:g}"
    return f"{'–' if stated is None else f'{stated:g}'} (platform {used:g})"


def _value(claim: Claim, value: object) -> str:
    """Returns the stated or obtained value of a claim as text.

    The table of power modes (claim x2) is only named, because the page shows it above the claims.
    """
    if claim.id.startswith("x2_") and isinstance(value, list):
        return "table of power modes"
    return summary.shown_value(value)


def _short(claim: Claim) -> str:
    number, *words = claim.id.split("_")
    # Two claims have the number e3: one about the saving, one about the angle estimates.
    return f"{number} {words[-1]}" if number == "e3" and words[-1] == "executions" else number


def _kind(claim: Claim) -> str:
    """Returns the badge of a claim; arithmetic and construction have separate badges."""
    if claim.evidence in NO_EVIDENCE and claim.is_judged:
        return claim.evidence.split()[-1]
    return {REPRODUCED: "yes", NOT_REPRODUCED: "no"}.get(claim.verdict, "fit")


def _verdict(claim: Claim) -> Html:
    given = claim.evidence in NO_EVIDENCE and claim.is_judged
    text = f"{claim.evidence}: {claim.verdict}" if given else claim.verdict
    return badge(text, _kind(claim))


def _deviation_text(deviation: float, tolerance: float) -> str:
    return (
        f"deviation {deviation:.1%}, no tolerance"
        if tolerance < 0.01
        else (f"deviation {deviation:.0%}, tolerance {tolerance:.0%}")
    )


def _met(held: bool) -> Html:
    return badge("hold", "yes") if held else badge("do not hold", "no")


def _cell(claim: Claim) -> Html:
    """Returns value and verdict of a claim as a small table cell."""
    if not claim.is_judged:
        return badge("–", "fit")
    sign = summary.SIGNS[claim.verdict]
    if claim.seed_sensitive:
        sign += f" {claim.seeds_met or '?'}"
    plain = isinstance(claim.obtained, (int, float))
    below = [summary.shown_value(claim.obtained)] if plain else []
    return small(badge(sign, _kind(claim)), *below)
