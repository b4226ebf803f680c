"""Paired comparison of two results that were simulated with equal seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from access_av.errors import InputError
from access_av.statistics.paired import paired_difference
from access_av.tables.result import Result

if TYPE_CHECKING:
    from access_av.run.simulation import Simulation


@dataclass(frozen=True, eq=False)
class Difference(Result):
    """Difference of an error percentile between two results, in pairs of runs.

    Attributes
    ----------
    percent
        The percentile.
    delta_m
        Percentile of the result minus that of the baseline, in metres.
    low_m, high_m
        Ends of the 95 % interval over pairs of runs; infinite with a single run.
    runs
        Number of pairs.
    identical
        Whether all errors are equal.
    """

    percent: float
    delta_m: float
    low_m: float
    high_m: float
    runs: int
    identical: bool

    @property
    def is_significant(self) -> bool:
        """Whether the 95 % interval excludes zero."""
        return self.low_m > 0.0 or self.high_m < 0.0

    def __str__(self) -> str:
        if self.identical:
            return f"{self.percent:g} % error: identical in {self.runs} runs"
        verdict = "no significant difference"
        if self.is_significant:
            verdict = "larger" if self.delta_m > 0.0 else "smaller"
        return (
            f"{self.percent:g} % error: {self.delta_m:+.3f} m (95 %: {self.low_m:+.3f} to "
            f"{self.high_m:+.3f} m), {verdict}"
        )


def difference(result: Simulation, baseline: Simulation, *, percent: float = 99.0) -> Difference:
    """Compares two results run by run: equal seeds give both the same environments.

    Parameters
    ----------
    result, baseline
        Results of ``simulate`` with equal seed, number of runs, and kept trajectories or errors.
    percent
        Percentile of the horizontal error.

    Returns
    -------
    Difference
        Result minus baseline: negative if the result is more accurate.

    Raises
    ------
    InputError
        If the runs cannot be paired; names why.

    Examples
    --------
    >>> from access_av import simulate
    >>> found = simulate("paper", runs=2, keep_trajectories=True)
    >>> str(difference(found, found))
    '99 % error: identical in 2 runs'
    """
    errors = []
    for name, each in (("result", result), ("baseline", baseline)):
        kept = each.horizontal_errors_m
        if kept is None:
            raise InputError(
                f"{name}: simulate it with keep_trajectories=True or errors_every, which keep the "
                "errors of each run"
            )
        errors.append(np.where(np.isnan(kept), np.inf, kept))
    mine, its = errors
    if result.seed != baseline.seed:
        raise InputError(f"seeds {result.seed} and {baseline.seed}: pairs need equal seeds")
    if len(mine) != len(its):
        raise InputError(f"{len(mine)} and {len(its)} runs: pairs need equal numbers")
    delta_m, low_m, high_m = paired_difference(mine, its, percent)
    return Difference(
        percent=percent,
        delta_m=delta_m,
        low_m=low_m,
        high_m=high_m,
        runs=len(mine),
        identical=bool(np.array_equal(mine, its)),
    )
