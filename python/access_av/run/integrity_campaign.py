"""Integrity under differences of truth and model, by channel and number of radio heads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.run.campaign import Campaign, Task
from access_av.run.fault_injection import Overrides, hypotheses, mismatches
from access_av.run.pairs import UNCHANGED, ErrorSamples
from access_av.run.simulation import simulate
from access_av.settings import as_dict
from access_av.statistics.alarms import Alarms
from access_av.statistics.consistency import horizontal_error_m
from access_av.statistics.extremes import ObtainedRisk
from access_av.statistics.integrity import STATES, Integrity
from access_av.statistics.percentiles import with_ends

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray


# Runs per part, which are lost by an interruption.
PART_RUNS = 5
# Columns of the trajectories that a part contains, by their names in the part.
NUMBERS = {name: name for name in ("time_s", "error_x_m", "error_y_m")}
NUMBERS["level_m"] = "protection_level_m"


@dataclass(frozen=True)
class Case:
    """One case of the campaign.

    Attributes
    ----------
    mismatch, channel, heads, asked_risk_per_hour
        Difference of truth and model, channel, number of received radio heads, and target
        integrity risk.
    scenario
        Scenario of the case.
    trajectories
        ``run, time_s, error_x_m, error_y_m, protection_level_m, integrity`` of every step.
    variant
        Name of the variant.
    """

    mismatch: str
    channel: str
    heads: int
    asked_risk_per_hour: float
    scenario: _core.Scenario
    trajectories: pl.DataFrame
    variant: str = UNCHANGED

    @property
    def alert_limit_m(self) -> float:
        """Returns the alert limit of the integrity monitor."""
        return float(_settings(self.scenario)["alert_limit_m"])

    def as_record(self) -> dict[str, Any]:
        """Returns a row of the table; columns ``integrity_cases`` of :mod:`access_av.columns`."""
        found = Integrity.of(self.trajectories)
        alarms = Alarms.of(self.trajectories, self.alert_limit_m)
        if found is None or alarms is None:
            raise InputError(f"{self.scenario.name}: no step has a protection level")
        error_m = self.trajectories.select(horizontal_error_m()).to_series()
        risk = ObtainedRisk.of(self.trajectories, _core.ERROR_CORRELATION_S)
        return {
            "variant": self.variant,
            "mismatch": self.mismatch,
            "channel": self.channel,
            "heads": self.heads,
            "runs": found.runs,
            "availability": found.availability,
            "unavailable_share": found.state_shares["unavailable"],
            "exceedances": found.exceedances,
            **with_ends("exceedance_share{}", (found.exceedance_share, *found.exceedance_interval)),
            "runs_with_exceedances": found.runs_with_exceedances,
            "time_to_alert_s": alarms.longest_silence_s,
            "level_over_error": found.median_level_over_error,
            "asked_risk_per_hour": self.asked_risk_per_hour,
            **with_ends(
                "risk_per_hour{}", None if risk is None else (risk.per_hour, *risk.interval)
            ),
            "p90_error_m": error_m.quantile(0.9, "linear"),
            "max_error_m": error_m.max(),
        }

    def errors(self, name: str) -> ErrorSamples:
        """Returns the errors of each run; infinite during the search for the first position."""
        by_run = [
            part.select(horizontal_error_m()).to_series().to_numpy()
            for part in self.trajectories.partition_by("run", maintain_order=True)
        ]
        errors_m = np.full((len(by_run), max(map(len, by_run))), np.inf)
        for row, found_m in zip(errors_m, by_run, strict=True):
            row[len(row) - len(found_m) :] = found_m
        duration_s = float(self.trajectories["time_s"].max())  # type: ignore[arg-type]
        return ErrorSamples(name=name, errors_m=errors_m, duration_s=duration_s)


def _settings(scenario: _core.Scenario) -> dict[str, Any]:
    """Returns the complete ``[integrity]`` settings of the vehicle."""
    found: dict[str, Any] = as_dict(scenario.vehicle)["integrity"]
    return found


def channels(names: Sequence[str]) -> dict[str, Overrides]:
    """Returns channels by name: ``as set``, ``K=dB`` for a true Rician K, or a model.

    Examples
    --------
    >>> channels(["K=5", "inf-sh"])
    {'K=5': {'truth.site.rician_k_db': 5.0}, 'inf-sh': {'channel': {'model': 'inf-sh'}}}
    """
    found: dict[str, Overrides] = {}
    for name in names:
        kind, _, k_db = name.partition("=")
        if name == "as set":
            found[name] = {}
        elif kind == "K":
            try:
                found[name] = {"truth.site.rician_k_db": float(k_db)}
            except ValueError:
                raise InputError(f"channel {name}: write K=5 for a Rician K of 5 dB") from None
        else:
            found[name] = {"channel": {"model": name}}
    return found


def drive(
    campaign: Campaign,
    scenario: _core.Scenario | str,
    *,
    runs: int = 20,
    seed: int = 1,
    only: Sequence[str] | None = None,
    channel_names: Sequence[str] = ("as set",),
    heads: Sequence[int] | None = None,
    risks_per_hour: Sequence[float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Case]:
    """Simulates a scenario with every mismatch, channel and number of radio heads.

    Parameters
    ----------
    campaign
        Workers and storage of the runs.
    scenario
        A scenario, or the name or path of one. A disabled integrity monitor is enabled.
    runs, seed
        Number of runs per case, and seed.
    only
        Names out of :func:`~access_av.hypotheses.mismatches`, (default: all of them), and of
        :func:`~access_av.hypotheses.hypotheses`.
    channel_names
        See :func:`channels`.
    heads
        Numbers of received radio heads, the first ones of the site. Default: all.
    risks_per_hour
        Target integrity risks. Default: that of the vehicle.
    progress
        Called as ``progress(done, total)``.

    Returns
    -------
    list of Case
        In the order mismatch, channel, heads, risk.

    Raises
    ------
    InputError
        Unknown name or number.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from access_av.run.campaign import Campaign
    >>> from access_av.run.campaign import ResultCache
    >>> kept = Campaign(ResultCache(Path(tempfile.mkdtemp())))
    >>> [case] = drive(kept, "paper-real-odometry-4", runs=1, only=["none"])
    >>> case.as_record()["availability"] > 0.9
    True
    """
    if not isinstance(scenario, _core.Scenario):
        scenario = _core.Scenario.load(scenario)
    scenario = scenario.with_overrides({"vehicle.integrity.enabled": True})
    usual = mismatches(scenario)
    known = {**usual, **hypotheses(scenario)} if only else usual
    for name in only or ():
        if name not in known:
            raise InputError(f"fault {name!r} is unknown; allowed are {', '.join(known)}")
    cells = [head["pci"] for head in as_dict(scenario.site)["radio_heads"]]
    for count in heads or ():
        if not 1 <= count <= len(cells):
            raise InputError(f"{count} radio heads: the site has {len(cells)}")
    grid = [
        (
            mismatch,
            channel,
            count,
            risk,
            scenario.with_overrides(
                {
                    **over,
                    **known[mismatch],
                    "vehicle.receiver.pci_allow_list": cells[:count],
                    "vehicle.integrity.risk_per_hour": risk,
                }
            ),
        )
        for mismatch in only or usual
        for channel, over in channels(channel_names).items()
        for count in heads or (len(cells),)
        for risk in risks_per_hour or (_settings(scenario)["risk_per_hour"],)
    ]
    tasks = [
        Task(
            depends_on={"integrity": text, "first_run": first, "runs": count, "seed": seed},
            work=driven,
            arguments=(text, first, count, seed),
        )
        for *_, chosen in grid
        for text in (chosen.to_toml(),)
        for first in range(0, runs, PART_RUNS)
        for count in (min(PART_RUNS, runs - first),)
    ]
    parts = campaign.run(tasks, progress)
    each = len(parts) // len(grid)
    return [
        Case(*case, pl.concat(map(_table, parts[number * each : (number + 1) * each])))
        for number, case in enumerate(grid)
    ]


def driven(scenario: str, first_run: int, runs: int, seed: int) -> dict[str, NDArray[Any]]:
    """Simulates one part: errors, levels and states of every step, in one thread."""
    found = simulate(
        _core.Scenario.from_toml(scenario),
        runs=runs,
        seed=seed,
        first_run=first_run,
        threads=1,
        keep_trajectories=True,
    )
    if found.trajectories is None:  # keep_trajectories is set
        raise RuntimeError("the simulation stored no trajectories")
    steps = found.trajectories.filter(pl.col("protection_level_m").is_not_null())
    state = steps["integrity"].cast(pl.Enum(STATES)).to_physical()
    return {
        "run": steps["run"].to_numpy().astype(np.int32),
        **{name: steps[column].to_numpy().astype(np.float32) for name, column in NUMBERS.items()},
        "state": state.to_numpy().astype(np.uint8),
    }


def _table(arrays: Mapping[str, NDArray[Any]]) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "run": arrays["run"],
            **{column: arrays[name].astype(np.float64) for name, column in NUMBERS.items()},
            "integrity": np.asarray(STATES)[arrays["state"]],
        }
    )
