"""One scenario, many drives: the simulator, with tables instead of raw columns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from access_av import _core
from access_av.platform import Platform

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np
    from numpy.typing import NDArray

Scenario = _core.Scenario


@dataclass(frozen=True)
class Simulation:
    """What many drives found.

    Attributes
    ----------
    steps
        Statistics over all runs, one row per SSB: ``time_s``, ``mean_abs_error_x_m``,
        ``mean_abs_error_y_m``, ``rms_error_m``, ``mean_snr_db`` and more.
    runs
        One row per run: ``run``, ``executions``, ``energy_j``, ``rms_error_m`` and more.
    trajectories
        Truth and estimate, one row per run and SSB: ``run``, ``time_s``, ``x_m``, ``y_m``,
        ``heading_rad``, ``true_x_m``, ``true_y_m``, ``error_x_m``, ``error_y_m`` and more.
        ``None`` unless kept.
    executions
        The angle estimates, one row each. ``None`` unless trajectories were kept.
    error_quantiles_m
        Quantiles of the horizontal error over all runs and SSBs, by probability.
    """

    steps: pl.DataFrame
    runs: pl.DataFrame
    trajectories: pl.DataFrame | None
    executions: pl.DataFrame | None
    error_quantiles_m: Mapping[float, float]

    @property
    def rms_error_m(self) -> float:
        """Root mean square of the horizontal error over track and runs."""
        return float(self.steps.select((pl.col("rms_error_m") ** 2).mean().sqrt()).item())


def simulate(
    scenario: Scenario | str | Path,
    *,
    runs: int = 1,
    seed: int = 1,
    platform: Platform | None = None,
    threads: int | None = None,
    keep_trajectories: bool = False,
    estimator: Callable[[NDArray[np.complex128]], float] | None = None,
    policy: Callable[[float, float, float], float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Simulation:
    """Drive a scenario many times.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    runs
        Number of drives.
    seed
        Seed of all random streams: the same seed gives the same bytes.
    platform
        The onboard computer; the one the scenario names when ``None``.
    threads
        Worker threads; all cores when ``None``. Results do not depend on it.
    keep_trajectories
        Whether to keep every drive's trajectory and executions, not only their statistics.
    estimator
        In place of the scenario's: takes complex snapshots of shape (antennas, snapshots) and
        returns the angle from the array's axis in radians.
    policy
        In place of the scenario's controller: takes the SNR error, the velocity error and the
        seconds since its last call, and returns the wake-up time in seconds.
    progress
        Called as ``progress(done, total)`` with numbers of drives.

    Returns
    -------
    Simulation
        Tables.

    Raises
    ------
    ScenarioError
        When the scenario cannot be used; names the key and what is allowed.

    Examples
    --------
    >>> result = simulate("paper", runs=2, seed=7)
    >>> result.runs["run"].to_list()
    [0, 1]
    """
    found = _core.simulate(
        scenario if isinstance(scenario, Scenario) else Scenario.load(str(scenario)),
        runs,
        seed,
        platform=platform.core if platform else None,
        threads=threads,
        keep_trajectories=keep_trajectories,
        estimator=estimator,
        policy=policy,
        progress=progress,
    )
    return Simulation(
        steps=pl.DataFrame(found.steps),
        runs=pl.DataFrame(found.runs),
        trajectories=None if found.trajectories is None else pl.DataFrame(found.trajectories),
        executions=None if found.executions is None else pl.DataFrame(found.executions),
        error_quantiles_m=found.error_quantiles_m,
    )
