"""Functions that several sections of a study's report use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.report.parts import badge, folded, records
from access_av.tables.numbers import unsigned_zero
from access_av.verdicts import NotOk

if TYPE_CHECKING:
    from collections.abc import Iterable

    from access_av.economics.carbon import Range
    from access_av.run.runs import Runs
    from access_av.study.points import Point
    from access_av.study.study_result import Study


def lost(driven: Runs) -> str:
    """Returns the number of lost drives as text."""
    runs = driven.lost_runs
    return badge(f"LOST in {runs} of {driven.runs}", "no") if runs else f"0 of {driven.runs}"


def reliability_rows(drives: Iterable[Runs]) -> list[dict[str, str]]:
    """Returns the reliability of each variant: lost drives, state ``ok``, reasons, errors."""
    return [
        {
            "Variant": driven.name,
            "Lost drives": lost(driven),
            "State ok": ok(driven),
            **{
                it.words: "–" if driven.not_ok_shares is None else f"{driven.not_ok_shares[it]:.1%}"
                for it in NotOk
            },
            "Errors while ok": "–" if driven.exceedances is None else f"{driven.exceedances:,}",
        }
        for driven in drives
    ]


def ok(driven: Runs) -> str:
    """Returns the share of the time in state ``ok`` as text."""
    return "–" if driven.ok_share is None else f"{driven.ok_share:.1%}"


def in_points(delta: tuple[float, float, float]) -> str:
    """Returns a difference of shares with its 95 % interval in percentage points, as text.

    Examples
    --------
    >>> in_points((-0.021, -0.05, 0.012))
    '-2.1 points (-5.0 to +1.2)'
    """
    middle, low, high = (unsigned_zero(f"{100.0 * it:+.1f}") for it in delta)
    return f"{middle} points ({low} to {high})"


def sources(study: Study, keys: list[str]) -> str:
    """Returns a collapsed table of figures and their sources."""
    rows = [
        {
            "Figure": key.replace("_", " "),
            "low … central … high": ends(study.prices.ranges[key]),
            "": badge("unverified", "fit") if key in study.prices.published else "",
            "Source": study.prices.sources[key],
        }
        for key in dict.fromkeys(keys)
    ]
    return folded("Sources of these figures", records(rows, numbers=(1,)))


def digits(value: float) -> str:
    """Returns a number with at least three digits."""
    return f"{value:,.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def ends(values: Range) -> str:
    """Returns a range as text, low to high."""
    return low_to_high(map(digits, values.ends))


def low_to_high(texts: Iterable[str]) -> str:
    """Returns low, central and high value as text, or one value if all are equal.

    Examples
    --------
    >>> low_to_high(["307", "307", "3,000"]), low_to_high(["20", "20", "20"])
    ('307 … 307 … 3,000', '20')
    """
    every = list(texts)
    return every[0] if len({*every}) == 1 else " … ".join(every)


def joules(value: float) -> str:
    """Returns an energy as text."""
    return f"{digits(value)} J"


def joules_range(values: Range) -> str:
    """Returns a range of an energy as text."""
    return f"{ends(values)} J"


def numbered(study: Study) -> list[tuple[int, Point]]:
    """Returns all operating points with their indices, in the order of their numbers: by energy."""
    return sorted(enumerate(study.points), key=lambda it: (it[1].energy_j, it[1].error_m))
