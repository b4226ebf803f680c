"""Pareto front of two minimized quantities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def pareto_front(first: ArrayLike, second: ArrayLike) -> NDArray[np.intp]:
    """Returns the indices that no other index exceeds in both quantities, ordered by the first.

    The first of equal pairs remains.

    Examples
    --------
    >>> pareto_front([3.0, 1.0, 2.0, 2.5], [0.1, 0.3, 0.2, 0.25]).tolist()
    [1, 2, 0]
    """
    x, y = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    order = np.lexsort((y, x))
    best = np.minimum.accumulate(np.concatenate([[np.inf], y[order][:-1]]))
    return order[y[order] < best]
