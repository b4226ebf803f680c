"""Comparison of variants (other files, or other values of a key) in equal environments."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.errors import InputError
from access_av.run.pairs import ErrorSamples
from access_av.run.runs import drive
from access_av.tables.numbers import count
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from access_av import _core

MOST_VARIANTS = 24


@dataclass(frozen=True)
class Compared:
    """Comparison of a variant with the baseline.

    Attributes
    ----------
    delta_m
        Paired difference of each percentile, variant minus baseline, and the ends of its 95 %
        interval; ``None`` for the baseline.
    identical
        Whether all errors equal those of the baseline.
    """

    driven: ErrorSamples
    percents: Sequence[float]
    delta_m: Sequence[tuple[float, float, float]] | None
    identical: bool = False

    def lost_in_words(self) -> str:
        """Returns the number of lost runs as text, the first statement of a row."""
        driven = self.driven
        return f"{'LOST in ' if driven.lost_runs else ''}{driven.lost_runs} of {driven.runs}"

    def reliability(self) -> str:
        """Returns shares of the states, and errors above the level in state ``ok``, as text."""
        shares, reasons = self.driven.state_shares, self.driven.not_ok_shares
        if shares is None or reasons is None:
            return "no monitor"
        others = [f"{share:.1%} {it.words}" for it, share in reasons.items() if share > 0.0]
        text = ", ".join([f"{shares['ok']:.1%} ok", *others])
        beyond = self.driven.exceedances
        return f"{text}; {beyond} errors beyond the level while ok" if beyond else text

    def difference_in_words(self) -> str:
        """Returns the difference of the last percentile to the baseline as text."""
        if self.delta_m is None:
            return "baseline"
        if self.identical:
            return "identical to the baseline"
        delta, low, high = self.delta_m[-1]
        if math.isinf(low):
            return f"{delta:+.3f} m; no interval: it needs at least two {self.driven.rows}"
        if math.isnan(delta):
            return "no difference: the baseline has no finite percentile"
        interval = f"{delta:+.3f} m (95 %: {low:+.3f} to {high:+.3f} m)"
        if low <= 0.0 <= high:
            return f"no significant difference: {interval}"
        return f"{'better' if delta < 0.0 else 'worse'}: {interval}"


def values(text: str) -> tuple[str, list[Any]]:
    """Splits ``KEY=a,b,c``; the values are TOML, otherwise plain text.

    Raises
    ------
    InputError
        If the text has another form.

    Examples
    --------
    >>> values("site.rician_k_db=5,10")
    ('site.rician_k_db', [5, 10])
    >>> values("vehicle.estimator.method=music,esprit")
    ('vehicle.estimator.method', ['music', 'esprit'])
    """
    key, equals, rest = text.partition("=")
    if not equals or not key.strip() or not rest.strip():
        raise InputError(f"--sweep {text}: write KEY=a,b,c, for example site.rician_k_db=5,10,15")
    try:
        return key.strip(), list(tomllib.loads(f"values = [{rest}]")["values"])
    except tomllib.TOMLDecodeError:
        return key.strip(), [part.strip() for part in rest.split(",")]


def varied(vary: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """Returns every combination of the values of some keys: label and overrides.

    Raises
    ------
    InputError
        If there are too many combinations.
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
            f"--sweep: {len(found)} variants; at most {MOST_VARIANTS} are allowed; access-av "
            f"design sweep searches more"
        )
    return found if vary else []


def combinations(vary: Sequence[str]) -> str:
    """Returns the combinations of the ``--sweep`` options as text; empty without options.

    Examples
    --------
    >>> combinations(["site.rician_k_db=5,10", "vehicle.array.elements=4,8"])
    '2 values of site.rician_k_db × 2 values of vehicle.array.elements = 4 variants'
    """
    keys = [values(text) for text in vary]
    if not keys:
        return ""

    parts = " × ".join(f"{count(len(its), 'value')} of {key}" for key, its in keys)
    total = count(math.prod(len(its) for _, its in keys), "variant")
    return f"{parts} = {total}" if len(keys) > 1 else parts


def compare(
    scenarios: Mapping[str, _core.Scenario],
    percents: Sequence[float],
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    plug_ins: Mapping[str, Mapping[str, Any]] | None = None,
    baseline: ErrorSamples | None = None,
) -> list[Compared]:
    """Simulates variants in equal environments; the first one is the baseline.

    Parameters
    ----------
    baseline
        Runs of the first variant, if it was simulated before with equal runs and seed.
    """
    known = [] if baseline is None else [baseline]
    left = dict(list(scenarios.items())[len(known) :])
    found = list[ErrorSamples](known)

    def tell(done: int, _: int) -> None:
        if progress is not None:
            progress(runs * (len(found) - len(known)) + done, runs * len(left))

    for label, scenario in left.items():
        found.append(drive(label, scenario, runs, seed, threads, tell, (plug_ins or {}).get(label)))
    return beside_first(found, percents)


def beside_first(found: Sequence[ErrorSamples], percents: Sequence[float]) -> list[Compared]:
    """Compares variants that were simulated in equal environments with the first one."""
    return [
        Compared(
            it,
            percents,
            [it.delta_m(found[0], percent) for percent in percents],
            np.array_equal(it.errors_m, found[0].errors_m),
        )
        if it is not found[0]
        else Compared(it, percents, None)
        for it in found
    ]


def table(found: Sequence[Compared]) -> pl.DataFrame:
    """Returns one row per variant and percentile: columns ``compared``."""
    rows = [
        it.driven.record(percent, None if it.delta_m is None else it.delta_m[place])
        for it in found
        for place, percent in enumerate(it.percents)
    ]
    return pl.DataFrame(rows, infer_schema_length=None)
