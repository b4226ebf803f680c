"""Comparison of protection levels and errors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.statistics.bootstrap import bootstrap_interval
from access_av.statistics.consistency import horizontal_error_m
from access_av.statistics.proportions import clopper_pearson

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

STATES = ("ok", "degraded", "unavailable")


@dataclass(frozen=True)
class Integrity:
    """Integrity statistics of a monitored localizer.

    Attributes
    ----------
    runs
        Number of runs with a protection level.
    epochs
        Number of steps with a protection level.
    state_shares
        Share of the steps in each state; the share of ``ok`` is the availability.
    median_level_over_error
        Median of protection level divided by horizontal error.
    exceedances
        Steps in state ``ok`` with an error above the protection level.
    runs_with_exceedances
        Runs with at least one such step.
    exceedance_share
        ``exceedances`` divided by the steps in state ``ok``; 0 without such steps.
    exceedance_interval
        95 % interval of ``exceedance_share`` by the bootstrap over whole runs. The upper end is 0
        without an exceedance; ``run_interval`` is then the informative interval.
    run_interval
        95 % interval of the share of runs with an exceedance, by Clopper and Pearson. Epochs of a
        run are correlated; runs are independent.
    by_run
        Number of steps of each run by state, ``beyond`` the level while ``ok``, and, from a
        campaign, ``too_wide``: degraded with a protection level above the alert limit.

    Examples
    --------
    >>> trajectories = pl.DataFrame(
    ...     {
    ...         "run": [0, 0, 1, 1],
    ...         "error_x_m": [0.3, 0.0, 0.6, 0.1],
    ...         "error_y_m": [0.4, 0.2, 0.8, 0.0],
    ...         "protection_level_m": [1.0, 0.1, 4.0, 0.4],
    ...         "integrity": ["ok", "ok", "degraded", "ok"],
    ...     }
    ... )
    >>> found = Integrity.of(trajectories)
    >>> found.availability, found.exceedances, found.runs_with_exceedances
    (0.75, 1, 1)
    """

    runs: int
    epochs: int
    state_shares: Mapping[str, float]
    median_level_over_error: float
    exceedances: int
    runs_with_exceedances: int
    exceedance_share: float
    exceedance_interval: tuple[float, float]
    run_interval: tuple[float, float]
    by_run: Mapping[str, NDArray[np.float64]] = field(
        default_factory=dict, compare=False, repr=False
    )

    @property
    def availability(self) -> float:
        """Returns the share of the epochs in state ``ok``."""
        return self.state_shares["ok"]

    @property
    def ok_shares(self) -> NDArray[np.float64]:
        """Returns the share of the epochs of each run in state ``ok``, shape (runs,)."""
        counts = np.stack([self.by_run[state] for state in STATES])
        return np.asarray(self.by_run["ok"] / counts.sum(axis=0), dtype=np.float64)

    @classmethod
    def of(cls, trajectories: pl.DataFrame) -> Integrity | None:
        """Evaluates a table of trajectories; ``None`` if no step has a protection level."""
        stated = _stated(trajectories)
        if stated.is_empty():
            return None
        ok = pl.col("integrity") == "ok"
        beyond = ok & (pl.col("error_m") > pl.col("protection_level_m"))
        runs = stated.group_by("run", maintain_order=True).agg(
            beyond.sum().alias("beyond"),
            *((pl.col("integrity") == state).sum().alias(state) for state in STATES),
        )
        ratio = (pl.col("protection_level_m") / pl.col("error_m")).median()
        counts = {name: runs[name].to_numpy().astype(np.float64) for name in ("beyond", *STATES)}
        return cls.of_runs(counts, float(stated.select(ratio).item()))

    @classmethod
    def of_runs(
        cls, counts: Mapping[str, NDArray[np.float64]], median_level_over_error: float
    ) -> Integrity:
        """Evaluates numbers of steps of each run: by state, and ``beyond`` the level while ``ok``.

        Examples
        --------
        >>> counts = {"ok": [1, 2], "degraded": [1, 0], "unavailable": [0, 0], "beyond": [1, 0]}
        >>> counts = {name: np.array(of_run, float) for name, of_run in counts.items()}
        >>> Integrity.of_runs(counts, 4.0).availability
        0.75
        """
        by_run = np.column_stack([counts["beyond"], counts["ok"]])
        epochs = int(sum(counts[state].sum() for state in STATES))
        runs, affected = len(by_run), int((by_run[:, 0] > 0).sum())
        return cls(
            runs=runs,
            epochs=epochs,
            state_shares={state: float(counts[state].sum() / epochs) for state in STATES},
            median_level_over_error=median_level_over_error,
            exceedances=int(by_run[:, 0].sum()),
            runs_with_exceedances=affected,
            exceedance_share=_share(by_run),
            # Without an exceedance, every resample has none.
            exceedance_interval=bootstrap_interval(by_run, _share) if affected else (0.0, 0.0),
            run_interval=clopper_pearson(affected, runs),
            by_run=counts,
        )

    def first(self, runs: int) -> Integrity:
        """Returns the first ``runs`` runs, with the ratio of level and error of all runs."""
        counts = {name: it[:runs] for name, it in self.by_run.items()}
        return Integrity.of_runs(counts, self.median_level_over_error)


def _stated(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Returns the steps with a protection level, and their ``error_m``."""
    return trajectories.filter(pl.col("protection_level_m").is_not_null()).select(
        "run", "protection_level_m", "integrity", error_m=horizontal_error_m()
    )


def _share(beyond_and_ok: NDArray[np.float64]) -> float:
    beyond, ok = beyond_and_ok.sum(axis=0)
    return float(beyond / max(1.0, ok))
