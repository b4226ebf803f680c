"""Variants side by side, as a table of a page."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report.parts import section, table
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.study.compare import Compared


def compared_section(found: Sequence[Compared]) -> str:
    """A section of the page; nothing without variants."""
    if not found:
        return ""
    percents = found[0].percents
    rows = [
        (
            escape(it.driven.name),
            *(f"{it.driven.percentile(percent).value:.3f} m" for percent in percents),
            escape(it.in_words()),
            escape(it.reliability()),
            "–" if it.driven.energy_j is None else f"{number(it.driven.energy_j, 2)} J",
        )
        for it in found
    ]
    head = (
        "Variant", *(f"{percent:g} % within" for percent in percents),
        f"{percents[-1]:g} %, against the first", "Reliability", "Energy of a trip",
    )  # fmt: skip
    return section(
        "Side by side",
        f"{found[0].driven.runs} {found[0].driven.rows} of each, in the same worlds; differences "
        "are of pairs of them, with 95 % intervals.",
        table(head, rows, numbers=range(1, len(percents) + 1)),
    )
