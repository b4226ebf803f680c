"""Integrity risk per hour by extreme-value theory, for events that are too rare to count."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.statistics.bootstrap import bootstrap_interval
from access_av.statistics.consistency import horizontal_error_m

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Share of the maxima in the tail, and minimum number of maxima for a fit.
TAIL = 0.1
LEAST_PEAKS = 20

# Minimum protection level in the ratio (m), because an exact start has a level of micrometres.
LEAST_LEVEL_M = 0.01

RESAMPLES = 500


def exceedance(values: ArrayLike, level: float) -> float:
    """Returns the probability of a value above ``level``, by peaks over a threshold.

    The excesses of the largest tenth of the values above its minimum u follow a generalised Pareto
    distribution: ``P(x > level) = share · (1 + ξ (level − u) / σ)^(−1/ξ)`` (Pickands, Annals of
    Statistics 3, 1975), with ξ and σ by probability-weighted moments (Hosking and Wallis,
    Technometrics 29, 1987). A shape below 0 (a bounded tail) is replaced by ξ = 0, the
    exponential tail of a squared Gaussian. If ``level`` is not above u, the values are
    counted.

    Parameters
    ----------
    values
        Independent values, (count,).
    level
        Threshold of the probability.

    Examples
    --------
    Far beyond the largest value a tail is known within a factor of about ten.

    >>> rng = np.random.default_rng(1)
    >>> found = exceedance(rng.exponential(size=10_000), 12.0)
    >>> bool(0.1 < found / np.exp(-12.0) < 10.0)
    True
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    tail = max(2, round(TAIL * len(ordered)))
    if len(ordered) <= tail or ordered[-tail - 1] >= level:
        return float((ordered > level).mean()) if len(ordered) else 0.0
    peaks = ordered[-tail:] - ordered[-tail - 1]
    mean = peaks.mean()
    # Mean of x (1 − F(x)), with F by plotting positions.
    lower = (peaks * (1.0 - (np.arange(tail) + 0.65) / tail)).mean()
    shape = max(0.0, 2.0 - mean / (mean - 2.0 * lower)) if mean > 2.0 * lower else 0.0
    scale = mean * (1.0 - shape)
    if scale <= 0.0:
        return 0.0
    reduced = (level - ordered[-tail - 1]) / scale
    beyond = np.exp(-reduced) if shape == 0.0 else (1.0 + shape * reduced) ** (-1.0 / shape)
    return float(tail / len(ordered) * beyond)


@dataclass(frozen=True)
class ObtainedRisk:
    """Rate of errors above the protection level in state ``ok``.

    Attributes
    ----------
    per_hour
        Errors per hour.
    interval
        95 % interval of the rate by the bootstrap over runs.

    Examples
    --------
    An independent Gaussian error every 10 s, and a protection level of four standard deviations.

    >>> rng = np.random.default_rng(1)
    >>> count = 50 * 40
    >>> drives = pl.DataFrame(
    ...     {
    ...         "run": np.arange(count) // 40,
    ...         "time_s": 10.0 * (np.arange(count) % 40),
    ...         "error_x_m": rng.standard_normal(count),
    ...         "error_y_m": np.zeros(count),
    ...         "protection_level_m": np.full(count, 4.0),
    ...         "integrity": ["ok"] * count,
    ...     }
    ... )
    >>> found = ObtainedRisk.of(drives, 10.0)
    >>> truth = 6.33e-5 * 360.0
    >>> bool(found.interval[0] < truth < found.interval[1])
    True
    """

    per_hour: float
    interval: tuple[float, float]

    @classmethod
    def of(cls, trajectories: pl.DataFrame, correlation_s: float) -> ObtainedRisk | None:
        """Evaluates a table of trajectories; ``None`` if it has too few exceedances for a tail.

        One value is the maximum squared ratio of error and level in state ``ok`` within
        ``correlation_s`` seconds. A longer error therefore counts more than once.
        """
        block = (pl.col("time_s") / correlation_s).floor().alias("block")
        ratio = (horizontal_error_m() / pl.col("protection_level_m").clip(LEAST_LEVEL_M)) ** 2
        peaks = (
            trajectories.filter(
                pl.col("protection_level_m").is_not_null(), pl.col("integrity") == "ok"
            )
            .group_by("run", block, maintain_order=True)
            .agg(ratio.max().alias("peak"))
        )
        if TAIL * peaks.height < LEAST_PEAKS:
            return None
        by_run = peaks.group_by("run", maintain_order=True).agg("peak")["peak"].to_list()
        rows = np.full((len(by_run), max(map(len, by_run))), np.nan)
        for row, run in zip(rows, by_run, strict=True):
            row[: len(run)] = run

        def per_hour(runs: NDArray[np.float64]) -> float:
            return 3600.0 / correlation_s * exceedance(runs[np.isfinite(runs)], 1.0)

        return cls(per_hour(rows), bootstrap_interval(rows, per_hour, resamples=RESAMPLES))
