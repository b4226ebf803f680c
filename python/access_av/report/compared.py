"""Comparison of variants as a table of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.report.parts import section, shown
from access_av.report.shown import compared

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.study.compare import Compared


def compared_section(found: Sequence[Compared], combined: str = "") -> str:
    """Returns a section of the report; empty without variants.

    ``combined`` states the combinations of the variants.
    """
    if not found:
        return ""
    return section(
        "Comparison of variants",
        (f"{combined}. " if combined else "")
        + f"Percentiles of the horizontal error, {found[0].driven.runs} {found[0].driven.rows} "
        "each, in equal environments. Differences to the first variant are paired, with 95 % "
        "intervals.",
        shown(compared(found)),
    )
