"""Calibration of an angle's standard deviation and of its reliability flag, case by case.

Each case lists the fraction of estimates that are flagged as unreliable, the RMS of the normalised
error (error over standard deviation; 1 if consistent) of the other estimates and of all, and the
median error. Simulated cases draw new directions; an echo has the waveform of the source and a
random phase. "at most" and "at least" are bounds: the power, and the RMS of the normalised error of
undetected cases, of a test with a false-alarm rate of 1 % that knows everything except the noise
(directions, waveforms, phase of the echo). Cases with real data need third-party recordings in
``ACCESS_AV_DATA`` or ``../shared/data``; otherwise, they are omitted::

    python benches/angle_fit.py --seeds 2000
"""

from __future__ import annotations

import argparse
import csv
import os
from collections import defaultdict
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from access_av import aoa, nr
from access_av.signal.recorded_angles import estimate_bursts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Case = tuple[str, NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_], NDArray | None]

ANTENNAS, SNAPSHOTS = 4, 20
# Minimum separation (degrees): with less, source and echo act as one plane wave.
APART_DEG = 10.0


# Quantile of a false-alarm rate of 1 %.
ALARM_DEVIATE = 2.326


def gaussian(rng: np.random.Generator, *shape: int) -> NDArray[np.complex128]:
    """Circular complex Gaussian samples of unit variance."""
    return (rng.normal(size=(*shape, 2)) @ [1, 1j]) / np.sqrt(2)


