"""Positioning service levels of 3GPP: which of them a site and a vehicle reach.

Horizontal accuracy and availability of TS 22.261, 7.3.2.2 (level 7, which is relative between
vehicles, is judged as if it were absolute), and the industrial target of TR 38.857. Latency is not
judged: it is the platform's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.bootstrap import bootstrap_interval
from access_av.statistics.proportions import clopper_pearson

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

DIRECTIONS = 64
# After so long a position's error is another's: the tracker's memory at usual speeds.
INDEPENDENT_S = 10.0


@dataclass(frozen=True)
class Level:
    """A service level: at least this share of positions is to be this near."""

    name: str
    accuracy_m: float
    availability: float


LEVELS = (
    Level("1", 10.0, 0.95),
    Level("2", 3.0, 0.99),
    Level("3", 1.0, 0.99),
    Level("4", 1.0, 0.999),
    Level("5", 0.3, 0.99),
    Level("6", 0.3, 0.999),
    Level("7", 0.2, 0.99),
    Level("IIoT", 0.2, 0.9),
)


@dataclass(frozen=True)
class Verdict:
    """Whether a level is reached.

    Attributes
    ----------
    level
        The level.
    share
        Share of positions as near as it asks.
    least_share
        Low end of the share's 95 % interval; the share itself where there is no chance in it.
    """

    level: Level
    share: float
    least_share: float

    @property
    def reached(self) -> bool:
        """Whether the level is reached, at 95 % confidence."""
        return self.least_share >= self.level.availability

    @property
    def outcome(self) -> str:
        """Whether it is reached, or why that is not said."""
        if self.reached:
            return "reached"
        enough = self.share >= self.level.availability
        return "too few drives" if enough else "not reached"

    def as_record(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "level": self.level.name,
            "accuracy_m": self.level.accuracy_m,
            "availability": self.level.availability,
            "share": self.share,
            "least_share": self.least_share,
            "reached": self.reached,
        }


def of_runs(errors_m: ArrayLike, step_s: float) -> list[Verdict]:
    """The verdicts on horizontal errors of many drives.

    The confidence is the lesser of two: the bootstrap over whole drives, which knows that drives
    differ; and Clopper and Pearson's for as many independent positions as there are
    :data:`INDEPENDENT_S`, which knows that what has not happened in an hour may happen in the next.

    Parameters
    ----------
    errors_m
        Horizontal errors, shape (runs, steps); NaN, where the vehicle does not know its place, is
        not near.
    step_s
        Time between two steps.

    Returns
    -------
    list of Verdict
        One for each of :data:`LEVELS`.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> errors_m = 0.05 * np.abs(rng.standard_normal((50, 4000)))
    >>> reached_in_words(of_runs(errors_m, step_s=0.2))
    'levels 1, 2, 3, 4, 5, 6, 7, IIoT'
    >>> reached_in_words(of_runs(20.0 * errors_m, step_s=0.2))
    'levels 1, 2'
    """
    errors_m = np.atleast_2d(np.asarray(errors_m, dtype=np.float64))
    runs, steps = errors_m.shape
    looks = max(1, int(runs * steps * step_s / INDEPENDENT_S))
    verdicts = []
    for level in LEVELS:
        # Runs are of equal length: the share of all is the mean of theirs.
        shares = (errors_m <= level.accuracy_m).mean(axis=1)
        share = float(shares.mean())
        least, _ = clopper_pearson(int(share * looks), looks)
        if runs > 1:
            least = min(least, bootstrap_interval(shares[:, None], lambda it: float(it.mean()))[0])
        verdicts.append(Verdict(level, share, least))
    return verdicts


def of_bound(along_std_m: ArrayLike, across_std_m: ArrayLike) -> list[Verdict]:
    """The verdicts on a route whose errors are Gaussian and as small as the bound allows.

    Parameters
    ----------
    along_std_m, across_std_m
        Least standard deviations of the position in two directions at right angles, shape (steps,).

    Returns
    -------
    list of Verdict
        One for each of :data:`LEVELS`: what no localizer can better.

    Examples
    --------
    >>> [verdict.level.name for verdict in of_bound([0.1], [0.1]) if verdict.reached]
    ['1', '2', '3', '4']
    """
    return [
        Verdict(level, share, share)
        for level in LEVELS
        for share in (float(within(along_std_m, across_std_m, level.accuracy_m).mean()),)
    ]


def within(first_std_m: ArrayLike, second_std_m: ArrayLike, radius_m: float) -> NDArray[np.float64]:
    """Probability that a Gaussian place lies within a circle about its mean.

    In polar coordinates, ``1 - (1/2π) ∫ exp(-r²/2 q(θ)) / (σ₁ σ₂ q(θ)) dθ`` with
    ``q = cos²θ/σ₁² + sin²θ/σ₂²``; in the angle of the rounded Gaussian the weight is even.

    Parameters
    ----------
    first_std_m, second_std_m
        Standard deviations along the axes.
    radius_m
        The circle's radius.

    Returns
    -------
    numpy.ndarray
        Probabilities.

    Examples
    --------
    >>> within([0.1, 1.0], [0.1, 0.0], 0.2).round(4).tolist()
    [0.8647, 0.1581]
    """
    first, second = (
        np.maximum(np.atleast_1d(np.asarray(std, dtype=np.float64)), 1e-9)
        for std in (first_std_m, second_std_m)
    )
    # Half a step off the axes, so that a place on a line is integrated evenly too.
    angles = (np.arange(DIRECTIONS) + 0.5) * (2.0 * np.pi / DIRECTIONS)
    stretch = (first[:, None] * np.cos(angles)) ** 2 + (second[:, None] * np.sin(angles)) ** 2
    return np.asarray(1.0 - np.exp(-0.5 * radius_m**2 / stretch).mean(axis=1))


def reached_in_words(verdicts: list[Verdict]) -> str:
    """What is reached.

    Examples
    --------
    >>> reached_in_words(of_bound([0.1], [0.05]))
    'levels 1, 2, 3, 4, 5, IIoT'
    """
    reached = [verdict.level.name for verdict in verdicts if verdict.reached]
    return f"levels {', '.join(reached)}" if reached else "no level"
