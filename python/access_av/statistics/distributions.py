"""Quantiles of the chi-squared and beta distributions, with nothing but ``math``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

# Terms of a series or continued fraction; far more than any count of runs or epochs needs.
MOST_TERMS = 1_000_000
CLOSE = 1e-15
TINY = 1e-300


def chi_squared_quantile(probability: float, freedom: float) -> float:
    """Value that a chi-squared variable with ``freedom`` degrees stays below with ``probability``.

    Solves ``P(freedom / 2, x / 2) = probability`` for x by bisection, P being the regularized lower
    incomplete gamma function (NIST DLMF 8.2.4).

    Parameters
    ----------
    probability
        Above 0, below 1.
    freedom
        Degrees of freedom, above 0.

    Examples
    --------
    >>> round(chi_squared_quantile(0.95, 2), 4)
    5.9915
    >>> round(chi_squared_quantile(0.025, 200), 2)
    162.73
    """
    _check(probability, freedom)
    half = 0.5 * freedom
    # Far beyond the quantile for any probability that is not next to 1.
    high = freedom + 10.0 * math.sqrt(2.0 * freedom) + 10.0
    while _gamma(half, 0.5 * high) < probability:
        high *= 2.0
    return _solve(lambda x: _gamma(half, 0.5 * x), probability, high)


def beta_quantile(probability: float, a: float, b: float) -> float:
    """Value that a beta variable with the shapes ``a`` and ``b`` stays below with ``probability``.

    Solves ``I_x(a, b) = probability`` for x by bisection, I being the regularized incomplete beta
    function (NIST DLMF 8.17.2).

    Parameters
    ----------
    probability
        Above 0, below 1.
    a, b
        Shapes, above 0.

    Examples
    --------
    >>> round(beta_quantile(0.5, 3, 3), 6), round(beta_quantile(0.25, 1, 1), 6)
    (0.5, 0.25)
    """
    _check(probability, a, b)
    return _solve(lambda x: _beta(x, a, b), probability, 1.0)


def _check(probability: float, *shapes: float) -> None:
    if not 0.0 < probability < 1.0:
        raise ValueError(f"`probability` is {probability}; it must be above 0 and below 1")
    for shape in shapes:
        if not (shape > 0.0 and math.isfinite(shape)):
            raise ValueError(f"{shape} is no shape of a distribution; it must be above 0")


def _solve(cumulative: Callable[[float], float], probability: float, high: float) -> float:
    low = 0.0
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if cumulative(middle) < probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _gamma(a: float, x: float) -> float:
    """Regularized lower incomplete gamma function P(a, x)."""
    if x <= 0.0:
        return 0.0
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1.0:  # the series 8.11.4 of DLMF
        term = total = 1.0 / a
        for number in range(1, MOST_TERMS):
            term *= x / (a + number)
            total += term
            if term < CLOSE * total:
                break
        return front * total
    # The continued fraction 8.9.2, by Lentz.
    b = x + 1.0 - a
    c, d = 1.0 / TINY, 1.0 / b
    fraction = d
    for number in range(1, MOST_TERMS):
        step = -number * (number - a)
        b += 2.0
        d = 1.0 / _not_zero(step * d + b)
        c = _not_zero(b + step / c)
        fraction *= c * d
        if abs(c * d - 1.0) < CLOSE:
            break
    return 1.0 - front * fraction


def _beta(x: float, a: float, b: float) -> float:
    """Regularized incomplete beta function, by the continued fraction 8.17.22 of DLMF."""
    if x <= 0.0 or x >= 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):
        return 1.0 - _beta(1.0 - x, b, a)
    logarithm = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(logarithm + a * math.log(x) + b * math.log1p(-x)) / a
    c, d = 1.0, 1.0 / _not_zero(1.0 - (a + b) * x / (a + 1.0))
    fraction = d
    for m in range(1, MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        for step in (even, odd):
            d = 1.0 / _not_zero(1.0 + step * d)
            c = _not_zero(1.0 + step / c)
            fraction *= c * d
        if abs(c * d - 1.0) < CLOSE:
            break
    return front * fraction


def _not_zero(value: float) -> float:
    return value if abs(value) > TINY else TINY
