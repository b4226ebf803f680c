from __future__ import annotations

import pytest

import synthetic
from access_av.paper import study
from access_av.paper.energy_fit import ModeDemand, fit_energy
from access_av.paper.methods import METHODS
from access_av.paper.statements import paper_numbers
from access_av.platform import Platform

Energies = dict[int, dict[str, float]]


@pytest.fixture(scope="module")
def demands() -> dict[int, ModeDemand]:
    return {
        number: ModeDemand(
            cpu_hz=mhz * 1e6,
            base_wake_up_s={m: t / 1e3 for m, t in zip(METHODS, times, strict=True)},
            fixed_executions={m: int(80_330 / t) + 1 for m, t in zip(METHODS, times, strict=True)},
            adaptive_executions=synthetic.ADAPTIVE_EXECUTIONS[times[0]],
        )
        for number, mhz, *times in synthetic.ROWS
    }


@pytest.fixture(scope="module")
def energies(demands: dict[int, ModeDemand]) -> Energies:
    return fit_energy(demands)


def test_mode_0_meets_the_stated_sums(demands: dict[int, ModeDemand], energies: Energies) -> None:
    stated = paper_numbers()["energy_j"]
    for method in METHODS:
        total_j = energies[0][method] * demands[0].fixed_executions[method]
        assert total_j == pytest.approx(stated["fixed_mode_0"][method], rel=0.05)
    adaptive_j = energies[0]["music"] * demands[0].adaptive_executions
    assert adaptive_j == pytest.approx(stated["adaptive_mode_0"], rel=0.05)


def test_budgets_are_kept(demands: dict[int, ModeDemand], energies: Energies) -> None:
    adaptive_j = {m: energies[m]["music"] * d.adaptive_executions for m, d in demands.items()}
    assert adaptive_j[7] == pytest.approx(206.5)
    assert [mode for mode, energy in adaptive_j.items() if energy <= 210.0] == [7]
    assert [mode for mode, energy in adaptive_j.items() if energy <= 260.0] == [2, 3, 6, 7]


def test_mode_0_draws_most_at_fixed_intervals(
    demands: dict[int, ModeDemand], energies: Energies
) -> None:
    for method in METHODS:
        fixed_j = {m: energies[m][method] * d.fixed_executions[method] for m, d in demands.items()}
        assert max(fixed_j, key=fixed_j.__getitem__) == 0


def test_savings_are_those_stated(demands: dict[int, ModeDemand], energies: Energies) -> None:
    savings = {
        mode: [
            1.0
            - energies[mode]["music"]
            * demand.adaptive_executions
            / (energies[mode][method] * demand.fixed_executions[method])
            for method in METHODS
        ]
        for mode, demand in demands.items()
    }
    pairs = [saving for by_method in savings.values() for saving in by_method]
    assert sum(pairs) / len(pairs) == pytest.approx(0.4309, abs=1e-9)
    for mode in (6, 7):
        assert sum(savings[mode]) / len(METHODS) > 0.52


def test_the_shipped_platform_holds_what_the_fit_gives() -> None:
    shipped = Platform.load("jetson-agx-xavier")
    fitted = study.fit_platform("paper", "jetson-agx-xavier", runs=10, seed=2)
    for held, found in zip(shipped.modes, fitted.modes, strict=True):
        for method in METHODS:
            energy = held.energy_per_execution_j[method]
            assert energy.provenance == "fitted"
            assert energy.value == pytest.approx(
                found.energy_per_execution_j[method].value, rel=0.02
            )
