"""What integrity means for operation: how often a vehicle may rely on its position, and why not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av._core import Vehicle

# Why a position is not to be relied on, and what changes that, in the order in which they are
# asked: the first that is so is the reason.
SEARCHING = "the first position was not found yet"
CONTRADICTED = "several radio heads contradict each other, or the array or the odometer all of them"
TOO_WIDE = "the protection level was above the alert limit of {limit_m:g} m"
SUSPECTED = "a radio head, the array or the odometer was suspected of a fault, or had just been"
REMEDIES = {
    SEARCHING: "an initial pose, or more radio heads in reach of it",
    CONTRADICTED: "the places of the radio heads and the array's mounting, surveyed (access-av "
    "survey finds them from drives)",
    TOO_WIDE: "wake-ups more often, more radio heads in reach, smaller stated deviations, or a "
    "higher integrity.alert_limit_m where the plant allows it",
    SUSPECTED: "deviations that are stated as large as they are (array, odometer, radio heads): "
    "what is within them is no fault",
}


@dataclass(frozen=True)
class Operation:
    """For how much of the time a vehicle may rely on its position.

    Attributes
    ----------
    reliable
        Share of the time in state ``ok``.
    reasons
        Share of the time by the reason why it may not, the most frequent first.
    level_m
        Median protection level while it may; ``None`` where it never may.
    alert_limit_m
        Alert limit of the vehicle.
    beyond, epochs
        Errors beyond the protection level while it may, of so many; ``None`` without a truth.
    """

    reliable: float
    reasons: Mapping[str, float]
    level_m: float | None
    alert_limit_m: float
    beyond: int | None
    epochs: int

    @classmethod
    def of(cls, steps: pl.DataFrame, alert_limit_m: float) -> Operation | None:
        """Count in a table of poses or trajectories, evenly spaced in time.

        Parameters
        ----------
        steps
            Columns ``integrity``, ``protection_level_m`` and ``searching``; ``error_m`` where the
            truth is known.
        alert_limit_m
            ``integrity.alert_limit_m`` of the vehicle.

        Returns
        -------
        Operation or None
            ``None`` where no state is told: nothing watches over the position.

        Examples
        --------
        >>> steps = pl.DataFrame(
        ...     {
        ...         "integrity": ["ok"] * 62 + ["degraded"] * 30 + ["unavailable"] * 8,
        ...         "protection_level_m": [0.4] * 62 + [1.8] * 30 + [0.9] * 8,
        ...         "searching": [False] * 100,
        ...     }
        ... )
        >>> print(Operation.of(steps, 1.0).in_words())
        The vehicle may rely on its position 62 % of the time (state ok); half of that time it \
knows it to within 0.4 m (protection level). The rest of the time it knows that it may not, and \
has to slow down or stop: 30 % because the protection level was above the alert limit of 1 m, \
8 % because several radio heads contradict each other, or the array or the odometer all of them.
        """
        told = steps.filter(pl.col("integrity").is_not_null() | pl.col("searching"))
        if told["integrity"].null_count() == told.height:
            return None
        ok = (pl.col("integrity") == "ok") & ~pl.col("searching")
        reason = (
            pl.when(ok.fill_null(value=False))
            .then(pl.lit(None, dtype=pl.String))
            .when("searching")
            .then(pl.lit(SEARCHING))
            .when(pl.col("integrity") == "unavailable")
            .then(pl.lit(CONTRADICTED))
            .when(pl.col("protection_level_m") > alert_limit_m)
            .then(pl.lit(TOO_WIDE))
            .otherwise(pl.lit(SUSPECTED))
        )
        why = told.select(reason=reason)["reason"]
        counts = why.drop_nulls().value_counts().sort("count", "reason", descending=[True, False])
        relied = told.filter(why.is_null())
        level_m = relied["protection_level_m"].median()
        beyond = None
        if "error_m" in told.columns:
            beyond = int((relied["error_m"] > relied["protection_level_m"]).sum())
        return cls(
            reliable=relied.height / told.height,
            reasons={name: count / told.height for name, count in counts.iter_rows()},
            level_m=float(level_m) if isinstance(level_m, float) else None,
            alert_limit_m=alert_limit_m,
            beyond=beyond,
            epochs=relied.height,
        )

    @classmethod
    def under(cls, vehicle: Vehicle, steps: pl.DataFrame) -> Operation | None:
        """The same, by the vehicle's own alert limit; ``None`` where it is not guarded."""
        limit_m = vehicle.alert_limit_m
        return None if limit_m is None else cls.of(steps, limit_m)

    def in_words(self) -> str:
        """How often, how near, and why not else."""
        text = (
            f"The vehicle may rely on its position {_percent(self.reliable)} of the time (state ok)"
        )
        if self.level_m is not None:
            text += (
                f"; half of that time it knows it to within {self.level_m:.2g} m (protection level)"
            )
        text += "."
        if self.beyond is not None and self.epochs:
            text += (
                f" While it might, the error was beyond that level in {self.beyond:,} of "
                f"{self.epochs:,} positions."
            )
        if self.reasons:
            whys = [
                f"{_percent(share)} because {name.format(limit_m=self.alert_limit_m)}"
                for name, share in self.reasons.items()
            ]
            text += (
                " The rest of the time it knows that it may not, and has to slow down or stop: "
                f"{', '.join(whys)}."
            )
        return text

    def what_helps(self) -> str:
        """What changes the most frequent reason; empty where it may nearly always."""
        if not self.reasons or self.reliable > 0.99:
            return ""
        return f"What helps most: {REMEDIES[next(iter(self.reasons))]}."


def _percent(share: float) -> str:
    """A share, not rounded to all or none.

    Examples
    --------
    >>> _percent(0.99999), _percent(0.6234), _percent(0.00001)
    ('more than 99.9 %', '62 %', 'less than 0.1 %')
    """
    if 0.999 < share < 1.0:
        return "more than 99.9 %"
    if 0.0 < share < 0.001:
        return "less than 0.1 %"
    return f"{100.0 * share:.1f} %" if share > 0.98 or share < 0.02 else f"{100.0 * share:.0f} %"
