"""Tables of runs and resamples, sufficient to compute intervals and shares again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.paper.statements import METHODS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from access_av.paper.evaluation import Evaluation
    from access_av.paper.outcome import Drives

# Campaigns of the table of runs that are not operating points: constants in place of Algorithm 1,
# MUSIC at fixed intervals, the tracker of this project, and both with equal information.
CONSTANT, FRONT, TRACKER, EQUAL = "constant", "front", "tracker", "equal"


# Columns that identify a setting: type, and value unless given.
_KEY: dict[str, tuple[Any, Any]] = {
    "interpretation": (pl.String, None),
    "campaign": (pl.String, None),
    "mode": (pl.Int64, None),
    "method": (pl.String, "music"),
    "adaptive": (pl.Boolean, False),
    "base_wake_up_ms": (pl.Float64, None),
    "variant": (pl.String, ""),
}


def of_drives(
    drives: Drives | None, energy_per_execution_j: float | None = None, **key: Any
) -> pl.DataFrame:
    """Returns the runs of a setting; columns ``runs`` of :mod:`access_av.columns`.

    Parameters
    ----------
    drives
        Runs of the setting. Without single runs the table is empty.
    energy_per_execution_j
        Energy per angle estimate; ``None`` if unknown.
    key
        Columns that identify the setting; by default fixed MUSIC without power mode.
    """
    if drives is None or drives.runs is None:
        return pl.DataFrame()
    energy_j = (
        pl.lit(None, dtype=pl.Float64)
        if energy_per_execution_j is None
        else pl.col("aoa_estimates") * energy_per_execution_j + pl.col("other_energy_j")
    )
    return drives.runs.select(
        *_key(key),
        "run",
        "aoa_estimates",
        "rms_error_m",
        "max_error_x_m",
        "max_error_y_m",
        "longest_gap_s",
        energy_j.alias("energy_j"),
    )


def _key(given: Mapping[str, Any]) -> list[pl.Expr]:
    return [
        pl.lit(given.get(name, usual), dtype=kind).alias(name)
        for name, (kind, usual) in _KEY.items()
    ]


def points_of(evaluation: Evaluation) -> Iterator[tuple[dict[str, Any], Drives, float | None]]:
    """Yields key, drives and energy per estimate of every operating point."""
    outcome = evaluation.outcome
    for point in evaluation.points.iter_rows(named=True):
        drives = outcome.drives(point["mode"], point["method"], adaptive=point["adaptive"])
        names = ("campaign", "mode", "method", "adaptive", "base_wake_up_ms")
        key = {
            "interpretation": evaluation.interpretation.name,
            **{name: point[name] for name in names},
        }
        yield key, drives, point["energy_per_execution_j"]


def resamples_of(evaluation: Evaluation) -> list[pl.DataFrame]:
    """Returns the bootstrap resamples of every operating point of an evaluation.

    Columns ``runs`` of :mod:`access_av.columns`. Row 0 of a setting is the sample.
    """
    tables = []
    for key, drives, _ in points_of(evaluation):
        count, fixed = len(drives.rms_error_m), evaluation.outcome.fixed
        unknown = np.full(count, np.nan)
        values = {
            "aoa_estimates": drives.aoa_estimates,
            "worst_error_x_m": drives.worst_x_m,
            "worst_error_y_m": drives.worst_y_m,
            "rms_error_m": drives.rms_error_m,
            "late_to_early": drives.late_to_early,
            **{
                f"share_below_{method}": drives.share_below(fixed[key["mode"], method])
                if key["adaptive"]
                else unknown
                for method in METHODS
            },
        }
        table = pl.DataFrame({"resample": np.arange(count), **values}).fill_nan(None)
        tables.append(table.select(*_key(key), pl.all()))
    return tables


def joined(tables: Iterable[pl.DataFrame]) -> pl.DataFrame:
    """Joins tables; returns an empty table without input."""
    found = [table for table in tables if not table.is_empty()]
    return pl.concat(found) if found else pl.DataFrame()
