"""Table of simulated designs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.designs.front import may_be_front
from access_av.statistics.percentiles import as_columns, names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.designs.driven import Driven

# Columns that can contain unknown values.
NUMBERS = dict.fromkeys(("energy_j", "rms_error_m", "p90_max_error_m", *names()), pl.Float64)


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
