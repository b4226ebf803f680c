"""Alarms of a monitored localizer: timely, early and missed alarms."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl

from access_av.statistics.consistency import horizontal_error_m


@dataclass(frozen=True)
class Alarms:
    """Statistics of alarms; an alarm is a step at which the state leaves ``ok``.

    Attributes
    ----------
    alarms
        Number of alarms.
    early
        Alarms at which the error was within the alert limit.
    suspicions
        Early alarms with a protection level within the alert limit: a source was suspected. Without
        a fault, such an alarm is a false alarm.
    excursions
        Number of times that the error exceeded the alert limit.
    longest_silence_s
        Maximum time with an error above the alert limit in state ``ok``.
    duration_s
        Total duration of all runs.

    Examples
    --------
    >>> import access_av
    >>> scenario = access_av.Scenario.load("paper-real-odometry-4").with_overrides(
    ...     {"vehicle.integrity": {}}
    ... )
    >>> drives = access_av.simulate(scenario, runs=2, keep_trajectories=True)
    >>> Alarms.of(drives.trajectories, alert_limit_m=1.5).longest_silence_s
    0.0
    """

    alarms: int
    early: int
    suspicions: int
    excursions: int
    longest_silence_s: float
    duration_s: float

    def per_hour(self, count: int) -> float:
        """Returns the number of alarms per hour."""
        return count / (self.duration_s / 3600.0)

    @classmethod
    def of(cls, trajectories: pl.DataFrame, alert_limit_m: float) -> Alarms | None:
        """Evaluates a table of trajectories; ``None`` if no step has a protection level."""
        steps = trajectories.filter(pl.col("protection_level_m").is_not_null()).sort(
            "run", "time_s", maintain_order=True
        )
        if steps.is_empty():
            return None
        steps = steps.with_columns(
            ok=pl.col("integrity") == "ok",
            exceeds=horizontal_error_m() > alert_limit_m,
            vouched=pl.col("protection_level_m") <= alert_limit_m,
        ).with_columns(
            alarm=~pl.col("ok") & pl.col("ok").shift(1, fill_value=True).over("run"),
            begins=pl.col("exceeds") & ~pl.col("exceeds").shift(1, fill_value=False).over("run"),
        )
        since_s = pl.when("begins").then("time_s").forward_fill().over("run").alias("since_s")
        silence_s = steps.with_columns(since_s).filter("exceeds", "ok")
        early = pl.col("alarm") & ~pl.col("exceeds")
        longest_s = silence_s.select((pl.col("time_s") - pl.col("since_s")).max()).item()
        counted = steps.select(
            alarms=pl.col("alarm").sum(),
            early=early.sum(),
            suspicions=(early & pl.col("vouched")).sum(),
            excursions=pl.col("begins").sum(),
        )
        return cls(
            **counted.row(0, named=True),
            longest_silence_s=longest_s or 0.0,
            duration_s=float(
                steps.group_by("run", maintain_order=True)
                .agg(pl.col("time_s").max())["time_s"]
                .sum()
            ),
        )
