"""Results of a study: runs, verdicts, figures and tables."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.run.runs import EXTENTS
from access_av.settings import as_dict
from access_av.statistics.percentiles import with_ends
from access_av.study import economy
from access_av.study.points import OK_MARGIN, OWN, Point, own_mode
from access_av.study.targets import table as targets_table
from access_av.tables.result import Result
from access_av.verdicts import Judgement

if TYPE_CHECKING:
    from access_av import _core
    from access_av.economics.balance import Way
    from access_av.economics.carbon import Range
    from access_av.run.runs import Runs
    from access_av.run.simulation import Simulation
    from access_av.study.measures import Measure, Measures
    from access_av.study.operate import Recommendation
    from access_av.study.places import WorstPlace
    from access_av.study.targets import TargetResult, Targets
    from access_av.study.unverified import Unverified


@dataclass(frozen=True, eq=False)
class Study(Result):
    """Results of a study.

    Attributes
    ----------
    targets
        The targets; that of the whole trip is the first one.
    nominal, poor_los
        Runs with the nominal channel, and with poor line of sight.
    places, worst
        The error along the road, and the positions with the largest errors.
    heads
        Side and distance of each radio head from the road.
    measured
        Measures that reduce the error; ``None`` if the runs meet all targets.
    recommendation
        Operating points, and the recommended one.
    prices, day, ways
        Prices, energy of a fleet's day, and money and carbon of each kind of localization.
    unverified
        Values that are equal to the template's or the default.
    example_run
        Steps of the first run with the nominal channel.
    """

    plant: _core.Plant
    seed: int
    targets: Targets
    nominal: Runs
    poor_los: Runs
    places: pl.DataFrame
    worst: list[WorstPlace]
    heads: pl.DataFrame
    measured: Measures | None
    recommendation: Recommendation
    prices: economy.Prices
    day: economy.Day | None
    ways: dict[str, Way]
    unverified: list[Unverified]
    example_run: Simulation

    @property
    def scenario(self) -> _core.Scenario:
        """Scenario of the runs with the nominal channel."""
        return self.nominal.scenario

    def __repr__(self) -> str:
        return f"Study({self.plant.name}: {self.verdict})"

    @property
    def error_m(self) -> float:
        """Error of the target of the whole trip, in metres."""
        return self.targets.each[0].error_m

    @property
    def percent(self) -> float:
        """Share of the time of the target of the whole trip, in percent."""
        return self.targets.each[0].percent

    @property
    def remedies(self) -> list[Measure]:
        """All measures: single measures first, in order of their effect."""
        return [] if self.measured is None else self.measured.every

    @property
    def points(self) -> list[Point]:
        """All operating points."""
        return self.recommendation.points

    @property
    def front(self) -> list[int]:
        """Indices of the Pareto front of the available points."""
        return self.recommendation.front

    @property
    def recommended(self) -> int | None:
        """Index of the recommended point."""
        return self.recommendation.chosen

    @property
    def point(self) -> Point | None:
        """The recommended point; ``None`` without a figure of energy."""
        return self.recommendation.point

    @property
    def alert_limit_m(self) -> float:
        """Alert limit of the vehicle in metres; twice the target's error unless set."""
        limit_m = self.nominal.scenario.vehicle.alert_limit_m
        if limit_m is None:  # a study requires an integrity monitor
            raise RuntimeError("the vehicle has no integrity monitor")
        return limit_m

    def results(self, driven: Runs) -> list[TargetResult]:
        """Returns the result of runs for each target."""
        return self.targets.results(driven)

    def judged(self, driven: Runs) -> Judgement:
        """Returns the judgement of runs for all targets."""
        return self.targets.judgement(driven)

    def in_words(self, driven: Runs) -> str:
        """Returns lost runs and the target's percentile with its interval as text."""
        found = driven.percentile(self.percent)
        lost = f"LOST in {driven.lost_runs} of {driven.runs} drives; " if driven.lost_runs else ""
        return (
            f"{lost}{self.percent:g} % of the position errors are within {found.value:.2f} m "
            f"({found.interval} m, {driven.runs} drives)"
        )

    @property
    def verdict(self) -> str:
        """The verdict on all targets with the nominal channel, and with poor line of sight."""
        nominal = self.judged(self.nominal).words
        text = (
            f"{nominal[0].upper()}{nominal[1:]}: {self.in_words(self.nominal)}; "
            f"{self.error_m:g} m is required."
        )
        if missed := [it for it in self.results(self.nominal)[1:] if not it.judgement.holds]:
            named = ", ".join(
                f"{it.target.name} ({it.error.value:.2f} m, required {it.target.words})"
                for it in missed
            )
            text += f" Stretches that miss their targets: {named}."
        return (
            f"{text} With poor line of sight: {self.judged(self.poor_los).words}: "
            f"{self.in_words(self.poor_los)}."
        )

    @property
    def trajectory(self) -> pl.DataFrame:
        """Truth and estimate of the example run, by step."""
        if self.example_run.trajectories is None:  # keep_trajectories is set
            raise RuntimeError("the simulation stored no trajectories")
        return self.example_run.trajectories

    def summary(self) -> dict[str, Any]:
        """Every figure of the page, as plain values for JSON."""
        written = as_dict(self.plant)
        fleet = written["fleet"]
        cheapest = None if self.measured is None else self.measured.cheapest
        return {
            "plant": self.plant.name,
            "seed": self.seed,
            "target": {"error_m": self.error_m, "percent": self.percent},
            "targets": [vars(it) for it in self.targets.each],
            "alert_limit_m": self.alert_limit_m,
            "verdict": self.verdict,
            "nominal": _figures(self, self.nominal),
            "poor_los": _figures(self, self.poor_los),
            "worst": [vars(place) for place in self.worst],
            "radio_heads": self.heads.to_dicts(),
            "before_measures": None
            if self.measured is None
            else _figures(self, self.measured.before),
            "remedies": [_measure(self, it) for it in self.remedies],
            "cheapest_measure": cheapest and cheapest.name,
            **_recommendation(self),
            "currency": self.prices.currency,
            "years": fleet["years"],
            "ways": {
                name: {key: vars(value) for key, value in vars(way).items()}
                for name, way in self.ways.items()
            },
            "prices": {
                key: {
                    **vars(value),
                    "source": self.prices.sources[key],
                    "is_published": key in self.prices.published,
                }
                for key, value in self.prices.ranges.items()
            },
            "unverified": [vars(it) for it in self.unverified],
        }

    def tables(self) -> dict[str, pl.DataFrame]:
        """Everything the figures are computed from, by the file's name."""
        drives = [self.nominal, self.poor_los, *(it.driven for it in self.remedies)]
        of_points = {point.driven.name: point.driven for point in self.points}
        drives += [it for name, it in of_points.items() if name != self.nominal.name]
        rows = [
            {
                "variant": point.driven.name,
                "mode": point.mode,
                "mode_name": point.mode_name,
                "method": point.operation.method,
                "wake_up": point.operation.wake_up,
                "runs": point.driven.runs,
                "target_error_m": point.error_m,
                "judgement": point.judgement.value,
                **{
                    f"{part}_{extent}_j": joules
                    for part in ("estimates", "listening", "idle")
                    for extent, joules in _extents(getattr(point.energy, f"{part}_j")).items()
                },
                **{f"idle_{extent}_w": watts for extent, watts in _extents(point.idle_w).items()},
                "on_front": index in self.front,
                "recommended": index == self.recommended,
            }
            for index, point in enumerate(self.points)
        ]
        return {
            "errors": pl.concat(driven.table() for driven in drives),
            "drives": pl.concat(driven.drives() for driven in drives),
            "targets": targets_table(
                {it.name: self.results(it) for it in (self.nominal, self.poor_los)}
            ),
            "places": self.places,
            "points": pl.DataFrame(rows, infer_schema_length=None),
            "trajectories": self.trajectory,
        }


