"""Comparison of variants as a table of a report."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report.parts import section, table
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.study.compare import Compared


def compared_section(found: Sequence[Compared], combined: str = "") -> str:
    """Returns a section of the report; empty without variants.

    ``combined`` states the combinations of the variants.
    """
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
        "Variant", *(f"Percentile {percent:g}" for percent in percents),
        f"Percentile {percents[-1]:g}, difference to the first", "Reliability", "Energy of a trip",
    )  # fmt: skip
    return section(
        "Comparison of variants",
        (f"{combined}. " if combined else "")
        + f"Horizontal error, {found[0].driven.runs} {found[0].driven.rows} each, in equal "
        "environments. Differences are paired, with 95 % intervals.",
        table(head, rows, numbers=range(1, len(percents) + 1)),
    )
