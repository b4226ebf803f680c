"""Positioning service levels of 3GPP, and which of them a site and a vehicle reach.

Horizontal accuracy and availability of TS 22.261, 7.3.2.2 (level 7, which is relative between
vehicles, is evaluated as absolute), and the industrial target of TR 38.857. Latency is not
evaluated, because it depends on the platform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.statistics.proportions import share_interval
from access_av.verdicts import LevelResult

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

DIRECTIONS = 64
# Time between independent errors (s): the memory of the tracker at typical speeds.
INDEPENDENT_S = 10.0


@dataclass(frozen=True)
class Level:
    """A service level: accuracy and required availability."""

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
    """Result for one service level.

    Attributes
    ----------
    level
        The level.
    share
        Share of positions within the accuracy.
    least_share
        Lower end of the share's 95 % interval; the share itself for a bound.
    """

    level: Level
    share: float
    least_share: float

    @property
    def reached(self) -> bool:
        """Returns whether the level is reached with 95 % confidence."""
        return self.least_share >= self.level.availability

    @property
    def result(self) -> LevelResult:
        """Whether the level is reached, also without 95 % confidence."""
        if self.reached:
            return LevelResult.REACHED
        enough = self.share >= self.level.availability
        return LevelResult.TOO_FEW_RUNS if enough else LevelResult.NOT_REACHED

    def as_record(self) -> dict[str, Any]:
        """Returns the values for JSON."""
        return {
            "level": self.level.name,
            "accuracy_m": self.level.accuracy_m,
            "availability": self.level.availability,
            "share": self.share,
            "least_share": self.least_share,
            "reached": self.reached,
        }


def of_runs(errors_m: ArrayLike, step_s: float) -> list[Verdict]:
    """Evaluates horizontal errors of many runs, for each of :data:`LEVELS`.

    The lower end is the minimum of two: the bootstrap over whole runs, which covers differences
    between runs, and the interval of Clopper and Pearson with one independent position every
    :data:`INDEPENDENT_S`, which covers events that have not occurred yet.

    Parameters
    ----------
    errors_m
        Horizontal errors, shape (runs, steps); NaN (unknown position) counts as not within the
        accuracy.
    step_s
        Time between two steps.

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
        # The share of all is the mean of the runs, because they have equal lengths.
        shares = (errors_m <= level.accuracy_m).mean(axis=1)
        share = float(shares.mean())
        verdicts.append(Verdict(level, share, share_interval(shares, looks)[0]))
    return verdicts


def of_bound(along_std_m: ArrayLike, across_std_m: ArrayLike) -> list[Verdict]:
    """Evaluates a route with Gaussian errors as small as the bound, for each of :data:`LEVELS`.

    No localizer exceeds the results.

    Parameters
    ----------
    along_std_m, across_std_m
        Bounds of the standard deviations in two perpendicular directions, shape (steps,).

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
    """Returns the probability of a Gaussian position within a circle around its mean.

    In polar coordinates, ``1 - (1/2π) ∫ exp(-r²/2 q(θ)) / (σ₁ σ₂ q(θ)) dθ`` with
    ``q = cos²θ/σ₁² + sin²θ/σ₂²``. With axes divided by their σ, all angles have equal weight.

    Parameters
    ----------
    first_std_m, second_std_m
        Standard deviations along the axes.
    radius_m
        Radius of the circle.

    Examples
    --------
    >>> within([0.1, 1.0], [0.1, 0.0], 0.2).round(4).tolist()
    [0.8647, 0.1581]
    """
    first, second = (
        np.maximum(np.atleast_1d(np.asarray(std, dtype=np.float64)), 1e-9)
        for std in (first_std_m, second_std_m)
    )
    # Offset by half a step from the axes, so that a degenerate Gaussian is integrated evenly.
    angles = (np.arange(DIRECTIONS) + 0.5) * (2.0 * np.pi / DIRECTIONS)
    stretch = (first[:, None] * np.cos(angles)) ** 2 + (second[:, None] * np.sin(angles)) ** 2
    return np.asarray(1.0 - np.exp(-0.5 * radius_m**2 / stretch).mean(axis=1))


def reached_in_words(verdicts: list[Verdict]) -> str:
    """Returns the reached levels as text.

    Examples
    --------
    >>> reached_in_words(of_bound([0.1], [0.05]))
    'levels 1, 2, 3, 4, 5, IIoT'
    """
    reached = [verdict.level.name for verdict in verdicts if verdict.reached]
    return f"levels {', '.join(reached)}" if reached else "no level"
