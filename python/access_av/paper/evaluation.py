"""The paper's evaluation: three campaigns over methods, power modes and wake-up policies.

P   every method at every SSB (20 ms), what the radio would allow;
Q   every method in every power mode at its base wake-up time, what the computer allows;
R   adaptive MUSIC in every power mode.

Power modes that share a method, a policy and a wake-up time drive the same way, so each such
setting is simulated once, on the same seeds as all others.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av._core import Scenario
from access_av.errors import InputError
from access_av.paper.methods import METHODS
from access_av.paper.statements import paper_numbers
from access_av.platform import Platform, PowerMode
from access_av.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from access_av.simulation import Simulation


@dataclass(frozen=True, order=True)
class Setting:
    """What a drive depends on besides scenario and seed."""

    method: str
    adaptive: bool
    base_wake_up_ms: float

    def apply(self, scenario: Scenario, mode: PowerMode) -> Scenario:
        """The scenario with this method and wake-up policy, in a power mode."""
        changes: dict[str, Any] = {
            "vehicle.estimator.method": self.method.replace("_", "-"),
            "vehicle.platform.mode": mode.number,
        }
        if self.adaptive:
            changes |= {
                "vehicle.wake_up.policy": "pid",
                "vehicle.wake_up.base_ms": self.base_wake_up_ms,
            }
        else:
            changes |= {
                "vehicle.wake_up.policy": "fixed",
                "vehicle.wake_up.interval_ms": self.base_wake_up_ms,
            }
        return scenario.with_overrides(changes)


@dataclass(frozen=True)
class Case:
    """One operating point of the evaluation."""

    campaign: str
    setting: Setting
    mode: PowerMode | None = None


def cases(platform: Platform) -> list[Case]:
    """Every operating point of the three campaigns on a platform."""
    for mode in platform.modes:
        _require(platform, mode, "base_wake_up_ms", mode.base_wake_up_ms)
    ssb_ms = paper_numbers()["wake_up"]["ssb_period_ms"]
    every_ssb = [
        Case("P", Setting(method, adaptive=False, base_wake_up_ms=ssb_ms)) for method in METHODS
    ]
    fixed = [
        Case(
            "Q", Setting(method, adaptive=False, base_wake_up_ms=mode.base_wake_up_ms[method]), mode
        )
        for mode in platform.modes
        for method in METHODS
    ]
    adaptive = [
        Case(
            "R",
            Setting("music", adaptive=True, base_wake_up_ms=mode.base_wake_up_ms["music"]),
            mode,
        )
        for mode in platform.modes
    ]
    return every_ssb + fixed + adaptive


@dataclass(frozen=True)
class Evaluation:
    """All results of an evaluation, as tables.

    Attributes
    ----------
    points
        One row per operating point; columns ``operating_points`` of :mod:`access_av.columns`.
    errors
        Mean errors, one row per setting and time; columns ``errors``.
    snr
        SNR along the track; columns ``snr``.
    """

    points: pl.DataFrame
    errors: pl.DataFrame
    snr: pl.DataFrame
    scenario: Scenario
    platform: Platform
    runs: int
    seed: int
    duration_s: float

    def campaign(self, name: str) -> pl.DataFrame:
        """Operating points of one campaign."""
        return self.points.filter(pl.col("campaign") == name)

    def series(self, point: Mapping[str, Any]) -> pl.DataFrame:
        """Errors against time at an operating point."""
        keys = ("method", "adaptive", "base_wake_up_ms")
        return self.errors.filter(*(pl.col(key) == point[key] for key in keys))

    def horizontal_error_m(self, point: Mapping[str, Any]) -> NDArray[np.float64]:
        """Mean absolute errors in X and Y, put together, against time."""
        series = self.series(point)
        x_m, y_m = (
            series[name].to_numpy() for name in ("mean_abs_error_x_m", "mean_abs_error_y_m")
        )
        return np.asarray(np.hypot(x_m, y_m), dtype=np.float64)


def evaluate(
    scenario: Scenario | str = "paper",
    platform: Platform | str = "jetson-agx-xavier",
    *,
    runs: int = 100,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Run the three campaigns.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one. Its estimator and wake-up interval are replaced
        by each campaign's; its controller settings are kept.
    platform
        A platform, or the name or path of one.
    runs
        Drives per setting.
    seed
        Seed of all random streams.
    threads
        Worker threads; all cores when ``None``. Results do not depend on it.
    progress
        Called as ``progress(done, total)`` with numbers of drives.

    Returns
    -------
    Evaluation
        Operating points, errors against time, SNR along the track.

    Examples
    --------
    >>> found = evaluate(runs=1, seed=1)
    >>> found.points["campaign"].unique().sort().to_list()
    ['P', 'Q', 'R']
    >>> found.campaign("R").height
    8
    """
    started = time.monotonic()
    scenario = Scenario.load(scenario) if isinstance(scenario, str) else scenario
    platform = Platform.load(platform) if isinstance(platform, str) else platform
    wanted = cases(platform)
    settings = {case.setting: case.mode or platform.modes[0] for case in wanted}
    total = runs * len(settings)
    results: dict[Setting, Simulation] = {}
    for setting, mode in settings.items():
        before = runs * len(results)
        results[setting] = simulate(
            setting.apply(scenario, mode),
            runs=runs,
            seed=seed,
            platform=platform,
            threads=threads,
            progress=progress and partial(_tick, progress, before, total),
        )
    reference = results[wanted[0].setting]
    return Evaluation(
        points=pl.DataFrame([_point(case, results[case.setting]) for case in wanted]),
        errors=pl.concat([_errors(setting, result) for setting, result in results.items()]),
        snr=reference.steps.select("time_s", "mean_true_snr_db"),
        scenario=scenario,
        platform=platform,
        runs=runs,
        seed=seed,
        duration_s=time.monotonic() - started,
    )


