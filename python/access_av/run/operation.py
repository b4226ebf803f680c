"""Availability of the position, and the causes of unavailability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import polars as pl

from access_av.verdicts import Cause

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av._core import Vehicle


@dataclass(frozen=True)
class Operation:
    """Availability of a vehicle's position.

    Attributes
    ----------
    reliable
        Share of the time in state ``ok``.
    reasons
        Share of the time by cause of unavailability, the most frequent first.
    level_m
        Median protection level in state ``ok``; ``None`` if the state is never ``ok``.
    alert_limit_m
        Alert limit of the vehicle.
    beyond, epochs
        Number of errors above the protection level in state ``ok``, and number of positions in
        state ``ok``; ``None`` without truth.
    """

    reliable: float
    reasons: Mapping[Cause, float]
    level_m: float | None
    alert_limit_m: float
    beyond: int | None
    epochs: int

    @classmethod
    def of(cls, steps: pl.DataFrame, alert_limit_m: float) -> Operation | None:
        """Evaluates a table of poses or trajectories with a constant time step.

        Parameters
        ----------
        steps
            Columns ``integrity``, ``protection_level_m`` and ``searching``; ``error_m`` if the
            truth is known.
        alert_limit_m
            ``integrity.alert_limit_m`` of the vehicle.

        Returns
        -------
        Operation or None
            ``None`` without an integrity monitor.

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
        The position is available (state ok) 62 % of the time, with a median protection level of \
0.4 m. Otherwise the vehicle must slow down or stop. Causes: 30 % protection level above the alert \
limit of 1 m, 8 % contradictions between radio heads, array and odometer.
        """
        monitored = steps.filter(pl.col("integrity").is_not_null() | pl.col("searching"))
        if monitored["integrity"].null_count() == monitored.height:
            return None
        ok = (pl.col("integrity") == "ok") & ~pl.col("searching")
        # The first cause that applies counts.
        reason = (
            pl.when(ok.fill_null(value=False))
            .then(pl.lit(None, dtype=pl.String))
            .when("searching")
            .then(pl.lit(Cause.SEARCHING.value))
            .when(pl.col("integrity") == "unavailable")
            .then(pl.lit(Cause.CONTRADICTED.value))
            .when(pl.col("protection_level_m") > alert_limit_m)
            .then(pl.lit(Cause.TOO_WIDE.value))
            .otherwise(pl.lit(Cause.SUSPECTED.value))
        )
        why = monitored.select(reason=reason)["reason"]
        counts = why.drop_nulls().value_counts().sort("count", "reason", descending=[True, False])
        relied = monitored.filter(why.is_null())
        level_m = relied["protection_level_m"].median()
        beyond = None
        if "error_m" in monitored.columns:
            beyond = int((relied["error_m"] > relied["protection_level_m"]).sum())
        return cls(
            reliable=relied.height / monitored.height,
            reasons={Cause(name): count / monitored.height for name, count in counts.iter_rows()},
            level_m=float(level_m) if isinstance(level_m, float) else None,
            alert_limit_m=alert_limit_m,
            beyond=beyond,
            epochs=relied.height,
        )

    @classmethod
    def under(cls, vehicle: Vehicle, steps: pl.DataFrame) -> Operation | None:
        """Evaluates with the vehicle's alert limit; ``None`` without an integrity monitor."""
        limit_m = vehicle.alert_limit_m
        return None if limit_m is None else cls.of(steps, limit_m)

    def in_words(self) -> str:
        """Returns availability, protection level and causes as text."""
        text = f"The position is available (state ok) {_percent(self.reliable)} of the time"
        if self.level_m is not None:
            text += f", with a median protection level of {self.level_m:.2g} m"
        text += "."
        if self.beyond is not None and self.epochs:
            text += (
                f" The error exceeded the level in {self.beyond:,} of {self.epochs:,} available "
                "positions."
            )
        if self.reasons:
            whys = [
                f"{_percent(share)} {cause.words(self.alert_limit_m)}"
                for cause, share in self.reasons.items()
            ]
            text += f" Otherwise the vehicle must slow down or stop. Causes: {', '.join(whys)}."
        return text

    def what_helps(self) -> str:
        """Returns the remedy of the most frequent cause; empty above 99 % availability."""
        if not self.reasons or self.reliable > 0.99:
            return ""
        return f"Remedy: {next(iter(self.reasons)).remedy}."


def _percent(share: float) -> str:
    """Returns a share in percent; a share between 0 and 1 is not rounded to 0 or 100 %.

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
