"""Errors of a variant in paired rows: runs, or sections of one drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.run.service_levels import INDEPENDENT_S
from access_av.statistics.paired import paired_difference
from access_av.statistics.percentiles import PERCENTS, Percentile, finite, percentiles, with_ends
from access_av.statistics.proportions import share_interval
from access_av.verdicts import NotOk

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from access_av.statistics.integrity import Integrity


# Baseline of the comparison of variants.
UNCHANGED = "unchanged"
DRIVES = "drives"
# Error of a lost vehicle in metres: more than the width of a two-lane road.
LOST_M = 5.0
# Maximum time with an error above :data:`LOST_M`, in seconds: the vehicle stops and is localized
# again.
LOST_S = 5.0
STRETCHES = f"stretches of {INDEPENDENT_S:g} s of one drive"


@dataclass(frozen=True, eq=False, kw_only=True)
class ErrorSamples:
    """Horizontal errors of one variant.

    Attributes
    ----------
    name
        Name in tables.
    errors_m
        Shape (rows, epochs); infinite during the search for the position.
    duration_s
        Duration of a row.
    rows
        Name of the rows, in the plural.
    integrity
        Counts of states and of errors above the protection level; ``None`` without a monitor.
    """

    name: str = ""
    errors_m: NDArray[Any]
    duration_s: float
    rows: str = DRIVES
    integrity: Integrity | None = None

    @property
    def runs(self) -> int:
        """Number of rows."""
        return len(self.errors_m)

    @property
    def independent(self) -> int:
        """Number of independent errors."""
        return max(1, int(self.runs * self.duration_s / INDEPENDENT_S))

    @property
    def energy_j(self) -> float | None:
        """Energy of a trip; ``None`` if it is unknown."""
        return None

    def percentiles(
        self, percents: Sequence[float] = PERCENTS, *, of_seen: bool = False, resamples: int = 1000
    ) -> list[Percentile]:
        """Returns percentiles of the error with their 95 % intervals.

        With ``of_seen`` the intervals are those of the bootstrap alone, which ignores events that
        did not occur in the runs. Comparisons of designs use them.
        """
        independent = None if of_seen else self.independent
        return percentiles(self.errors_m, percents, independent=independent, resamples=resamples)

    def percentile(self, percent: float) -> Percentile:
        """Returns a percentile of the error with its 95 % interval."""
        [found] = self.percentiles([percent])
        return found

    def within(self, error_m: float) -> tuple[float, float, float]:
        """Share of the time within an error, and the ends of its 95 % interval."""
        shares = (self.errors_m <= error_m).mean(axis=1)
        return float(shares.mean()), *share_interval(shares, self.independent)

    @property
    def lost(self) -> NDArray[np.bool_]:
        """Whether the vehicle is lost, by row; see :attr:`lost_runs`."""
        known = np.logical_or.accumulate(np.isfinite(self.errors_m), axis=1)
        beyond = known & ~(self.errors_m <= LOST_M)
        never = ~known[:, -1] if known.shape[1] else np.zeros(self.runs, dtype=bool)
        lost_s = beyond.mean(axis=1) * self.duration_s
        return np.asarray((lost_s > LOST_S) | never)

    @property
    def lost_runs(self) -> int:
        """Number of rows with a lost vehicle.

        A vehicle is lost if the error exceeds :data:`LOST_M`, or the position becomes unknown, for
        more than :data:`LOST_S` in total. The search for the first position does not count.

        Examples
        --------
        >>> errors_m = np.full((3, 100), 0.1)
        >>> errors_m[0, :40] = np.inf
        >>> errors_m[1, 40:] = 30.0
        >>> ErrorSamples(name="a", errors_m=errors_m, duration_s=100.0).lost_runs
        1
        """
        return int(self.lost.sum())

    @property
    def state_shares(self) -> Mapping[str, float] | None:
        """Share of the time by state of integrity; ``None`` without an integrity monitor."""
        return None if self.integrity is None else self.integrity.state_shares

    @property
    def not_ok_shares(self) -> Mapping[NotOk, float] | None:
        """Share of the time by reason why the state is not ``ok``; ``None`` without a monitor."""
        if self.integrity is None:
            return None
        counts = {name: float(it.sum()) for name, it in self.integrity.by_run.items()}
        epochs = counts["ok"] + counts["degraded"] + counts["unavailable"]
        return {
            NotOk.LEVEL: counts["too_wide"] / epochs,
            NotOk.SUSPECTED: (counts["degraded"] - counts["too_wide"]) / epochs,
            NotOk.CONTRADICTED: counts["unavailable"] / epochs,
        }

    @property
    def exceedances(self) -> int | None:
        """Number of positions in state ``ok`` whose error exceeds the protection level."""
        return None if self.integrity is None else self.integrity.exceedances

    def delta_m(
        self, baseline: ErrorSamples, percent: float, comparisons: int = 1
    ) -> tuple[float, float, float]:
        """Returns the paired difference of a percentile to that of the baseline, in metres.

        Returns
        -------
        tuple of float
            Variant minus baseline, and the ends of the 95 % interval; negative if the variant is
            more accurate. The intervals of a number of ``comparisons`` hold together.
        """
        runs = min(self.runs, baseline.runs)
        mine, its = self.errors_m[:runs], baseline.errors_m[:runs]
        return paired_difference(mine, its, percent, comparisons=comparisons)

    def record(self, percent: float, delta_m: tuple[float, float, float] | None) -> dict[str, Any]:
        """Returns a row of the table ``compared`` of :mod:`access_av.columns`."""
        known, shares = self.percentile(percent), self.state_shares or {}
        counts = {name: getattr(self, name, None) for name in ("aoa_estimates", "bursts_received")}
        rms_m = float(np.sqrt(np.mean(np.square(self.errors_m))))
        return {
            "variant": self.name,
            "runs": self.runs,
            "percent": percent,
            **with_ends("percentile{}_m", known.numbers),
            **with_ends("delta{}_m", delta_m),
            "rms_error_m": finite(rms_m),
            "lost_runs": self.lost_runs,
            "availability": shares.get("ok"),
            "unavailable_share": shares.get("unavailable"),
            "exceedances": self.exceedances,
            **{name: None if it is None else float(it.mean()) for name, it in counts.items()},
            "energy_j": self.energy_j,
        }
