"""Sets of measures, and comparison of operating points, with synthetic runs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av import Plant
from access_av.economics.carbon import Range
from access_av.run.runs import Runs, drive
from access_av.statistics.integrity import Integrity
from access_av.study.economy import Prices
from access_av.study.measures import measures
from access_av.study.operate import operate
from access_av.study.points import OWN, own_mode
from access_av.study.remedies import Remedy
from access_av.study.targets import Targets

if TYPE_CHECKING:
    from access_av import _core

RUNS = 4
# The end of the road, so that a drive takes a moment.
PLANT = Plant.load("bends").with_overrides({"motion.start_at_m": 585.0, "motion.stops": []})
FREE = {"site.rician_k_db": 11.0}


@pytest.fixture(scope="module")
def real() -> Runs:
    return drive("unchanged", PLANT.scenario(), 2, 1)


def made(real: Runs, name: str, scenario: _core.Scenario, level_m: float, seed: int) -> Runs:
    """Drives of 600 s with errors about a level: 99 % of them are within three times it."""
    random = np.random.default_rng(seed)
    errors_m = level_m * np.abs(random.standard_normal((RUNS, len(real.time_s))))
    return replace(
        real,
        name=name,
        scenario=scenario,
        errors_m=errors_m,
        levels_m=np.full(errors_m.shape, np.nan, dtype=np.float32),
        aoa_estimates=np.full(RUNS, 100),
        bursts_received=np.full(RUNS, 50),
        seeds=np.full(RUNS, seed),
        duration_s=600.0,
        integrity=None,
    )


def prices(each: dict[str, float]) -> Prices:
    ranges = {name: Range(value, value, value) for name, value in each.items()}
    return Prices("EUR", ranges, dict.fromkeys(each, "test"), ())


@pytest.mark.parametrize(
    ("ratios", "costs", "cheapest"),
    [
        # A sufficient single measure is more expensive than a sufficient pair.
        ({"a": 0.2, "b": 0.5, "c": 0.5}, {"a": 900.0, "b": 10.0, "c": 20.0}, "b + c"),
        # The single measure is the cheapest.
        ({"a": 0.2, "b": 0.5, "c": 0.5}, {"a": 9.0, "b": 10.0, "c": 20.0}, "a"),
        # All three are needed, and none of the pairs is simulated before.
        ({"a": 0.6, "b": 0.6, "c": 0.7}, {"a": 9.0, "b": 10.0, "c": 20.0}, "a + b + c"),
        # No set is sufficient: the most effective one is simulated.
        ({"a": 0.9, "b": 0.9, "c": 0.9}, {"a": 9.0, "b": 10.0, "c": 20.0}, None),
    ],
)
def test_the_cheapest_set_that_meets_the_target_is_found(
    real: Runs, ratios: dict[str, float], costs: dict[str, float], cheapest: str | None
) -> None:
    level_m = 0.33  # 99 % within 0.85 m; 0.3 m are required
    simulated = []

    def simulate(name: str, scenario: _core.Scenario, runs: int, seed: int) -> Runs:
        simulated.append(name)
        assert runs == RUNS
        ratio = float(np.prod([ratios[it] for it in name.split(" + ")]))
        return made(real, name, scenario, level_m * ratio, seed)

    before = made(real, "unchanged", PLANT.scenario(), level_m, 1)
    changes = [Remedy(name, name, FREE, name, 1) for name in ratios]
    stages: list[tuple[str, int]] = []
    found = measures(
        PLANT.scenario(), changes, before, Targets.of(PLANT), prices(costs), 1, simulate,
        lambda *stage: stages.append(stage),
    )  # fmt: skip
    assert (found.cheapest and found.cheapest.name) == cheapest
    assert stages[0] == ("measures", RUNS * len(ratios))
    assert stages[1][1] >= RUNS * (len(simulated) - len(ratios))
    assert simulated[:3] == list(ratios)
    if cheapest is None:
        assert simulated[3:] == ["a + b + c"]
    for it in found.single:
        gained_cm = 100.0 * (before.percentile(99.0).value - it.error.value)
        assert it.cm_per_price == pytest.approx(gained_cm / costs[it.name])


# Received bursts of a drive whose energy is 2 % of that of the fleet's day, with idle computers.
MANY = 20_000


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("own_level", "own_bursts", "levels", "best", "chosen"),
    [
        # The vehicle's own operation misses the target; half a second is accurate enough.
        (0.2, 150, {200: 0.05, 500: 0.06, 1000: 0.4}, "every 500 ms", "every 500 ms"),
        # No operation meets the target, and all have equal errors: the best one is random.
        (0.2, 150, {200: 0.2, 500: 0.2, 1000: 0.2}, None, OWN),
        # All operations meet the target, and the energy of the fleet's day is nearly equal.
        (0.05, 150, {200: 0.05, 500: 0.05, 1000: 0.05}, "every 1000 ms", OWN),
        # The vehicle's own operation takes at least 1 % more energy.
        (0.05, MANY, {200: 0.05, 500: 0.05, 1000: 0.05}, "every 1000 ms", "every 1000 ms"),
    ],
)
def test_the_vehicle_is_changed_only_for_an_advantage_that_matters(
    real: Runs,
    seed: int,
    own_level: float,
    own_bursts: int,
    levels: dict[int, float],
    best: str | None,
    chosen: str,
) -> None:
    bursts = {200: 30, 500: 12, 1000: 6}

    def simulate(name: str, scenario: _core.Scenario, runs: int, seed: int) -> Runs:
        assert runs == RUNS
        interval_ms = next((it for it in levels if name.startswith(f"every {it} ms")), None)
        level_m = own_level if interval_ms is None else levels[interval_ms]
        count = own_bursts if interval_ms is None else bursts[interval_ms]
        # The runs of different operations are independent.
        found = made(real, name, scenario, level_m, seed + count)
        return replace(
            found, bursts_received=np.full(RUNS, count), aoa_estimates=np.full(RUNS, 3 * count)
        )

    found = operate(PLANT, Targets.of(PLANT), RUNS, seed, simulate, lambda *_: None)
    assert found.point is not None
    assert found.best in found.front
    assert found.best is not None
    assert best is None or found.points[found.best].operation.name == best
    assert found.point.operation.name == chosen
    own = own_mode(PLANT.scenario())
    assert found.point.mode == own  # another power mode saves less than 1 %
    equivalent = {it.point.operation.name for it in found.rivals if it.is_equivalent}
    for interval_ms, level_m in levels.items():
        is_accurate = level_m <= 0.06 or (best is None and level_m == own_level)
        if f"every {interval_ms} ms" != chosen:
            assert (f"every {interval_ms} ms" in equivalent) == is_accurate
    assert (OWN in equivalent) == (chosen == OWN)  # its other power modes
    modes = {it.point.mode for it in found.rivals if it.point.operation == found.point.operation}
    assert modes == set(range(8)) - {own}


@pytest.mark.parametrize(
    ("shares", "chosen"),
    [
        # Half of a percentage point less than the vehicle's own operation: the cheapest is taken.
        ({200: 0.895, 500: 0.895, 1000: 0.895}, "every 1000 ms"),
        ({200: 0.95, 500: 0.88, 1000: 0.6}, "every 200 ms"),
        # No other operation is available: the vehicle's own one is recommended.
        ({200: 0.8, 500: 0.88, 1000: 0.6}, OWN),
    ],
)
def test_operations_that_are_less_often_ok_are_not_recommended(
    real: Runs, shares: dict[int, float], chosen: str
) -> None:
    bursts = {200: 30, 500: 12, 1000: 6}

    def simulate(name: str, scenario: _core.Scenario, runs: int, seed: int) -> Runs:
        interval_ms = next((it for it in shares if name.startswith(f"every {it} ms")), None)
        # Methods with unknown pilots are more expensive, and as often ok as the vehicle's own one.
        assert runs == RUNS
        share = 0.9 if interval_ms is None else shares[interval_ms]
        count = MANY if interval_ms is None else bursts[interval_ms]
        ok = 1000.0 * (share + 0.02 * np.random.default_rng(seed).standard_normal(RUNS))
        counts = {"ok": ok, "degraded": 1000.0 - ok, "unavailable": 0.0 * ok}
        counts |= {"too_wide": 1000.0 - ok, "beyond": 0.0 * ok}
        expensive = name.startswith(("root-music", "esprit"))
        return replace(
            made(real, name, scenario, 0.05, seed),
            bursts_received=np.full(RUNS, count + expensive),
            aoa_estimates=np.full(RUNS, 3 * count),
            integrity=Integrity.of_runs(counts, 3.0),
        )

    found = operate(PLANT, Targets.of(PLANT), RUNS, 1, simulate, lambda *_: None)
    assert found.point is not None
    assert found.point.operation.name == chosen
    assert found.point.is_available
    assert all(found.points[place].is_available for place in found.front)
    for it in found.points:
        assert it.ok_delta is not None
        is_fixed = it.operation.name.startswith("every ")
        expected = shares[int(it.operation.name.split()[1])] - 0.9 if is_fixed else 0.0
        assert it.ok_delta[0] == pytest.approx(expected, abs=1e-9)
    # A rival whose availability differs is no equivalent of the recommended point.
    for rival in found.rivals:
        assert rival.ok_delta is not None
        if rival.ok_delta[0] < -0.01 and rival.ok_delta[2] < 0.0:
            assert not rival.is_equivalent


def test_a_target_of_a_road_section_is_evaluated_there_only(real: Runs) -> None:
    plant = PLANT.with_overrides(
        {
            "targets": [
                {"name": "gate", "at_m": 595.0, "target": "0.1 m 95 %"},
                {"from_m": 586.0, "to_m": 588.0, "target": "0.1 m 95 %"},
            ]
        }
    )
    targets = Targets.of(plant)
    assert [it.name for it in targets.each] == ["whole trip", "gate", "586 to 588 m"]
    driven = made(real, "unchanged", plant.scenario(), 0.01, 1)
    along_m = np.interp(driven.time_s, targets.time_s, targets.along_m)
    driven.errors_m[:, along_m > 589.0] = 0.2
    judgements = [it.judgement.holds for it in targets.results(driven)]
    assert judgements == [True, False, True]
    assert not targets.judgement(driven).holds
