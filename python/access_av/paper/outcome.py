"""Numbers for the verdicts on the claims: the results of the paper's three campaigns.

Every number is an array over *variants* of the same campaigns: the original sample, resamples of
its runs (for intervals), or the interpretations of a search. Claims treat all of them equally.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import polars as pl
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.run.simulation import Simulation

Numbers: TypeAlias = NDArray[np.float64]
# Interval, in SSBs, of the stored errors over time of resamples. Maxima, and all figures of the
# original sample, use every SSB.
EVERY = 5


@dataclass(frozen=True)
class Drives:
    """Setting with many runs.

    Attributes
    ----------
    aoa_estimates, worst_x_m, worst_y_m, rms_error_m
        Arrays over variants. The worst error is the maximum along the track of the mean absolute
        error over the runs.
    horizontal_m
        Root sum square of the mean absolute errors in x and y, shape (variants, every fifth SSB).
    longest_gap_s
        Maximum time between two estimates, over all runs.
    other_energy_j
        Energy other than that of the estimates, if the platform includes it.
    worst_of_runs_m
        Maximum error of each run in x or y over every SSB; ``None`` if runs are unknown.
    track_m
        ``horizontal_m`` of the sample at every SSB, of shape (SSBs,); ``None`` if unknown.
    runs
        One row per run: ``run``, ``aoa_estimates``, ``rms_error_m``, ``max_error_x_m``,
        ``max_error_y_m``, ``longest_gap_s``, and ``other_energy_j``, the energy in addition to that
        of the angle estimates; ``None`` if unknown.
    """

    aoa_estimates: Numbers
    worst_x_m: Numbers
    worst_y_m: Numbers
    rms_error_m: Numbers
    horizontal_m: Numbers
    longest_gap_s: float | Numbers = 0.0
    other_energy_j: float = 0.0
    worst_of_runs_m: Numbers | None = None
    track_m: Numbers | None = None
    runs: pl.DataFrame | None = None

    @property
    def figures(self) -> dict[str, float]:
        """Mean numbers of the sample, by their columns in the tables."""
        return {
            "aoa_estimates": float(self.aoa_estimates[0]),
            "worst_error_x_m": float(self.worst_x_m[0]),
            "worst_error_y_m": float(self.worst_y_m[0]),
            "rms_error_m": float(self.rms_error_m[0]),
        }

    @property
    def worst_m(self) -> Numbers:
        """Maximum of X and Y."""
        return np.maximum(self.worst_x_m, self.worst_y_m)

    def share_below(self, other: Drives) -> Numbers:
        """Returns the share of the track on which the mean error is below that of other runs.

        The first variant uses every SSB if both have these errors; resamples use every fifth SSB.
        """
        found = np.asarray((self.horizontal_m < other.horizontal_m).mean(axis=1), dtype=np.float64)
        if self.track_m is not None and other.track_m is not None:
            found[0] = np.mean(self.track_m < other.track_m)
        return found

    @property
    def late_to_early(self) -> Numbers:
        """Returns the mean error of the last quarter of the trip over that of the first."""
        found = _late_to_early(self.horizontal_m)
        if self.track_m is not None:
            found[0] = _late_to_early(self.track_m[None, :])[0]
        return found

    @classmethod
    def of(cls, found: Simulation, weights: Numbers) -> Drives:
        """Returns the statistics of runs with errors at every SSB.

        Parameters
        ----------
        weights
            One row per variant, of shape (variants, runs), each of sum 1; the first one is the
            original sample.
        """
        errors_m = found.errors_m
        assert errors_m is not None
        size_x, size_y = (np.abs(np.ascontiguousarray(errors_m[:, :, it])) for it in (0, 1))
        light = weights.astype(np.float32)
        mean_x, mean_y = light @ size_x, light @ size_y
        square_m2 = np.square(errors_m, dtype=np.float64).sum(axis=2).mean(axis=1)
        worst_x_m, worst_y_m = (it.max(axis=1).astype(np.float64) for it in (mean_x, mean_y))
        rms_error_m = np.sqrt(weights @ square_m2)
        # The original sample has double precision.
        track = [found.steps[f"mean_abs_error_{axis}_m"].to_numpy() for axis in "xy"]
        worst_x_m[0], worst_y_m[0] = (it.max() for it in track)
        rms_error_m[0] = found.rms_error_m
        aoa_estimates = found.runs["aoa_estimates"].to_numpy().astype(np.float64)
        other_j = pl.col("energy_j") - pl.col("energy_aoa_estimates_j")
        runs = found.runs.select(
            run=np.arange(len(aoa_estimates)),
            aoa_estimates=aoa_estimates,
            rms_error_m=np.sqrt(square_m2),
            max_error_x_m=size_x.max(axis=1).astype(np.float64),
            max_error_y_m=size_y.max(axis=1).astype(np.float64),
            other_energy_j=other_j.fill_null(0.0),
            longest_gap_s="longest_gap_s",
        )
        return cls(
            aoa_estimates=weights @ aoa_estimates,
            worst_x_m=worst_x_m,
            worst_y_m=worst_y_m,
            rms_error_m=rms_error_m,
            horizontal_m=np.hypot(mean_x[:, ::EVERY], mean_y[:, ::EVERY]),
            longest_gap_s=float(runs["longest_gap_s"].to_numpy().max()),
            other_energy_j=float(runs["other_energy_j"].to_numpy().mean()),
            worst_of_runs_m=np.maximum(size_x.max(axis=1), size_y.max(axis=1)).astype(np.float64),
            track_m=np.hypot(*track),
            runs=runs,
        )


@dataclass(frozen=True)
class Outcome:
    """The three campaigns of one interpretation, or of several side by side.

    Attributes
    ----------
    every_ssb
        Campaign P by method.
    fixed
        Campaign Q by power mode and method.
    adaptive
        Campaign R by power mode.
    energy_per_execution_j
        Energy by power mode and method; values that the platform lacks are absent.
    base_wake_up_ms
        Wake-up time by power mode and method.
    settings
        Other settings that the paper specifies, by name.
    """

    every_ssb: Mapping[str, Drives]
    fixed: Mapping[tuple[int, str], Drives]
    adaptive: Mapping[int, Drives]
    energy_per_execution_j: Mapping[int, Mapping[str, Numbers]]
    trip_s: float
    duty: float = 1.0
    platform: str = ""
    cpu_mhz: Mapping[int, float] = field(default_factory=dict)
    base_wake_up_ms: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    settings: Mapping[str, float] = field(default_factory=dict)

    def drives(self, mode: int | None, method: str, *, adaptive: bool) -> Drives:
        """Returns the drives of an operating point; at every SSB without a mode."""
        if mode is None:
            return self.every_ssb[method]
        return self.adaptive[mode] if adaptive else self.fixed[mode, method]


def resamples(runs: int, count: int) -> Numbers:
    """Returns weights of a bootstrap over whole runs; the first row is the original sample.

    Examples
    --------
    >>> resamples(4, 2).shape, resamples(4, 2)[0].tolist()
    ((3, 4), [0.25, 0.25, 0.25, 0.25])
    """
    rng = np.random.default_rng(0)
    drawn = rng.multinomial(runs, np.full(runs, 1.0 / runs), size=count) / runs
    return np.vstack([np.full(runs, 1.0 / runs), drawn])


def interval(values: Numbers) -> tuple[float, float]:
    """Returns the 95 % interval of a figure, from its values in the bootstrap resamples.

    Without resamples, both ends are the figure itself.
    """
    low, high = np.quantile(values[1:] if len(values) > 1 else values, (0.025, 0.975))
    return float(low), float(high)


def rows(records: Sequence[Any]) -> pl.DataFrame:
    """Returns one row per record; the columns are the fields that its ``repr`` shows."""
    return pl.DataFrame(
        [{it.name: getattr(each, it.name) for it in fields(each) if it.repr} for each in records]
    )


def _late_to_early(errors_m: Numbers) -> Numbers:
    quarter = errors_m.shape[1] // 4
    early, late = errors_m[:, :quarter], errors_m[:, -quarter:]
    # An exact start has an error of 0, which is replaced by a nanometre.
    return np.asarray(late.mean(axis=1) / np.maximum(early.mean(axis=1), 1e-9), dtype=np.float64)
