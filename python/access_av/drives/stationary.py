"""Position of a stationary receiver from a log of ranges.

The medians of the ranges over the log are computed (:mod:`access_av.drives.range_survey`), which
removes the receiver's clock from one-way delays. Weighted least squares with the weights of
Student's t then determine the position. The standard deviations of the range offsets are the errors
of the medians.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from access_av import _core
from access_av.drives.range_survey import Ranging, epochs, median_ranges, places_of
from access_av.errors import InputError
from access_av.settings import as_dict

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

# Duration of the ranges that count as one independent measurement (s): multipath and the tracking
# of a receiver change slowly.
INDEPENDENT_S = 1.0
# σ of a delay in samples: rounding (0.29) and equal receiver noise.
SAMPLE_SIGMA = 0.5
# Initial positions per axis, within the radio heads' extent and half of it beyond. Solutions
# farther away are left out: there, differences of delays determine only a direction.
GRID = 7
BEYOND = 0.5
# Squared error (in variances) by which another position may fit worse to be an alternative: 3 σ.
ALTERNATIVE = 9.0
# Minimum distance of an alternative position (m), and in standard deviations.
APART_M, APART_SIGMAS = 0.5, 3.0
# Squared error per degree of freedom that is reported as a contradiction.
CONTRADICTION = 10.0
# Degrees of freedom of Student's t as the distribution of the range offsets: a blocked first path
# makes the ranges of single radio heads too long. An offset of 4 σ has a fifth of its weight.
TAIL = 3.0
REWEIGHTINGS = 10


@dataclass(frozen=True)
class StationaryPosition:
    """Position of a stationary receiver.

    Attributes
    ----------
    x_m, y_m
        Position of the ranging antenna in m.
    covariance_m2
        Covariance of x and y in m².
    ranges
        Number of ranges.
    radio_heads
        Number of radio heads with ranges.
    alternatives_m
        Other positions that fit about equally well.
    remarks
        Defects of the log and contradictions.
    """

    x_m: float
    y_m: float
    covariance_m2: Numbers
    ranges: int
    radio_heads: int
    alternatives_m: list[tuple[float, float]]
    remarks: list[str]

    @property
    def std_m(self) -> float:
        """Standard deviation of the horizontal error in m (both axes)."""
        return math.sqrt(float(np.trace(self.covariance_m2)))

    def nees_per_axis(self, error_m: tuple[float, float]) -> float:
        """Normalized squared error of x and y, divided by 2; the expected value is 1."""
        error = np.array(error_m)
        return float(error @ np.linalg.solve(self.covariance_m2, error)) / 2.0


def locate_stationary(
    site: _core.Site | str,
    vehicle: _core.Vehicle | str,
    recording: str | Path,
    *,
    near_m: tuple[float, float] | None = None,
) -> StationaryPosition:
    """Locates a stationary receiver from ranges.

    Parameters
    ----------
    site
        Site, or the name or path of a site file. ``range_offset_m`` and ``range_offset_std_m`` of
        the radio heads are surveyed by :func:`access_av.drives.range_survey.survey_offsets`.
    vehicle
        Vehicle, or the name or path of a vehicle file: ``[ranging]`` and height of the antenna.
    recording
        Range log (CSV) or log of an OpenAirInterface UE (``.log``, ``.txt``).
    near_m
        Approximate x and y in m, to choose among positions that fit equally well.

    Raises
    ------
    InputError
        Ranges of too few radio heads, or radio heads on a line with the receiver.
    RecordingError, SettingsError
        When a file is unusable.
    """
    site = _core.Site.load(site) if isinstance(site, str) else site
    vehicle = _core.Vehicle.load(vehicle) if isinstance(vehicle, str) else vehicle
    heads = as_dict(site)["radio_heads"]
    columns, one_way, sample_m, said = _core.read_ranges(site, recording)
    index = places_of(columns, heads)
    known = index >= 0
    remarks = list(said)
    if unknown := int((~known).sum()):
        remarks.append(
            f"{unknown} ranges are not of a radio head of the site; check pci, ssb_index"
        )
    index, time_s, range_m = index[known], columns["time_s"][known], columns["range_m"][known]
    epoch = epochs(time_s) if one_way else None
    median_m = median_ranges(range_m, index, epoch, len(heads), sample_m)
    received = np.flatnonzero(np.isfinite(median_m))
    needed = 3 if one_way else 2
    if len(received) < needed:
        kind = "one-way delays" if one_way else "two-way ranges"
        raise InputError(
            f"{recording}: ranges of {len(received)} radio heads of the site; the position of a "
            f"stationary receiver needs {kind} of at least {needed}"
        )
    ranging = Ranging.of(vehicle)
    duration_s = float(np.ptp(time_s))
    sigma_m = ranging.sigma_m or SAMPLE_SIGMA * (sample_m or 0.0)
    noise_m = sigma_m / math.sqrt(1.0 + duration_s / INDEPENDENT_S)
    measured = [heads[at] for at in received]
    offset_std_m = [it.get("range_offset_std_m", ranging.offset_std_m) for it in measured]
    position_std_m = [it["position_std_m"] for it in measured]
    std_m = np.sqrt(np.square(offset_std_m) + np.square(position_std_m) + noise_m**2)
    problem = _Problem(
        positions_m=np.array([it["position_m"] for it in measured]),
        height_m=ranging.antenna_m[2],
        pseudorange_m=median_m[received]
        - np.array([it.get("range_offset_m", 0.0) for it in measured]),
        std_m=np.maximum(std_m, 1e-3),
        has_clock=one_way,
    )
    return _best(problem, near_m, remarks, len(range_m), recording)


@dataclass(frozen=True)
class _Problem:
    """Weighted least squares of position and clock."""

    positions_m: Numbers
    height_m: float
    pseudorange_m: Numbers
    std_m: Numbers
    has_clock: bool

    def linearized(self, place: Numbers) -> tuple[Numbers, Numbers]:
        """Returns weighted residuals and derivatives by x, y and clock."""
        here = np.array([place[0], place[1], self.height_m])
        away = here - self.positions_m
        distance_m = np.maximum(np.linalg.norm(away, axis=1), 1e-6)
        residual_m = self.pseudorange_m - distance_m - (place[2] if self.has_clock else 0.0)
        rows = away[:, :2] / distance_m[:, None]
        if self.has_clock:
            rows = np.column_stack([rows, np.ones(len(rows))])
        return residual_m / self.std_m, rows / self.std_m[:, None]

    def reweighted(self, place: Numbers) -> _Problem:
        """Returns the problem with the weights of Student's t at a solution."""
        residual, _ = self.linearized(place)
        factor = np.sqrt(np.maximum(1.0, (TAIL + residual**2) / (TAIL + 1.0)))
        return replace(self, std_m=self.std_m * factor)

    def solved(self, start: Numbers) -> tuple[float, Numbers]:
        """Returns squared error and solution from an initial position (Levenberg–Marquardt)."""
        from scipy.optimize import least_squares  # here, because its import is slow

        place = start.astype(float)
        if self.has_clock:
            residual, _ = self.linearized(np.append(place, 0.0))
            place = np.append(place, float(np.mean(residual * self.std_m)))
        found = least_squares(
            lambda it: self.linearized(it)[0],
            place,
            lambda it: -self.linearized(it)[1],
            method="lm",
        )
        return 2.0 * float(found.cost), found.x


