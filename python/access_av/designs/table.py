"""The table of driven designs, and what is asked of it afterwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.designs.front import may_be_front
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.designs.drives import Driven


def rows_of(driven: Sequence[Driven]) -> pl.DataFrame:
    """One row per design: what was chosen, energy, error, and whether it may be of the front."""
    on_front = set(may_be_front(driven))
    return pl.DataFrame(
        [
            {
                "design": index,
                "choice": one.design.label,
                "runs": one.square_m2.size,
                "energy_j": _known(one.mean_energy_j),
                "rms_error_m": _known(one.rms_m),
                "p90_max_error_m": _known(one.p90_worst_m),
                "executions": float(one.executions.mean()),
                "listened": float(one.listened.mean()),
                "on_front": index in on_front,
            }
            for index, one in enumerate(driven)
        ]
    )


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


@dataclass(frozen=True)
class Constraints:
    """What a design has to keep; ``None`` leaves one open.

    Attributes
    ----------
    max_energy_j
        Mean energy of a trip.
    max_rms_m
        Root mean square error over track and runs.
    max_worst_m
        Largest error of a run, in nine of ten.
    """

    max_energy_j: float | None = None
    max_rms_m: float | None = None
    max_worst_m: float | None = None

    def excess(self, row: Mapping[str, Any]) -> dict[str, float]:
        """By what factor a design goes beyond each constraint; at most 1 where it keeps it."""
        has = {
            "energy": (row["energy_j"], self.max_energy_j),
            "RMS error": (row["rms_error_m"], self.max_rms_m),
            "worst error": (row["p90_max_error_m"], self.max_worst_m),
        }
        return {
            name: np.inf if value is None or bound <= 0.0 else value / bound
            for name, (value, bound) in has.items()
            if bound is not None
        }

    def kept(self, rows: pl.DataFrame) -> pl.DataFrame:
        """Designs that keep all of them, the one with the least energy first.

        Examples
        --------
        >>> rows = pl.DataFrame(
        ...     {"energy_j": [2.0, 1.0], "rms_error_m": [0.1, 0.2], "p90_max_error_m": [0.3, 0.6]}
        ... )
        >>> Constraints(max_rms_m=0.15).kept(rows)["energy_j"].to_list()
        [2.0]
        """
        keeps = [
            all(excess <= 1.0 for excess in self.excess(row).values())
            for row in rows.iter_rows(named=True)
        ]
        return rows.filter(pl.Series(keeps, dtype=pl.Boolean)).sort("energy_j", "rms_error_m")


def what_to_change(constraints: Constraints, rows: pl.DataFrame) -> list[str]:
    """Where no design keeps all constraints: what each would have to be, the others kept.

    Raises
    ------
    InputError
        When there are no designs.
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
            advice.append(f"{name} allowed to be {factor:.3g} times as much: {label}")
        else:
            advice.append(f"{name} alone, however much is allowed, does not help")
    nearest, row = min(zip(excesses, records, strict=True), key=lambda pair: max(pair[0].values()))
    factor = max(nearest.values())
    if np.isfinite(factor):
        advice.append(f"all of them {factor:.3g} times as much: {row['choice']}")
    advice.append("else what does not vary: more radio heads, a better odometer, a surveyed road")
    return advice
