"""Finding a 5G cell against py3gpp: 20 ms of one antenna, from samples to the MIB, in the same run.

Both get the same recording at 7.68 Msps: one SSB at 30 kHz subcarrier spacing in noise at 10 dB, no
frequency offset. py3gpp is used as its notebooks do: the PSS by correlation, the strongest SSS,
DM-RS, channel, PBCH, polar code; it sees one frequency hypothesis where we look at three, is told
the SSB index, and has its SSS made before the clock starts. Times are the least of several
repetitions, on one thread. Run with the extra ``bench`` installed::

    python benches/nr_peers.py
"""

# ruff: noqa: E402  (the number of threads must be set before NumPy is imported)
from __future__ import annotations

import functools
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

    Samples = NDArray[np.complex128]

PCI, SSB_INDEX, SFN = 501, 2, 300
FREQUENCY_HZ = 3.7008e9
RATE_HZ, SUBCARRIER_KHZ, TRANSFORM = 7.68e6, 30, 256
RESOURCE_BLOCKS = 20
SNR_DB = 10.0
PREFIX = 18


def recording(rng: np.random.Generator) -> Samples:
    """20 ms that hold one SSB, ``(samples,)``."""
    burst = nr.build_burst(PCI, ssb_indices=[SSB_INDEX], sfn=SFN, ssb_freq_hz=FREQUENCY_HZ)
    samples = np.zeros(int(0.02 * RATE_HZ), dtype=np.complex128)
    start = 12_345
    samples[start : start + burst.size] = np.asarray(burst).ravel()
    # A resource element of amplitude one has 1/256 of its power in a sample.
    scale = np.sqrt(0.5 / TRANSFORM) * 10 ** (-SNR_DB / 20)
    return samples + scale * (rng.normal(size=(samples.size, 2)) @ [1, 1j])


def ours(samples: Samples) -> tuple[int, int]:
    """PCI and SFN, by this package."""
    (cell,) = nr.search(
        samples[None, :],
        RATE_HZ,
        centre_frequency_hz=FREQUENCY_HZ,
        ssb_freq_hz=FREQUENCY_HZ,
        scs_khz=SUBCARRIER_KHZ,
    )
    return cell.pci, cell.sfn


@functools.cache
def all_sss() -> list[Samples]:
    """The SSS of every PCI, made once: a receiver would not make them for each search."""
    return [py3gpp.nrSSS(pci) for pci in range(1008)]


def theirs(samples: Samples) -> tuple[int, int]:
    """PCI and SFN, by py3gpp."""
    size = 12 * RESOURCE_BLOCKS
    # The strongest of the three PSS.
    peaks = []
    for n_id_2 in range(3):
        grid = np.zeros((size, 4), dtype=complex)
        py3gpp.nrSetResources(py3gpp.nrPSSIndices(), grid, py3gpp.nrPSS(n_id_2))
        symbol, _ = py3gpp.nrOFDMModulate(
            grid=grid[:, :1], scs=SUBCARRIER_KHZ, initialNSlot=2, SampleRate=RATE_HZ
        )
        # What `nrTimingEstimate` does inside; it returns no more than where the largest is.
        correlation = np.abs(correlate(samples, symbol[-TRANSFORM:], "valid"))
        peaks.append((correlation.max(), n_id_2, int(correlation.argmax())))
    _, n_id_2, pss = max(peaks)
    wave = samples[pss - PREFIX : pss - PREFIX + 4 * (TRANSFORM + PREFIX)]
    grid = py3gpp.nrOFDMDemodulate(
        waveform=wave,
        nrb=RESOURCE_BLOCKS,
        scs=SUBCARRIER_KHZ,
        initialNSlot=2,
        SampleRate=RATE_HZ,
        CarrierFrequency=0,
    )[:, :4]
    # TS 38.211 section 5.4: the phase reset of each symbol.
    grid = grid * np.exp(
        2j * np.pi * FREQUENCY_HZ / RATE_HZ * (TRANSFORM + PREFIX) * np.arange(grid.shape[1])
    )
    received = py3gpp.nrExtractResources(py3gpp.nrSSSIndices(), grid)
    fits = [abs(np.vdot(all_sss()[3 * n + n_id_2], received)) for n in range(336)]
    pci = 3 * int(np.argmax(fits)) + n_id_2
    # The SSB index is told, so that only one DM-RS is tried.
    reference = np.zeros((size, 4), dtype=complex)
    py3gpp.nrSetResources(
        py3gpp.nrPBCHDMRSIndices(pci), reference, py3gpp.nrPBCHDMRS(pci, SSB_INDEX)
    )
    py3gpp.nrSetResources(py3gpp.nrSSSIndices(), reference, py3gpp.nrSSS(pci))
    with np.errstate(divide="ignore", invalid="ignore"):
        channel, _ = py3gpp.nrChannelEstimate(rxGrid=grid, refGrid=reference)
    indices = py3gpp.nrPBCHIndices(pci)
    symbols = py3gpp.nrExtractResources(indices, grid) / py3gpp.nrExtractResources(indices, channel)
    soft = py3gpp.nrSymbolDemodulate(symbols, "QPSK", 0.1, "soft")
    soft = soft * (1 - 2.0 * py3gpp.nrPBCHPRBS(pci, SSB_INDEX, soft.size))
    _, error, payload, sfn_lsb, *_ = py3gpp.nrBCHDecode(soft, 8, 8, pci)
    if np.any(error):
        message = "py3gpp did not decode the PBCH"
        raise RuntimeError(message)
    bits = [*payload[1:7], *sfn_lsb]
    return pci, int("".join(str(int(bit)) for bit in bits), 2)


def least_s(act: Callable[[Samples], object], samples: Samples, repetitions: int) -> float:
    """The least time of several."""
    times = []
    for _ in range(repetitions):
        began = time.perf_counter()
        act(samples)
        times.append(time.perf_counter() - began)
    return min(times)


def main() -> None:
    """Print the table."""
    samples = recording(np.random.default_rng(1))
    for receiver in (ours, theirs):
        if receiver(samples) != (PCI, SFN):
            message = f"{receiver.__name__}: {receiver(samples)} is not {(PCI, SFN)}"
            raise RuntimeError(message)
    times = {"access_av.nr": least_s(ours, samples, 30), "py3gpp": least_s(theirs, samples, 5)}
    table = Table("receiver", "ms", "ratio", title="20 ms, one antenna, to the MIB")
    for name, seconds in times.items():
        ratio = times["py3gpp"] / seconds
        table.add_row(name, f"{1e3 * seconds:.2f}", f"{ratio:.0f}")
    Console().print(table)


if __name__ == "__main__":
    main()
