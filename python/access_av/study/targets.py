"""Targets of a plant: for the whole trip, and for positions and stretches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.run.error_bound import along_route
from access_av.statistics.percentiles import Percentile, with_ends
from access_av.verdicts import Judgement

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from access_av import _core
    from access_av.run.runs import Runs

WHOLE_TRIP = "whole trip"


@dataclass(frozen=True)
class StretchTarget:
    """A required accuracy on a stretch of the road.

    Attributes
    ----------
    from_m, to_m
        Ends of the stretch as distances along the road, in metres.
    error_m, percent
        Horizontal error, and the share of the time with at most this error, in percent.
    """

    name: str
    from_m: float
    to_m: float
    error_m: float
    percent: float

    @property
    def words(self) -> str:
        """Required accuracy as text."""
        return f"{self.error_m:g} m {self.percent:g} %"


@dataclass(frozen=True)
class TargetResult:
    """Result of runs for one target.

    Attributes
    ----------
    error
        Error at the target's percentile on its section of the road.
    share
        Share of the time within the target's error, and the ends of its 95 % interval.
    """

    target: StretchTarget
    error: Percentile
    share: tuple[float, float, float]

    @property
    def judgement(self) -> Judgement:
        """Judgement: whether the runs meet the target."""
        return Judgement.of(self.share, self.target.percent)


@dataclass(frozen=True, eq=False)
class Targets:
    """All targets of a plant; that of the whole trip is the first one.

    Attributes
    ----------
    each
        The targets.
    time_s, along_m
        Nominal distance along the road as a function of time.
    """

    each: list[StretchTarget]
    time_s: NDArray[np.float64]
    along_m: NDArray[np.float64]

    @classmethod
    def of(cls, plant: _core.Plant) -> Targets:
        """Returns the targets of a plant."""
        route = along_route(plant.scenario())
        time_s, along_m = (route[name].to_numpy() for name in ("time_s", "along_m"))
        error_m, percent = plant.target
        found = [StretchTarget(WHOLE_TRIP, float(along_m[0]), float(along_m[-1]), error_m, percent)]
        for name, from_m, to_m, own_m, own_percent in plant.targets:
            label = name or f"{from_m:.0f} to {to_m:.0f} m"
            found.append(StretchTarget(label, from_m, to_m, own_m, own_percent))
        return cls(found, time_s, along_m)

    def results(self, driven: Runs) -> list[TargetResult]:
        """Returns the result of each target; the nominal position assigns an epoch to a section."""
        at_m = np.interp(driven.time_s, self.time_s, self.along_m)
        found = []
        for target in self.each:
            first = int(np.searchsorted(at_m, target.from_m, side="left"))
            last = int(np.searchsorted(at_m, target.to_m, side="right"))
            first = min(first, len(at_m) - 1)
            errors = driven.between(first, max(last, first + 1))
            error = errors.percentile(target.percent)
            found.append(TargetResult(target, error, errors.within(target.error_m)))
        return found

    def judgement(self, driven: Runs) -> Judgement:
        """Returns the judgement of runs for all targets."""
        return Judgement.of_all(it.judgement for it in self.results(driven))


def table(found: dict[str, list[TargetResult]]) -> pl.DataFrame:
    """Returns one row per variant and target: columns ``study_targets``."""
    return pl.DataFrame(
        [
            {
                "variant": variant,
                "target": it.target.name,
                "from_m": it.target.from_m,
                "to_m": it.target.to_m,
                "required_error_m": it.target.error_m,
                "percent": it.target.percent,
                **with_ends("target_error{}_m", it.error.numbers),
                **with_ends("within{}_share", it.share),
                "judgement": it.judgement.value,
            }
            for variant, each in found.items()
            for it in each
        ],
        infer_schema_length=None,
    )
