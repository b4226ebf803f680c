"""Radio heads and array as ordinary drives show them: a survey by the vehicle itself.

Prediction-error identification: given site and vehicle, what a tracker finds new in each angle is
independent and normal, so that

    Λ(θ) = ½ Σ ν(θ)² / S + ½ Σ (θ − θ₀)² / σ₀²

is the negative logarithm of the posterior of the parameters θ, over all angles of all drives
(Schweppe 1965; Ljung, System Identification, 7.4). Gauss–Newton finds its least; the derivatives of
ν are central differences, each a replay of every drive. The road, if there is one, and the drives'
starts hold the frame.
"""

from __future__ import annotations

import json
import math
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Met = tuple[Numbers, Numbers, Flags]

# A parameter whose deviation did not fall below this share of what it was before is not surveyed.
LEARNT = 0.7
MOST_ITERATIONS = 20
# Done when no parameter moves by more than this share of its deviation.
STILL = 0.05
# Steps of the central differences: small against what bends, large against rounding.
STEP_M, STEP_RAD = 0.02, 2e-4


@dataclass(frozen=True)
class SurveyDrive:
    """A recorded drive.

    Attributes
    ----------
    name
        What it is called in messages.
    log
        Its odometry and angles.
    start_m_rad
        Where it begins: x and y in metres, heading in radians.
    """

    name: str
    log: _core.LoggedDrive
    start_m_rad: tuple[float, float, float]


@dataclass(frozen=True)
class Parameter:
    """Something that is surveyed.

    Attributes
    ----------
    key
        Its key in the site or vehicle file.
    unit
        ``m`` or ``rad``.
    before, std_before
        What was believed, and its standard deviation.
    found, std
        What the drives say together with that, and its standard deviation.
    """

    key: str
    unit: str
    before: float
    std_before: float
    found: float
    std: float

    @property
    def is_learnt(self) -> bool:
        """Whether the drives say something of it."""
        return self.std < LEARNT * self.std_before

    @property
    def is_as_believed(self) -> bool:
        """Whether it is within three standard deviations of what was believed."""
        return abs(self.found - self.before) < 3.0 * self.std_before


@dataclass(frozen=True, eq=False)
class Survey(Result):
    """What a survey found.

    Attributes
    ----------
    parameters
        Everything that was surveyed.
    covariance
        Of them, shape (n, n).
    site, vehicle
        With what was learnt, and its standard deviations.
    angles, used
        How many there were, and how many counted.
    nis
        Mean squared innovation over its variance; 1 where everything is as believed.
    iterations
        Steps of Gauss–Newton.
    """

    parameters: list[Parameter]
    covariance: NDArray[np.floating[Any]]
    site: _core.Site
    vehicle: _core.Vehicle
    angles: int
    used: int
    nis: float
    iterations: int

    def table(self) -> pl.DataFrame:
        """One row per parameter, as ``access_av.columns.TABLES["survey"]`` has it."""
        rows = [{**vars(it), "is_learnt": it.is_learnt} for it in self.parameters]
        return pl.DataFrame(rows)


