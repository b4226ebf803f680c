"""Paired difference of a percentile between two variants with equal runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.percentiles import resampled

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

RESAMPLES = 400


def paired_difference(
    errors: ArrayLike, others: ArrayLike, percent: float, *, comparisons: int = 1, seed: int = 0
) -> tuple[float, float, float]:
    """Returns the difference of a percentile, and its 95 % interval over pairs of runs.

    Whole runs are drawn with replacement, in pairs. The errors of a pair are correlated; therefore
    the difference is more accurate than either percentile. The interval is the difference ± the
    bootstrap's standard error times Student's t with (number of runs − 1) degrees of freedom (Efron
    and Tibshirani, An Introduction to the Bootstrap, 1993, 12.5).

    Parameters
    ----------
    errors, others
        Errors of equal runs, each of shape (runs, epochs); infinity is above any bound.
    percent
        The percentile, above 0 and at most 100.
    comparisons
        Number of differences whose intervals hold together with 95 % confidence (Bonferroni).
    seed
        Seed of the resamples.

    Returns
    -------
    tuple of float
        Difference (first minus second) and the ends of its interval; infinite ends with one run.

    Raises
    ------
    ValueError
        Different numbers of runs.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> errors = np.abs(rng.standard_normal((20, 500)))
    >>> found = paired_difference(0.5 * errors, errors, 90.0)
    >>> bool(found[0] < 0.0 and found[2] < 0.0)
    True
    """
    mine, its = (np.atleast_2d(np.asarray(it, dtype=np.float64)) for it in (errors, others))
    if len(mine) != len(its):
        raise ValueError(f"{len(mine)} drives cannot be paired with {len(its)}")
    every = np.ones((1, len(mine)), dtype=np.int64)
    first, second = (float(_resampled(it, every, percent)[0]) for it in (mine, its))
    difference = 0.0 if first == second else first - second  # also for infinite percentiles
    runs = len(mine)
    if runs == 1 or not np.isfinite(difference):
        return difference, -math.inf, math.inf
    drawn = np.random.default_rng(seed).multinomial(runs, np.full(runs, 1.0 / runs), RESAMPLES)
    spread = _resampled(mine, drawn, percent) - _resampled(its, drawn, percent)
    if not np.isfinite(spread).all():
        return difference, -math.inf, math.inf
    standard_error = float(np.std(spread, ddof=1)) * math.sqrt(runs / (runs - 1))
    half = half_width(standard_error, runs, comparisons)
    return difference, difference - half, difference + half


def paired_mean(
    values: NDArray[np.float64], others: NDArray[np.float64], *, comparisons: int = 1
) -> tuple[float, float, float]:
    """Returns the mean difference over pairs of runs, and its 95 % interval by Student's t.

    The intervals of a number of ``comparisons`` hold together (Bonferroni). If only one of the
    variants has unknown (infinite) values, the difference is infinite.

    Examples
    --------
    >>> [round(it, 3) for it in paired_mean(np.array([1.0, 2.0, 3.5]), np.array([0.0, 1.0, 2.0]))]
    [1.167, 0.45, 1.884]
    """
    known = float(np.isfinite(others).all()), float(np.isfinite(values).all())
    if 0.0 in known:
        sure = math.inf * (known[0] - known[1]) if known[0] != known[1] else 0.0
        return sure, sure, sure
    less = values - others
    mean = float(np.mean(less))
    if less.size < 2:
        return mean, -math.inf, math.inf
    standard_error = float(np.std(less, ddof=1)) / math.sqrt(less.size)
    half = half_width(standard_error, less.size, comparisons)
    return mean, mean - half, mean + half


def half_width(standard_error: float, runs: int, comparisons: int = 1) -> float:
    """Returns half of the width of a mean's 95 % interval by Student's t.

    Examples
    --------
    >>> [round(half_width(1.0, runs), 3) for runs in (2, 3, 20)]
    [12.706, 4.303, 2.093]
    """
    from scipy.special import stdtrit  # here, because its import is slow

    return float(stdtrit(runs - 1, 1.0 - 0.025 / comparisons)) * standard_error


def _resampled(errors: NDArray[Any], drawn: NDArray[Any], percent: float) -> NDArray[np.float64]:
    """Returns the percentile of each resample, with runs weighted by their number of draws."""
    order = np.argsort(errors, axis=None, kind="stable")
    return resampled(errors.ravel()[order], order // errors.shape[1], drawn, percent)
