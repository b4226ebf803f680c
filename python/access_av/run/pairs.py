"""Errors of a variant in rows that pair with another's: drives, or stretches of one drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.run.service_levels import INDEPENDENT_S
from access_av.statistics.paired import paired_difference
from access_av.statistics.percentiles import percentiles

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from access_av.statistics.percentiles import Percentile

# What variants are compared with.
AS_IT_IS = "as it is"
DRIVES = "drives"
STRETCHES = f"stretches of {INDEPENDENT_S:g} s of one drive"


@dataclass(frozen=True, eq=False, kw_only=True)
class Errors:
    """Horizontal errors of one variant.

    Attributes
    ----------
    name
        What it is called in tables.
    errors_m
        Shape (rows, epochs); infinite as long as the place is searched for.
    duration_s
        Of a row.
    rows
        What a row is, in the plural.
    """

    name: str
    errors_m: NDArray[np.float64]
    duration_s: float
    rows: str = DRIVES

    @property
    def runs(self) -> int:
        """Number of rows."""
        return len(self.errors_m)

    @property
    def independent(self) -> int:
        """How many of the errors are as good as independent of each other."""
        return max(1, int(self.runs * self.duration_s / INDEPENDENT_S))

    @property
    def energy_j(self) -> float | None:
        """Energy of a trip; ``None`` where nothing is known of it."""
        return None

    def percentile(self, percent: float) -> Percentile:
        """A percentile of the error with its 95 % interval."""
        [found] = percentiles(self.errors_m, [percent], independent=self.independent)
        return found

    def less_than(self, other: Errors, percent: float) -> tuple[float, float, float]:
        """By how many metres a percentile is larger than another's, row by row.

        Returns
        -------
        tuple of float
            The difference, negative where this one is better, and the ends of its 95 % interval.
        """
        runs = min(self.runs, other.runs)
        return paired_difference(self.errors_m[:runs], other.errors_m[:runs], percent)
