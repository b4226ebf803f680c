"""Variants side by side: other files, or other values of a key, driven in the same worlds."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.errors import InputError
from access_av.study.trips import Driven, drive
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from access_av import _core

MOST_VARIANTS = 24
AS_IT_IS = "as it is"


@dataclass(frozen=True)
class Compared:
    """A variant beside the first one.

    Attributes
    ----------
    driven
        Its drives.
    percents
        Which percentiles of the error are compared.
    less_m
        By how much each is larger than the first variant's, in pairs of drives, and the ends of
        the 95 % interval; ``None`` of the first one itself.
    """

    driven: Driven
    percents: Sequence[float]
    less_m: Sequence[tuple[float, float, float]] | None

    @property
    def energy_j(self) -> float | None:
        """Energy of a trip; ``None`` where the platform has no figure."""
        energy = self.driven.energy()
        return None if energy is None else energy["value"].total_j

    def in_words(self, place: int = -1) -> str:
        """How one of the percentiles differs from the first variant's."""
        if self.less_m is None:
            return "what the others are compared with"
        less, low, high = self.less_m[place]
        if low <= 0.0 <= high:
            return f"not surely different ({low:+.3f} to {high:+.3f} m)"
        kind = "better" if less < 0.0 else "worse"
        near, far = sorted((abs(low), abs(high)))
        return f"{abs(less):.3f} m {kind} ({near:.3f} to {far:.3f} m)"


def values(text: str) -> tuple[str, list[Any]]:
    """Split ``KEY=a,b,c``; the values are read as TOML, and as plain text where they are none.

    Raises
    ------
    InputError
        When it is not that.

    Examples
    --------
    >>> values("site.rician_k_db=5,10")
    ('site.rician_k_db', [5, 10])
    >>> values("vehicle.estimator.method=music,esprit")
    ('vehicle.estimator.method', ['music', 'esprit'])
    """
    key, equals, rest = text.partition("=")
    if not equals or not key.strip() or not rest.strip():
        raise InputError(f"--vary {text}: write KEY=a,b,c, for example site.rician_k_db=5,10,15")
    try:
        return key.strip(), list(tomllib.loads(f"values = [{rest}]")["values"])
    except tomllib.TOMLDecodeError:
        return key.strip(), [part.strip() for part in rest.split(",")]


def varied(vary: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """Every combination of the values of some keys: a label, and what to override.

    Raises
    ------
    InputError
        Where there are too many.
    """
    keys = [values(text) for text in vary]
    found = [
        (
            ", ".join(f"{key} = {value}" for key, value in pairs),
            dict(pairs),
        )
        for pairs in itertools.product(*([(key, it) for it in its] for key, its in keys))
    ]
    if len(found) > MOST_VARIANTS:
        raise InputError(
            f"--vary: {len(found)} variants; at most {MOST_VARIANTS} are driven beside each other, "
            "access-av designs searches more"
        )
    return found if vary else []


def compare(
    scenarios: Mapping[str, _core.Scenario],
    percents: Sequence[float],
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Compared]:
    """Drive variants in the same worlds, the first being what the others are compared with.

    Parameters
    ----------
    scenarios
        By their labels.
    percents
        Which percentiles of the error.
    """
    total, found = runs * len(scenarios), list[Compared]()
    for number, (label, scenario) in enumerate(scenarios.items()):

        def tell(done: int, _: int, before: int = number * runs) -> None:
            if progress is not None:
                progress(before + done, total)

        driven = drive(label, scenario, runs, seed, threads, tell)
        first = found[0].driven if found else None
        less = None if first is None else [driven.less_than(first, it) for it in percents]
        found.append(Compared(driven, percents, less))
    return found


def table(found: Sequence[Compared]) -> pl.DataFrame:
    """One row per variant and percentile: columns ``compared`` of :mod:`access_av.columns`."""
    rows = []
    for it in found:
        for place, percent in enumerate(it.percents):
            known = it.driven.percentile(percent)
            more = (None, None, None) if it.less_m is None else it.less_m[place]
            rows.append(
                {
                    "variant": it.driven.name,
                    "runs": it.driven.runs,
                    "percent": percent,
                    "percentile_m": known.value,
                    "percentile_low_m": known.low,
                    "percentile_high_m": known.high,
                    **dict(zip(("more_m", "more_low_m", "more_high_m"), more, strict=True)),
                    "energy_j": it.energy_j,
                }
            )
    return pl.DataFrame(rows, infer_schema_length=None)
