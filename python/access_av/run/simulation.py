"""Simulation of a scenario in many runs, with results as tables."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.device.platform import Platform
from access_av.errors import ImplausibleSettingsWarning
from access_av.run import service_levels
from access_av.run.operation import Operation
from access_av.run.pairs import ErrorSamples
from access_av.run.plug_ins import factory
from access_av.run.shared_state import SharedState
from access_av.statistics.consistency import Consistency, horizontal_error_m
from access_av.statistics.integrity import Integrity
from access_av.statistics.percentiles import Percentile, column
from access_av.tables.columns import TABLES
from access_av.tables.numbers import number
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

Scenario = _core.Scenario

# Number of SSBs in the first ten seconds, at a period of 20 ms.
SETTLED_STEPS = 500
# Key of the plausibility warning of a localizer that does not support the site.
LOCALIZER_KEY = "localizer.kind"


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Result):
    """Results of a simulation. :mod:`access_av.columns` describes the columns of the tables.

    Attributes
    ----------
    steps
        Statistics over all runs, one row per SSB. Errors are those of runs with a known
        pose.
    runs
        One row per run.
    trajectories
        Truth and estimate, one row per run and SSB. ``None`` unless kept.
    aoa_estimates
        One row per angle estimate. ``None`` unless trajectories were kept.
    integrity
        Comparison of protection levels and errors; ``None`` without protection levels.
    error_quantiles_m
        Quantiles of the horizontal error over all runs and SSBs, by probability, from a histogram
        with bins of 5.9 %. Exact values with intervals: :attr:`percentiles`.
    errors_m
        Estimate minus truth in x and y, of shape (runs, SSBs, 2); NaN before the first known
        pose. ``None`` unless kept.
    scenario, seed
        Simulated scenario and seed, which reproduce the result.
    """

    steps: pl.DataFrame
    runs: pl.DataFrame
    trajectories: pl.DataFrame | None
    aoa_estimates: pl.DataFrame | None
    integrity: Integrity | None
    error_quantiles_m: Mapping[float, float]
    errors_m: NDArray[np.float32] | None = None
    levels_m: NDArray[np.float32] | None = None
    scenario: Scenario | None = None
    seed: int | None = None

    def __repr__(self) -> str:
        name = "" if self.scenario is None else f"{self.scenario.name}, "
        return f"Simulation({name}{self.runs.height} runs, RMS error {self.rms_error_m:.3f} m)"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{number(value)}</td></tr>"
            for name, value in self.summary().items()
        )
        return f"<table><caption>{escape(repr(self))}</caption>{rows}</table>"

    @classmethod
    def of(
        cls,
        found: _core.SimulationResult,
        scenario: Scenario | None = None,
        seed: int | None = None,
    ) -> Simulation:
        """Converts the results of the Rust core to tables."""
        kept, estimates = found.trajectories, found.aoa_estimates
        return cls(
            steps=TABLES["steps"].frame(found.steps),
            runs=TABLES["runs"].frame(found.runs),
            trajectories=None if kept is None else TABLES["trajectories"].frame(kept),
            aoa_estimates=None if estimates is None else TABLES["measurements"].frame(estimates),
            integrity=found.integrity and Integrity.of_runs(*found.integrity),
            error_quantiles_m=found.error_quantiles_m,
            errors_m=found.errors_m,
            levels_m=found.levels_m,
            scenario=scenario,
            seed=seed,
        )

    def summary(self) -> dict[str, float | None]:
        """Returns the main figures; aoa_estimates and energy are means over the runs.

        Examples
        --------
        >>> list(simulate("paper", runs=2).summary())[:3]
        ['rms_error_m', 'mean_error_m', 'p50_error_m']
        """
        exact = self.percentiles
        errors_m = (
            {column(100.0 * share): value for share, value in self.error_quantiles_m.items()}
            if exact is None
            else {column(each.percent): each.value for each in exact}
        )
        return {
            "rms_error_m": self.rms_error_m,
            "mean_error_m": self.mean_error_m,
            **errors_m,
            **self.means,
            "duration_s": float(self.steps["time_s"][-1]),
        }

    @property
    def means(self) -> dict[str, float | None]:
        """Means over the runs of angle estimates, received bursts and energy."""
        of_runs = self.runs.select("aoa_estimates", "bursts_received", "energy_j")
        return of_runs.mean().row(0, named=True)

    @property
    def percentiles(self) -> list[Percentile] | None:
        """Percentiles of the horizontal error with intervals; ``None`` without single runs.

        Computed over all known positions by :func:`access_av.statistics.percentiles`.
        """
        errors = self.errors()
        return None if errors is None or np.isnan(errors.errors_m).all() else errors.percentiles()

    def errors(self, name: str = "") -> ErrorSamples | None:
        """Returns :attr:`horizontal_errors_m` with statistics; ``None`` without single runs."""
        errors_m, duration_s = self.horizontal_errors_m, float(self.steps["time_s"][-1])
        if errors_m is None:
            return None
        return ErrorSamples(
            name=name, errors_m=errors_m, duration_s=duration_s, integrity=self.integrity
        )

    @property
    def mean_error_m(self) -> float | None:
        """Mean horizontal error over all known positions; ``None`` without data of single runs."""
        errors_m = self.horizontal_errors_m
        if errors_m is None or np.isnan(errors_m).all():
            return None
        return float(np.nanmean(errors_m))

    @property
    def horizontal_errors_m(self) -> NDArray[np.float64] | None:
        """Horizontal errors of shape (runs, times); NaN until the first pose is known.

        At every SSB with trajectories, at every ``errors_every``-th one with errors; ``None``
        without both.
        """
        if self.trajectories is None:
            if self.errors_m is None:
                return None
            errors_m = self.errors_m.astype(np.float64)
            return np.asarray(np.hypot(errors_m[..., 0], errors_m[..., 1]))
        error_m = pl.when(~pl.col("searching")).then(horizontal_error_m())
        errors_m = self.trajectories.sort("run", "time_s").select(error_m).to_numpy()
        return np.asarray(errors_m.reshape(-1, self.steps.height))

    def plot(self) -> Any:
        """Draws the RMS error and percentiles of all runs against time, with Altair."""
        from access_av.plots.of_results import lines

        columns = ("rms_error_m", "p50_error_m", "p90_error_m", "p99_error_m")
        titles = ("time / s", "horizontal error / m")
        return lines(self.steps, "time_s", columns, titles=titles)

    @property
    def operation(self) -> Operation | None:
        """Availability of the position, and causes of unavailability."""
        if self.trajectories is None or self.scenario is None:
            return None
        steps = self.trajectories.with_columns(error_m=horizontal_error_m())
        return Operation.under(self.scenario.vehicle, steps)

    @property
    def consistency(self) -> Consistency | None:
        """Comparison of errors with the localizer's covariance; ``None`` without trajectories.

        The first :data:`SETTLED_STEPS` are left out of the NEES: an exact start has no covariance.
        """
        if self.trajectories is None:
            return None
        return Consistency.of(self.trajectories, skip=min(SETTLED_STEPS, self.steps.height - 1))

    @property
    def service_levels(self) -> list[service_levels.Verdict] | None:
        """Results for the 3GPP service levels; ``None`` without trajectories."""
        errors_m = self.horizontal_errors_m
        if errors_m is None or self.trajectories is None:
            return None
        step_s = float(self.steps["time_s"][-1]) / max(1, self.steps.height - 1)
        return service_levels.of_runs(errors_m, step_s)

    @property
    def rms_error_m(self) -> float:
        """Root mean square of the horizontal error over track and runs."""
        rms_m = self.steps.select((pl.col("rms_error_m") ** 2).mean().sqrt()).item()
        return math.nan if rms_m is None else float(rms_m)


def simulate(
    scenario: Scenario | str | Path,
    *,
    runs: int = 1,
    seed: int = 1,
    first_run: int = 0,
    platform: Platform | None = None,
    threads: int | None = None,
    keep_trajectories: bool = False,
    errors_every: int | None = None,
    estimator: Callable[..., Any] | None = None,
    policy: Callable[..., Any] | None = None,
    localizer: Callable[..., Any] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Simulation:
    """Simulates a scenario in many runs.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    runs
        Number of runs.
    seed
        Seed of all random streams; equal seeds give bit-identical results.
    first_run
        Index of the first run: runs of equal seed and index are equal.
    platform
        Onboard computer. Default: that of the scenario.
    threads
        Number of worker threads. Default and maximum: one per core. Results do not depend on it.
    keep_trajectories
        Whether to keep the trajectory and angle estimates of every run.
    errors_every
        Interval, in SSBs, of stored errors in x and y and protection levels of every run, for
        statistics over whole runs.
    estimator
        Replaces the vehicle's angle estimator: a class, or a function that makes an estimator. It
        is called once per run, without arguments or as ``estimator(site, vehicle, start)``; a
        function of the snapshots that keeps no state may be given itself. The object is called
        with complex snapshots of shape (antennas, snapshots) and returns the angle from the
        array's axis in radians, 0 to π; or the angle and its standard deviation; or the logarithm
        of the likelihood over the electrical angle, at equally spaced values from −π on; or
        ``None`` where there is no angle. An angle without standard deviation gets the Cramér–Rao
        bound at its SSB's SNR, and one warning. The attribute ``energy_per_execution_j`` or
        ``time_per_execution_s`` specifies the cost of an estimate; without it the runs have
        no energy.
    policy
        Replaces the vehicle's wake-up policy: a class, or a function that makes a policy, as for
        ``estimator``; a function of the situation that keeps no state may be given itself. The
        object is called with the :class:`Situation <access_av._core.Situation>` at each burst that
        is received, and returns whether to estimate the angles of its SSBs, or a list with an
        answer for each. Its method ``listens``, if any, decides before the burst whether the
        receiver is on; without it every burst is received. The attribute ``wake_up_time_s`` is
        recorded with each execution.
    localizer
        Replaces the vehicle's localizer: a class, or a function that makes a localizer, called
        once per run as ``localizer(site, vehicle, start)``, with both settings as dictionaries and
        the initial pose (x and y in metres, heading in radians) as the vehicle knows it. The object
        needs the methods ``odometry(time_s, distance_m, speed_mps, yaw_rate_radps)``,
        ``angle(time_s, head, phase_rad, phase_sigma_rad)``, which may return whether the angle was
        used, and ``pose(time_s)``, which returns x, y, heading and, if known, the 3 by 3 covariance
        of the three. Late angles go to copies of it (:func:`copy.deepcopy`).
    progress
        Called as ``progress(done, total)`` with numbers of runs.

    Raises
    ------
    SettingsError
        Unusable scenario; the message names the key and the allowed values.
    TypeError
        If an estimator, policy or localizer is an object instead of a factory, or a function that
        keeps state.
    ValueError
        If an estimator, policy or localizer returns an invalid value; the message contains the
        call.
    OSError
        Too many threads for the system.

    Warns
    -----
    ImplausibleSettingsWarning
        The localizer does not support the site: dead reckoning with several radio heads.
    UserWarning
        Runs have changed a value that outlives them and that a plug-in reads.

    Examples
    --------
    >>> result = simulate("paper", runs=2, seed=7)
    >>> result.runs["run"].to_list()
    [0, 1]
    """
    if not isinstance(scenario, Scenario):
        scenario = Scenario.load(str(scenario))
    if localizer is None:
        _warn_of_localizer(scenario)
    plug_ins = {"estimator": estimator, "policy": policy, "localizer": localizer}
    factories = {role: factory(plug_in, role) for role, plug_in in plug_ins.items()}
    shared = SharedState(plug_ins)
    found = _core.simulate(
        scenario,
        runs,
        seed,
        first_run=first_run,
        platform=platform.core if platform else None,
        threads=threads,
        keep_trajectories=keep_trajectories,
        errors_every=errors_every,
        estimator=factories["estimator"],
        policy=factories["policy"],
        localizer=factories["localizer"],
        progress=progress,
    )
    if runs > 1:
        shared.warn_of_changes(stacklevel=2)
    return Simulation.of(found, scenario, seed)


def _warn_of_localizer(scenario: Scenario) -> None:
    """Warns of a localizer that does not support the site, at the caller of :func:`simulate`."""
    for it in scenario.warnings():
        if it.key.endswith(LOCALIZER_KEY):
            warnings.warn(f"{scenario.name}: {it}", ImplausibleSettingsWarning, stacklevel=3)
