"""What a percentile of two variants differs by, where both drove the same drives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.percentiles import resampled

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

RESAMPLES = 400


def paired_difference(
    errors: ArrayLike, others: ArrayLike, percent: float, *, seed: int = 0
) -> tuple[float, float, float]:
    """Percentile of one minus that of the other, and its 95 % interval over pairs of drives.

    Drives are drawn with replacement, whole, and for both alike: what makes a drive hard for one
    makes it hard for the other, so that the difference is known better than either. The interval is
    the bootstrap's standard error times Student's t of as many drives less one, about the
    difference (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, 12.5).

    Parameters
    ----------
    errors, others
        Errors of the same drives, each of shape (runs, epochs); infinity is beyond any bound.
    percent
        The percentile, above 0 and at most 100.
    seed
        Same seed, same interval.

    Returns
    -------
    tuple of float
        Difference and the ends of its interval; infinite ends with a single drive.

    Raises
    ------
    ValueError
        Where they are not of as many drives.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> errors = np.abs(rng.standard_normal((20, 500)))
    >>> found = paired_difference(0.5 * errors, errors, 90.0)
    >>> bool(found[0] < 0.0 and found[2] < 0.0)
    True
    """
    from scipy.special import stdtrit

    mine, its = (np.atleast_2d(np.asarray(it, dtype=np.float64)) for it in (errors, others))
    if len(mine) != len(its):
        raise ValueError(f"{len(mine)} drives cannot be paired with {len(its)}")
    every = np.ones((1, len(mine)), dtype=np.int64)
    difference = _less(*(float(_resampled(it, every, percent)[0]) for it in (mine, its)))
    runs = len(mine)
    if runs == 1 or not np.isfinite(difference):
        return difference, -np.inf, np.inf
    drawn = np.random.default_rng(seed).multinomial(runs, np.full(runs, 1.0 / runs), RESAMPLES)
    spread = _resampled(mine, drawn, percent) - _resampled(its, drawn, percent)
    if not np.isfinite(spread).all():
        return difference, -np.inf, np.inf
    half = (
        float(stdtrit(runs - 1, 0.975)) * float(np.std(spread, ddof=1)) * np.sqrt(runs / (runs - 1))
    )
    return difference, difference - half, difference + half


def _less(first: float, second: float) -> float:
    return 0.0 if first == second else first - second


def _resampled(errors: NDArray[Any], drawn: NDArray[Any], percent: float) -> NDArray[np.float64]:
    """The percentile in each resample, whose drives count as often as they were drawn."""
    order = np.argsort(errors, axis=None, kind="stable")
    return resampled(errors.ravel()[order], order // errors.shape[1], drawn, percent)