def read_drive(folder: str | Path) -> SurveyDrive:
    """Read a drive: ``odometry.csv`` or ``odometry.mcap``, ``angles.csv``, ``vehicle.toml``.

    The vehicle file tells the drive's start (``start.pose``), and how far apart the wheels are
    (``odometer.track_width_m``) where the odometry is that of left and right wheel.

    Raises
    ------
    InputError
        When a file is missing, or the start.
    RecordingError, SettingsError
        When a file is unusable.
    """
    folder = Path(folder)
    there = [it for it in (folder / "odometry.csv", folder / "odometry.mcap") if it.is_file()]
    if not there:
        raise InputError(f"{folder}: neither odometry.csv nor odometry.mcap is here")
    vehicle = _core.Vehicle.load(str(folder / "vehicle.toml"))
    stated = json.loads(vehicle.to_json())
    start = stated.get("start", {}).get("pose")
    if start is None:
        raise InputError(
            f"{folder / 'vehicle.toml'}: `start.pose` is missing: where the drive starts"
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
    """Refine where radio heads stand and how the array is mounted and calibrated.

    Parameters
    ----------
    site, vehicle
        What is believed, or its name or path.
    drives
        Drives, or their folders as :func:`read_drive` takes them.
    position_std_m
        Standard deviation of a radio head's place in each of x and y where the site states none.
    mounting_std_rad, phase_std_rad
        Those of the array's direction and of its phase per element where the vehicle states none.
    threads
        Worker threads; all cores if not given.
    progress
        Called with the replays that are done and that there are at most.

    Raises
    ------
    InputError
        When no angle of the drives is to a radio head of the site.
    SettingsError, RecordingError
        When a file is unusable.
    """
    site = _core.Site.load(site) if isinstance(site, str) else site
    vehicle = _core.Vehicle.load(vehicle) if isinstance(vehicle, str) else vehicle
    logged = [it if isinstance(it, SurveyDrive) else read_drive(it) for it in drives]
    model = _Model(site, vehicle, position_std_m, mounting_std_rad, phase_std_rad)
    heard = {head for drive in logged for head in drive.log.heads}
    if not heard & set(model.heads):
        which = ", ".join(f"pci={pci} ssb_index={index}" for pci, index in sorted(heard)[:8])
        raise InputError(f"no angle is to a radio head of {site.name}; heard: {which or 'none'}")
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
        heads = json.loads(site.to_json())["radio_heads"]
        array = json.loads(vehicle.to_json())["array"]
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
        self.before, self.stds_before = np.array(before), np.array(stds)
        self.steps = np.where(np.arange(len(keys)) < 2 * len(heads), STEP_M, STEP_RAD)

    def believed(self, values: Numbers, stds: Numbers) -> tuple[_core.Site, _core.Vehicle]:
        """Site and vehicle with these parameters, known so well."""
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
    """The drives as functions of the parameters."""

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
        """Innovations, their variances and whether they counted, drive by drive."""
        site, vehicle = self.model.believed(values, stds)

        def drive(index: int) -> Met:
            logged = self.drives[index]
            x_m, y_m, heading_rad = logged.start_m_rad
            pose = {"x_m": x_m, "y_m": y_m, "heading_rad": heading_rad}
            there = vehicle.with_overrides({"start.pose": pose, "start.known": True})
            return logged.log.innovations(site, there, None if used is None else used[index])

        found = list(self.pool.map(drive, range(len(self.drives))))
        self.done += 1
        if self.progress is not None:
            most = MOST_ITERATIONS * (2 * len(values) + 4)
            self.progress(min(self.done, most), most)
        return found

    def misfit(self, values: Numbers, used: list[Flags]) -> float:
        """Twice Λ(θ), but for a constant."""
        prior = float(np.sum(((values - self.model.before) / self.model.stds_before) ** 2))
        met = self.meet(values, np.zeros_like(values), used)
        return prior + sum(_normalised(*each) for each in met)

    def linearised(self, values: Numbers, used: list[Flags]) -> tuple[Numbers, Numbers]:
        """Gradient and Gauss–Newton Hessian of Λ(θ), the information matrix."""
        exact = np.zeros_like(values)
        met = self.meet(values, exact, used)
        slopes = []
        for step in np.diag(self.model.steps):
            ahead = self.meet(values + step, exact, used)
            behind = self.meet(values - step, exact, used)
            both = zip(ahead, behind, strict=True)
            slopes.append([_wrapped(a[0] - b[0]) / (2.0 * step.sum()) for a, b in both])
        information = np.diag(self.model.stds_before**-2.0)
        gradient = (values - self.model.before) / self.model.stds_before**2
        for index, (residual, variance, counted) in enumerate(met):
            jacobian = np.stack([slope[index] for slope in slopes])
            kept = counted & np.isfinite(jacobian).all(axis=0) & np.isfinite(residual)
            weighted = jacobian[:, kept] / variance[kept]
            information += weighted @ jacobian[:, kept].T
            gradient += weighted @ residual[kept]
        return gradient, information


def _identify(problem: _Problem) -> Survey:
    model = problem.model
    values, stds = model.before.copy(), model.stds_before.copy()
    iterations, moved = 0, math.inf
    while iterations < MOST_ITERATIONS and moved > STILL:
        iterations += 1
        # What does not fit even in view of what is not known does not count.
        used = [each[2] for each in problem.meet(values, stds, None)]
        gradient, information = problem.linearised(values, used)
        covariance = np.linalg.inv(information)
        stds = np.sqrt(np.diag(covariance))
        step = -covariance @ gradient
        here = problem.misfit(values, used)
        while problem.misfit(values + step, used) > here and np.max(np.abs(step) / stds) > STILL:
            step = 0.5 * step
        values = values + step
        moved = float(np.max(np.abs(step) / stds))
    met = problem.meet(values, np.zeros_like(values), used)
    counted = sum(int(each[2].sum()) for each in met)
    learnt = stds < LEARNT * model.stds_before
    # A place is one thing: both of its coordinates, or neither.
    places = learnt[: 2 * len(model.heads)].reshape(-1, 2)
    places[:] = places.any(axis=1, keepdims=True)
    site, vehicle = model.believed(
        np.where(learnt, values, model.before), np.where(learnt, stds, model.stds_before)
    )
    columns = (model.keys, model.before, model.stds_before, values, stds)
    return Survey(
        parameters=[
            Parameter(key, "m" if "position" in key else "rad", *map(float, numbers))
            for key, *numbers in zip(*columns, strict=True)
        ],
        covariance=covariance,
        site=site,
        vehicle=vehicle,
        angles=sum(len(drive.log) for drive in problem.drives),
        used=counted,
        nis=sum(_normalised(*each) for each in met) / max(counted, 1),
        iterations=iterations,
    )


def _normalised(residual: Numbers, variance: Numbers, used: Flags) -> float:
    kept = used & np.isfinite(residual)
    return float(np.sum(residual[kept] ** 2 / variance[kept]))


def _wrapped(angle_rad: Numbers) -> Numbers:
    return (angle_rad + np.pi) % (2.0 * np.pi) - np.pi
