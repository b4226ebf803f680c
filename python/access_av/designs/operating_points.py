"""Operating points that meet an energy budget and an accuracy limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from access_av.errors import InputError
from access_av.statistics.percentiles import PERCENTS, column

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True)
class Query:
    """Limits of an operating point; ``None`` means no limit.

    Attributes
    ----------
    max_energy_j
        Maximum energy of one trip.
    max_rms_m
        Maximum root mean square of the horizontal error over the track and the runs.
    max_worst_m
        Maximum along the track, in X and in Y, of the mean absolute error over the runs.
    max_aoa_estimates
        Maximum number of angle estimates in one trip.
    modes
        Permitted power modes.
    max_error_m, percentile
        Maximum of this percentile of the horizontal error.
    """

    max_energy_j: float | None = None
    max_rms_m: float | None = None
    max_worst_m: float | None = None
    max_aoa_estimates: float | None = None
    modes: Sequence[int] | None = None
    max_error_m: float | None = None
    percentile: float = 99.0

    def __post_init__(self) -> None:
        if self.percentile not in PERCENTS:
            allowed = ", ".join(f"{percent:g}" for percent in PERCENTS)
            raise InputError(f"percentile {self.percentile:g}: it can be {allowed}")

    def __str__(self) -> str:
        parts = [
            f"{name} ≤ {bound:g} {unit}".rstrip()
            for name, bound, unit in (
                ("energy", self.max_energy_j, "J"),
                ("RMS error", self.max_rms_m, "m"),
                (f"{self.percentile:g} % of errors", self.max_error_m, "m"),
                ("worst error", self.max_worst_m, "m"),
                ("aoa_estimates", self.max_aoa_estimates, ""),
            )
            if bound is not None
        ]
        if self.modes is not None:
            parts.append("mode " + ", ".join(map(str, self.modes)))
        return " and ".join(parts) or "any operating point"


def explore(points: pl.DataFrame, query: Query) -> pl.DataFrame:
    """Returns the operating points that meet a query, ordered by energy.

    Parameters
    ----------
    points
        Operating points of :func:`access_av.evaluate`.
    query
        Limits.

    Returns
    -------
    polars.DataFrame
        Matching rows, by energy, then by error. May be empty.

    Examples
    --------
    >>> points = pl.DataFrame(
    ...     {"mode": [0, 1], "energy_j": [256.0, 207.0], "rms_error_m": [0.12, 0.17]}
    ... )
    >>> explore(points, Query(max_rms_m=0.15))["mode"].to_list()
    [0]
    """
    bounds = {
        "energy_j": query.max_energy_j,
        "rms_error_m": query.max_rms_m,
        column(query.percentile): query.max_error_m,
        "worst_error_x_m": query.max_worst_m,
        "worst_error_y_m": query.max_worst_m,
        "aoa_estimates": query.max_aoa_estimates,
    }
    kept = points.filter(pl.col("energy_j").is_not_null())
    for name, bound in bounds.items():
        if bound is not None:
            kept = kept.filter(pl.col(name) <= bound)
    if query.modes is not None:
        kept = kept.filter(pl.col("mode").is_in(list(query.modes)))
    return kept.sort("energy_j", "rms_error_m", "mode")


def pareto_front(points: pl.DataFrame) -> pl.DataFrame:
    """Returns the Pareto front of energy and RMS error, ordered by energy."""
    ordered = points.filter(pl.col("energy_j").is_not_null()).sort("energy_j", "rms_error_m")
    best_so_far = pl.col("rms_error_m").cum_min().shift(1)
    return ordered.filter(best_so_far.is_null() | (pl.col("rms_error_m") < best_so_far))
