"""Pareto front of designs with its confidence, and the table of designs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.statistics.paired import paired_mean
from access_av.statistics.pareto import pareto_front
from access_av.statistics.percentiles import as_columns, names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from access_av.designs.driven import Driven

# Columns that can contain unknown values.
NUMBERS = dict.fromkeys(("energy_j", "rms_error_m", "p90_max_error_m", *names()), pl.Float64)


def differences(one: Driven, others: Sequence[Driven]) -> NDArray[np.float64]:
    """Returns paired differences of energy and squared error of one design to each other one.

    Uses the common runs. Shape (others, 2, 3): mean and the ends of its 95 % interval.
    """
    found = np.empty((len(others), 2, 3))
    for row, other in enumerate(others):
        count = min(one.square_m2.size, other.square_m2.size)
        for column, name in enumerate(("energy_j", "square_m2")):
            mine, its = getattr(one, name)[:count], getattr(other, name)[:count]
            found[row, column] = paired_mean(mine, its)
    return found


def front(driven: Sequence[Driven]) -> list[int]:
    """Returns the Pareto front of mean energy and mean error, ordered by energy."""
    energy_j, square_m2 = aims(driven)
    found = pareto_front(energy_j, square_m2)
    return [int(index) for index in found if np.isfinite(energy_j[index])]


def aims(driven: Sequence[Driven]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns mean energy and mean squared error of each design."""
    return (
        np.array([each.mean_energy_j for each in driven]),
        np.array([float(np.mean(each.square_m2)) for each in driven]),
    )


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


def rows_of(driven: Sequence[Driven]) -> pl.DataFrame:
    """Returns one row per design: choice, energy, errors, and membership of the Pareto front.

    With several environments, each row is that of the worst one.
    """
    return _rows(driven, list(enumerate(driven)))


def rows_of_worlds(driven: Sequence[Driven]) -> pl.DataFrame:
    """Returns one row per design and environment; empty for a single environment."""
    return _rows(driven, [(index, it) for index, one in enumerate(driven) for it in one.worlds])


def _rows(driven: Sequence[Driven], shown: Sequence[tuple[int, Driven]]) -> pl.DataFrame:
    on_front = set(may_be_front(driven)) if shown else set()
    return pl.DataFrame(
        [{"design": index, **row_of(one), "on_front": index in on_front} for index, one in shown],
        infer_schema_length=None,
        schema_overrides=NUMBERS,
    )


def row_of(one: Driven) -> dict[str, Any]:
    """Returns choice, energy and errors of one design."""
    return {
        "choice": one.design.label,
        "world": one.design.world,
        "runs": one.square_m2.size,
        "aoa_estimates": float(one.aoa_estimates.mean()),
        "bursts_received": float(one.bursts_received.mean()),
        "rms_error_m": _known(one.rms_m),
        "energy_j": _known(one.mean_energy_j),
        **as_columns(one.percentiles()),
        "p90_max_error_m": _known(one.p90_worst_m),
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