def recommended_toml(study: Study) -> str | None:
    """The recommended operating point as a scenario for ``access-av run``.

    ``None`` without a recommendation. The scenario is a trip of the plant with the keys of the
    point; the rule of the recommendation and the keys are named at its top.
    """
    point = study.point
    if point is None:
        return None
    scenario = study.plant.scenario().with_overrides(point.settings)
    keys = "".join(f"#   {key} = {as_toml(value)}\n" for key, value in point.settings.items())
    rules = "".join(f"# {it}\n" for it in rule(study.recommendation))
    return (
        f"# Recommended operating point of plant {study.plant.name}: {point.name}.\n"
        f"{rules}# Keys that select it:\n{keys}"
        f"# Simulate it: access-av run recommended.toml\n\n{scenario.to_toml()}"
    )


def rule(recommendation: Recommendation) -> list[str]:
    """Returns the rule that selected the recommended point, as sentences."""
    found = recommendation.points
    if recommendation.best is None or recommendation.chosen is None:
        return []
    leader, point = found[recommendation.best], found[recommendation.chosen]
    criterion = {
        Judgement.MET: "the least energy of the points that meet all targets",
        Judgement.PROBABLY_MET: "the least energy of the points that probably meet all targets, "
        "because none meets them with 95 % confidence",
    }.get(leader.judgement, "the smallest error, because no point meets all targets")
    same = ["operation"] if point.operation.name == OWN else []
    same += ["power mode"] if point.mode == own_mode(found[0].driven.scenario) else []
    kept = f"The vehicle keeps its {' and its '.join(same)}, because the difference does not matter"
    return [
        "Candidates: points whose share of time in state ok is at most "
        f"{100.0 * OK_MARGIN:g} percentage point below that of the vehicle's own operation.",
        f"Best candidate: {leader.name}, with {criterion}.",
        *([] if point is leader else [f"{kept}."]),
    ]


