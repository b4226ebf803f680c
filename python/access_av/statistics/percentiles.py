"""Percentiles of errors over many runs, with confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.proportions import clopper_pearson

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import ArrayLike, NDArray

# Reported percentiles: the median, and the availabilities of 3GPP's service levels.
PERCENTS = (50.0, 90.0, 95.0, 99.0, 99.9)

# Block size of the counting.
BLOCK = 256


@dataclass(frozen=True)
class Percentile:
    """A percentile of the errors of many runs.

    Attributes
    ----------
    percent
        Share of the errors up to the value, in percent.
    value
        Percentile in the unit of the errors; infinite if too many errors are infinite.
    low, high
        Ends of the 95 % interval; ``None`` with a single run.
    """

    percent: float
    value: float
    low: float | None
    high: float | None

    @property
    def interval(self) -> str:
        """Returns the interval as text."""
        return ends_text(self.low, self.high)

    @property
    def numbers(self) -> tuple[float, float | None, float | None]:
        """Value and both ends of the interval."""
        return self.value, self.low, self.high


def with_ends(name: str, values: Iterable[Any] | None) -> dict[str, Any]:
    """Returns a value and the ends of its interval by column; ``None`` for unknown ones.

    Examples
    --------
    >>> with_ends("delta{}_m", (1.0, 0.5, 1.5))
    {'delta_m': 1.0, 'delta_low_m': 0.5, 'delta_high_m': 1.5}
    """
    columns = (name.format(end) for end in ("", "_low", "_high"))
    return dict(zip(columns, (None, None, None) if values is None else values, strict=True))


def ends_text(low: float | None, high: float | None) -> str:
    """Returns an interval as text; an infinite upper end means too few runs.

    Examples
    --------
    >>> ends_text(0.21, 0.34), ends_text(0.21, math.inf), ends_text(None, None)
    ('0.21 to 0.34', 'above 0.21', 'unknown for one run')
    """
    if low is None:
        return "unknown for one run"
    return f"above {low:.3g}" if high is None or math.isinf(high) else f"{low:.3g} to {high:.3g}"


def column(percent: float) -> str:
    """Returns the column name of a percentile of the horizontal error.

    Examples
    --------
    >>> column(90.0), column(99.9)
    ('p90_error_m', 'p99_9_error_m')
    """
    return f"p{percent:g}_error_m".replace(".", "_")


def as_columns(percentiles: Sequence[Percentile]) -> dict[str, float | None]:
    """Returns percentiles of the horizontal error and their intervals, by column name."""
    found: dict[str, float | None] = {}
    for each in percentiles:
        name = column(each.percent).replace("_error_m", "_error{}_m")
        found |= with_ends(name, map(finite, each.numbers))
    return found


def names() -> list[str]:
    """Returns the names of all columns of :func:`as_columns`."""
    every = [Percentile(percent, 0.0, 0.0, 0.0) for percent in PERCENTS]
    return list(as_columns(every))


def finite(value: float | None) -> float | None:
    """Returns a value of a table: ``None`` unless finite."""
    return None if value is None or not math.isfinite(value) else value


def percentiles(
    errors: ArrayLike,
    percents: Sequence[float] = PERCENTS,
    *,
    independent: int | None = None,
    resamples: int = 1000,
    seed: int = 0,
) -> list[Percentile]:
    """Returns percentiles over all runs and epochs, with 95 % bootstrap intervals.

    A percentile is the inverse of the empirical distribution. Epochs of a run are correlated, runs
    are independent: whole runs are drawn with replacement, and the ends of the interval are
    quantiles of the percentile over the resamples (Efron, Annals of Statistics 7, 1979). The
    quantiles are expanded according to Student's t for the number of runs (Hesterberg, The American
    Statistician 69, 2015, 4.3.2: the expanded percentile interval).

    With ``independent``, the interval also covers events that have not occurred: the upper end is
    at least the error whose share, by Clopper and Pearson's 95 % interval, reaches the percentage.
    It is infinite if there are too few independent errors.

    Intervals of the tail are too short with few runs. If the errors of runs differ by a factor of
    1.6 (one
    standard deviation), intervals of 20 runs cover the median in 95 % of the cases, the 90th
    percentile in 93 %, the 99th in 75 %; those of 40 runs in 96, 95 and 83 %.

    Parameters
    ----------
    errors
        Absolute errors, shape (runs, epochs); NaN is ignored, infinity is above any bound.
    percents
        Percentages, each above 0 and at most 100.
    independent
        Number of independent errors. Default: only the bootstrap.
    resamples
        Number of draws.
    seed
        Seed of the resamples.

    Raises
    ------
    ValueError
        No errors, or an invalid percentage.

    Examples
    --------
    Ten drives, one of which is ten times as bad: it may come twice in ten, or not at all.

    >>> errors = np.outer([1.0] * 9 + [10.0], np.linspace(0.01, 1.0, 100))
    >>> [found] = percentiles(errors, [99.0])
    >>> found.value, found.low, found.high
    (9.0, 0.99, 9.8)
    """
    rows: NDArray[Any] = np.atleast_2d(np.asarray(errors, dtype=np.float64))
    run, epoch = np.nonzero(~np.isnan(rows))
    order = np.argsort(rows[run, epoch])
    run, pooled = run[order], rows[run, epoch][order]
    if pooled.size == 0:
        raise ValueError("percentiles need at least one error")
    for percent in percents:
        if not 0.0 < percent <= 100.0:
            raise ValueError(f"percentile {percent}: it must be above 0 and at most 100")
    runs = len(rows)
    rng = np.random.default_rng(seed)
    drawn = rng.multinomial(runs, np.full(runs, 1.0 / runs), size=resamples)
    outside = int(_beyond(runs) * resamples) if runs > 1 else 0
    found = []
    for percent in percents:
        value = float(pooled[_ranks(percent, np.array([pooled.size]))[0] - 1])
        if runs == 1:
            found.append(Percentile(percent, value, None, None))
            continue
        of_resamples = np.sort(resampled(pooled, run, drawn, percent))
        low, high = float(of_resamples[outside]), float(of_resamples[-1 - outside])
        if independent is not None:
            high = max(high, _seldom_seen(pooled, percent, independent))
        found.append(Percentile(percent, value, low, high))
    return found


def resampled(
    pooled: NDArray[Any], run: NDArray[Any], drawn: NDArray[Any], percent: float
) -> NDArray[Any]:
    """Returns a percentile of each resample.

    Parameters
    ----------
    pooled, run
        All errors in ascending order, and the run of each.
    drawn
        Number of draws of each run in each resample, shape (resamples, runs).
    percent
        The percentile, above 0 and at most 100.
    """
    sizes = drawn @ np.bincount(run, minlength=drawn.shape[1])
    found: NDArray[Any] = pooled[_places(run, drawn, _ranks(percent, sizes))]
    return found


def _beyond(runs: int) -> float:
    """Returns the share of the resamples outside each end of a 95 % interval."""
    from scipy.special import stdtrit  # here, because its import is slow

    freedom = runs - 1
    t = float(stdtrit(freedom, 0.975)) * math.sqrt(runs / freedom)
    return 0.5 * math.erfc(t / math.sqrt(2.0))


def _seldom_seen(pooled: NDArray[Any], percent: float, independent: int) -> float:
    """Returns the minimum error below which the percentage lies with 95 % confidence."""
    within = _within(percent, independent)
    if within is None:
        return math.inf
    return float(pooled[max(0, math.ceil(within / independent * pooled.size) - 1)])


@lru_cache(maxsize=256)
def _within(percent: float, independent: int) -> int | None:
    """Returns the required number of independent errors within a bound; ``None`` if impossible."""
    for within in range(int(percent / 100.0 * independent), independent + 1):
        if clopper_pearson(within, independent)[0] >= percent / 100.0:
            return within
    return None


def _ranks(percent: float, sizes: NDArray[Any]) -> NDArray[Any]:
    """Returns the rank of the percentile among ordered errors, from 1."""
    return np.maximum(np.ceil(np.round(percent / 100.0 * sizes, 6)).astype(np.int64), 1)


def _places(run: NDArray[Any], drawn: NDArray[Any], ranks: NDArray[Any]) -> NDArray[Any]:
    """Returns the index at which each resample reaches its rank among all ordered errors.

    Counts blocks first, then single errors within the found blocks. ``run`` is the run of each
    ordered error, ``drawn`` the number of draws of each run in each resample.
    """
    runs, blocks = drawn.shape[1], -(-len(run) // BLOCK)
    in_block = np.bincount(run * blocks + np.arange(len(run)) // BLOCK, minlength=runs * blocks)
    reached = np.cumsum(drawn @ in_block.reshape(runs, blocks), axis=1)
    block = (reached < ranks[:, np.newaxis]).sum(axis=1)
    places = np.empty(len(drawn), dtype=np.int64)
    for number in np.unique(block):
        of, start = np.flatnonzero(block == number), number * BLOCK
        before = reached[of, number - 1] if number else np.zeros(len(of), dtype=np.int64)
        within = before[:, np.newaxis] + np.cumsum(
            drawn[np.ix_(of, run[start : start + BLOCK])], axis=1
        )
        places[of] = start + (within < ranks[of, np.newaxis]).sum(axis=1)
    return places
