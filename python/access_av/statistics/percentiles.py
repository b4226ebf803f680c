"""Percentiles of errors over many drives, and how far they are known."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.distributions import beta_quantile
from access_av.statistics.proportions import clopper_pearson

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

# What is told of every distribution of errors, in percent: the median, and what 3GPP's service
# levels ask for.
PERCENTS = (50.0, 90.0, 95.0, 99.0, 99.9)

# Errors that are counted together before they are counted one by one.
BLOCK = 256


@dataclass(frozen=True)
class Percentile:
    """A percentile of the errors of many drives.

    Attributes
    ----------
    percent
        Share of the errors that is no larger, in percent.
    value
        The percentile, in the errors' unit; infinite where so many have no error.
    low, high
        Ends of its 95 % interval; ``None`` with a single run.
    """

    percent: float
    value: float
    low: float | None
    high: float | None

    @property
    def interval(self) -> str:
        """The interval in words."""
        return ends_text(self.low, self.high)


def ends_text(low: float | None, high: float | None) -> str:
    """An interval in words; without a high end where more may be than was seen.

    Examples
    --------
    >>> ends_text(0.21, 0.34), ends_text(0.21, math.inf), ends_text(None, None)
    ('0.21 to 0.34', 'above 0.21', 'unknown for one run')
    """
    if low is None:
        return "unknown for one run"
    return f"above {low:.3g}" if high is None or math.isinf(high) else f"{low:.3g} to {high:.3g}"


def column(percent: float) -> str:
    """Name of the column that holds a percentile of the horizontal error.

    Examples
    --------
    >>> column(90.0), column(99.9)
    ('p90_error_m', 'p99_9_error_m')
    """
    return f"p{percent:g}_error_m".replace(".", "_")


def as_columns(percentiles: Sequence[Percentile]) -> dict[str, float | None]:
    """Percentiles of the horizontal error and their intervals, by the names of columns."""
    found: dict[str, float | None] = {}
    for each in percentiles:
        name = column(each.percent)
        found[name] = _finite(each.value)
        for end in ("low", "high"):
            found[name.replace("_error_m", f"_error_{end}_m")] = _finite(getattr(each, end))
    return found


def names() -> list[str]:
    """Names of all columns that :func:`as_columns` may give."""
    every = [Percentile(percent, 0.0, 0.0, 0.0) for percent in PERCENTS]
    return list(as_columns(every))


def _finite(value: float | None) -> float | None:
    return None if value is None or math.isinf(value) else value


def percentiles(
    errors: ArrayLike,
    percents: Sequence[float] = PERCENTS,
    *,
    independent: int | None = None,
    resamples: int = 1000,
    seed: int = 0,
) -> list[Percentile]:
    """Percentiles over all drives and epochs, with 95 % intervals by bootstrap over whole drives.

    A percentile is the least error that so many are no larger than (the inverse of the empirical
    distribution). Epochs of a drive hang together, drives do not: drives are drawn with
    replacement, whole, and the interval's ends are quantiles of what the percentile is over the
    resamples (Efron, Annals of Statistics 7, 1979). They are those beyond which a Gaussian has as
    much as Student's t of so few drives has beyond its 95 % interval (Hesterberg, The American
    Statistician 69, 2015, 4.3.2: the expanded percentile interval).

    What has not happened may yet happen: given ``independent``, the high end is no lower than the
    error below which, by Clopper and Pearson's 95 % interval of a share, at least so many are;
    infinite where too few were seen to say that of any error.

    A tail is known no better than its worst drives are. Where drives differ by a factor of 1.6
    (one standard deviation), intervals of 20 drives hold the median in 95 % of the cases, the 90th
    percentile in 93 %, the 99th in 75 %; those of 40 drives in 96, 95 and 83 %.

    Parameters
    ----------
    errors
        Absolute errors, shape (runs, epochs); NaN is left out, infinity is beyond any bound.
    percents
        Which, each above 0 and at most 100.
    independent
        How many of the errors are as good as independent; the bootstrap alone where ``None``.
    resamples
        Number of draws.
    seed
        Same seed, same intervals.

    Returns
    -------
    list of Percentile
        In the order of ``percents``.

    Raises
    ------
    ValueError
        Without a single error, or with a percentage that there is not.

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
    """A percentile in each resample.

    Parameters
    ----------
    pooled, run
        All errors in ascending order, and the run of each.
    drawn
        How often each resample has each run, shape (resamples, runs).
    percent
        The percentile, above 0 and at most 100.
    """
    sizes = drawn @ np.bincount(run, minlength=drawn.shape[1])
    found: NDArray[Any] = pooled[_places(run, drawn, _ranks(percent, sizes))]
    return found


def _beyond(runs: int) -> float:
    """Share of the resamples beyond each end of a 95 % interval."""
    freedom = runs - 1
    # Student's t squared, by the beta distribution of t² / (t² + freedom).
    share = beta_quantile(0.95, 0.5, 0.5 * freedom)
    t = math.sqrt(freedom * share / (1.0 - share) * runs / freedom)
    return 0.5 * math.erfc(t / math.sqrt(2.0))


def _seldom_seen(pooled: NDArray[Any], percent: float, independent: int) -> float:
    """The least error below which, with 95 % confidence, is the percentage of all."""
    within = _within(percent, independent)
    if within is None:
        return math.inf
    return float(pooled[max(0, math.ceil(within / independent * pooled.size) - 1)])


@lru_cache(maxsize=256)
def _within(percent: float, independent: int) -> int | None:
    """How many of the independent ones have to be within an error; ``None`` if all are too few."""
    for within in range(int(percent / 100.0 * independent), independent + 1):
        if clopper_pearson(within, independent)[0] >= percent / 100.0:
            return within
    return None


def _ranks(percent: float, sizes: NDArray[Any]) -> NDArray[Any]:
    """Which of so many errors in order is the percentile, from 1 on."""
    return np.maximum(np.ceil(np.round(percent / 100.0 * sizes, 6)).astype(np.int64), 1)


def _places(run: NDArray[Any], drawn: NDArray[Any], ranks: NDArray[Any]) -> NDArray[Any]:
    """Where in the order of all errors each resample has as many as its rank.

    Counted by blocks first, and then within the few blocks in which that happens. ``run`` is the
    run of each error, in their order; ``drawn`` how often a resample has a run.
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