def as_toml(value: object) -> str:
    """Returns a value of a key in TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {as_toml(it)}" for key, it in value.items()) + " }"
    return json.dumps(value)


def _measure(study: Study, it: Measure) -> dict[str, Any]:
    return {
        "name": it.name,
        "what": it.what,
        "settings": [dict(one.settings) for one in it.remedies],
        **_figures(study, it.driven),
        **with_ends("delta{}_m", it.delta_m),
        "effect": it.effect.value,
        "cost": vars(it.cost),
        "cm_per_price": it.cm_per_price,
    }


def _recommendation(study: Study) -> dict[str, Any]:
    point, day = study.point, study.day
    if point is None or day is None:
        return {"recommended": None, "rivals": [], "day": None}
    fleet = as_dict(study.plant)["fleet"]
    return {
        "recommended": {
            "name": point.name,
            "method": point.operation.method,
            "wake_up": point.operation.wake_up,
            "mode": point.mode,
            "settings": point.settings,
            "runs": point.driven.runs,
            "error_m": point.error_m,
            **with_ends("target_error{}_m", point.driven.percentile(study.percent).numbers),
            "ok_share": point.driven.ok_share,
            **with_ends("ok_delta{}", point.ok_delta),
            "judged": point.judgement.value,
            "trip_j": vars(economy.trip_j(point)),
            "idle_w": point.idle_w and _extents(point.idle_w),
            "best": study.points[study.recommendation.best or 0].name,
        },
        "rivals": [
            {
                "name": it.point.name,
                "error_m": it.point.error_m,
                **with_ends("delta{}_m", it.delta_m),
                **with_ends("ok_delta{}", it.ok_delta),
                "delta_j": it.delta_j,
                "day_share": it.day_share,
                "is_equivalent": it.is_equivalent,
                "judged": it.point.judgement.value,
            }
            for it in study.recommendation.rivals
        ],
        "day": {
            "trips_wh": vars(day.trips_wh),
            "idle_wh": day.idle_wh and vars(day.idle_wh),
            "idle_share": day.idle_share,
            "composition_wh": economy.composition(point, day, fleet),
        },
    }


def _extents(values: Range | None) -> dict[str, float | None]:
    return dict(zip(EXTENTS, (None,) * 3 if values is None else values.ends, strict=True))


def _figures(study: Study, driven: Runs) -> dict[str, Any]:
    reasons = driven.not_ok_shares
    return {
        "runs": driven.runs,
        **with_ends("target_error{}_m", driven.percentile(study.percent).numbers),
        **with_ends("within{}_share", driven.within(study.error_m)),
        "judged": study.judged(driven).value,
        "lost_runs": driven.lost_runs,
        "ok_share": driven.ok_share,
        "state_shares": driven.state_shares and dict(driven.state_shares),
        "not_ok_shares": reasons and {it.value: share for it, share in reasons.items()},
        "integrity_failures": driven.exceedances,
    }
