"""Variants side by side: other files, or other values of a key, driven in the same worlds."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.errors import InputError
from access_av.run.pairs import Errors
from access_av.study.trips import drive
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from access_av import _core

MOST_VARIANTS = 24


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

    driven: Errors
    percents: Sequence[float]
    less_m: Sequence[tuple[float, float, float]] | None

    def in_words(self, place: int = -1) -> str:
        """How one of the percentiles differs from the first variant's."""
        if self.less_m is None:
            return "what the others are compared with"
        less, low, high = self.less_m[place]
        if math.isinf(low):
            return f"{less:+.3f} m; of one of the {self.driven.rows} there is no interval"
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
    total, found = runs * len(scenarios), list[Errors]()
    for number, (label, scenario) in enumerate(scenarios.items()):

        def tell(done: int, _: int, before: int = number * runs) -> None:
            if progress is not None:
                progress(before + done, total)

        found.append(drive(label, scenario, runs, seed, threads, tell))
    return beside_first(found, percents)


def beside_first(found: Sequence[Errors], percents: Sequence[float]) -> list[Compared]:
    """What was driven in the same worlds, each beside the first."""
    return [
        Compared(it, percents, [it.less_than(found[0], percent) for percent in percents])
        if it is not found[0]
        else Compared(it, percents, None)
        for it in found
    ]


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
                    "energy_j": it.driven.energy_j,
                }
            )
    return pl.DataFrame(rows, infer_schema_length=None)
