from __future__ import annotations

import pytest

import synthetic
from access_av.device.platform import Platform
from access_av.paper import study
from access_av.paper.energy_fit import FREEDOMS, ModeDemand, fit_energy, numbers
from access_av.paper.statements import METHODS, paper_numbers

Energies = dict[int, dict[str, float]]


@pytest.fixture(scope="module")
def demands() -> dict[int, ModeDemand]:
    return {
        number: ModeDemand(
            cpu_hz=mhz * 1e6,
            base_wake_up_s={m: t / 1e3 for m, t in zip(METHODS, times, strict=True)},
            fixed_aoa_estimates={
                m: int(80_330 / t) + 1 for m, t in zip(METHODS, times, strict=True)
            },
            adaptive_aoa_estimates=synthetic.ADAPTIVE_EXECUTIONS[times[0]],
        )
        for number, mhz, *times in synthetic.ROWS
    }


@pytest.fixture(scope="module")
def energies(demands: dict[int, ModeDemand]) -> Energies:
    return fit_energy(demands)


def test_the_fit_meets_the_papers_sums_in_mode_0(
    demands: dict[int, ModeDemand], energies: Energies
) -> None:
    stated = paper_numbers()["energy_j"]
    for method in METHODS:
        total_j = energies[0][method] * demands[0].fixed_aoa_estimates[method]
        assert total_j == pytest.approx(stated["fixed_mode_0"][method], rel=0.05)
    adaptive_j = energies[0]["music"] * demands[0].adaptive_aoa_estimates
    assert adaptive_j == pytest.approx(stated["adaptive_mode_0"], rel=0.05)


def test_the_fit_meets_the_papers_energy_budgets(
    demands: dict[int, ModeDemand], energies: Energies
) -> None:
    adaptive_j = {m: energies[m]["music"] * d.adaptive_aoa_estimates for m, d in demands.items()}
    assert adaptive_j[7] == pytest.approx(206.5)
    assert [mode for mode, energy in adaptive_j.items() if energy <= 210.0] == [7]
    assert [mode for mode, energy in adaptive_j.items() if energy <= 260.0] == [2, 3, 6, 7]


def test_mode_0_draws_most_at_fixed_intervals(
    demands: dict[int, ModeDemand], energies: Energies
) -> None:
    for method in METHODS:
        fixed_j = {
            m: energies[m][method] * d.fixed_aoa_estimates[method] for m, d in demands.items()
        }
        assert max(fixed_j, key=fixed_j.__getitem__) == 0


def savings(demands: dict[int, ModeDemand], energies: Energies) -> dict[int, list[float]]:
    return {
        mode: [
            1.0
            - energies[mode]["music"]
            * demand.adaptive_aoa_estimates
            / (energies[mode][method] * demand.fixed_aoa_estimates[method])
            for method in METHODS
        ]
        for mode, demand in demands.items()
    }


def test_power_ratios_of_the_methods_are_equal_in_all_modes(
    demands: dict[int, ModeDemand], energies: Energies
) -> None:
    for method in METHODS[1:]:
        powers = [
            energies[mode][method]
            / demand.base_wake_up_s[method]
            / (energies[mode]["music"] / demand.base_wake_up_s["music"])
            for mode, demand in demands.items()
        ]
        assert powers == pytest.approx([powers[0]] * len(powers), rel=1e-12)


def test_each_fit_parameter_has_the_described_effect(demands: dict[int, ModeDemand]) -> None:
    none = fit_energy(demands, ())
    for method in METHODS[1:]:
        ratio = none[3][method] / none[3]["music"]
        times_s = demands[3].base_wake_up_s
        assert ratio == pytest.approx(times_s[method] / times_s["music"]), "the same power"
    # A mode without its own power has that of a busy core at its clock.
    assert none[1]["music"] == pytest.approx(none[3]["music"]), "the same clock"
    ratio = fit_energy(demands, ("ratio",))
    for method in METHODS:
        assert ratio[0][method] == pytest.approx(fit_energy(demands)[0][method])
    assert ratio[4]["music"] == pytest.approx(none[4]["music"])
    free = fit_energy(demands, ("ratio", "mode", "factor"))
    pairs = [saving for by_method in savings(demands, free).values() for saving in by_method]
    assert sum(pairs) / len(pairs) == pytest.approx(0.4309, abs=1e-9)
    for mode, method in ((mode, method) for mode in (0, 6, 7) for method in METHODS):
        assert free[mode][method] == pytest.approx(fit_energy(demands)[mode][method])


def test_fit_parameters_are_counted() -> None:
    assert numbers(()) == (1, 1)
    assert numbers() == (10, 4)
    assert numbers(tuple(FREEDOMS)) == (11, 5)


def test_the_shipped_platform_equals_the_fit() -> None:
    shipped = Platform.load("jetson-agx-xavier")
    fitted = study.fit_platform("paper", "jetson-agx-xavier", runs=10, seed=2)
    for held, found in zip(shipped.modes, fitted.modes, strict=True):
        for method in METHODS:
            energy = held.energy_per_execution_j[method]
            assert energy.provenance == "fitted"
            assert energy.value == pytest.approx(
                found.energy_per_execution_j[method].value, rel=0.02
            )
