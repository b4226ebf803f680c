"""Limits of operating points and designs, and the rows of a table that meet them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.errors import InputError
from access_av.statistics.percentiles import PERCENTS, column, ends_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

ENERGY = "energy"
# Default percentile of the error limit: availability of 3GPP's levels 2, 3 and 5.
USUAL_PERCENT = 99.0
# Column: whether the limits are met with 95 % confidence.
SURELY = "is_sure"
# Columns of the maximum error: of designs, and of operating points of the paper in x and y.
WORST = ("p90_max_error_m", "worst_error_x_m", "worst_error_y_m")


@dataclass(frozen=True)
class Query:
    """Limits of an operating point or a design; ``None`` means no limit.

    Attributes
    ----------
    max_energy_j
        Maximum mean energy of a trip.
    max_rms_m
        Maximum root mean square of the horizontal error over track and runs.
    max_worst_m
        Designs: maximum of the 90th percentile over the runs of the maximum error. Operating points
        of the paper: maximum along the track, in X and in Y, of the mean absolute error.
    max_aoa_estimates
        Maximum number of angle estimates of a trip.
    modes
        Permitted power modes.
    max_error_m, percentile
        Maximum of this percentile of the horizontal error. Default percentile: 99.

    Raises
    ------
    InputError
        Percentile that is not one of :data:`~access_av.statistics.percentiles.PERCENTS`.
    """

    max_energy_j: float | None = None
    max_rms_m: float | None = None
    max_worst_m: float | None = None
    max_aoa_estimates: float | None = None
    modes: Sequence[int] | None = None
    max_error_m: float | None = None
    percentile: float | None = None

    def __post_init__(self) -> None:
        if self.percent not in PERCENTS:
            allowed = ", ".join(f"{percent:g}" for percent in PERCENTS)
            raise InputError(f"percentile {self.percent:g}: allowed are {allowed}")

    def __str__(self) -> str:
        parts = [
            f"{name} ≤ {bound:g} {unit}".rstrip()
            for name, bound, unit in (
                ("energy", self.max_energy_j, "J"),
                ("RMS error", self.max_rms_m, "m"),
                (f"{self.percent:g} % of errors", self.max_error_m, "m"),
                ("worst error", self.max_worst_m, "m"),
                ("aoa_estimates", self.max_aoa_estimates, ""),
            )
            if bound is not None
        ]
        if self.modes is not None:
            parts.append("mode " + ", ".join(map(str, self.modes)))
        return " and ".join(parts) or "any operating point"

    @property
    def percent(self) -> float:
        """Returns the limited percentile, in percent."""
        return USUAL_PERCENT if self.percentile is None else self.percentile

    @property
    def is_empty(self) -> bool:
        """Returns whether there is no limit."""
        return not self._judged({}) and self.modes is None

    @property
    def binds_energy_alone(self) -> bool:
        """Returns whether only the energy is limited."""
        return self._judged({}).keys() <= {ENERGY}

    def excess(self, row: Mapping[str, Any]) -> dict[str, float]:
        """Returns the ratio of value and limit for each limit; at most 1 if it is met."""
        return {
            name: np.inf if value is None or bound <= 0.0 else value / bound
            for name, (value, bound, _) in self._judged(row).items()
        }

    def keeps(self, row: Mapping[str, Any]) -> bool:
        """Returns whether a row meets all limits."""
        in_modes = self.modes is None or row["mode"] in self.modes
        return in_modes and all(factor <= 1.0 for factor in self.excess(row).values())

    def keeps_surely(self, row: Mapping[str, Any]) -> bool:
        """Returns whether all limits are met with 95 % confidence (upper end of the interval)."""
        high_m = self._ends(row)[1]
        of_percentile = self.max_error_m is None or (
            high_m is not None and high_m <= self.max_error_m
        )
        return of_percentile and self.keeps(row)

    def in_words(self, row: Mapping[str, Any]) -> list[str]:
        """Returns value and limit of each limited quantity as text.

        Examples
        --------
        >>> row = {"p99_error_m": 0.286, "p99_error_low_m": 0.21, "p99_error_high_m": 0.34}
        >>> Query(max_error_m=0.3).in_words(row)
        ['99th percentile of the error 0.286 m (95 %: 0.21 to 0.34), limit 0.3 m: too few runs']
        """
        found = []
        for name, (value, bound, unit) in self._judged(row).items():
            had, verdict = "unknown" if value is None else f"{value:.3g} {unit}", "missed"
            if value is not None and value <= bound:
                verdict = "met"
            if name == self._percentile_name and value is not None:
                low_m, high_m = self._ends(row)
                if (high_m is None and verdict == "met") or (high_m or 0.0) > bound >= value:
                    verdict = "too few runs"
                had += f" (95 %: {ends_text(low_m, high_m)})"
            found.append(f"{name} {had}, limit {bound:g} {unit}: {verdict}")
        return found

    def instead(self, name: str, factor: float) -> str:
        """Returns a relaxed limit (the limit multiplied by a factor) and the present limit as text.

        Examples
        --------
        >>> Query(max_energy_j=3.0).instead("energy", 4.0 / 3.0)
        'energy 4 J instead of 3 J'
        """
        _, bound, unit = self._judged({})[name]
        # Round up, so that the design meets the limit.
        needed = math.nextafter(bound * factor, 0.0)
        step = 10.0 ** (math.floor(math.log10(needed)) - 2)
        return f"{name} {math.ceil(needed / step) * step:.3g} {unit} instead of {bound:g} {unit}"

    def kept(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Returns the designs that meet all limits, by 95 % confidence, then by energy.

        Examples
        --------
        >>> rows = pl.DataFrame(
        ...     {
        ...         **{"energy_j": [2.0, 1.0], "rms_error_m": [0.1, 0.2]},
        ...         **{"p90_max_error_m": [0.3, 0.6], "p99_error_high_m": [0.3, 0.6]},
        ...         "p99_error_m": [0.25, 0.5],
        ...     }
        ... )
        >>> Query(max_rms_m=0.15).kept(rows)["energy_j"].to_list()
        [2.0]
        """
        surely = pl.Series(SURELY, map(self.keeps_surely, rows.to_dicts()), dtype=pl.Boolean)
        found = rows.with_columns(surely).filter(self._mask(rows))
        return found.sort(SURELY, "energy_j", "rms_error_m", descending=[True, False, False])

    def _mask(self, rows: pl.DataFrame) -> pl.Series:
        return pl.Series(map(self.keeps, rows.to_dicts()), dtype=pl.Boolean)

    @property
    def _percentile_name(self) -> str:
        return f"{self.percent:g}th percentile of the error"

    def _judged(self, row: Mapping[str, Any]) -> dict[str, tuple[float | None, float, str]]:
        """Returns value, limit and unit of each limited quantity of a row."""
        worst_m = [row[name] for name in WORST if row.get(name) is not None]
        every = {
            ENERGY: (row.get("energy_j"), self.max_energy_j, "J"),
            "RMS error": (row.get("rms_error_m"), self.max_rms_m, "m"),
            self._percentile_name: (row.get(column(self.percent)), self.max_error_m, "m"),
            "maximum error": (max(worst_m, default=None), self.max_worst_m, "m"),
            "angle estimates": (row.get("aoa_estimates"), self.max_aoa_estimates, ""),
        }
        return {
            name: (value, bound, unit)
            for name, (value, bound, unit) in every.items()
            if bound is not None
        }

    def _ends(self, row: Mapping[str, Any]) -> tuple[float | None, float | None]:
        """Returns the ends of the 95 % interval of the limited percentile."""
        name = column(self.percent)
        low_m, high_m = (
            row.get(name.replace("_error_m", f"_error_{it}_m")) for it in ("low", "high")
        )
        return low_m, high_m


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
    known = points.filter(pl.col("energy_j").is_not_null())
    return known.filter(query._mask(known)).sort("energy_j", "rms_error_m", "mode")


def what_to_change(query: Query, rows: pl.DataFrame) -> list[str]:
    """Returns the limits that would have to change if no design meets all limits.

    Raises
    ------
    InputError
        No designs.
    """
    if rows.is_empty():
        raise InputError("the results contain no designs")
    records = rows.to_dicts()
    excesses = [query.excess(row) for row in records]
    advice = []
    for name in excesses[0]:
        others = [
            (excess[name], row["choice"])
            for row, excess in zip(records, excesses, strict=True)
            if all(value <= 1.0 for other, value in excess.items() if other != name)
            and np.isfinite(excess[name])
        ]
        if others:
            factor, label = min(others)
            advice.append(f"{query.instead(name, factor)}: {label}")
        else:
            advice.append(f"{name}: no value of this limit alone is sufficient")
    nearest, row = min(zip(excesses, records, strict=True), key=lambda pair: max(pair[0].values()))
    factor = max(nearest.values())
    if np.isfinite(factor) and len(nearest) > 1:
        every = ", ".join(query.instead(name, factor) for name in nearest)
        advice.append(f"{every}: {row['choice']}")
    advice.append("other changes: more radio heads, a better odometer, a surveyed road")
    return advice
