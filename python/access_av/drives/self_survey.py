"""Survey of radio heads and array from ordinary drives of the vehicle.

Prediction-error identification: for correct site and vehicle, the innovations of a tracker are
independent and normal, so that

    Λ(θ) = ½ Σ ν(θ)² / S + ½ Σ (θ − θ₀)² / σ₀²

is the negative logarithm of the posterior of the parameters θ, over all angles of all drives
(Schweppe 1965; Ljung, System Identification, 7.4). Gauss–Newton finds its minimum. The derivatives
of ν are differences, each a replay of every drive, so that they are only computed again after a
large step. The road, if any, and the start poses define the frame.

The tracker estimates a multipath bias of each radio head, which is retained or drawn again at an
angle. The minimum is found by expectation maximisation (Dempster, Laird and Rubin 1977): an angle
contributes one ν for each of both hypotheses, and its 1 / S is the expected one. The hypotheses are
missing data, so that the observed information is smaller than the complete one,

    Hᵢⱼ = Σ ∂ᵢν ∂ⱼ(ν / S),

with the derivatives of S (Louis 1982). The covariance follows from the observed information.

Multipath that this model does not describe correlates the innovations, so that a sum over all of
them counts information repeatedly. The sum is divided by tr(H⁻¹J)/p: H is the information about p
parameters, and J is the sum of g gᵀ over blocks of a drive with gradients g (Pauli, Racugno and
Ventura, Statistica Sinica 21, 2011). The factor is at least 1.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.drives.site_frame import displacement_probability
from access_av.errors import InputError
from access_av.settings import as_dict
from access_av.signal.manifold import wrapped
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Met = tuple[Numbers, Numbers, Flags]
    Slopes = tuple[NDArray[np.float32], Numbers]

# Maximum ratio of posterior and prior standard deviation of a surveyed parameter.
LEARNT = 0.7
MOST_ITERATIONS = 20
# Iterations of most surveys, for the progress.
USUAL_ITERATIONS = 6
# Blocks per drive, each long against the correlation of multipath.
BLOCKS = 10
# Convergence: maximum step of a parameter relative to its standard deviation.
STILL = 0.05
# Maximum step, in the same unit, for which the derivatives remain valid.
LINEAR = 1.0
# Probability that the site plan is displaced against the road.
OFFSET_KEY = "integrity.fault_probability.site_frame_offset"
# Steps of the differences: small against the curvature, large against rounding.
STEP_M, STEP_RAD = 0.02, 2e-4


@dataclass(frozen=True)
class SurveyDrive:
    """A recorded drive.

    Attributes
    ----------
    name
        Name in messages.
    log
        Odometry and angles.
    start_m_rad
        Start pose: x and y in metres, heading in radians.
    """

    name: str
    log: _core.LoggedDrive
    start_m_rad: tuple[float, float, float]


@dataclass(frozen=True)
class Parameter:
    """A surveyed parameter.

    Attributes
    ----------
    key
        Key in the site or vehicle file.
    unit
        ``m`` or ``rad``.
    before, std_before
        Given value and its standard deviation.
    found, std
        Estimate from the drives and the given value, and its standard deviation.
    """

    key: str
    unit: str
    before: float
    std_before: float
    found: float
    std: float

    @property
    def is_learnt(self) -> bool:
        """Returns whether the drives determine the parameter."""
        return self.std < LEARNT * self.std_before

    @property
    def is_as_believed(self) -> bool:
        """Returns whether the estimate is within three standard deviations of the prior."""
        return abs(self.found - self.before) < 3.0 * self.std_before


@dataclass(frozen=True, eq=False)
class Survey(Result):
    """Result of a survey.

    Attributes
    ----------
    parameters
        Surveyed parameters.
    covariance
        Covariance of the parameters, shape (n, n).
    site, vehicle
        Settings with the estimates and their standard deviations.
    site_frame_offset
        Posterior probability that the surveyed radio heads are displaced against the road, written
        to the vehicle's ``integrity.fault_probability.site_frame_offset``; ``None`` without a road.
    angles, used
        Number of angles, and number without outliers.
    nis
        Mean normalized innovation squared, given the estimated biases; at most 1 for a correct
        model, because dependent angles have increased variances.
    iterations
        Number of Gauss–Newton steps.
    """

    parameters: list[Parameter]
    covariance: NDArray[np.floating[Any]]
    site: _core.Site
    vehicle: _core.Vehicle
    site_frame_offset: float | None
    angles: int
    used: int
    nis: float
    iterations: int

    def table(self) -> pl.DataFrame:
        """Returns one row per parameter; columns ``access_av.columns.TABLES["survey"]``."""
        rows = [{**vars(it), "is_learnt": it.is_learnt} for it in self.parameters]
        return pl.DataFrame(rows)


def read_drive(folder: str | Path) -> SurveyDrive:
    """Reads a drive: ``odometry.csv`` or ``odometry.mcap``, ``angles.csv``, ``vehicle.toml``.

    The vehicle file contains the start pose (``start.pose``) and, for odometry of two wheels, the
    track width (``odometer.track_width_m``).

    Raises
    ------
    InputError
        Missing file or start pose.
    RecordingError, SettingsError
        When a file is unusable.
    """
    folder = Path(folder)
    there = [it for it in (folder / "odometry.csv", folder / "odometry.mcap") if it.is_file()]
    if not there:
        raise InputError(f"{folder}: the folder contains neither odometry.csv nor odometry.mcap")
    vehicle = _core.Vehicle.load(str(folder / "vehicle.toml"))
    stated = as_dict(vehicle)
    start = stated.get("start", {}).get("pose")
    if start is None:
        raise InputError(
            f"{folder / 'vehicle.toml'}: `start.pose` is missing: add the pose at the start of "
            f"the drive"
        )
    return SurveyDrive(
        name=str(folder),
        log=_core.LoggedDrive(
            there[0], folder / "angles.csv", stated.get("odometer", {}).get("track_width_m")
        ),
        start_m_rad=(start["x_m"], start["y_m"], start["heading_rad"]),
    )


def survey(
    site: _core.Site | str,
    vehicle: _core.Vehicle | str,
    drives: Sequence[SurveyDrive | str | Path],
    *,
    position_std_m: float = 2.0,
    mounting_std_rad: float = 0.05,
    phase_std_rad: float = 0.1,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Survey:
    """Estimates radio-head positions, and mounting and calibration of the array, from drives.

    Parameters
    ----------
    site, vehicle
        Nominal settings, or their names or paths.
    drives
        Drives, or their folders (see :func:`read_drive`).
    position_std_m
        Prior standard deviation of a radio head's x and y, if the site has none.
    mounting_std_rad, phase_std_rad
        Prior standard deviations of mounting and phase per element, if the vehicle has none.
    threads
        Number of worker threads. Default: all cores.
    progress
        Called with the number of completed replays and their expected number.

    Raises
    ------
    InputError
        No angle of a radio head of the site.
    SettingsError, RecordingError
        When a file is unusable.
    """
    site = _core.Site.load(site) if isinstance(site, str) else site
    vehicle = _core.Vehicle.load(vehicle) if isinstance(vehicle, str) else vehicle
    logged = [it if isinstance(it, SurveyDrive) else read_drive(it) for it in drives]
    model = _Model(site, vehicle, position_std_m, mounting_std_rad, phase_std_rad)
    received = {head for drive in logged for head in drive.log.heads}
    if not received & set(model.heads):
        which = ", ".join(f"pci={pci} ssb_index={index}" for pci, index in sorted(received)[:8])
        raise InputError(
            f"no angle belongs to a radio head of {site.name}; the log contains: {which or 'none'}"
        )
    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        return _identify(_Problem(model, logged, pool, progress))


class _Model:
    """Site and vehicle as functions of the parameters."""

    def __init__(
        self,
        site: _core.Site,
        vehicle: _core.Vehicle,
        position_std_m: float,
        mounting_std_rad: float,
        phase_std_rad: float,
    ) -> None:
        self.site, self.vehicle = site, vehicle
        heads = as_dict(site)["radio_heads"]
        array = as_dict(vehicle)["array"]
        self.heads = [(head["pci"], head.get("ssb_index", 0)) for head in heads]
        self._heights_m = [head["position_m"][2] for head in heads]
        keys, before, stds = [], [], []
        for index, head in enumerate(heads):
            for axis in range(2):
                keys.append(f"radio_heads[{index}].position_m[{axis}]")
                before.append(head["position_m"][axis])
                stds.append(head.get("position_std_m", 0.0) or position_std_m)
        for name, default in (("mounting", mounting_std_rad), ("phase", phase_std_rad)):
            keys.append(f"array.{name}_rad")
            before.append(array[f"{name}_rad"])
            stds.append(array.get(f"{name}_std_rad") or default)
        self.keys = keys
        # Setting any key of the table fills in the defaults of the others.
        complete = as_dict(vehicle.with_overrides({"integrity.enabled": True}))
        faults = complete["integrity"]["fault_probability"]
        self.offset_before = float(faults["site_frame_offset"])
        self.before, self.stds_before = np.array(before), np.array(stds)
        self.steps = np.where(np.arange(len(keys)) < 2 * len(heads), STEP_M, STEP_RAD)

    def nominal(self, values: Numbers, stds: Numbers) -> tuple[_core.Site, _core.Vehicle]:
        """Returns copies of site and vehicle with the given parameters and standard deviations."""
        count = len(self.heads)
        places, place_stds = values[: 2 * count].reshape(-1, 2), stds[: 2 * count].reshape(-1, 2)
        changed: dict[str, Any] = {}
        for index, ((x_m, y_m), z_m, deviation) in enumerate(
            zip(places.tolist(), self._heights_m, place_stds.max(axis=1).tolist(), strict=True)
        ):
            changed[f"radio_heads[{index}].position_m"] = [x_m, y_m, z_m]
            changed[f"radio_heads[{index}].position_std_m"] = deviation
        array = {
            f"array.{name}{what}_rad": float(of[2 * count + index])
            for index, name in enumerate(("mounting", "phase"))
            for what, of in (("", values), ("_std", stds))
        }
        return self.site.with_overrides(changed), self.vehicle.with_overrides(array)


class _Problem:
    """Innovations of the drives as functions of the parameters."""

    def __init__(
        self,
        model: _Model,
        drives: list[SurveyDrive],
        pool: ThreadPoolExecutor,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self.model, self.drives, self.pool = model, drives, pool
        self.progress, self.done = progress, 0

    def meet(self, values: Numbers, stds: Numbers, used: list[Flags] | None) -> list[Met]:
        """Replays the drives; returns innovations, variances and outlier flags of each drive."""
        site, vehicle = self.model.nominal(values, stds)

        def drive(index: int) -> Met:
            logged = self.drives[index]
            x_m, y_m, heading_rad = logged.start_m_rad
            pose = {"x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}
            there = vehicle.with_overrides({"start.pose": pose, "start.known": True})
            return logged.log.innovations(site, there, None if used is None else used[index])

        found = list(self.pool.map(drive, range(len(self.drives))))
        self.done += 1
        if self.progress is not None:
            expected = USUAL_ITERATIONS * (len(values) + 4)
            self.progress(self.done, max(expected, self.done + 1))
        return found

    def slopes(self, values: Numbers, used: list[Flags], met: list[Met]) -> list[Slopes]:
        """Returns ∂ν of each drive, shape (parameters, angles, 2), and Σ ∂ᵢν ∂ⱼ(ν / S)."""
        shapes = [(len(values), *residual.shape) for residual, _, _ in met]
        of_drives = [(np.empty(it, np.float32), np.empty(it, np.float32)) for it in shapes]
        for row, step in enumerate(np.diag(self.model.steps)):
            ahead = self.meet(values + step, np.zeros_like(values), used)
            for (jacobian, scores), (there, after, _), (here, before, counted) in zip(
                of_drives, ahead, met, strict=True
            ):
                change = np.where(counted[:, None], wrapped(there - here), 0.0)
                score = np.where(counted[:, None], (here + change) / after - here / before, 0.0)
                jacobian[row] = np.nan_to_num(change / step.sum())
                scores[row] = np.nan_to_num(score / step.sum())
        return [
            (jacobian, np.einsum("ian,jan->ij", jacobian, scores, dtype=np.float64))
            for jacobian, scores in of_drives
        ]

    def increase(
        self, values: Numbers, step: Numbers, here: list[Met], there: list[Met], inflation: float
    ) -> float:
        """Returns the change of 2 Λ(θ) by a step, with the variances before the step."""
        model = self.model
        before, after = (
            float(np.sum(((at - model.before) / model.stds_before) ** 2))
            for at in (values, values + step)
        )
        by_angles = 0.0
        for (residual, variance, used), (moved, _, _) in zip(here, there, strict=True):
            squares = (moved[used] ** 2 - residual[used] ** 2) / variance[used]
            by_angles += float(np.nansum(squares))
        return after - before + by_angles / inflation

    def linearised(self, met: list[Met], slopes: list[Slopes]) -> _Linearised:
        """Sums the drives' contributions to Λ(θ) without the prior."""
        count = len(self.model.keys)
        complete, observed, squared = (np.zeros((count, count)) for _ in range(3))
        gradient = np.zeros(count)
        for (residual, variance, counted), (jacobian, of_drive) in zip(met, slopes, strict=True):
            kept = counted & np.isfinite(residual).all(axis=1)
            rows = jacobian[:, kept].reshape(count, -1).astype(np.float64)
            weighted = rows / variance[kept].ravel()
            complete += weighted @ rows.T
            observed += of_drive
            gradients = weighted * residual[kept].ravel()
            gradient += gradients.sum(axis=1)
            for block in np.array_split(gradients, BLOCKS, axis=1):
                squared += np.outer(block.sum(axis=1), block.sum(axis=1))
        prior = np.diag(self.model.stds_before**-2.0)
        observed = _limited(0.5 * (observed + observed.T), complete + prior)
        return _Linearised(gradient, complete, observed, squared, prior)


