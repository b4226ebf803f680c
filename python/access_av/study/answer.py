"""A study: everything that a plant's question needs, driven, and put into words."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.run.service_levels import INDEPENDENT_S
from access_av.run.simulation import Simulation, simulate
from access_av.study import economy
from access_av.study.places import WorstPlace, by_place, worst_places
from access_av.study.points import Point, front, points, recommended, tried
from access_av.study.remedies import Remedy, remedies
from access_av.study.trips import Driven, drive
from access_av.study.unstated import Unstated, unstated
from access_av.study.verdicts import Effect, Judgement
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from access_av.economics.balance import Way
    from access_av.economics.carbon import Range
    from access_av.statistics.percentiles import Percentile

# Drives as believed where none are asked for, by how many angles a trip may take: about a minute on
# two cores, all in all. A vehicle that asks its own error wakes up for a quarter of the SSBs or so.
BUDGET_ANGLES = 105_000.0
WOKEN_SHARE = 0.25
FEWEST, MOST = 4, 24
# Of them for each remedy, each way to operate, and poor line of sight, which takes longest.
SHARES = (0.65, 0.4, 0.2)


@dataclass(frozen=True)
class Mended:
    """A remedy that was driven.

    Attributes
    ----------
    remedy
        What was changed.
    driven
        Its drives.
    error
        The target's percentile with it.
    delta_m
        Difference of ``error`` to the plant without the remedy, in pairs of drives, and the ends
        of the 95 % interval; negative where the remedy helps.
    cost
        What it costs, low to high.
    """

    remedy: Remedy
    driven: Driven
    error: Percentile
    delta_m: tuple[float, float, float]
    cost: Range

    @property
    def effect(self) -> Effect:
        """Whether the remedy helps."""
        return Effect.of(self.delta_m)


@dataclass(frozen=True, eq=False)
class Study(Result):
    """What a study found.

    Attributes
    ----------
    plant, seed
        What was studied, and the seed of its drives.
    error_m, percent
        The target: horizontal error, and for how much of the time, in percent.
    believed, poor
        Drives through the channel as it is believed, and where lines of sight are poor.
    places, worst
        The error by place, and the worst places.
    mended
        Remedies, the best one first; none where the drives keep the target anyway.
    points, front, recommended
        Ways to operate; those no other beats, and the one to take, by their places in the list.
    prices, day, ways
        Prices, energy of a fleet's day, and money and carbon of each way to localize.
    unstated
        What nobody at the plant has stated.
    played
        The first of the drives as believed, step by step.
    """

    plant: _core.Plant
    seed: int
    error_m: float
    percent: float
    believed: Driven
    poor: Driven
    places: pl.DataFrame
    worst: list[WorstPlace]
    mended: list[Mended]
    points: list[Point]
    front: list[int]
    recommended: int | None
    prices: economy.Prices
    day: economy.Day | None
    ways: dict[str, Way]
    unstated: list[Unstated]
    played: Simulation

    def __repr__(self) -> str:
        return f"Study({self.plant.name}: {self.verdict})"

    @property
    def point(self) -> Point | None:
        """The way to operate that is recommended; ``None`` without any figure of energy."""
        return None if self.recommended is None else self.points[self.recommended]

    def judged(self, driven: Driven) -> Judgement:
        """Whether drives meet the target with 95 % confidence, or probably."""
        share, low, high = driven.within(self.error_m)
        required = 0.01 * self.percent
        if low >= required:
            return Judgement.MET
        if high < required:
            return Judgement.MISSED
        return Judgement.PROBABLY_MET if share >= required else Judgement.PROBABLY_MISSED

    def in_words(self, driven: Driven) -> str:
        """The target's percentile of drives with its interval, in words."""
        found = driven.percentile(self.percent)
        return f"within {_metres(found.value)} ({found.interval} m, {driven.runs} drives)"

    @property
    def verdict(self) -> str:
        """One sentence: as believed, and in poor line of sight."""
        believed = self.judged(self.believed).words
        return (
            f"{believed[0].upper()}{believed[1:]}: for {self.percent:g} % of the time the vehicle "
            f"knows its position {self.in_words(self.believed)}; {self.error_m:g} m is asked. "
            f"Where lines of sight are poor: {self.judged(self.poor).words}, "
            f"{self.in_words(self.poor)}."
        )

    @property
    def trajectory(self) -> pl.DataFrame:
        """Truth and estimate of the drive that is played, step by step."""
        if self.played.trajectories is None:  # they were asked for
            raise RuntimeError("the simulation kept no trajectories")
        return self.played.trajectories

    def summary(self) -> dict[str, Any]:
        """Every figure of the page, as plain values for JSON."""
        point, fleet = self.point, json.loads(self.plant.to_json())["fleet"]
        return {
            "plant": self.plant.name,
            "seed": self.seed,
            "target": {"error_m": self.error_m, "percent": self.percent},
            "verdict": self.verdict,
            "believed": self._figures(self.believed),
            "poor": self._figures(self.poor),
            "worst": [vars(place) for place in self.worst],
            "remedies": [
                {
                    "name": it.remedy.name,
                    "what": it.remedy.what,
                    "settings": dict(it.remedy.settings),
                    **_percentile(it.error),
                    "delta_m": it.delta_m[0],
                    "delta_low_m": it.delta_m[1],
                    "delta_high_m": it.delta_m[2],
                    "effect": it.effect.value,
                    "cost": vars(it.cost),
                }
                for it in self.mended
            ],
            "recommended": point
            and {
                "name": point.name,
                "error_m": point.error_m,
                "trip_j": vars(economy.trip_j(point)),
                "idle_w": point.idle_w and dict(point.idle_w),
            },
            "day": self.day
            and {
                "trips_wh": vars(self.day.trips_wh),
                "idle_wh": self.day.idle_wh and vars(self.day.idle_wh),
                "idle_share": self.day.idle_share,
            },
            "currency": self.prices.currency,
            "years": fleet["years"],
            "ways": {
                name: {key: vars(value) for key, value in vars(way).items()}
                for name, way in self.ways.items()
            },
            "unstated": [vars(it) for it in self.unstated],
        }

    def _figures(self, driven: Driven) -> dict[str, Any]:
        share, low, high = driven.within(self.error_m)
        return {
            "runs": driven.runs,
            **_percentile(driven.percentile(self.percent)),
            "within_share": share,
            "within_low_share": low,
            "within_high_share": high,
            "judged": self.judged(driven).value,
            "lost_runs": driven.lost_runs,
            "ok_share": driven.ok_share,
            "state_shares": driven.state_shares and dict(driven.state_shares),
            "beyond_level_while_ok": driven.exceedances,
        }

    def tables(self) -> dict[str, pl.DataFrame]:
        """Everything the figures are computed from, by the file's name."""
        drives = [self.believed, self.poor, *(it.driven for it in self.mended)]
        ways = {id(point.driven): point.driven for point in self.points}
        drives += [driven for driven in ways.values() if driven.name != self.believed.name]
        rows = [
            {
                "variant": point.driven.name,
                "method": point.method,
                "wake_up": point.wake_up,
                "mode": point.mode,
                "mode_name": point.mode_name,
                "target_error_m": point.error_m,
                **{
                    f"{part}_{extent}_j": getattr(point.energy[extent], f"{part}_j")
                    for part in ("estimates", "listening", "idle")
                    for extent in ("low", "value", "high")
                },
                **{
                    f"idle_{extent}_w": None if point.idle_w is None else point.idle_w[extent]
                    for extent in ("low", "value", "high")
                },
                "on_front": index in self.front,
                "recommended": index == self.recommended,
            }
            for index, point in enumerate(self.points)
        ]
        return {
            "errors": pl.concat(driven.table() for driven in drives),
            "drives": pl.concat(driven.drives() for driven in drives),
            "places": self.places,
            "points": pl.DataFrame(rows),
            "trajectories": self.trajectory,
        }


