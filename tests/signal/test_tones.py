"""DC offset and tones in Python: removed, reported; SSB indices that are guesses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import aoa, nr

if TYPE_CHECKING:
    from numpy.typing import NDArray

CARRIER: dict[str, Any] = {"centre_frequency_hz": 3.7008e9, "ssb_freq_hz": 3.7008e9}
RATE_HZ = 7.68e6


def received(above_ssb_db: float, tone_hz: float) -> NDArray[np.complex128]:
    """Two antennas with one SSB of unit power in 5 ms, noise 20 dB below it, and a tone."""
    rng = np.random.default_rng(2)
    burst = nr.build_burst(42, ssb_indices=[1], sfn=7, ssb_freq_hz=CARRIER["ssb_freq_hz"])
    burst = burst / np.sqrt(np.mean(np.abs(burst[np.abs(burst) > 0]) ** 2))
    noise = rng.normal(scale=0.07, size=(2, burst.size, 2)) @ [1, 1j]
    turning = np.exp(2j * np.pi * tone_hz / RATE_HZ * np.arange(burst.size))
    tone = 10 ** (above_ssb_db / 20) * np.outer([1, 1j], turning)
    out: NDArray[np.complex128] = (np.outer([1, -1j], burst) + noise + tone).astype(complex)
    return out


@pytest.mark.parametrize("above_ssb_db", [-10, 5, 15, 20])
@pytest.mark.parametrize("tone_hz", [0.0, 432e3])
def test_a_cell_is_found_through_a_tone_that_is_reported(
    above_ssb_db: float, tone_hz: float
) -> None:
    cells = nr.search(received(above_ssb_db, tone_hz), RATE_HZ, scs_khz=30, **CARRIER)
    assert [(cell.pci, cell.ssb_index, cell.sfn) for cell in cells] == [(42, 1, 7)]
    assert not cells[0].ssb_index_is_guess
    assert nr.record(cells[0])["ssb_index_is_guess"] is False
    # Noise of 20 dB on 830 elements: 0.2 degrees; five standard deviations.
    assert cells[0].phase_rad is not None
    assert abs(np.degrees(cells[0].phase_rad) + 90) < 1.0
    [fault] = cells.faults
    assert ("DC offset" if tone_hz == 0 else "tone +432.00 kHz") in fault
    assert f"{above_ssb_db:.1f} dBFS" in fault
    assert "removed" in fault


def test_searchers_and_receivers_list_the_tones() -> None:
    samples = received(10, 432e3)
    common = CARRIER | {"scs_khz": 30, "antennas": 2}
    searcher = nr.Searcher(RATE_HZ, **common)
    assert len(searcher.search(samples)) == 1
    receiver = nr.Receiver(RATE_HZ, **common)
    receiver.push(np.concatenate([samples, samples], axis=1))
    for tones in (searcher.tones, receiver.tones):
        [(frequency_hz, power_dbfs)] = tones
        assert frequency_hz == pytest.approx(3.7008e9 + 432e3, abs=50)
        assert power_dbfs == pytest.approx(10, abs=0.1)


def test_the_index_of_an_ssb_without_its_pbch_is_a_guess() -> None:
    samples = received(-300, 0)
    [cell] = nr.search(samples, RATE_HZ, scs_khz=30, **CARRIER)
    rng = np.random.default_rng(5)
    # Noise 20 dB above the signal in the symbols of the PBCH, 8 dB in that of the SSS: the cell is
    # identified, but 96 elements of the PBCH next to the SSS are not enough.
    for symbol, scale in ((1, 10), (2, 2.5), (3, 10)):
        first = round(cell.sample_start) + 274 * symbol
        noise = rng.normal(size=(2, 274, 2)) @ [1, 1j] / np.sqrt(2)
        samples[:, first : first + 274] += scale * noise
    [cell] = nr.search(samples, RATE_HZ, scs_khz=30, **CARRIER)
    assert (cell.pci, cell.sfn, cell.ssb_index_is_guess) == (42, None, True)
    assert "(guess)" in repr(cell)


def test_standard_deviations_of_phase_only_angles_are_correct() -> None:
    rng = np.random.default_rng(6)
    angles = rng.uniform(0.6, 2.5, 4000)
    steering = np.exp(1j * np.pi * np.cos(angles)[:, None] * np.arange(4))[:, :, None]
    waveform = np.exp(2j * np.pi * rng.random((4000, 1, 40)))
    noise = rng.normal(scale=0.1 / np.sqrt(2), size=(4000, 4, 40, 2)) @ [1, 1j]
    samples = steering * waveform + noise
    for snapshots in (samples, samples / np.abs(samples)):
        found = aoa.maximum_likelihood(np.ascontiguousarray(snapshots))
        errors = found.phase_rad - np.pi * np.cos(angles)
        z_rms = np.sqrt(np.mean((errors / found.phase_sigma_rad)[found.reliable] ** 2))
        # 4000 estimates: a standard error of 0.011.
        assert z_rms == pytest.approx(1.0, abs=0.05)
