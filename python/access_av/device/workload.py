"""Timed workloads: each estimator on the snapshots of an SSB, and the SSB receiver.

One execution is one call from Python: the estimator plus about one microsecond of call overhead.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from access_av.signal import aoa, nr

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

ANTENNAS, SNAPSHOTS = 4, 20
CHAIN = "ssb-chain"
SAMPLE_RATE_HZ, CARRIER_HZ = 7.68e6, 3.7008e9
# Minimum number of executions for a 99th percentile.
LEAST_EXECUTIONS = 100


@dataclass(frozen=True)
class Timing:
    """Time of one execution in seconds, and the number of executions."""

    executions: int
    median_s: float
    p99_s: float
    cpu_median_s: float
    cpu_p99_s: float


def workloads() -> dict[str, Callable[[], object]]:
    """Returns functions that execute each method and the SSB chain once, by name.

    The chain finds the cell in the samples of one half frame of four antennas, decodes it and
    computes its observation, as a receiver that has lost the cell. A receiver that tracks the cell
    needs less time.
    """
    rng = np.random.default_rng(1)
    steering = np.exp(1j * np.pi * np.cos(1.0) * np.arange(ANTENNAS))
    snapshots = steering[:, None] + 0.1 * _noise(rng, (ANTENNAS, SNAPSHOTS))
    burst = nr.build_burst(42, ssb_indices=[0], ssb_freq_hz=CARRIER_HZ)
    samples = np.outer(steering, burst) + 1e-3 * _noise(rng, (ANTENNAS, burst.size))
    searcher = nr.Searcher(
        SAMPLE_RATE_HZ,
        centre_frequency_hz=CARRIER_HZ,
        ssb_freq_hz=CARRIER_HZ,
        scs_khz=30,
        antennas=ANTENNAS,
    )
    return {
        "music": lambda: aoa.music(snapshots),
        "esprit": lambda: aoa.esprit(snapshots),
        "root-music": lambda: aoa.root_music(snapshots),
        "maximum-likelihood": lambda: aoa.maximum_likelihood(snapshots),
        CHAIN: lambda: searcher.search(samples),
    }


def repeat(work: Callable[[], object], least_s: float) -> Timing:
    """Repeats a workload for a minimum duration, and often enough for a 99th percentile."""
    work()
    wall_ns, cpu_ns = [], []
    clock, cpu = time.perf_counter_ns, time.thread_time_ns
    end_ns = clock() + round(least_s * 1e9)
    while True:
        cpu_before, before = cpu(), clock()
        work()
        after, cpu_after = clock(), cpu()
        wall_ns.append(after - before)
        cpu_ns.append(cpu_after - cpu_before)
        if after >= end_ns and len(wall_ns) >= LEAST_EXECUTIONS:
            break
    wall_s, cpu_s = np.array(wall_ns) * 1e-9, np.array(cpu_ns) * 1e-9
    return Timing(
        executions=wall_s.size,
        median_s=float(np.median(wall_s)),
        p99_s=float(np.quantile(wall_s, 0.99)),
        cpu_median_s=float(np.median(cpu_s)),
        cpu_p99_s=float(np.quantile(cpu_s, 0.99)),
    )


def _noise(rng: np.random.Generator, shape: tuple[int, ...]) -> NDArray[np.complex128]:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)
