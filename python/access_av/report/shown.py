"""Tables that both the terminal and the reports show: each has one definition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from access_av.tables.numbers import unsigned_zero

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from access_av.radio.upgrades import NextLevel
    from access_av.run.service_levels import Verdict
    from access_av.study.compare import Compared


class Badge(NamedTuple):
    """Text of a cell with the kind of its badge on a page: ``yes``, ``fit`` or ``no``."""

    text: str
    kind: str


@dataclass(frozen=True)
class Shown:
    """Table without markup.

    Attributes
    ----------
    head
        Names of the columns, with units.
    rows
        Cells of each row.
    texts
        Columns with text; the others are right-aligned.
    details
        Columns that a narrow terminal omits.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str | Badge]]
    texts: Sequence[int] = (0,)
    details: Sequence[int] = ()


def service_levels(verdicts: Iterable[Verdict]) -> Shown:
    """Returns 3GPP's positioning service levels with their results.

    "At least" is the lower end of the 95 % interval of the share within the error.

    Examples
    --------
    >>> from access_av.run.service_levels import of_bound
    >>> service_levels(of_bound([0.1], [0.1])).rows[0]
    ('1', '10', '95.0%', '100.00%', '100.00%', Badge(text='reached', kind='yes'))
    """
    rows = [
        (
            it.level.name,
            f"{it.level.accuracy_m:g}",
            f"{it.level.availability:.1%}",
            f"{it.share:.2%}",
            f"{it.least_share:.2%}",
            Badge(it.result.value, it.result.badge),
        )
        for it in verdicts
    ]
    head = ("level", "error / m", "target", "within", "at least", "result")
    return Shown(head, rows, (0, 5))


def next_level(found: NextLevel) -> Shown:
    """Returns the effect of each single change on a missed service level."""
    results = {True: Badge("yes", "yes"), False: Badge("no", "no")}
    rows = [(it.what, f"{it.share:.2%}", results[it.reaches]) for it in found.changes]
    return Shown((f"change (baseline {found.share:.2%})", "within", "reached"), rows, (0, 2))


def radio_heads(heads: Iterable[dict[str, Any]]) -> Shown:
    """Returns position, distance and SNR of each radio head of an error bound."""
    rows = []
    for it in heads:
        snr_db = (it["least_expected_snr_db"], it["most_expected_snr_db"])
        rows.append(
            (
                it["name"],
                str(it["pci"]),
                str(it["ssb_index"]),
                unsigned_zero(f"{it['x_m']:.1f}"),
                unsigned_zero(f"{it['y_m']:.1f}"),
                f"{it['nearest_m']:.0f} to {it['farthest_m']:.0f}",
                "–" if None in snr_db else f"{snr_db[0]:.0f} to {snr_db[1]:.0f}",
                f"{it['visible_share']:.1%}",
            )
        )
    head = ("radio head", "PCI", "SSB", "x / m", "y / m", "distance / m", "SNR / dB", "visible")
    return Shown(head, rows, details=(3, 4))


def compared(found: Sequence[Compared]) -> Shown:
    """Returns lost runs and percentiles of each variant, and the difference to the first one."""
    percents = found[0].percents
    rows = [
        (
            it.driven.name,
            Badge(it.lost_in_words(), "no") if it.driven.lost_runs else it.lost_in_words(),
            *(f"{it.driven.percentile(percent).value:.3f}" for percent in percents),
            it.reliability(),
            "–" if it.driven.energy_j is None else f"{it.driven.energy_j:.2f}",
            it.difference_in_words(),
        )
        for it in found
    ]
    last = len(percents) + 4
    head = ("variant", "lost", *(f"p{it:g} / m" for it in percents), "reliability", "energy / J",
            f"difference of p{percents[-1]:g}")  # fmt: skip
    return Shown(head, rows, (0, 1, last - 2, last))
