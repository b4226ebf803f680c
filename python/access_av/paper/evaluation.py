"""The paper's evaluation under one interpretation: campaigns over methods, modes and policies.

P   every method at every SSB (20 ms), the limit of the radio signal;
Q   every method in every power mode at its base wake-up time, the limit of the computer;
R   adaptive MUSIC in every power mode.

Power modes with equal method, policy and wake-up time have equal drives: such a setting is
simulated once, with the same seeds as all others.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av._core import Scenario
from access_av.device.platform import Platform, PowerMode
from access_av.errors import InputError
from access_av.paper import energy_fit
from access_av.paper.driver import Driven, Driver
from access_av.paper.energy_fit import NEEDED_MODES, ModeDemand, fit_energy
from access_av.paper.findings import MissingFigureError, energy_j
from access_av.paper.interpretations import SHIPPED, Interpretation, load
from access_av.paper.outcome import Drives, Outcome
from access_av.paper.statements import METHODS, paper_numbers
from access_av.settings import as_dict
from access_av.statistics.percentiles import as_columns, names
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


@dataclass(frozen=True)
class Setting:
    """Parameters of a run in addition to scenario and seed."""

    method: str
    adaptive: bool
    base_wake_up_ms: float


def fixed_interval(scenario: Scenario, interval_ms: float) -> dict[str, Any]:
    """Returns the wake-up settings of a fixed interval, with the SSB selection of the scenario."""
    wake_up = as_dict(scenario)["vehicle"]["wake_up"]
    clock = wake_up.get("trigger", wake_up).get("ssb_selection", "first-after")
    return {"policy": "fixed", "interval_ms": interval_ms, "ssb_selection": clock}


@dataclass(frozen=True)
class Case:
    """One operating point of the evaluation."""

    campaign: str
    setting: Setting
    mode: PowerMode | None = None

    def apply(self, scenario: Scenario) -> Scenario:
        """Returns the scenario with the method, and with its fixed interval or its power mode."""
        setting = self.setting
        changes: dict[str, Any] = {"vehicle.estimator.method": setting.method.replace("_", "-")}
        if not setting.adaptive:
            changes["vehicle.wake_up"] = fixed_interval(scenario, setting.base_wake_up_ms)
        elif self.mode is not None:
            changes["vehicle.platform.mode"] = self.mode.number
        return scenario.with_overrides(changes)


def cases(platform: Platform) -> list[Case]:
    """Returns every operating point of the three campaigns on a platform."""
    for mode in platform.modes:
        if missing := [method for method in METHODS if method not in mode.base_wake_up_ms]:
            raise InputError(
                f"platform {platform.name}: mode {mode.number} has no `base_wake_up_ms` for "
                f"{', '.join(missing)}; the evaluation compares {', '.join(METHODS)}"
            )
    ssb_ms = paper_numbers()["wake_up"]["ssb_period_ms"]
    every_ssb = [Case("P", Setting(method, False, ssb_ms)) for method in METHODS]
    fixed = [
        Case("Q", Setting(method, False, mode.base_wake_up_ms[method]), mode)
        for mode in platform.modes
        for method in METHODS
    ]
    adaptive = [
        Case("R", Setting("music", True, mode.base_wake_up_ms["music"]), mode)
        for mode in platform.modes
    ]
    return every_ssb + fixed + adaptive


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Result):
    """All results of one interpretation.

    Attributes
    ----------
    points
        One row per operating point; columns ``operating_points`` of :mod:`access_av.columns`.
    errors
        Mean errors, one row per setting and time; columns ``errors``.
    snr
        SNR along the track; columns ``snr``.
    outcome
        Numbers for the verdicts on the claims.
    refitted
        Whether the energies per estimate were fitted to the paper; otherwise those of the platform.
    freedoms
        Degrees of freedom of the fit, of :data:`access_av.paper.energy_fit.FREEDOMS`.
    duration_s
        Computing time. Not compared.
    """

    interpretation: Interpretation
    points: pl.DataFrame
    errors: pl.DataFrame
    snr: pl.DataFrame
    outcome: Outcome
    platform: Platform
    runs: int
    seed: int
    refitted: bool
    duration_s: float = field(default=0.0, compare=False)
    freedoms: tuple[str, ...] = energy_fit.SHIPPED

    def __repr__(self) -> str:
        return (
            f"Evaluation({self.interpretation.name}, {self.runs} runs, {self.points.height} points)"
        )

    @property
    def scenario(self) -> Scenario:
        """The interpretation's scenario."""
        return self.interpretation.scenario

    def plot(self) -> Any:
        """Draws RMS error against energy of every operating point with a mode, with Altair."""
        from access_av.plots.of_results import scatter

        kind = pl.when("adaptive").then(pl.lit("adaptive ")).otherwise(pl.lit("fixed "))
        rows = self.points.filter(pl.col("energy_j").is_not_null()).with_columns(
            line=kind + pl.col("method")
        )
        titles = ("energy of a trip / J", "RMS error / m")
        return scatter(rows, "energy_j", "rms_error_m", "line", titles=titles)

    @property
    def longest_gap_s(self) -> float:
        """Maximum time between two adaptive estimates, over all modes and runs."""
        return max(float(drives.longest_gap_s) for drives in self.outcome.adaptive.values())

    def refit(self, freedoms: Sequence[str]) -> Evaluation:
        """Returns the evaluation with energies per estimate fitted with other degrees of freedom.

        Energies of the platform are not changed. The table of operating points is not changed.
        """
        if not self.refitted:
            return self
        energies_j = fit_energy(demands(self.outcome, self.platform), freedoms)
        outcome = replace(self.outcome, energy_per_execution_j=energies_j)
        return replace(self, outcome=outcome, freedoms=tuple(freedoms))

    def campaign(self, name: str) -> pl.DataFrame:
        """Returns the operating points of one campaign."""
        return self.points.filter(pl.col("campaign") == name)

    def series(self, point: Mapping[str, Any]) -> pl.DataFrame:
        """Returns the errors over time at an operating point."""
        keys = ("method", "adaptive", "base_wake_up_ms")
        return self.errors.filter(*(pl.col(key) == point[key] for key in keys))


