"""What the claims are judged by: the paper's three campaigns as numbers.

Every number is an array over *variants* of the same campaigns: the sample as it is, resamples of
its runs (which make intervals), or readings that a search lays side by side. Claims do not care.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping

Numbers: TypeAlias = NDArray[np.float64]
# How many SSBs lie between two errors that are kept of each run.
EVERY = 5


@dataclass(frozen=True)
class Drives:
    """One setting, driven many times.

    Attributes
    ----------
    executions, worst_x_m, worst_y_m, rms_error_m
        Arrays over variants. Worst is along the track, of the mean over runs of the absolute error.
    horizontal_m
        Mean absolute errors in x and y, put together, against time: variants by SSBs.
    longest_gap_s
        Longest time between two estimates of any run.
    besides_j
        Energy besides that of the executions, where the platform counts it.
    worst_of_runs_m
        The worst error of each single run in x or y, where single runs are known.
    """

    executions: Numbers
    worst_x_m: Numbers
    worst_y_m: Numbers
    rms_error_m: Numbers
    horizontal_m: Numbers
    longest_gap_s: float | Numbers = 0.0
    besides_j: float = 0.0
    worst_of_runs_m: Numbers | None = None

    @property
    def worst_m(self) -> Numbers:
        """The larger of X and Y."""
        return np.maximum(self.worst_x_m, self.worst_y_m)

    @classmethod
    def of_runs(
        cls, executions: Numbers, errors_m: NDArray[np.float32], weights: Numbers
    ) -> Drives:
        """Drives from their runs.

        Parameters
        ----------
        executions
            Of each run.
        errors_m
            Estimate minus truth in x and y, of shape (runs, SSBs, 2).
        weights
            One row per variant, of shape (variants, runs), each of sum 1.
        """
        size = np.abs(errors_m)
        light = weights.astype(np.float32)
        mean_x, mean_y = (light @ size[:, :, axis] for axis in (0, 1))
        square_m2 = np.square(errors_m, dtype=np.float64).sum(axis=2).mean(axis=1)
        return cls(
            executions=weights @ executions,
            worst_x_m=mean_x.max(axis=1).astype(np.float64),
            worst_y_m=mean_y.max(axis=1).astype(np.float64),
            rms_error_m=np.sqrt(weights @ square_m2),
            horizontal_m=np.hypot(mean_x, mean_y),
            worst_of_runs_m=size.max(axis=(1, 2)).astype(np.float64),
        )


@dataclass(frozen=True)
class Outcome:
    """The three campaigns of one reading, or of several side by side.

    Attributes
    ----------
    every_ssb
        Campaign P by method.
    fixed
        Campaign Q by power mode and method.
    adaptive
        Campaign R by power mode.
    energy_per_execution_j
        By power mode and method; what the platform has no figure for is absent.
    trip_s
        Duration of a trip.
    cpu_mhz
        Clock by power mode.
    base_wake_up_ms
        By power mode and method.
    settings
        What else the reading and the evaluation are set to that the paper states, by name.
    duty
        Share of the day that is driven.
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


def resamples(runs: int, count: int, seed: int = 0) -> Numbers:
    """Weights of a bootstrap over whole runs; the first row is the sample as it is.

    Examples
    --------
    >>> resamples(4, 2).shape, resamples(4, 2)[0].tolist()
    ((3, 4), [0.25, 0.25, 0.25, 0.25])
    """
    rng = np.random.default_rng(seed)
    drawn = rng.multinomial(runs, np.full(runs, 1.0 / runs), size=count) / runs
    return np.vstack([np.full(runs, 1.0 / runs), drawn])
