"""Intervals of a proportion from independent trials, or from runs with correlated epochs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.statistics.bootstrap import bootstrap_interval, check_probability

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def clopper_pearson(
    successes: int, trials: int, *, probability: float = 0.95
) -> tuple[float, float]:
    """Returns the exact interval of a proportion, with a coverage of at least ``probability``.

    With ``alpha = 1 - probability``, the ends are the quantile ``alpha / 2`` of
    ``Beta(successes, trials - successes + 1)`` and the quantile ``1 - alpha / 2`` of
    ``Beta(successes + 1, trials - successes)`` (Clopper and Pearson, Biometrika 26, 1934).

    Parameters
    ----------
    successes
        Number of successful trials.
    trials
        Number of independent trials.
    probability
        Coverage, above 0 and below 1.

    Examples
    --------
    Nothing in 300 trials: below 1.2 %, the rule of three with 97.5 %.

    >>> [round(end, 4) for end in clopper_pearson(0, 300)]
    [0.0, 0.0122]
    >>> [round(end, 4) for end in clopper_pearson(5, 10)]
    [0.1871, 0.8129]
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(
            f"{successes} of {trials}: there must be at least one trial, and at most as many "
            f"successes as trials"
        )
    check_probability(probability)
    from scipy.special import betaincinv  # here, because its import is slow

    tail, failures = 0.5 * (1.0 - probability), trials - successes
    low = float(betaincinv(successes, failures + 1, tail)) if successes else 0.0
    high = float(betaincinv(successes + 1, failures, 1.0 - tail)) if failures else 1.0
    return low, high


def share_interval(shares: NDArray[np.float64], independent: int) -> tuple[float, float]:
    """Returns the 95 % interval of the mean of a share over runs.

    Each end is the wider one of two intervals: the bootstrap over whole runs, which covers
    differences between runs, and Clopper and Pearson's, which covers events that have not occurred.

    Parameters
    ----------
    shares
        Share of each run, (runs,); the runs have equal lengths.
    independent
        Number of independent epochs of all runs.

    Examples
    --------
    >>> import numpy as np
    >>> low, high = share_interval(np.ones(50), independent=1000)
    >>> round(low, 4), high
    (0.9963, 1.0)
    """
    share = float(shares.mean())
    low, high = clopper_pearson(int(share * independent), independent)
    if len(shares) > 1:
        least, most = bootstrap_interval(shares)
        low, high = min(low, least), max(high, most)
    return low, max(high, share)