@dataclass(frozen=True)
class _Linearised:
    """Gradient and information of the drives, J of the variance inflation, prior information."""

    gradient: Numbers
    complete: Numbers
    observed: Numbers
    squared: Numbers
    prior: Numbers

    def inflated(self, information: Numbers) -> tuple[Numbers, float]:
        """Returns the covariance of the parameters for an information, and the inflation."""
        # Parameters that the drives do not determine count neither in the numerator nor in p.
        posterior = np.linalg.inv(information + self.prior)
        determined = np.trace(posterior @ information)
        ratio = np.trace(posterior @ self.squared) / determined if determined > 0.0 else 1.0
        inflation = max(1.0, float(ratio))
        covariance = np.linalg.inv(information / inflation + self.prior)
        return np.asarray(covariance, dtype=np.float64), inflation


def _limited(observed: Numbers, complete: Numbers) -> Numbers:
    """Returns the observed information, limited to the range from zero to the complete one.

    Uncertain biases are missing data, so that the information about the parameters is within this
    range (Louis, J. Royal Statistical Society B 44, 1982); differences may be outside.
    """
    root = np.linalg.cholesky(complete)
    inverse = np.linalg.inv(root)
    shares, axes = np.linalg.eigh(inverse @ observed @ inverse.T)
    whitened = root @ axes
    return np.asarray((whitened * np.clip(shares, 0.0, 1.0)) @ whitened.T, dtype=np.float64)


