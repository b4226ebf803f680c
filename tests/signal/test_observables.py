"""Delay, carrier phase, range rate and power of the SSBs of a receiver."""

from __future__ import annotations

import numpy as np
import pytest

from access_av import nr

SSB_HZ = 3.7008e9
SCS_KHZ = 30
RATE_HZ = 7.68e6
PERIODS = 60
# The first sample of SSB 1 of case C: symbol 8, after the longer prefix of symbol 0.
START = 8 * 274 + 4
LIGHT_M_S = 299_792_458.0


@pytest.fixture(scope="module")
def cells() -> list[nr.Cell]:
    """SSBs of a cell at rest with an oscillator that is 100 Hz off."""
    receiver = nr.Receiver(
        RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ, scs_khz=SCS_KHZ, antennas=4
    )
    rng, cells, count = np.random.default_rng(5), [], 0
    for number in range(PERIODS):
        burst = nr.build_burst(42, ssb_indices=[1], sfn=2 * number, ssb_freq_hz=SSB_HZ)
        period = np.concatenate([burst, np.zeros(3 * burst.size, np.complex64)])
        time = np.arange(count, count + period.size)
        count += period.size
        turned = period * np.exp(2j * np.pi * 100.0 * time / RATE_HZ)
        noise = rng.normal(scale=0.01, size=(4, period.size, 2)) @ [1, 1j]
        cells += receiver.push(np.outer(np.exp(0.9j * np.arange(4)), turned) + noise)
    return cells + receiver.finish()


def test_errors_have_their_standard_deviations(cells: list[nr.Cell]) -> None:
    assert len(cells) == PERIODS
    seen = [cell.observables for cell in cells[10:]]
    assert all(it is not None for it in seen)
    observed = [it for it in seen if it is not None]
    period = 0.02 * RATE_HZ
    start = START + period * np.arange(10, PERIODS)
    delay_s = (np.array([it.first_path_start for it in observed]) - start) / RATE_HZ
    delay_z = delay_s / [it.delay_sigma_s for it in observed]
    reference_s = np.array([it.reference_start for it in observed]) / RATE_HZ
    phase = np.array([it.carrier_phase_rad for it in observed]) - 2 * np.pi * 100 * reference_s
    phase_z = np.angle(np.exp(1j * phase)) / [it.carrier_phase_sigma_rad for it in observed]
    rate = np.array([it.range_rate_m_s for it in observed]) + 100 * LIGHT_M_S / SSB_HZ
    rate_z = rate / [it.range_rate_sigma_m_s for it in observed]
    for name, z in {"delay": delay_z, "phase": phase_z, "rate": rate_z}.items():
        # Four standard deviations of a mean of squares; successive rates share a phase.
        assert np.mean(np.square(z)) == pytest.approx(1, abs=5 * np.sqrt(2 / z.size)), name
    assert {it.rate_source for it in observed} == {"phase difference"}
    assert [it.multipath for it in observed].count("not detected") > 0.9 * len(observed)
    assert np.allclose([it.interval_s for it in observed], 0.02, atol=1e-6)


def test_amplitudes_and_powers_agree_with_the_measurements(cells: list[nr.Cell]) -> None:
    cell = cells[-1]
    it = cell.observables
    assert it is not None
    assert it.amplitudes.shape == (4,)
    assert it.amplitude_variance.shape == (4,)
    assert it.covariance.shape == (3, 3)
    assert np.allclose(it.covariance, it.covariance.T)
    assert it.covariance[0, 0] == pytest.approx(it.delay_sigma_s**2)
    steps = np.angle(it.amplitudes[1:] / it.amplitudes[:-1])
    assert np.allclose(steps, 0.9, atol=0.02)
    assert it.rsrp_dbfs == pytest.approx(np.mean(cell.rsrp_dbfs), abs=0.1)
    assert it.first_path_dbfs <= it.rsrp_dbfs
    assert "range_rate_m_s" in repr(it)


def test_cells_of_a_search_have_no_annotations() -> None:
    burst = nr.build_burst(42, ssb_indices=[1], sfn=0, ssb_freq_hz=SSB_HZ)
    [cell] = nr.search(burst, RATE_HZ, centre_frequency_hz=SSB_HZ, ssb_freq_hz=SSB_HZ)
    assert cell.observables is None
