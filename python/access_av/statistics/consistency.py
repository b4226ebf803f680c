"""Consistency of a localizer: comparison of its errors with its covariance.

The functions use a table of trajectories from ``access_av.simulate(…, keep_trajectories=True)`` or
``trajectories.parquet``. Steps before the first known pose are ignored. Equal tables give
bit-identical results: sums are computed over lists, because the last digit of a ``group_by`` sum
depends on its threads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from access_av.statistics.bootstrap import bootstrap_interval, check_probability

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# Dimensions of the position: x and y.
DIMENSIONS = 2


def horizontal_error_m() -> pl.Expr:
    """Returns the distance between truth and estimate in a table of trajectories.

    Examples
    --------
    >>> steps = pl.DataFrame({"error_x_m": [3.0], "error_y_m": [4.0]})
    >>> steps.select(horizontal_error_m()).item()
    5.0
    """
    return (pl.col("error_x_m") ** 2 + pl.col("error_y_m") ** 2).sqrt()


def nees(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Returns the normalised estimation error squared (NEES) of the position for each step and run.

    ``e' P⁻¹ e`` with the error e in x and y and the localizer's covariance P of it; chi-squared
    with two degrees of freedom where error and covariance agree, 2 on average (Bar-Shalom, Li and
    Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, 5.4.2).

    Parameters
    ----------
    trajectories
        Columns ``trajectories`` of :mod:`access_av.columns`.

    Returns
    -------
    polars.DataFrame
        Columns ``nees``; null without a covariance, with a singular one, and before the first
        known pose.

    Examples
    --------
    An error of one standard deviation in x and of two in y.

    >>> step = {"run": 0, "time_s": 0.0, "searching": False, "error_x_m": 0.1, "error_y_m": 0.4}
    >>> covariance = {"covariance_xx_m2": 0.01, "covariance_xy_m2": 0.0, "covariance_yy_m2": 0.04}
    >>> round(nees(pl.DataFrame([step | covariance]))["nees"][0], 9)
    5.0
    """
    usable = ~pl.col("searching")
    return trajectories.select("run", "time_s", nees=pl.when(usable).then(nees_of_step()))


def nees_of_step() -> pl.Expr:
    """Returns the NEES of the position of each row; null with a singular covariance."""
    dx, dy = pl.col("error_x_m"), pl.col("error_y_m")
    xx, xy, yy = (pl.col(f"covariance_{axes}_m2") for axes in ("xx", "xy", "yy"))
    determinant = xx * yy - xy**2
    squared = (yy * dx**2 - 2.0 * xy * dx * dy + xx * dy**2) / determinant
    return pl.when(determinant > 0.0).then(squared)


def nees_band(
    runs: int, *, probability: float = 0.95, dimensions: int = DIMENSIONS
) -> tuple[float, float]:
    """Returns the band of the mean NEES over ``runs`` runs of a consistent localizer.

    The sum over the runs is chi-squared with ``runs · dimensions`` degrees of freedom, so the ends
    are its quantiles ``(1 ∓ probability) / 2``, divided by the runs (Bar-Shalom, Li and
    Kirubarajan, 2001, 5.4.2).

    Parameters
    ----------
    runs
        Independent runs, at least 1.
    probability
        Share of the steps within the band.
    dimensions
        Dimension of the state of the NEES.

    Examples
    --------
    >>> [round(end, 4) for end in nees_band(100)]
    [1.6273, 2.4106]
    >>> [round(end, 3) for end in nees_band(1)]
    [0.051, 7.378]
    """
    if runs < 1:
        raise ValueError(f"`runs` is {runs}; it must be at least 1")
    check_probability(probability)
    from scipy.special import gammaincinv  # here, because its import is slow

    tail = 0.5 * (1.0 - probability)
    # Quantiles of chi-squared by the regularized incomplete gamma function (NIST DLMF 8.2.4).
    low, high = (
        2.0 * float(gammaincinv(0.5 * runs * dimensions, share)) / runs
        for share in (tail, 1.0 - tail)
    )
    return low, high


