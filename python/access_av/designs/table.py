"""Table of simulated designs, and queries of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.designs.front import may_be_front
from access_av.errors import InputError
from access_av.statistics.percentiles import PERCENTS, as_columns, column, ends_text, names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.designs.driven import Driven

# Columns that can contain unknown values.
NUMBERS = dict.fromkeys(("energy_j", "rms_error_m", "p90_max_error_m", *names()), pl.Float64)
ENERGY = "energy"
# Default percentile of the error limit: availability of 3GPP's levels 2, 3 and 5.
USUAL_PERCENT = 99.0
# Column: whether the limits are met with 95 % confidence.
SURELY = "is_sure"


def rows_of(driven: Sequence[Driven]) -> pl.DataFrame:
    """Returns one row per design: choice, energy, errors, and membership of the Pareto front.

    With several environments, each row is that of the worst one.
    """
    on_front = set(may_be_front(driven))
    return pl.DataFrame(
        [
            {"design": index, **row_of(one), "on_front": index in on_front}
            for index, one in enumerate(driven)
        ],
        infer_schema_length=None,
        schema_overrides=NUMBERS,
    )


def rows_of_worlds(driven: Sequence[Driven]) -> pl.DataFrame:
    """Returns one row per design and environment; empty for a single environment."""
    return pl.DataFrame(
        [
            {"design": index, **row_of(world)}
            for index, one in enumerate(driven)
            for world in one.worlds
        ],
        infer_schema_length=None,
        schema_overrides=NUMBERS,
    )


def row_of(one: Driven) -> dict[str, Any]:
    """Returns choice, energy and errors of one design."""
    return {
        "choice": one.design.label,
        "world": one.design.world,
        "runs": one.square_m2.size,
        "energy_j": _known(one.mean_energy_j),
        "rms_error_m": _known(one.rms_m),
        **as_columns(one.percentiles()),
        "p90_max_error_m": _known(one.p90_worst_m),
        "aoa_estimates": float(one.aoa_estimates.mean()),
        "bursts_received": float(one.bursts_received.mean()),
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


@dataclass(frozen=True)
class Constraints:
    """Limits of a design; ``None`` means no limit.

    Attributes
    ----------
    max_energy_j
        Maximum mean energy of a trip.
    max_rms_m
        Maximum root mean square error over track and runs.
    max_worst_m
        Maximum of the 90th percentile over the runs of the maximum error.
    max_error_m, percentile
        Maximum of this percentile of the error. Default percentile: 99.

    Raises
    ------
    InputError
        Percentile that is not one of :data:`~access_av.statistics.percentiles.PERCENTS`.
    """

    max_energy_j: float | None = None
    max_rms_m: float | None = None
    max_worst_m: float | None = None
    max_error_m: float | None = None
    percentile: float | None = None

    def __post_init__(self) -> None:
        if self.percent not in PERCENTS:
            allowed = ", ".join(f"{percent:g}" for percent in PERCENTS)
            raise InputError(f"percentile {self.percent:g}: it can be {allowed}")

    @property
    def percent(self) -> float:
        """Returns the limited percentile, in percent."""
        return USUAL_PERCENT if self.percentile is None else self.percentile

    @property
    def is_empty(self) -> bool:
        """Returns whether there is no limit."""
        return not self._judged({})

    @property
    def binds_energy_alone(self) -> bool:
        """Returns whether only the energy is limited."""
        return self._judged({}).keys() <= {ENERGY}

    def excess(self, row: Mapping[str, Any]) -> dict[str, float]:
        """Returns the ratio of value and limit for each limit; at most 1 if it is met."""
        return {
            name: np.inf if value is None or bound <= 0.0 else value / bound
            for name, (value, bound) in self._judged(row).items()
        }

    def keeps(self, row: Mapping[str, Any]) -> bool:
        """Returns whether a design meets all limits."""
        return all(factor <= 1.0 for factor in self.excess(row).values())

    def keeps_surely(self, row: Mapping[str, Any]) -> bool:
        """Returns whether all limits are met with 95 % confidence (upper end of the interval)."""
        high_m = row[column(self.percent).replace("_error_m", "_error_high_m")]
        of_percentile = self.max_error_m is None or (
            high_m is not None and high_m <= self.max_error_m
        )
        return of_percentile and self.keeps(row)

    def in_words(self, row: Mapping[str, Any]) -> list[str]:
        """Returns value and limit of each limited quantity as text.

        Examples
        --------
        >>> row = {"p99_error_m": 0.286, "p99_error_low_m": 0.21, "p99_error_high_m": 0.34}
        >>> Constraints(max_error_m=0.3).in_words(row)
        ['99th percentile of the error 0.286 m (95 %: 0.21 to 0.34), limit 0.3 m: too few runs']
        """
        told = []
        for name, (value, bound) in self._judged(row).items():
            unit = "J" if name == ENERGY else "m"
            had, verdict = "unknown" if value is None else f"{value:.3g} {unit}", "missed"
            if value is not None and value <= bound:
                verdict = "met"
            if name == self._percentile_name and value is not None:
                low_m, high_m = _ends(row, self.percent)
                if (high_m is None and verdict == "met") or (high_m or 0.0) > bound >= value:
                    verdict = "too few runs"
                had += f" (95 %: {ends_text(low_m, high_m)})"
            told.append(f"{name} {had}, limit {bound:g} {unit}: {verdict}")
        return told

    def instead(self, name: str, factor: float) -> str:
        """Returns a limit multiplied by a factor, and the present limit, as text.

        Examples
        --------
        >>> Constraints(max_energy_j=3.0).instead("energy", 4.0 / 3.0)
        'energy 4 J instead of 3 J'
        """
        _, bound = self._judged({})[name]
        unit = "J" if name == ENERGY else "m"
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
        >>> Constraints(max_rms_m=0.15).kept(rows)["energy_j"].to_list()
        [2.0]
        """
        records = rows.to_dicts()
        keeps = pl.Series([self.keeps(row) for row in records], dtype=pl.Boolean)
        surely = pl.Series(SURELY, [self.keeps_surely(row) for row in records], dtype=pl.Boolean)
        found = rows.with_columns(surely).filter(keeps)
        return found.sort(SURELY, "energy_j", "rms_error_m", descending=[True, False, False])

    @property
    def _percentile_name(self) -> str:
        return f"{self.percent:g}th percentile of the error"

    def _judged(self, row: Mapping[str, Any]) -> dict[str, tuple[float | None, float]]:
        """Returns value and limit of each limited quantity of a row."""
        every = {
            ENERGY: (row.get("energy_j"), self.max_energy_j),
            "RMS error": (row.get("rms_error_m"), self.max_rms_m),
            self._percentile_name: (row.get(column(self.percent)), self.max_error_m),
            "maximum error": (row.get("p90_max_error_m"), self.max_worst_m),
        }
        return {name: (value, bound) for name, (value, bound) in every.items() if bound is not None}


def _ends(row: Mapping[str, Any], percent: float) -> tuple[float | None, float | None]:
    name = column(percent)
    low_m, high_m = (row.get(name.replace("_error_m", f"_error_{it}_m")) for it in ("low", "high"))
    return low_m, high_m


def what_to_change(constraints: Constraints, rows: pl.DataFrame) -> list[str]:
    """Returns the limits that would have to change if no design meets all limits.

    Raises
    ------
    InputError
        No designs.
    """
    if rows.is_empty():
        raise InputError("no designs to choose from")
    records = rows.to_dicts()
    excesses = [constraints.excess(row) for row in records]
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
            advice.append(f"{constraints.instead(name, factor)}: {label}")
        else:
            advice.append(f"{name}: no value of this limit alone is sufficient")
    nearest, row = min(zip(excesses, records, strict=True), key=lambda pair: max(pair[0].values()))
    factor = max(nearest.values())
    if np.isfinite(factor) and len(nearest) > 1:
        every = ", ".join(constraints.instead(name, factor) for name in nearest)
        advice.append(f"{every}: {row['choice']}")
    advice.append("other changes: more radio heads, a better odometer, a surveyed road")
    return advice