def _require(platform: Platform, mode: PowerMode, key: str, table: Mapping[str, Any]) -> None:
    if missing := [method for method in METHODS if method not in table]:
        raise InputError(
            f"platform {platform.name}: mode {mode.number} has no `{key}` for "
            f"{', '.join(missing)}; the evaluation compares {', '.join(METHODS)}"
        )


def require_energy(platform: Platform) -> None:
    """Refuse a platform that lacks an energy per execution.

    Raises
    ------
    InputError
        Naming mode and method.
    """
    for mode in platform.modes:
        _require(platform, mode, "energy_per_execution_j", mode.energy_per_execution_j)


def _tick(progress: Callable[[int, int], None], before: int, total: int, done: int, _: int) -> None:
    progress(before + done, total)


def _point(case: Case, result: Simulation) -> dict[str, Any]:
    executions = float(result.runs.select(pl.col("executions").mean()).item())
    worst_x_m, worst_y_m = result.steps.select(
        pl.col("mean_abs_error_x_m", "mean_abs_error_y_m").max()
    ).row(0)
    per_execution = case.mode.energy_per_execution_j.get(case.setting.method) if case.mode else None
    # Idle and listening power do not depend on the mode; they count where the platform says so.
    besides_j = result.runs.select(
        (pl.col("energy_j") - pl.col("energy_executions_j")).mean()
    ).item()
    return {
        "campaign": case.campaign,
        "mode": case.mode.number if case.mode else None,
        "mode_name": case.mode.name if case.mode else None,
        "method": case.setting.method,
        "adaptive": case.setting.adaptive,
        "base_wake_up_ms": case.setting.base_wake_up_ms,
        "executions": executions,
        "worst_error_x_m": worst_x_m,
        "worst_error_y_m": worst_y_m,
        "rms_error_m": result.rms_error_m,
        "energy_per_execution_j": per_execution.value if per_execution else None,
        "energy_j": executions * per_execution.value + besides_j if per_execution else None,
        "energy_provenance": per_execution.provenance if per_execution else None,
    }


def _errors(setting: Setting, result: Simulation) -> pl.DataFrame:
    return result.steps.select(
        pl.lit(setting.method).alias("method"),
        pl.lit(setting.adaptive).alias("adaptive"),
        pl.lit(setting.base_wake_up_ms).alias("base_wake_up_ms"),
        pl.col("time_s"),
        "mean_abs_error_x_m",
        "mean_abs_error_y_m",
    )
