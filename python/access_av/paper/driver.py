"""Simulation of the settings of an evaluation, each once, with a memory of the results."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av._core import MeasurementTraces, Scenario
from access_av.paper.outcome import Drives, resamples
from access_av.paper.statements import METHODS
from access_av.run.pairs import ErrorSamples
from access_av.run.simulation import Simulation, simulate

if TYPE_CHECKING:
    from collections.abc import MutableMapping

    from access_av.device.platform import Platform
    from access_av.statistics.percentiles import Percentile

RESAMPLES = 200
# Percentiles use every 25th SSB (0.5 s), because closer errors are correlated.
SPARSE = 25
# Columns of the statistics at each SSB that are kept: the others of 250 settings take 50 MB.
STEPS = ("time_s", "mean_abs_error_x_m", "mean_abs_error_y_m", "mean_true_snr_db")
# Methods of the paper that are simulated in every environment.
TAPED = tuple(method.replace("_", "-") for method in METHODS)


@dataclass(frozen=True)
class Driven:
    """Results of a setting: runs, statistics at each SSB, and a sample of horizontal errors."""

    drives: Drives
    steps: pl.DataFrame
    errors: ErrorSamples

    @cached_property
    def percentiles(self) -> list[Percentile]:
        """Returns percentiles of the horizontal error over all runs and times."""
        return self.errors.percentiles(resamples=RESAMPLES)


@dataclass
class Driver:
    """Simulates settings on one platform with one seed, and stores the results."""

    platform: Platform
    runs: int
    seed: int
    threads: int | None = None
    count: int = RESAMPLES
    methods: tuple[str, ...] = TAPED
    known: MutableMapping[str, Driven] = field(default_factory=dict)
    traces: list[MeasurementTraces] = field(default_factory=list)

    @property
    def trip_s(self) -> float:
        """Returns the duration of the simulated trip."""
        steps = next(iter(self.known.values())).steps
        return float(steps.select(pl.col("time_s").max()).item())

    def as_driven(self, scenario: Scenario) -> Scenario:
        """Returns the scenario with all default values; equal drives have equal scenarios."""
        first_mode = self.platform.modes[0].number
        # A power mode affects the runs only by its base wake-up time, which is resolved here.
        return scenario.resolved(self.platform.core).with_overrides(
            {"name": "drive", "description": "", "vehicle.platform.mode": first_mode}
        )

    def drive(self, scenario: Scenario) -> Driven:
        """Simulates runs of a scenario, unless an equal scenario was simulated before."""
        return self.drive_once(self.as_driven(scenario))

    def drive_once(self, scenario: Scenario) -> Driven:
        """Simulates runs of a scenario of :meth:`as_driven`."""
        key = scenario.to_toml()
        if key not in self.known:
            self.known[key] = self._drive(scenario)
        return self.known[key]

    def _simulate(self, scenario: Scenario) -> Simulation:
        """Simulates with measurement traces, which estimate each angle once for all policies."""
        core, threads = self.platform.core, self.threads
        serving = [it for it in self.traces if it.serve(scenario, platform=core)]
        if not serving:
            # A trace takes 100 MB. Keep that of the first environment, which most interpretations
            # use; release the latest one before the next one is recorded.
            del self.traces[1:]
            made = MeasurementTraces.record(
                scenario,
                self.runs,
                self.seed,
                methods=list(self.methods),
                platform=core,
                threads=threads,
            )
            serving = [it for it in [made] if it and it.serve(scenario, platform=core)]
            self.traces += serving
        if not serving:
            return simulate(
                scenario,
                runs=self.runs,
                seed=self.seed,
                platform=self.platform,
                threads=threads,
                errors_every=1,
            )
        found = serving[0].simulate(scenario, platform=core, threads=threads, errors_every=1)
        return Simulation.of(found)

    def _drive(self, scenario: Scenario) -> Driven:
        found = self._simulate(scenario)
        assert found.errors_m is not None
        return Driven(
            Drives.of(found, resamples(self.runs, self.count)),
            found.steps.select(STEPS),
            ErrorSamples(
                errors_m=np.hypot(*np.moveaxis(found.errors_m[:, ::SPARSE], -1, 0)),
                duration_s=float(found.steps["time_s"][-1]),
            ),
        )