def study_plant(
    plant: _core.Plant | str | Path,
    *,
    runs: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    always_mend: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Study:
    """Tell whether a plant's localization is good enough, where not, what mends it, and its cost.

    Parameters
    ----------
    plant
        A plant, or the name or path of one.
    runs
        Drives as believed; of the other comparisons there are fewer, in proportion. As many as
        take about a minute on two cores when ``None``.
    seed
        Seed of all drives: remedies and ways to operate are driven in the same worlds.
    threads
        Worker threads; all cores when ``None``.
    always_mend
        Drive the remedies also where the target is kept.
    progress
        Called as ``progress(done, total)`` with numbers of drives.

    Raises
    ------
    SettingsError
        When the plant cannot be used; names the key and what is allowed.
    InputError
        When its vehicle is not guarded: an error that nobody watches over is no answer.

    Examples
    --------
    >>> plant = _core.Plant.load("bends").with_overrides({"motion.start_at_m": 580.0})
    >>> found = study_plant(plant, runs=2)
    >>> found.point in [found.points[place] for place in found.front]
    True
    """
    named = plant.name if isinstance(plant, _core.Plant) else str(plant)
    if not isinstance(plant, _core.Plant):
        plant = _core.Plant.load(str(plant))
    scenario = plant.scenario()
    if scenario.vehicle.alert_limit_m is None:
        raise InputError(
            f"{named}: vehicle.integrity: off, or not possible with this localizer; a study drives "
            'nothing unguarded: take it out, with localizer.kind = "tracker"'
        )
    error_m, percent = plant.target
    fleet = json.loads(plant.to_json())["fleet"]
    usual = _runs(scenario) if runs is None else runs
    full = min(2 * usual, max(usual, _sure(scenario, percent))) if runs is None else runs
    pairs, few, fewest = (min(full, max(2, round(share * usual))) for share in SHARES)
    operated = tried(scenario)
    done, total = 0, full + fewest + few * (len(operated) - 1)

    def driven(name: str, variant: _core.Scenario, count: int) -> Driven:
        nonlocal done

        def tell(now: int, _: int) -> None:
            if progress is not None:
                progress(done + now, total)

        made = drive(name, variant, count, seed, threads, tell)
        done += count
        return made

    believed = driven("as it is", scenario, full)
    changes = []
    if always_mend or believed.within(error_m)[0] < 0.01 * percent:
        changes = remedies(scenario, fleet["vehicles"])
        total += pairs * len(changes)
    prices = economy.Prices.of(plant)
    mended = []
    for remedy in changes:
        changed = scenario.with_overrides(dict(remedy.settings))
        made = driven(remedy.name, changed, pairs)
        mended.append(_mended(remedy, made, believed, percent, prices))
    mended.sort(key=lambda it: it.delta_m[0])
    poor = driven("poor line of sight", plant.poor_scenario(), fewest)
    at_ways: list[tuple[str, str, Driven]] = []
    for name, (method, wake_up, settings) in operated.items():
        made = (
            driven(name, scenario.with_overrides(settings), few)
            if settings
            else believed.first(few)
        )
        at_ways.append((method, wake_up, made))
    found = points(at_ways, percent)
    chosen = recommended(found, error_m)
    places = by_place(believed, percent, error_m)
    stops_m = [stop["at_m"] for stop in json.loads(plant.to_json())["motion"]["stops"]]
    point = None if chosen is None else found[chosen]
    return Study(
        plant=plant,
        seed=seed,
        error_m=error_m,
        percent=percent,
        believed=believed,
        poor=poor,
        places=places,
        worst=worst_places(places, stops_m),
        mended=mended,
        points=found,
        front=front(found),
        recommended=chosen,
        prices=prices,
        day=None if point is None else economy.day(plant, point),
        ways={} if point is None else economy.ways(plant, point, prices),
        unstated=unstated(scenario, named),
        played=simulate(scenario, runs=1, seed=seed, threads=threads, keep_trajectories=True),
    )


def _runs(scenario: _core.Scenario) -> int:
    """As many drives as are within the budget."""
    wake_up = json.loads(scenario.resolved().vehicle.to_json())["wake_up"]
    share = WOKEN_SHARE
    if wake_up["policy"] == "fixed":
        period_ms = json.loads(scenario.site.to_json())["ssb"]["period_ms"]
        share = min(1.0, period_ms / wake_up["interval_ms"])
    return int(min(MOST, max(FEWEST, BUDGET_ANGLES // (share * scenario.size["ssbs"]))))


def _sure(scenario: _core.Scenario, percent: float) -> int:
    """From so many drives on the percentile's interval has a high end."""
    independent = math.log(0.025) / math.log(0.01 * percent)  # Clopper and Pearson, all within
    # The size is from above: a trip takes a little less.
    return math.ceil(1.02 * independent * INDEPENDENT_S / scenario.size["duration_s"])


def _mended(
    remedy: Remedy, driven: Driven, believed: Driven, percent: float, prices: economy.Prices
) -> Mended:
    return Mended(
        remedy=remedy,
        driven=driven,
        error=driven.percentile(percent),
        delta_m=driven.delta_m(believed, percent),
        cost=prices.ranges[remedy.price].scaled(remedy.units),
    )


def _percentile(found: Percentile) -> dict[str, Any]:
    return {
        "target_error_m": found.value,
        "target_error_low_m": found.low,
        "target_error_high_m": found.high,
    }


def _metres(value: float) -> str:
    return f"{value:.2f} m"
