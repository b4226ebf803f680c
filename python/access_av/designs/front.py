"""Pareto front of designs, and its confidence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from access_av.designs.driven import Driven


def differences(one: Driven, others: Sequence[Driven]) -> NDArray[np.float64]:
    """Returns paired differences of energy and squared error of one design to each other one.

    Uses the common runs. Shape (others, 2, 3): mean and the ends of its 95 % interval.
    """
    found = np.empty((len(others), 2, 3))
    for row, other in enumerate(others):
        count = min(one.square_m2.size, other.square_m2.size)
        for column, name in enumerate(("energy_j", "square_m2")):
            mine, its = getattr(one, name)[:count], getattr(other, name)[:count]
            found[row, column] = _interval(mine, its)
    return found


def _interval(mine: NDArray[np.float64], its: NDArray[np.float64]) -> tuple[float, float, float]:
    if not np.isfinite(mine).all() or not np.isfinite(its).all():
        known = float(np.isfinite(its).all()), float(np.isfinite(mine).all())
        sure = np.inf * (known[0] - known[1]) if known[0] != known[1] else 0.0
        return sure, sure, sure
    less = mine - its
    mean = float(np.mean(less))
    if less.size < 2:
        return mean, -np.inf, np.inf
    half = student(less.size - 1) * float(np.std(less, ddof=1)) / np.sqrt(less.size)
    return mean, mean - half, mean + half


def student(freedom: int) -> float:
    """Returns the two-sided 95 % quantile of Student's t (Hill's expansion; exact for 1 and 2).

    Examples
    --------
    >>> [round(student(freedom), 2) for freedom in (1, 2, 5, 19)]
    [12.71, 4.3, 2.57, 2.09]
    """
    if freedom <= 2:
        return (12.706, 4.303)[freedom - 1]
    z, n = 1.959964, float(freedom)
    return (
        z
        + (z**3 + z) / (4 * n)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3)
    )


def front(driven: Sequence[Driven]) -> list[int]:
    """Returns the Pareto front of mean energy and mean error, ordered by energy."""
    energy_j, square_m2 = aims(driven)
    found = not_beaten(energy_j, square_m2)
    return [int(index) for index in found if np.isfinite(energy_j[index])]


def aims(driven: Sequence[Driven]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns mean energy and mean squared error of each design."""
    return (
        np.array([each.mean_energy_j for each in driven]),
        np.array([float(np.mean(each.square_m2)) for each in driven]),
    )


def not_beaten(energy_j: NDArray[np.float64], square_m2: NDArray[np.float64]) -> NDArray[np.intp]:
    """Returns the indices of the Pareto front, ordered by energy."""
    order = np.lexsort((square_m2, energy_j))
    best_m2 = np.minimum.accumulate(np.concatenate([[np.inf], square_m2[order][:-1]]))
    return order[square_m2[order] < best_m2]


def may_be_front(driven: Sequence[Driven]) -> list[int]:
    """Returns the designs that may be on the Pareto front, with 95 % confidence.

    A design is excluded if another one is significantly better in one objective and not worse in
    the other.
    """
    on_front = front(driven)
    rivals = [driven[index] for index in on_front]
    found = []
    for index, one in enumerate(driven):
        low = differences(one, rivals)[:, :, 1]
        beaten = (low >= 0.0).all(axis=1) & (low > 0.0).any(axis=1)
        if index in on_front or not beaten.any():
            found.append(index)
    return found
