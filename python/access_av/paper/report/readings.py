"""The report's first section: the readings, and the claims under each."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.paper import summary
from access_av.paper.claims import NOT_JUDGED
from access_av.report.parts import badge, table, value_text

if TYPE_CHECKING:
    from access_av.paper.claims import Claim
    from access_av.paper.study import Study


def readings(study: Study) -> str:
    """What the readings are, which halves hold under each, and what carries them."""
    rows = []
    for index, half in enumerate(summary.halves(study), start=1):
        claims = study.of(half.reading.name)
        t_max = "kept" if half.keeps_t_max else "exceeded"
        if half.reading.keeps_t_max and not half.keeps_t_max:
            t_max = "claimed, and exceeded"
        rows.append(
            (
                f"<b>{index} {escape(half.reading.title)}</b>"
                f"<small>{escape(half.reading.scenario.description)} · "
                f"<code>{escape(half.reading.name)}</code></small>",
                _met(half.accuracy),
                _met(half.energy),
                f"{t_max}, {half.longest_gap_s:.2f} s",
                escape(summary.controller_text(half.controller)),
                escape(summary.counts_text(claims)),
            )
        )
    head = (
        "Reading",
        "Accuracy half",
        "Energy half",
        "t_max",
        "Algorithm 1",
        "Claims met",
    )
    unusable = "".join(
        f'<p class="note">Not evaluated: {escape(name)}: {escape(why)}</p>'
        for name, why in study.unusable.items()
    )
    return table(head, rows) + unusable


def matrix(study: Study) -> str:
    """Every claim under every reading."""
    columns = [study.of(each.reading.name) for each in study.evaluations]
    head = ("Claim", "Paper", *(str(index) for index in range(1, len(columns) + 1)))
    rows = [
        (
            f"<b>{escape(_short(claims[0]))}</b> <span>{escape(claims[0].says)}</span>",
            f"<span>{escape(value_text(claims[0].stated))}</span>",
            *(_cell(claim) for claim in claims),
        )
        for claims in zip(*columns, strict=True)
    ]
    return table(head, rows, kind="matrix")


def claims(study: Study) -> str:
    """The claims under the shown reading, with intervals and what each verdict is worth."""
    rows = []
    for claim in study.of(study.shown.reading.name):
        kind = "fit" if claim.verdict == NOT_JUDGED else "yes" if claim.reproduced else "no"
        turns = " " + badge("turns with the seed", "fit") if claim.turns_with_seed else ""
        if claim.seeds_met:
            turns += f"<small>met with {claim.seeds_met} seeds</small>"
        obtained = escape(value_text(claim.obtained))
        if isinstance(claim.interval, list):
            low, high = (value_text(end) for end in claim.interval)
            obtained += f"<small>{low} … {high}</small>"
        rows.append(
            (
                f"<b>{escape(claim.says)}</b><small>{escape(claim.where)} · "
                f"<code>{escape(claim.id)}</code></small><small>{escape(claim.note)}</small>",
                escape(value_text(claim.stated)),
                obtained,
                escape(claim.unit),
                escape(claim.evidence),
                badge(claim.verdict, kind) + turns,
            )
        )
    return table(("Claim", "Paper", "Obtained", "Unit", "Evidence", "Verdict"), rows)


def _short(claim: Claim) -> str:
    number, *words = claim.id.split("_")
    # Two claims are e3: one of the saving, one of the executions.
    return f"{number} {words[-1]}" if number == "e3" and words[-1] == "executions" else number


def _met(held: bool) -> str:
    return badge("holds", "yes") if held else badge("does not", "no")


def _cell(claim: Claim) -> str:
    """A claim's value and verdict in a small cell."""
    if claim.verdict == NOT_JUDGED:
        return badge("–", "fit")
    sign = "✓" if claim.reproduced else "✗"
    if claim.turns_with_seed:
        sign += f" {claim.seeds_met or '?'}"
    plain = isinstance(claim.obtained, (int, float))
    value = f"<small>{escape(value_text(claim.obtained))}</small>" if plain else ""
    return badge(sign, "yes" if claim.reproduced else "no") + value