def directions(
    rng: np.random.Generator, count: int, apart_deg: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Electrical angles (rad) of sources, and of other sources at a minimum separation."""
    first = rng.uniform(20, 160, count)
    second = rng.uniform(20, 160, count)
    while (close := np.abs(first - second) < apart_deg).any():
        second[close] = rng.uniform(20, 160, close.sum())
    return np.pi * np.cos(np.radians(first)), np.pi * np.cos(np.radians(second))


def most_named(signal: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Power of the Neyman-Pearson test between a signal and the nearest plane wave.

    Both are known, with noise of unit variance: `Phi(sqrt(2) |x - a s| - 2.326)` (Kay 1998, 4.3).
    """
    size = 4096
    spectrum = np.fft.fft(signal, size, axis=1)
    along = np.max(np.sum(np.abs(spectrum) ** 2, axis=2), axis=1) / ANTENNAS
    apart = np.sqrt(2 * np.maximum(np.sum(np.abs(signal) ** 2, axis=(1, 2)) - along, 0.0))
    return np.array([NormalDist().cdf(it - ALARM_DEVIATE) for it in apart])


def simulated(count: int) -> Iterator[Case]:
    """One plane wave; a reflection; two sources that are processed as one."""
    steering = np.arange(ANTENNAS)
    rng = np.random.default_rng(count)
    cases: list[tuple[str, float, float | None, str, float]] = []
    for snr_db in (0.0, 10.0, 20.0, 30.0):
        cases.append(("plane wave", snr_db, None, "", APART_DEG))
        cases += [("echo", snr_db, db, "", APART_DEG) for db in (-3.0, -6.0, -9.0, -12.0)]
        cases += [("second source", snr_db, db, "", APART_DEG) for db in (0.0, -6.0)]
    cases += [("echo", 20.0, -6.0, ", any direction", 0.0)]
    for kind, snr_db, other_db, where, apart_deg in cases:
        first, second = directions(rng, count, apart_deg)
        a, b = (np.exp(1j * phase[:, None, None] * steering[:, None]) for phase in (first, second))
        scale = 10 ** (snr_db / 20)
        waveform = scale * gaussian(rng, count, 1, SNAPSHOTS)
        noise = gaussian(rng, count, ANTENNAS, SNAPSHOTS)
        signal = a * waveform
        name = f"{kind}, SNR {snr_db:.0f} dB{where}"
        if other_db is not None:
            gain = 10 ** (other_db / 20) * np.exp(2j * np.pi * rng.uniform(size=(count, 1, 1)))
            other = waveform if kind == "echo" else scale * gaussian(rng, count, 1, SNAPSHOTS)
            signal = signal + gain * b * other
            name = f"{kind} {other_db:.0f} dB, SNR {snr_db:.0f} dB{where}"
        found = aoa.maximum_likelihood(signal + noise)
        errors = (np.asarray(found.phase_rad) - first + np.pi) % (2 * np.pi) - np.pi
        best = most_named(signal) if other_db is not None else None
        yield name, errors, np.asarray(found.phase_sigma_rad), np.asarray(found.reliable), best


def real_arrays(data: Path) -> Iterator[Case]:
    """Four antennas, 30 positions each, an unmodulated carrier."""
    for path in sorted((data / "captures").glob("aoa4_day1_array*.sigmf-meta")):
        bursts = [it for it in estimate_bursts(path) if it.truth_deg is not None]
        errors = [it.azimuth_deg - (it.truth_deg or 0.0) for it in bursts]
        yield (
            path.stem,
            np.radians(errors),
            np.radians([it.sigma_deg for it in bursts]),
            np.array([not it.doubt for it in bursts]),
            None,
        )


def two_channels(path: Path) -> Iterator[Case]:
    """Channels of two receivers over the carriers, at given angles from broadside."""
    responses: dict[float, dict[str, list[complex]]] = defaultdict(
        lambda: defaultdict(lambda: [0j, 0j])
    )
    with path.open() as file:
        for row in csv.DictReader(file):
            value = complex(float(row["re"]), float(row["im"]))
            if value:
                place = responses[float(row["angle_deg"])][row["carrier"]]
                place[int(row["channel"])] = value
    channels = [
        np.array([it for it in place.values() if all(it)]).T for place in responses.values()
    ]
    truth = -np.pi * np.sin(np.radians(list(responses)))
    found = [aoa.maximum_likelihood(it) for it in channels]
    errors = (np.array([it.phase_rad for it in found]) - truth + np.pi) % (2 * np.pi) - np.pi
    yield (
        "two measured channels",
        errors,
        np.array([it.phase_sigma_rad for it in found], float),
        np.array([it.reliable for it in found], bool),
        None,
    )


def channel_estimates(count: int) -> Iterator[Case]:
    """Channel estimate of `nr` for one SSB in noise, smoothed over the subcarriers.

    The variants are 240 snapshots, snapshots whitened by their covariance, and the angle of `nr`.
    """
    rng = np.random.default_rng(count + 1)
    burst = nr.build_burst(42, ssb_indices=[1], sfn=6, ssb_freq_hz=3.7008e9)
    power = np.mean(np.abs(burst[np.abs(burst) > 0]) ** 2)
    for snr_db in (-5.0, 10.0):
        found: dict[str, list[tuple[float, float, bool]]] = defaultdict(list)
        for _ in range(count):
            phase = float(rng.uniform(-2.8, 2.8))
            received = np.outer(np.exp(1j * phase * np.arange(ANTENNAS)), burst)
            noise = gaussian(rng, *received.shape) * np.sqrt(power) * 10 ** (-snr_db / 20)
            cells = nr.search(
                (received + noise).astype(np.complex64),
                7.68e6,
                centre_frequency_hz=3.7008e9,
                ssb_freq_hz=3.7008e9,
                scs_khz=30,
            )
            for cell in cells[:1]:
                looks = aoa.whiten(cell.channel, cell.channel_covariance)
                variance = float(np.mean(cell.noise_variance))
                for name, angle in (
                    ("smoothed channel", aoa.maximum_likelihood(cell.channel)),
                    ("whitened channel", aoa.maximum_likelihood(looks)),
                    (
                        "whitened, noise known",
                        aoa.maximum_likelihood_pilots(looks, noise_variance=variance),
                    ),
                    ("the cell's angle", cell),
                ):
                    error = (angle.phase_rad - phase + np.pi) % (2 * np.pi) - np.pi
                    is_reliable = not angle.doubt
                    found[name].append((error, angle.phase_sigma_rad, is_reliable))
        for name, values in found.items():
            errors, sigmas, resolved = (np.array(it) for it in zip(*values, strict=True))
            yield f"{name}, SNR {snr_db:.0f} dB", errors, sigmas, resolved, None


def rms(values: NDArray[np.float64], weights: NDArray[np.float64] | None = None) -> str:
    """Root mean square; a dash if there are no values."""
    return f"{np.sqrt(np.average(values**2, weights=weights)):.2f}" if values.size else "–"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1000, help="estimates of each simulated case")
    count = parser.parse_args().seeds
    root = Path(__file__).resolve().parents[1]
    data = Path(os.environ.get("ACCESS_AV_DATA", root / ".." / "shared" / "data"))
    columns = ("case", "estimates", "named", "at most", "z-RMS not named", "at least")
    table = Table(*columns, "z-RMS", "median error rad")

    def cases() -> Iterator[Case]:
        yield from simulated(count)
        yield from channel_estimates(max(count // 50, 10))
        if data.is_dir():
            yield from real_arrays(data)
            yield from two_channels(data / "two_channels" / "cfr.csv")

    for name, errors, sigmas, resolved, best in cases():
        z = errors / sigmas
        table.add_row(
            name,
            str(errors.size),
            f"{1 - resolved.mean():.1%}",
            "" if best is None else f"{best.mean():.1%}",
            rms(z[resolved]),
            "" if best is None or best.min() > 1 - 1e-9 else rms(z, 1 - best),
            rms(z),
            f"{np.median(np.abs(errors)):.4f}",
        )
    Console(width=132).print(table)


if __name__ == "__main__":
    main()
