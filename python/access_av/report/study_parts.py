"""Functions that several sections of a study's report use."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report.parts import badge, table
from access_av.verdicts import NotOk

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from access_av.economics.carbon import Range
    from access_av.study.points import Point
    from access_av.study.study_result import Study
    from access_av.study.trips import Driven


def lost(driven: Driven) -> str:
    """Returns the number of lost drives as text."""
    runs = driven.lost_runs
    return badge(f"LOST in {runs} of {driven.runs}", "no") if runs else f"0 of {driven.runs}"


def reliability_rows(drives: Iterable[Driven]) -> list[tuple[str, ...]]:
    """Returns the reliability of each variant: lost drives, state ``ok``, reasons, errors."""
    rows = []
    for driven in drives:
        reasons, beyond = driven.not_ok_shares, driven.exceedances
        shares = [None] * len(NotOk) if reasons is None else [reasons[it] for it in NotOk]
        rows.append(
            (
                escape(driven.name),
                lost(driven),
                ok(driven),
                *("–" if it is None else f"{it:.1%}" for it in shares),
                "–" if beyond is None else f"{beyond:,}",
            )
        )
    return rows


def ok(driven: Driven) -> str:
    """Returns the share of the time in state ``ok`` as text."""
    return "–" if driven.ok_share is None else f"{driven.ok_share:.1%}"


def count(number: int, what: str) -> str:
    """Returns a number with its noun."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def sources(study: Study, keys: list[str]) -> str:
    """Returns a collapsed table of figures and their sources."""
    rows = [
        (
            escape(key.replace("_", " ")),
            ends(study.prices.ranges[key]),
            badge("unverified", "fit") if key in study.prices.published else "",
            escape(study.prices.sources[key]),
        )
        for key in dict.fromkeys(keys)
    ]
    return (
        "<details><summary>Sources of these figures</summary>"
        f"{table(('Figure', 'low … central … high', '', 'Source'), rows, numbers=(1,))}</details>"
    )


def digits(value: float) -> str:
    """Returns a number with at least three digits."""
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def ends(values: Range) -> str:
    """Returns a range as text, low to high."""
    texts = dict.fromkeys(map(digits, (values.low, values.central, values.high)))
    return " … ".join(texts)


def joules(value: float) -> str:
    """Returns an energy as text."""
    return f"{digits(value)} J"


def joules_range(values: Range) -> str:
    """Returns a range of an energy as text."""
    return f"{ends(values)} J"


def watts(power_w: Mapping[str, float]) -> str:
    """Returns a range of a power as text."""
    texts = dict.fromkeys(f"{power_w[extent]:.3g}" for extent in ("low", "value", "high"))
    return " … ".join(texts)


def numbered(study: Study) -> list[tuple[int, Point]]:
    """Returns all operating points with their indices, in the order of their numbers: by energy."""
    return sorted(enumerate(study.points), key=lambda it: (it[1].energy_j, it[1].error_m))
