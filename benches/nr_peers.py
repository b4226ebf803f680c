"""Cell search compared with py3gpp: 20 ms, from samples to the MIB, in the same run.

One SSB at 15 kHz subcarrier spacing in 20 ms at 3.84 Msps, 10 dB per resource element, no frequency
offset. `access_av.nr` searches four antennas jointly, with three PSS at three frequency hypotheses
each and every SSB index, and also measures the angle. It runs with a reused searcher, and with a
new searcher in each call. py3gpp has one antenna and one frequency hypothesis. It runs in two
variants:

- as in its example notebook: the PSS by correlation and again by its timing estimate, all 336 SSS
  generated during the search, the DM-RS of eight SSB indices with a channel estimate each;
- lean: one correlation per PSS, the SSS generated in advance, the SSB index given.

Each time is the minimum of several repetitions on one thread. The receivers take turns, so that
they have the same machine load. Requires the extra ``bench``::

    python benches/nr_peers.py
"""

# ruff: noqa: E402  (the number of threads must be set before NumPy is imported)
from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import time
from typing import TYPE_CHECKING

import numpy as np
import py3gpp
from rich.console import Console
from rich.table import Table
from scipy.signal import correlate

from access_av import nr

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Samples = NDArray[np.complex64]
    Grid = NDArray[np.complex128]
    Receiver = Callable[[Samples], tuple[int, int | None]]

PCI, SSB_INDEX, SFN, LMAX = 501, 2, 300, 4
FREQUENCY_HZ = 2.1e9
RATE_HZ, SUBCARRIER_KHZ, TRANSFORM, PREFIX = 3.84e6, 15, 256, 18
ANTENNAS, RESOURCE_BLOCKS = 4, 20
SNR_DB = 10.0
ASKED = 100.0
ROUNDS = 8
# Repetitions of the short searches; more are needed for a minimum of equal stability.
REPETITIONS = 10


def recording(rng: np.random.Generator) -> Samples:
    """Returns 20 ms that contain one SSB, ``(antennas, samples)``."""
    burst = nr.build_burst(
        PCI, case="A", lmax=LMAX, ssb_indices=[SSB_INDEX], sfn=SFN, ssb_freq_hz=FREQUENCY_HZ,
        sample_rate_hz=RATE_HZ,
    )  # fmt: skip
    samples = np.zeros((ANTENNAS, int(0.02 * RATE_HZ)), dtype=np.complex64)
    start = 12_345
    steering = np.exp(0.7j * np.arange(ANTENNAS))
    samples[:, start : start + burst.size] = np.outer(steering, burst)
    # A resource element of unit power has the power 1/256 in a sample.
    scale = np.sqrt(0.5 / TRANSFORM) * 10 ** (-SNR_DB / 20)
    noise = scale * (rng.normal(size=(*samples.shape, 2)) @ [1, 1j])
    return samples + noise.astype(np.complex64)


def ours_kept() -> Receiver:
    """Searches with a reused searcher."""
    searcher = nr.Searcher(
        RATE_HZ,
        centre_frequency_hz=FREQUENCY_HZ,
        ssb_freq_hz=FREQUENCY_HZ,
        scs_khz=SUBCARRIER_KHZ,
        antennas=ANTENNAS,
    )

    def receive(samples: Samples) -> tuple[int, int | None]:
        (cell,) = searcher.search(samples)
        return cell.pci, cell.sfn

    return receive


def ours_anew(samples: Samples) -> tuple[int, int | None]:
    """Searches with transforms that are planned in the call."""
    (cell,) = nr.search(
        samples,
        RATE_HZ,
        centre_frequency_hz=FREQUENCY_HZ,
        ssb_freq_hz=FREQUENCY_HZ,
        scs_khz=SUBCARRIER_KHZ,
    )
    return cell.pci, cell.sfn


def pss_grid(n_id_2: int, symbols: int, place: int) -> Grid:
    """Returns a resource grid that contains only a PSS."""
    grid = np.zeros((12 * RESOURCE_BLOCKS, symbols), dtype=complex)
    grid[py3gpp.nrPSSIndices(), place] = py3gpp.nrPSS(n_id_2)
    return grid


def strongest_pss(samples: Samples) -> tuple[int, int]:
    """Returns N_ID2 of the strongest PSS, and its first sample without cyclic prefix."""
    peaks = []
    for n_id_2 in range(3):
        symbol, _ = py3gpp.nrOFDMModulate(
            grid=pss_grid(n_id_2, 1, 0), scs=SUBCARRIER_KHZ, initialNSlot=0, SampleRate=RATE_HZ
        )
        correlation = np.abs(correlate(samples, symbol[-TRANSFORM:], "valid"))
        peaks.append((correlation.max(), n_id_2, int(correlation.argmax())))
    _, n_id_2, start = max(peaks)
    return n_id_2, start


def ssb_grid(samples: Samples, pss_start: int) -> Grid:
    """Returns the SSB's four symbols, without the phase resets of TS 38.211 section 5.4."""
    # The symbols of a slot: its first symbol, with the long prefix, precedes the SSB.
    first = pss_start - PREFIX - (TRANSFORM + PREFIX + 2)
    wave = samples[first : first + 8 * (TRANSFORM + PREFIX)]
    grid = py3gpp.nrOFDMDemodulate(
        waveform=wave, nrb=RESOURCE_BLOCKS, scs=SUBCARRIER_KHZ, initialNSlot=0, SampleRate=RATE_HZ,
        CarrierFrequency=0,
    )[:, 1:5]  # fmt: skip
    step = 2j * np.pi * FREQUENCY_HZ / RATE_HZ * (TRANSFORM + PREFIX)
    return np.asarray(grid * np.exp(step * np.arange(4)))