def mean_nees(trajectories: pl.DataFrame) -> pl.DataFrame:
    """Returns the mean NEES of the position over the runs and its 95 % band for each step.

    Parameters
    ----------
    trajectories
        Columns ``trajectories`` of :mod:`access_av.columns`.

    Returns
    -------
    polars.DataFrame
        Columns ``mean_nees``, by time; without steps for which no run has a NEES.

    Examples
    --------
    >>> import access_av
    >>> drives = access_av.simulate("paper-real-odometry-4", runs=3, keep_trajectories=True)
    >>> table = mean_nees(drives.trajectories)
    >>> table["runs"][-1], table["mean_nees"].is_null().any()
    (3, False)
    """
    steps = (
        nees(trajectories)
        .drop_nulls("nees")
        .group_by("time_s")
        .agg("nees")
        .sort("time_s")
        .select("time_s", runs=pl.col("nees").list.len(), mean_nees=pl.col("nees").list.mean())
    )
    bands = {runs: nees_band(runs) for runs in steps["runs"].unique()}
    low, high = (
        pl.col("runs").replace_strict(
            {runs: band[end] for runs, band in bands.items()}, return_dtype=pl.Float64
        )
        for end in (0, 1)
    )
    return steps.with_columns(band_low=low, band_high=high).with_columns(
        in_band=pl.col("mean_nees").is_between("band_low", "band_high")
    )


@dataclass(frozen=True)
class Consistency:
    """Comparison of errors with the localizer's covariance.

    Attributes
    ----------
    runs
        Number of runs.
    rms_error_m
        Root mean square of the horizontal error over track and runs; ``None`` if no run has a
        known pose.
    predicted_rms_error_m
        Value predicted by the localizer's covariances; ``None`` without covariances.
    p90_error_m
        90th percentile of the horizontal error.
    anees
        Average NEES: its mean over steps and runs, divided by the two dimensions. 1 for a
        consistent localizer, more for an optimistic covariance; ``None`` without covariances
        (Li, Zhao and Jilkov, Practical measures and test for credibility of an estimator, 2001).
    anees_interval
        95 % interval of ``anees`` by the bootstrap over whole runs.
    in_band
        Share of the steps whose mean NEES over the runs is within its 95 % band.

    Examples
    --------
    >>> import access_av
    >>> drives = access_av.simulate("paper-real-odometry-4", runs=10, keep_trajectories=True)
    >>> found = Consistency.of(drives.trajectories, skip=50)
    >>> low, high = found.anees_interval
    >>> low < found.anees < high
    True
    """

    runs: int
    rms_error_m: float | None
    predicted_rms_error_m: float | None
    p90_error_m: float | None
    anees: float | None
    anees_interval: tuple[float, float] | None
    in_band: float | None

    @classmethod
    def of(cls, trajectories: pl.DataFrame, *, skip: int = 0) -> Consistency:
        """Evaluates a table of trajectories.

        Parameters
        ----------
        trajectories
            Columns ``trajectories`` of :mod:`access_av.columns`.
        skip
            Number of steps at the start without a NEES, because an exact start has a singular
            covariance.
        """
        times_s = trajectories["time_s"].unique().sort()
        known = trajectories.filter(~pl.col("searching")).with_columns(
            error_m=horizontal_error_m(),
            predicted_m2=pl.col("covariance_xx_m2") + pl.col("covariance_yy_m2"),
        )
        after_s = times_s[skip] if skip < len(times_s) else math.inf
        settled = trajectories.filter(pl.col("time_s") >= after_s)
        by_run = (
            nees(settled)
            .drop_nulls("nees")
            .group_by("run", maintain_order=True)
            .agg("nees")
            .select(pl.col("nees").list.sum().alias("sum"), pl.col("nees").list.len().alias("len"))
            .to_numpy()
        )
        judged = len(by_run) > 0
        return cls(
            runs=trajectories["run"].n_unique(),
            rms_error_m=_root_mean(known, pl.col("error_m") ** 2),
            predicted_rms_error_m=_root_mean(known, pl.col("predicted_m2")),
            p90_error_m=known["error_m"].quantile(0.9, "linear"),
            anees=_anees(by_run) if judged else None,
            anees_interval=bootstrap_interval(by_run, _anees) if judged else None,
            in_band=_share(mean_nees(settled)["in_band"]) if judged else None,
        )


def _root_mean(steps: pl.DataFrame, squared: pl.Expr) -> float | None:
    """Returns the root of the mean over the steps of the means over the runs."""
    by_step = steps.group_by("time_s").agg(squared.alias("squared")).sort("time_s")
    mean = by_step["squared"].list.mean().mean()
    return None if mean is None else math.sqrt(mean)  # type: ignore[arg-type]


def _anees(sums_and_counts: NDArray[np.float64]) -> float:
    total, count = sums_and_counts.sum(axis=0)
    return float(total / count / DIMENSIONS)


def _share(flags: pl.Series) -> float:
    return float(flags.sum() / len(flags))