def evaluate(
    interpretation: Interpretation | Scenario | str = SHIPPED,
    platform: Platform | str = "jetson-agx-xavier",
    *,
    runs: int = 100,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Simulates the three campaigns under one interpretation.

    Parameters
    ----------
    interpretation
        An interpretation, its name or path, or a scenario. Each campaign replaces the estimator;
        the fixed campaigns also replace the wake-up policy.
    platform
        A platform, or the name or path of one.
    runs
        Runs per setting.
    seed
        Seed of all random streams.
    threads
        Worker threads. Default and maximum: one per core. Results do not depend on it.
    progress
        Called as ``progress(done, total)`` with numbers of settings.

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
    if isinstance(interpretation, Scenario):
        interpretation = Interpretation(
            interpretation.name, interpretation.description, interpretation, (), keeps_t_max=False
        )
    elif isinstance(interpretation, str):
        interpretation = load(interpretation)
    board = Platform.load(platform) if isinstance(platform, str) else platform
    driver = Driver(board, runs, seed, threads)
    return evaluate_with(driver, interpretation, planned(driver, interpretation), progress)


def planned(driver: Driver, interpretation: Interpretation) -> dict[Setting, Scenario]:
    """Returns the scenario of each setting, in the order of the simulation."""
    found: dict[Setting, Scenario] = {}
    for case in cases(driver.platform):
        if case.setting not in found:
            found[case.setting] = driver.as_driven(case.apply(interpretation.scenario))
    return found


def evaluate_with(
    driver: Driver,
    interpretation: Interpretation,
    settings: Mapping[Setting, Scenario] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Evaluates an interpretation with a driver that may have cached runs.

    ``settings`` are those of :func:`planned`; ``progress`` is called with numbers of settings.
    """
    started = time.monotonic()
    platform = driver.platform
    wanted = cases(platform)
    settings = planned(driver, interpretation) if settings is None else settings
    driven: dict[Setting, Driven] = {}
    for setting, scenario in settings.items():
        driven[setting] = driver.drive_once(scenario)
        if progress is not None:
            progress(len(driven), len(settings))
    reference = driven[wanted[0].setting].steps
    outcome, refitted = outcome_of(
        [(case, driven[case.setting].drives) for case in wanted],
        platform,
        driver.trip_s,
        settings=settings_of(interpretation, platform) | {"runs": driver.runs},
    )
    errors = {setting: as_columns(each.percentiles) for setting, each in driven.items()}
    return Evaluation(
        interpretation=interpretation,
        points=pl.DataFrame(
            [_point(case, outcome, refitted) | errors[case.setting] for case in wanted],
            infer_schema_length=None,
            # A column without any value would have no type.
            schema_overrides={
                **dict.fromkeys(("energy_j", *names()), pl.Float64),
                "energy_provenance": pl.String,
            },
        ),
        errors=pl.concat(
            each.steps.select(
                *(pl.lit(value).alias(name) for name, value in vars(setting).items()),
                *("time_s", "mean_abs_error_x_m", "mean_abs_error_y_m"),
            )
            for setting, each in driven.items()
        ),
        snr=reference.select("time_s", "mean_true_snr_db"),
        outcome=outcome,
        platform=platform,
        runs=driver.runs,
        seed=driver.seed,
        refitted=refitted,
        duration_s=time.monotonic() - started,
    )


def outcome_of(
    drives: Sequence[tuple[Case, Drives]],
    platform: Platform,
    trip_s: float,
    *,
    fit_each: bool = False,
    settings: Mapping[str, float] | None = None,
) -> tuple[Outcome, bool]:
    """Returns the numbers for the verdicts, and whether the energies were fitted.

    If the platform's energies are fitted to the paper, they are fitted again to the angle estimates
    of the interpretation: to the first variant, or to each one with ``fit_each``. Measured energies
    are not changed.
    """
    every_ssb = {case.setting.method: each for case, each in drives if case.mode is None}
    fixed, adaptive = {}, {}
    for case, each in drives:
        if case.mode is not None and case.campaign == "Q":
            fixed[case.mode.number, case.setting.method] = each
        elif case.mode is not None:
            adaptive[case.mode.number] = each
    figures = [it for mode in platform.modes for it in mode.energy_per_execution_j.values()]
    refits = adaptive.keys() >= NEEDED_MODES and all(it.provenance == "fitted" for it in figures)
    outcome = Outcome(
        every_ssb,
        fixed,
        adaptive,
        {
            mode.number: {
                method: np.asarray(figure.value)
                for method, figure in mode.energy_per_execution_j.items()
            }
            for mode in platform.modes
        },
        trip_s,
        float(paper_numbers()["day"]["duty"]),
        platform.name,
        {mode.number: mode.cpu_hz / 1e6 for mode in platform.modes},
        {mode.number: mode.base_wake_up_ms for mode in platform.modes},
        {} if settings is None else settings,
    )
    if refits:
        fitted_j = fit_energy(demands(outcome, platform, None if fit_each else 1))
        outcome = replace(outcome, energy_per_execution_j=fitted_j)
    return outcome, refits


def settings_of(interpretation: Interpretation, platform: Platform) -> dict[str, float]:
    """Returns the values of an interpretation for the settings that the paper specifies."""
    scenario = as_dict(interpretation.scenario.resolved(platform.core))
    vehicle = scenario["vehicle"]
    controller = vehicle["wake_up"].get("trigger", vehicle["wake_up"])
    names = ("kp", "ki", "kd", "weight_snr", "weight_velocity", "t_max_ms")
    return {
        "antennas": vehicle["array"]["elements"],
        "snapshots": vehicle["receiver"]["snapshots"],
        "ssb_period_ms": scenario["site"]["ssb"]["period_ms"],
        **{name: controller[name] for name in names if name in controller},
    }


def demands(
    outcome: Outcome, platform: Platform, variants: int | None = 1
) -> dict[int, ModeDemand]:
    """Returns the load of each power mode, for the first ``variants`` or for all (``None``)."""
    return {
        mode.number: ModeDemand(
            cpu_hz=mode.cpu_hz,
            base_wake_up_s={method: mode.base_wake_up_ms[method] / 1e3 for method in METHODS},
            fixed_aoa_estimates={
                method: float(outcome.fixed[mode.number, method].aoa_estimates[0])
                for method in METHODS
            },
            adaptive_aoa_estimates=outcome.adaptive[mode.number].aoa_estimates[:variants],
        )
        for mode in platform.modes
    }


def _point(case: Case, outcome: Outcome, refitted: bool) -> dict[str, Any]:
    method, mode, adaptive = case.setting.method, case.mode, case.setting.adaptive
    drives = outcome.drives(mode.number if mode else None, method, adaptive=adaptive)
    per_execution_j = total_j = provenance = None
    if mode is not None:
        try:
            total_j = float(energy_j(outcome, mode.number, method, adaptive=adaptive)[0])
            per_execution_j = float(
                np.atleast_1d(outcome.energy_per_execution_j[mode.number][method])[0]
            )
            figure = mode.energy_per_execution_j[method]
            provenance = "fitted" if refitted else figure.provenance
        except MissingFigureError:
            pass
    return {
        "campaign": case.campaign,
        "mode": mode.number if mode else None,
        "mode_name": mode.name if mode else None,
        "method": method,
        "adaptive": adaptive,
        "base_wake_up_ms": case.setting.base_wake_up_ms,
        **drives.figures,
        "energy_per_execution_j": per_execution_j,
        "energy_j": total_j,
        "energy_provenance": provenance,
    }
