"""Quantiles of the chi-squared, beta and Student distributions.

SciPy is imported at first use, because its import is slower than that of the package.
"""

from __future__ import annotations

import math


def chi_squared_quantile(probability: float, freedom: float) -> float:
    """Returns the quantile of the chi-squared distribution with ``freedom`` degrees of freedom.

    Inverts the regularized lower incomplete gamma function P(freedom / 2, x / 2) (NIST DLMF 8.2.4).

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
    from scipy.special import gammaincinv

    return 2.0 * float(gammaincinv(0.5 * freedom, probability))


def beta_quantile(probability: float, a: float, b: float) -> float:
    """Returns the quantile of the beta distribution with the shapes ``a`` and ``b``.

    Inverts the regularized incomplete beta function I_x(a, b) (NIST DLMF 8.17.2).

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
    from scipy.special import betaincinv

    return float(betaincinv(a, b, probability))


def student_quantile(probability: float, freedom: float) -> float:
    """Value that Student's t with ``freedom`` degrees stays below with ``probability``.

    Examples
    --------
    >>> [round(student_quantile(0.975, freedom), 3) for freedom in (1, 2, 19)]
    [12.706, 4.303, 2.093]
    """
    _check(probability, freedom)
    from scipy.special import stdtrit

    return float(stdtrit(freedom, probability))


def _check(probability: float, *shapes: float) -> None:
    if not 0.0 < probability < 1.0:
        raise ValueError(f"`probability` is {probability}; it must be above 0 and below 1")
    for shape in shapes:
        if not (shape > 0.0 and math.isfinite(shape)):
            raise ValueError(f"the shape parameter is {shape}; it must be above 0")
