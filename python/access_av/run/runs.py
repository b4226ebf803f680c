"""Runs of one scenario as plain data: errors, protection levels, counts and energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.device.platform import Platform
from access_av.economics.carbon import Range
from access_av.run.pairs import ErrorSamples
from access_av.run.simulation import simulate
from access_av.settings import platform_name, ssb_period_s
from access_av.statistics.paired import paired_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from access_av import _core

# Interval of the stored errors (s): a vehicle moves less than its width in this time.
KEPT_EVERY_S = 0.1
EXTENTS = ("low", "value", "high")
# Attributes with one row per run.
PER_RUN = ("errors_m", "levels_m", "aoa_estimates", "bursts_received", "seeds")


@dataclass(frozen=True)
class Energy:
    """Mean energy of a trip in joules, low to high by the ranges of the figures.

    Attributes
    ----------
    estimates_j, listening_j
        Energy of angle estimates, and of the receiver while it is on.
    idle_j
        Idle energy of the board if the platform counts it, otherwise 0.
    """

    estimates_j: Range
    listening_j: Range
    idle_j: Range

    @property
    def total_j(self) -> Range:
        """Sum of the three energies."""
        return self.estimates_j.plus(self.listening_j).plus(self.idle_j)


@dataclass(frozen=True, eq=False, kw_only=True)
class Runs(ErrorSamples):
    """Runs of one scenario.

    Attributes
    ----------
    levels_m
        Protection levels, shape (runs, epochs); NaN unless the state is ``ok``.
    """

    scenario: _core.Scenario
    levels_m: NDArray[np.float32]
    time_s: NDArray[np.float64]
    aoa_estimates: NDArray[np.int64]
    bursts_received: NDArray[np.int64]
    seeds: NDArray[np.int64]
    has_own_estimator: bool = False
    own_energy_j: float | None = None

    @property
    def ok_share(self) -> float | None:
        """Share of the time in state ``ok``; ``None`` without an integrity monitor."""
        return None if self.state_shares is None else float(self.state_shares["ok"])

    def ok_delta(self, baseline: Runs, comparisons: int = 1) -> tuple[float, float, float] | None:
        """Returns the paired difference of the share of time in state ``ok`` to the baseline's.

        Variant minus baseline, and the ends of the 95 % interval; ``None`` without a monitor. The
        intervals of a number of ``comparisons`` hold together.
        """
        if self.integrity is None or baseline.integrity is None:
            return None
        mine, its = self.integrity.ok_shares, baseline.integrity.ok_shares
        return paired_mean(mine, its, comparisons=comparisons)

    @property
    def energy_j(self) -> float | None:
        """Mean energy of a trip; ``None`` if the platform has no figure."""
        if self.has_own_estimator:
            return self.own_energy_j
        energy = self.energy()
        return None if energy is None else energy.total_j.central

    def first(self, runs: int) -> Runs:
        """Returns the first `runs` runs, for paired comparisons."""
        its: dict[str, Any] = {name: getattr(self, name)[:runs] for name in PER_RUN}
        return replace(self, **its, integrity=self.integrity and self.integrity.first(runs))

    def named(self, name: str) -> Runs:
        """Returns the runs under another name of the variant."""
        return replace(self, name=name)

    def between(self, first: int, last: int) -> ErrorSamples:
        """Returns the errors of the epochs from ``first`` to before ``last``."""
        share = (last - first) / self.errors_m.shape[1]
        return ErrorSamples(
            name=self.name,
            errors_m=self.errors_m[:, first:last],
            duration_s=share * self.duration_s,
        )

    def energy(
        self, platform: Platform | None = None, vehicle: _core.Vehicle | None = None
    ) -> Energy | None:
        """Energy of a trip; ``None`` without a figure.

        ``vehicle`` may differ from that of the scenario if its runs are identical.
        """
        if self.has_own_estimator:
            return None
        vehicle = vehicle or self.scenario.vehicle
        core = (platform or Platform.load(platform_name(self.scenario.vehicle))).core
        estimates, bursts_received = (
            round(float(it.mean())) for it in (self.aoa_estimates, self.bursts_received)
        )
        found = [
            core.energy_j(vehicle, estimates, bursts_received, self.duration_s, extent)
            for extent in EXTENTS
        ]
        known = [parts[:3] for parts in found if parts is not None]
        if len(known) < len(EXTENTS):
            return None
        return Energy(*(Range(*ends) for ends in zip(*known, strict=True)))

    def table(self) -> pl.DataFrame:
        """Returns one row per run and epoch: columns ``position_errors``."""
        runs, epochs = self.errors_m.shape
        return pl.DataFrame(
            {
                "variant": pl.Series([self.name]).extend_constant(self.name, runs * epochs - 1),
                "run": np.repeat(np.arange(runs, dtype=np.uint32), epochs),
                "time_s": np.tile(self.time_s, runs),
                "error_m": self.errors_m.ravel().astype(np.float32),
                "protection_level_m": self.levels_m.ravel(),
            }
        ).with_columns(pl.col("protection_level_m").fill_nan(None))

    def drives(self) -> pl.DataFrame:
        """Returns one row per run: columns ``study_drives`` of :mod:`access_av.columns`."""
        counts = {} if self.integrity is None else self.integrity.by_run

        def column(name: str, minus: str = "") -> pl.Series:
            if name not in counts:
                return pl.Series([None] * self.runs, dtype=pl.Int64)
            found = counts[name] - counts[minus] if minus else counts[name]
            return pl.Series(np.asarray(found), dtype=pl.Float64).cast(pl.Int64)

        return pl.DataFrame(
            {
                "variant": [self.name] * self.runs,
                "run": np.arange(self.runs, dtype=np.uint32),
                "seed": self.seeds,
                "aoa_estimates": self.aoa_estimates,
                "bursts_received": self.bursts_received,
                "duration_s": [self.duration_s] * self.runs,
                "is_lost": self.lost,
                "ok_steps": column("ok"),
                "level_steps": column("too_wide"),
                "suspected_steps": column("degraded", "too_wide"),
                "unavailable_steps": column("unavailable"),
                "exceedances": column("beyond"),
            }
        )


def drive(
    name: str,
    scenario: _core.Scenario,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    plug_ins: Mapping[str, Any] | None = None,
) -> Runs:
    """Simulates a scenario; an equal seed gives every variant equal environments."""
    period_s = ssb_period_s(scenario.site)
    every = max(1, round(KEPT_EVERY_S / period_s))
    found = simulate(
        scenario,
        runs=runs,
        seed=seed,
        threads=threads,
        errors_every=every,
        progress=progress,
        **(plug_ins or {}),
    )
    if found.errors_m is None or found.levels_m is None:  # errors_every is set
        raise RuntimeError("the simulation stored no error samples")
    errors_m = np.hypot(found.errors_m[:, :, 0], found.errors_m[:, :, 1]).astype(np.float64)
    errors_m[np.isnan(errors_m)] = np.inf
    time_s, energy_j = found.steps["time_s"].to_numpy(), found.runs["energy_j"]
    return Runs(
        name=name,
        scenario=scenario,
        errors_m=errors_m,
        levels_m=found.levels_m,
        time_s=time_s[::every],
        aoa_estimates=found.runs["aoa_estimates"].to_numpy().astype(np.int64),
        bursts_received=found.runs["bursts_received"].to_numpy().astype(np.int64),
        duration_s=float(time_s[-1]),
        integrity=found.integrity,
        seeds=np.full(runs, seed, dtype=np.int64),
        has_own_estimator="estimator" in (plug_ins or {}),
        own_energy_j=None if energy_j.null_count() else float(energy_j.to_numpy().mean()),
    )