def _best(
    problem: _Problem,
    near_m: tuple[float, float] | None,
    remarks: list[str],
    ranges: int,
    recording: str | Path,
) -> StationaryPosition:
    low, high = problem.positions_m[:, :2].min(axis=0), problem.positions_m[:, :2].max(axis=0)
    margin = BEYOND * float((high - low).max())
    axes = [np.linspace(low[axis] - margin, high[axis] + margin, GRID) for axis in range(2)]
    starts = [np.array([x_m, y_m]) for x_m in axes[0] for y_m in axes[1]]
    if near_m is not None:
        starts.append(np.array(near_m))
    solved = [problem.solved(start) for start in starts]
    inside = [
        it for it in solved if ((it[1][:2] > low - margin) & (it[1][:2] < high + margin)).all()
    ]
    found = sorted(inside or solved, key=lambda it: it[0])
    least = found[0][0]
    _, rows = problem.linearized(found[0][1])
    normal = rows.T @ rows
    if np.linalg.cond(normal) > 1e12:
        raise InputError(
            f"{recording}: the radio heads do not determine the position; add one off the line "
            "through the others and the receiver"
        )
    apart_m = max(APART_M, APART_SIGMAS * math.sqrt(float(np.linalg.inv(normal)[:2, :2].trace())))
    distinct: list[Numbers] = []
    for cost, place in found:
        is_new = all(float(np.hypot(*(place - it)[:2])) > apart_m for it in distinct)
        if cost < least + ALTERNATIVE and is_new:
            distinct.append(place)
    if near_m is not None:
        distinct.sort(key=lambda it: float(np.hypot(*(it[:2] - np.array(near_m)))))
    place = distinct[0]
    residual, rows = problem.linearized(place)
    freedom = len(residual) - rows.shape[1]
    robust = problem
    for _ in range(REWEIGHTINGS if freedom > 0 else 0):
        robust = problem.reweighted(place)
        _, place = robust.solved(place[:2])
    weighted, rows = robust.linearized(place)
    # Offsets that scatter more than specified make the position uncertain.
    scale = max(1.0, float(weighted @ weighted) / freedom) if freedom > 0 else 1.0
    if freedom > 0 and float(residual @ residual) > CONTRADICTION * freedom:
        remarks.append(
            "the ranges contradict each other: check position_m, range_offset_m and "
            "range_offset_std_m of the radio heads"
        )
    alternatives_m = [(float(it[0]), float(it[1])) for it in distinct[1:]]
    if alternatives_m:
        where = ", ".join(f"({x_m:.1f}, {y_m:.1f})" for x_m, y_m in alternatives_m)
        remarks.append(f"other positions fit equally well: {where} m; give --start")
    return StationaryPosition(
        x_m=float(place[0]),
        y_m=float(place[1]),
        covariance_m2=np.asarray(scale * np.linalg.inv(rows.T @ rows)[:2, :2], dtype=np.float64),
        ranges=ranges,
        radio_heads=len(residual),
        alternatives_m=alternatives_m,
        remarks=remarks,
    )