def decoded(grid: Grid, pci: int, ssb_index: int) -> tuple[int, int]:
    """Returns PCI and SFN of an SSB with known index."""
    reference = np.zeros((12 * RESOURCE_BLOCKS, 4), dtype=complex)
    py3gpp.nrSetResources(
        py3gpp.nrPBCHDMRSIndices(pci), reference, py3gpp.nrPBCHDMRS(pci, ssb_index)
    )
    py3gpp.nrSetResources(py3gpp.nrSSSIndices(), reference, py3gpp.nrSSS(pci))
    with np.errstate(divide="ignore", invalid="ignore"):
        channel, _ = py3gpp.nrChannelEstimate(rxGrid=grid, refGrid=reference)
    indices = py3gpp.nrPBCHIndices(pci)
    symbols = py3gpp.nrExtractResources(indices, grid) / py3gpp.nrExtractResources(indices, channel)
    soft = py3gpp.nrSymbolDemodulate(symbols, "QPSK", 0.1, "soft")
    soft = soft * (1 - 2.0 * py3gpp.nrPBCHPRBS(pci, ssb_index, soft.size))
    _, error, payload, sfn_lsb, *_ = py3gpp.nrBCHDecode(soft, 8, LMAX, pci)
    if np.any(error):
        message = "py3gpp did not decode the PBCH"
        raise RuntimeError(message)
    bits = [*payload[1:7], *sfn_lsb]
    return pci, int("".join(str(int(bit)) for bit in bits), 2)


def py3gpp_lean() -> Receiver:
    """Searches with everything prepared that can be prepared."""
    table = np.array([py3gpp.nrSSS(pci) for pci in range(1008)])

    def receive(samples: Samples) -> tuple[int, int]:
        n_id_2, start = strongest_pss(samples[0])
        grid = ssb_grid(samples[0], start)
        received = py3gpp.nrExtractResources(py3gpp.nrSSSIndices(), grid)
        pci = 3 * int(np.argmax(np.abs(table[n_id_2::3] @ received))) + n_id_2
        return decoded(grid, pci, SSB_INDEX)

    return receive


def py3gpp_notebook(samples: Samples) -> tuple[int, int]:
    """Searches as in py3gpp's example."""
    antenna = samples[0]
    n_id_2, _ = strongest_pss(antenna)
    start = py3gpp.nrTimingEstimate(
        waveform=antenna, nrb=RESOURCE_BLOCKS, scs=SUBCARRIER_KHZ, initialNSlot=0,
        refGrid=pss_grid(n_id_2, 2, 1), SampleRate=RATE_HZ,
    )  # fmt: skip
    grid = ssb_grid(antenna, int(start) + TRANSFORM + PREFIX + 2 + PREFIX)
    received = py3gpp.nrExtractResources(py3gpp.nrSSSIndices(), grid)
    fits = [abs(np.vdot(py3gpp.nrSSS(3 * n + n_id_2), received)) for n in range(336)]
    pci = 3 * int(np.argmax(fits)) + n_id_2
    qualities = []
    for ssb_index in range(8):
        reference = np.zeros((12 * RESOURCE_BLOCKS, 4), dtype=complex)
        py3gpp.nrSetResources(
            py3gpp.nrPBCHDMRSIndices(pci), reference, py3gpp.nrPBCHDMRS(pci, ssb_index)
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            channel, noise = py3gpp.nrChannelEstimate(rxGrid=grid, refGrid=reference)
        qualities.append(float(np.mean(np.abs(channel) ** 2) / noise))
    # With L_max 4, the eight sequences encode the SSB index and the half frame.
    return decoded(grid, pci, int(np.argmax(qualities)) % LMAX)


def least_s(receivers: dict[str, tuple[Receiver, int]], samples: Samples) -> dict[str, float]:
    """Returns the minimum time of each search in seconds."""
    times = dict.fromkeys(receivers, np.inf)
    for _ in range(ROUNDS):
        for name, (receive, repetitions) in receivers.items():
            for _ in range(repetitions):
                began = time.perf_counter()
                receive(samples)
                times[name] = min(times[name], time.perf_counter() - began)
    return times


def main() -> None:
    """Prints the table."""
    samples = recording(np.random.default_rng(1))
    notebook, lean = "py3gpp, as its notebook", "py3gpp, lean"
    receivers: dict[str, tuple[Receiver, int]] = {
        "access_av.signal.nr.Searcher": (ours_kept(), REPETITIONS),
        "access_av.signal.nr.search": (ours_anew, REPETITIONS),
        notebook: (py3gpp_notebook, 1),
        lean: (py3gpp_lean(), 1),
    }
    for name, (receive, _) in receivers.items():
        if receive(samples) != (PCI, SFN):
            message = f"{name}: {receive(samples)} is not {(PCI, SFN)}"
            raise RuntimeError(message)
    times = least_s(receivers, samples)
    table = Table(
        "receiver", "antennas", "ms", "ms/antenna", "notebook's", "lean's",
        title="20 ms at 3.84 Msps to the MIB; py3gpp's time per antenna over ours",
    )  # fmt: skip
    for name, seconds in times.items():
        theirs = name in (notebook, lean)
        antennas = 1 if theirs else ANTENNAS
        ratios = [times[peer] * antennas / seconds for peer in (notebook, lean)]
        table.add_row(
            name, str(antennas), f"{1e3 * seconds:.2f}", f"{1e3 * seconds / antennas:.2f}",
            *("" if theirs else judged(ratio) for ratio in ratios),
        )  # fmt: skip
    Console(width=100).print(table)


def judged(ratio: float) -> str:
    """Returns the ratio, and whether it is below the requirement."""
    return f"{ratio:.0f}" if ratio >= ASKED else f"{ratio:.0f}, below {ASKED:.0f}"


if __name__ == "__main__":
    main()