def _identify(problem: _Problem) -> Survey:
    model = problem.model
    values, stds = model.before.copy(), model.stds_before.copy()
    exact = np.zeros_like(values)
    iterations, moved, since = 0, math.inf, math.inf
    while iterations < MOST_ITERATIONS and moved > STILL:
        iterations += 1
        # Exclude outliers with respect to the present uncertainty.
        used = [each[2] for each in problem.meet(values, stds, None)]
        met = problem.meet(values, exact, used)
        if since > LINEAR:
            slopes, since = problem.slopes(values, used, met), 0.0
        linear = problem.linearised(met, slopes)
        covariance, inflation = linear.inflated(linear.complete)
        stds = np.sqrt(np.diag(covariance))
        gradient = linear.gradient / inflation + linear.prior @ (values - model.before)
        step = -covariance @ gradient
        while (moved := float(np.max(np.abs(step) / stds))) > STILL:
            there = problem.meet(values + step, exact, used)
            if problem.increase(values, step, met, there, inflation) <= 0.0:
                break
            step = 0.5 * step
        values = values + step
        since += moved
    met = problem.meet(values, exact, used)
    linear = problem.linearised(met, problem.slopes(values, used, met))
    covariance = linear.inflated(linear.observed)[0]
    stds = np.sqrt(np.diag(covariance))
    counted = sum(int(each[2].sum()) for each in met)
    learnt = stds < LEARNT * model.stds_before
    # Accept both coordinates of a position, or none.
    places = learnt[: 2 * len(model.heads)].reshape(-1, 2)
    places[:] = places.any(axis=1, keepdims=True)
    written = np.where(learnt, values, model.before)
    written_stds = np.where(learnt, stds, model.stds_before)
    site, vehicle = model.nominal(written, written_stds)
    nis = sum(_normalised(*each) for each in met) / max(counted, 1)
    offset = None
    if as_dict(site).get("road") is not None:
        positions = slice(2 * len(model.heads))
        offset = displacement_probability(
            model.offset_before,
            model.before[positions],
            model.stds_before[positions],
            values[positions],
            covariance[positions, positions],
            written[positions],
            written_stds[positions],
        )
        vehicle = vehicle.with_overrides({OFFSET_KEY: offset})
    columns = (model.keys, model.before, model.stds_before, values, stds)
    return Survey(
        parameters=[
            Parameter(key, "m" if "position" in key else "rad", *map(float, numbers))
            for key, *numbers in zip(*columns, strict=True)
        ],
        covariance=covariance,
        site=site,
        vehicle=vehicle,
        site_frame_offset=offset,
        angles=sum(len(drive.log) for drive in problem.drives),
        used=counted,
        nis=nis,
        iterations=iterations,
    )


def _normalised(residual: Numbers, variance: Numbers, used: Flags) -> float:
    kept = used & np.isfinite(residual).all(axis=1)
    return float(np.sum(residual[kept] ** 2 / variance[kept]))
