"""Simulation of a plant study: selects the runs of each part and evaluates them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from access_av import _core
from access_av.errors import InputError
from access_av.run.pairs import UNCHANGED
from access_av.run.runs import Runs, drive
from access_av.run.service_levels import INDEPENDENT_S
from access_av.run.simulation import simulate
from access_av.settings import as_dict
from access_av.study import economy
from access_av.study.measures import measures
from access_av.study.operate import operate
from access_av.study.places import by_place, radio_head_sides, worst_places
from access_av.study.remedies import remedies
from access_av.study.study_result import Study
from access_av.study.targets import Targets
from access_av.study.unverified import unverified

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


# Angles of all drives of the nominal plant, without a given number of runs. A vehicle that wakes
# up by its own error estimates the angles of about a quarter of the SSBs.
BUDGET_ANGLES = 60_000.0
WOKEN_SHARE = 0.25
FEWEST, MOST = 3, 24
# Shares of these drives for each measure, each operation, and poor line of sight.
SHARES = (0.5, 0.4, 0.2)


def study_plant(
    plant: _core.Plant | str | Path,
    *,
    runs: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    force_remedies: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
) -> Study:
    """Evaluates a plant's localization: verdict, positions with large errors, remedies, cost.

    Parameters
    ----------
    plant
        A plant, or the name or path of one.
    runs
        Runs with the nominal channel; other comparisons have proportionally fewer. Default: 3 to
        24, so that the study takes about a minute on two cores.
    seed
        Seed of all runs: measures and operations are simulated in equal environments.
    threads
        Worker threads. Default: all cores.
    force_remedies
        Whether to simulate measures even if all targets are met.
    progress
        Called as ``progress(stage, done, total)`` with numbers of runs of the present stage. Their
        total is known when the stage begins; the results of a stage determine the later ones.

    Raises
    ------
    SettingsError
        If the plant is invalid; the message contains the key and the allowed values.
    InputError
        If the vehicle has no integrity monitor.

    Examples
    --------
    >>> plant = _core.Plant.load("bends").with_overrides({"motion.start_at_m": 580.0})
    >>> found = study_plant(plant, runs=2)
    >>> found.point in found.points
    True
    """
    named = plant.name if isinstance(plant, _core.Plant) else str(plant)
    if not isinstance(plant, _core.Plant):
        plant = _core.Plant.load(str(plant))
    scenario = plant.scenario()
    if scenario.vehicle.alert_limit_m is None:
        raise InputError(
            f"{named}: vehicle.integrity: a study needs the integrity monitor. The monitor is "
            f"disabled, or the localizer has none: remove `vehicle.integrity.enabled = false`, "
            f"and set "
            '`vehicle.localizer.kind = "tracker"`'
        )
    targets, (_, percent) = Targets.of(plant), plant.target
    fleet = as_dict(plant)["fleet"]
    usual = _runs(scenario) if runs is None else runs
    full = min(2 * usual, max(usual, _sure(scenario, percent))) if runs is None else runs
    pairs, few = (min(full, max(FEWEST, round(share * usual))) for share in SHARES[:2])
    fewest = min(full, max(2, round(SHARES[2] * usual)))
    # Present stage, its completed runs, and the number of its runs.
    stage, done, total = "", 0, 0
    known: dict[tuple[str, int], Runs] = {}

    def begin(name: str, runs_of_stage: int) -> None:
        nonlocal stage, done, total
        stage, done, total = name, 0, runs_of_stage
        if progress is not None and total:
            progress(stage, done, total)

    def driven(name: str, variant: _core.Scenario, count: int, of_seed: int = seed) -> Runs:
        """Simulates a scenario, or returns earlier runs of equal scenario and seed."""
        nonlocal done

        def tell(now: int, _: int) -> None:
            if progress is not None:
                progress(stage, done + now, total)

        key = (variant.to_toml(), of_seed)
        if key not in known or known[key].runs < count:
            known[key] = drive(name, variant, count, of_seed, threads, tell)
        else:
            tell(count, count)
        done += count
        return known[key].first(count).named(name)

    begin("nominal channel", full)
    nominal = driven(UNCHANGED, scenario, full)
    needs_measures = force_remedies or not targets.judgement(nominal).holds
    changes = remedies(scenario, fleet["vehicles"]) if needs_measures else []
    begin("poor line of sight", fewest)
    poor_los = driven("poor line of sight", plant.poor_scenario(), fewest)
    recommendation = operate(plant, targets, few, seed, driven, begin)
    prices = economy.Prices.of(plant)
    measured = None
    if changes:
        before = nominal.first(pairs)
        measured = measures(scenario, changes, before, targets, prices, seed, driven, begin)
    places = by_place(nominal, percent, targets.each[0].error_m)
    point = recommendation.point
    return Study(
        plant=plant,
        seed=seed,
        targets=targets,
        nominal=nominal,
        poor_los=poor_los,
        places=places,
        worst=worst_places(places, plant),
        heads=radio_head_sides(scenario),
        measured=measured,
        recommendation=recommendation,
        prices=prices,
        day=None if point is None else economy.day(plant, point),
        ways={} if point is None else economy.ways(plant, point, prices),
        unverified=unverified(plant),
        example_run=simulate(scenario, runs=1, seed=seed, threads=threads, keep_trajectories=True),
    )


def _runs(scenario: _core.Scenario) -> int:
    """Returns the number of runs within the budget."""
    wake_up = as_dict(scenario.resolved().vehicle)["wake_up"]
    share = WOKEN_SHARE
    if wake_up["policy"] == "fixed":
        period_ms = as_dict(scenario.site)["ssb"]["period_ms"]
        share = min(1.0, period_ms / wake_up["interval_ms"])
    return int(min(MOST, max(FEWEST, BUDGET_ANGLES // (share * scenario.size["ssbs"]))))


def _sure(scenario: _core.Scenario, percent: float) -> int:
    """Returns the minimum number of runs for a finite upper end of the percentile's interval."""
    independent = math.log(0.025) / math.log(
        0.01 * percent
    )  # Clopper and Pearson with all errors within the bound
    # Add 2 %, because the duration of a trip is an upper bound.
    return math.ceil(1.02 * independent * INDEPENDENT_S / scenario.size["duration_s"])
