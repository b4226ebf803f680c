"""Calibration of reliable angles for other margins of the threshold SNR and other variances.

Maximum likelihood of one source with estimated noise. An angle is reliable if its estimated SNR
exceeds `margin` times the threshold SNR. Its variance has the factor
`1 + increase * ratio ** exponent`, where `ratio` is the threshold SNR over the estimated SNR, 1 at
most. The shipped values are 1, 0.6 and 3. The table counts the conditions (antennas, snapshots,
SNR) with at least 60 reliable angles::

    python benches/angle_threshold.py --trials 8000
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

ANTENNAS = (2, 3, 4, 6, 8)
SNAPSHOTS = (1, 2, 3, 4, 5, 6, 8, 10, 14, 20)
# Degrees of freedom of the noise variance: fewer are never reliable; more are treated as known.
FREEDOMS = (8, 100)
MINIMUM_RELIABLE = 60
GRID = 256
OUTLIERS = 0.01
# Margin, increase at the threshold, exponent.
RULES = [
    (1.0, 0.6, 3),
    (1.0, 1.0, 3),
    (1.0, 1.5, 3),
    (1.0, 1.5, 6),
    (1.25, 1.5, 3),
    (1.5, 0.6, 3),
    (1.5, 2.0, 3),
    (2.0, 1.0, 3),
    (2.0, 2.0, 2),
    (3.0, 3.0, 3),
]


def resolvable_snr(antennas: int, snapshots: int) -> float:
    """SNR of `bound::resolvable_snr` of the crate `aoa-array`."""
    q = (OUTLIERS / (antennas - 1)) ** (1 / snapshots)
    return float(((2 - q + 2 * np.sqrt(1 - q)) / q - 1) / antennas)


def trials(
    rng: np.random.Generator, antennas: int, snapshots: int, snr_db: float, count: int
) -> tuple[Floats, Floats, Floats]:
    """Errors of the electrical angle (rad), electrical angles (rad) and estimated SNRs."""
    element = np.arange(antennas)
    phase = np.pi * np.cos(rng.uniform(0.6, 2.5, count))
    turn = np.exp(2j * np.pi * rng.random((count, snapshots)))
    signal = np.exp(1j * phase[:, None] * element)[:, :, None] * turn[:, None, :]
    shape = (count, antennas, snapshots)
    noise = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    received = 10 ** (snr_db / 20) * signal + noise
    covariance = received @ received.conj().transpose(0, 2, 1) / snapshots
    diagonals = np.zeros((count, GRID), complex)
    for lag in range(1, antennas):
        diagonals[:, lag] = np.trace(covariance, offset=-lag, axis1=1, axis2=2)
    power = np.trace(covariance, axis1=1, axis2=2).real
    spectrum = power[:, None] + 2 * np.fft.fft(diagonals, axis=1).real
    found = 2 * np.pi * spectrum.argmax(axis=1) / GRID

    def terms() -> NDArray[np.complex128]:
        return diagonals[:, :antennas] * np.exp(-1j * found[:, None] * element)

    for _ in range(4):
        slope = 2 * (-1j * element * terms()).sum(axis=1).real
        curvature = 2 * (-(element**2) * terms()).sum(axis=1).real
        is_peak = curvature < 0
        step = np.where(is_peak, -slope / np.where(is_peak, curvature, -1.0), 0.0)
        found = found + np.clip(step, -0.02, 0.02)
    beam = (power + 2 * terms().sum(axis=1).real) / antennas
    residual = (power - beam) / (antennas - 1)
    snr = np.maximum((beam / residual - 1) / antennas, 1e-9)
    found = (found + np.pi) % (2 * np.pi) - np.pi
    return (found - phase + np.pi) % (2 * np.pi) - np.pi, found, snr


def conditions(count: int) -> Iterator[tuple[int, int, tuple[Floats, Floats, Floats]]]:
    """Trials of every condition, with its numbers of antennas and snapshots."""
    rng = np.random.default_rng(5)
    for antennas in ANTENNAS:
        for snapshots in SNAPSHOTS:
            freedom = 2 * snapshots * (antennas - 1) - 1
            for snr_db in range(0, 31, 5) if freedom >= FREEDOMS[0] else ():
                found = trials(rng, antennas, snapshots, snr_db, count)
                if freedom < FREEDOMS[1]:
                    yield antennas, snapshots, found


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=8000, help="trials of each condition")
    everything = list(conditions(parser.parse_args().trials))
    print("margin increase exponent conditions z_above_1.15 z_below_0.9 z_max beyond_above_6e-3")
    for margin, increase, exponent in RULES:
        z_rms, beyond = [], []
        for antennas, snapshots, (errors, found, snr) in everything:
            dimensions = 2 * snapshots * (antennas - 1)
            freedom = dimensions - 1
            factor = dimensions / max(freedom - 3, 1)
            threshold = factor * (1 + 10 / freedom) * resolvable_snr(antennas, snapshots)
            ratio = np.minimum(threshold / snr, 1.0)
            aperture = antennas * (antennas**2 - 1) / 12
            variance = (1 / snr + 1 / (antennas * snr**2)) / (2 * snapshots * aperture)
            variance = variance * factor * (1 + increase * ratio**exponent)
            sigma = np.minimum(np.sqrt(variance), np.pi / np.sqrt(3))
            # Angles near end-fire are unreliable.
            is_reliable = (snr >= margin * threshold) & (np.abs(found) + 3 * sigma <= np.pi)
            z = (errors / sigma)[is_reliable]
            if z.size >= MINIMUM_RELIABLE:
                z_rms.append(np.sqrt(np.mean(z**2)))
                beyond.append(np.mean(np.abs(z) > 3))
        above, below = np.sum(np.array(z_rms) > 1.15), np.sum(np.array(z_rms) < 0.9)
        print(
            f"{margin:6} {increase:8} {exponent:8} {len(z_rms):10} {above:12} {below:11} "
            f"{max(z_rms):5.2f} {np.sum(np.array(beyond) > 6e-3):17}"
        )


if __name__ == "__main__":
    main()
