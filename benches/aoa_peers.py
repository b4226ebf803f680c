"""Angle of arrival compared with other libraries: accuracy and time in one table.

Four antennas half a wavelength apart, 20 snapshots, one Gaussian source between 20 and 160 degrees.
All libraries process the same data in the same run on one thread. Times are the minimum of several
repetitions and include the covariance. Requires the extra ``bench``::

    python benches/aoa_peers.py

Two methods are not on the package index and are implemented here from their formulas: MUSIC of
KrakenSDR, compiled by Numba (GPL: no code is copied), and Root-MUSIC and MUSIC of doatools. For the
latter, only the arithmetic is timed, so that it cannot be slower than the library.
"""

# ruff: noqa: E402  (the number of threads must be set before NumPy is imported)
from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import time
import warnings
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from access_av import aoa

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Snapshots = NDArray[np.complex128]
    Angles = NDArray[np.float64]

ANTENNAS, SNAPSHOTS = 4, 20
SNRS_DB = (0, 10, 20, 30)
TRIALS = 1000
ROUNDS = 12
CARRIER_HZ = 3.5e9
LIGHT_M_S = 299_792_458.0


def simulate(snr_db: float, trials: int, rng: np.random.Generator) -> tuple[Snapshots, Angles]:
    """Returns snapshots ``(trials, antennas, snapshots)`` in unit noise, and true angles (rad)."""

    def gaussian(*shape: int) -> Snapshots:
        return (rng.normal(size=(*shape, 2)) @ [1, 1j]) / np.sqrt(2)

    angles = np.radians(rng.uniform(20, 160, trials))
    steering = np.exp(1j * np.pi * np.cos(angles)[:, None] * np.arange(ANTENNAS))
    signal = 10 ** (snr_db / 20) * gaussian(trials, 1, SNAPSHOTS)
    return steering[:, :, None] * signal + gaussian(trials, ANTENNAS, SNAPSHOTS), angles


class BatchedNumpy:
    """Optimized NumPy code: processes the whole batch at once, without eigenvalues."""

    def __init__(self, points: int = 32) -> None:
        self.grid = 2 * np.pi * np.arange(points) / points
        lags = np.arange(1, ANTENNAS)[:, None]
        # Real and imaginary parts are concatenated, so that the search is one real product.
        self.basis = np.concatenate([np.cos(lags * self.grid), np.sin(lags * self.grid)])

    def maximum_likelihood(self, snapshots: Snapshots) -> Angles:
        """Angles in rad: maximum of the grid, then two steps of Newton's method."""
        covariance = np.matmul(snapshots, snapshots.conj().swapaxes(1, 2))
        r1 = covariance[:, 1, 0] + covariance[:, 2, 1] + covariance[:, 3, 2]
        r2 = covariance[:, 2, 0] + covariance[:, 3, 1]
        r3 = covariance[:, 3, 0]
        parts = np.stack([r1.real, r2.real, r3.real, r1.imag, r2.imag, r3.imag], axis=1)
        phase = self.grid[np.argmax(parts @ self.basis, axis=1)]
        for _ in range(2):
            z = np.exp(-1j * phase)
            squared = z * z
            t1, t2, t3 = r1 * z, r2 * squared, r3 * squared * z
            slope = t1.imag + 2 * t2.imag + 3 * t3.imag
            phase = phase + slope / (t1.real + 4 * t2.real + 9 * t3.real)
        phase = (phase + np.pi) % (2 * np.pi) - np.pi
        return np.arccos(np.clip(phase / np.pi, -1, 1))


class DoaPy:
    """doa_py; its angles are measured from broadside."""

    def __init__(self) -> None:
        from doa_py import algorithm, arrays

        # doa_py rounds the speed of light.
        self.algorithm = algorithm
        self.array = arrays.UniformLinearArray(m=ANTENNAS, dd=0.5 * arrays.C / CARRIER_HZ)
        self.grid_rad = np.radians(np.arange(-90, 90.05, 0.1))

    def music(self, snapshots: Snapshots) -> float:
        spectrum = self.algorithm.music(
            snapshots, 1, self.array, CARRIER_HZ, self.grid_rad, unit="rad"
        )
        return np.pi / 2 + float(self.grid_rad[np.argmax(spectrum)])

    def root_music(self, snapshots: Snapshots) -> float:
        found = self.algorithm.root_music(snapshots, 1, self.array, CARRIER_HZ, unit="rad")
        return np.pi / 2 + float(np.ravel(found)[0])

    def esprit(self, snapshots: Snapshots) -> float:
        found = self.algorithm.esprit(snapshots, 1, self.array, CARRIER_HZ, unit="rad")
        return np.pi / 2 + float(np.ravel(found)[0])


class Pyroomacoustics:
    """MUSIC of pyroomacoustics on a grid of 0.1 degrees over the half circle."""

    def __init__(self) -> None:
        import pyroomacoustics as pra

        # Four points at four times the carrier: the carrier is bin 1 of bins 0, 1, 2.
        fs, nfft = 4 * CARRIER_HZ, 4
        spacing = 0.5 * LIGHT_M_S / CARRIER_HZ
        place = np.zeros((2, ANTENNAS))
        place[0] = spacing * np.arange(ANTENNAS)
        grid = np.radians(np.arange(0, 180.05, 0.1))
        self.carrier_bin = np.array([1])
        self.music_of = pra.doa.MUSIC(place, fs, nfft, c=LIGHT_M_S, num_src=1, azimuth=grid)

    def music(self, snapshots: Snapshots) -> float:
        bins = np.zeros((ANTENNAS, 3, SNAPSHOTS), complex)
        bins[:, 1] = snapshots
        self.music_of.locate_sources(bins, num_src=1, freq_bins=self.carrier_bin)
        return float(self.music_of.azimuth_recon[0])


class Doatools:
    """Root-MUSIC and MUSIC on a grid of 1 degree with refinement, as in doatools.

    After the eigendecomposition, Root-MUSIC takes the roots of the noise subspace's polynomial that
    are nearest to the unit circle (Barabell 1983). MUSIC takes the maximum of the spectrum over a
    grid, refined on three finer grids of ten points between the neighbours of the maximum.
    """

    def __init__(self) -> None:
        self.grid_rad = np.radians(np.arange(-90.0, 90.0))
        self.steering = self.response(self.grid_rad)

    @staticmethod
    def response(angles_rad: Angles) -> Snapshots:
        return np.asarray(np.exp(1j * np.pi * np.arange(ANTENNAS)[:, None] * np.sin(angles_rad)))

    @staticmethod
    def noise_subspace(snapshots: Snapshots) -> Snapshots:
        covariance = snapshots @ snapshots.conj().T / snapshots.shape[1]
        return np.asarray(np.linalg.eigh(covariance)[1][:, :-1])

    def root_music(self, snapshots: Snapshots) -> float:
        noise = self.noise_subspace(snapshots)
        projection = noise @ noise.conj().T
        lags = range(ANTENNAS - 1, -ANTENNAS, -1)
        roots = np.roots([np.trace(projection, lag) for lag in lags])
        inside = roots[np.abs(roots) < 1.0]
        nearest = inside[np.argmax(np.abs(inside))]
        return float(np.arccos(np.clip(np.angle(nearest) / np.pi, -1.0, 1.0)))

    def music(self, snapshots: Snapshots) -> float:
        noise = self.noise_subspace(snapshots).conj().T

        def best(grid_rad: Angles, steering: Snapshots) -> float:
            return float(grid_rad[np.argmin(np.sum(np.abs(noise @ steering) ** 2, axis=0))])

        found, step = best(self.grid_rad, self.steering), np.radians(1.0)
        for _ in range(3):
            finer = found + step * np.linspace(-1.0, 1.0, 10)
            found, step = best(finer, self.response(finer)), step * 2.0 / 9.0
        return np.pi / 2 - found


class KrakenSdr:
    """MUSIC over 181 directions of one degree, compiled by Numba, as in KrakenSDR."""

    def __init__(self) -> None:
        import numba

        self.grid_rad = np.radians(np.arange(0.0, 180.5))
        phases = np.pi * np.arange(ANTENNAS)[:, None] * np.cos(self.grid_rad)
        self.steering = np.exp(1j * phases)
        self.compiled = numba.njit(fastmath=True)(self.spectrum)

    @staticmethod
    def spectrum(snapshots: Snapshots, steering: Snapshots) -> Angles:
        covariance = snapshots @ snapshots.conj().T / snapshots.shape[1]
        noise = np.ascontiguousarray(np.linalg.eigh(covariance)[1][:, :-1])
        projection = noise @ noise.conj().T
        spectrum = np.empty(steering.shape[1])
        for direction in range(steering.shape[1]):
            power = 0.0
            for i in range(steering.shape[0]):
                for j in range(steering.shape[0]):
                    term = projection[i, j] * steering[j, direction]
                    power += (np.conj(steering[i, direction]) * term).real
            spectrum[direction] = 1.0 / power
        return spectrum

    def music(self, snapshots: Snapshots) -> float:
        return float(self.grid_rad[np.argmax(self.compiled(snapshots, self.steering))])


def least_times_us(calls: dict[str, tuple[Callable[[], object], int]]) -> dict[str, float]:
    """Minimum time per estimate (µs); the methods take turns to have the same machine load.

    Each repetition lasts about 50 µs, because a busy machine interrupts longer ones more often.
    """

    def elapsed_s(call: Callable[[], object], repetitions: int) -> float:
        started = time.perf_counter()
        for _ in range(repetitions):
            call()
        return time.perf_counter() - started

    best = {name: min(elapsed_s(call, 1) for _ in range(20)) for name, (call, _) in calls.items()}
    for _ in range(ROUNDS):
        for name, (call, _) in calls.items():
            stop = time.perf_counter() + 0.05
            while time.perf_counter() < stop:
                repetitions = max(1, int(50e-6 / best[name]))
                best[name] = min(best[name], elapsed_s(call, repetitions) / repetitions)
    return {name: 1e6 * best[name] / estimates for name, (_, estimates) in calls.items()}


def main() -> None:
    """Measures and prints."""
    warnings.simplefilter("ignore")
    rng = np.random.default_rng(2026)
    data = {snr_db: simulate(snr_db, TRIALS, rng) for snr_db in SNRS_DB}
    batch = data[20][0]
    batch_single = batch.astype(np.complex64)
    one = np.ascontiguousarray(batch[0])
    doa_py, pra, batched = DoaPy(), Pyroomacoustics(), BatchedNumpy()
    doatools, kraken = Doatools(), KrakenSdr()

    def each(estimator: Callable[[Snapshots], float]) -> Callable[[Snapshots], Angles]:
        return lambda snapshots: np.array([estimator(item) for item in snapshots])

    # Name, angles of a batch, one timed call, estimates in that call.
    rows: list[tuple[str, Callable[[Snapshots], Angles], Callable[[], object], int]] = [
        ("doa_py MUSIC 0.1°", each(doa_py.music), lambda: doa_py.music(one), 1),
        ("doa_py Root-MUSIC", each(doa_py.root_music), lambda: doa_py.root_music(one), 1),
        ("doa_py ESPRIT", each(doa_py.esprit), lambda: doa_py.esprit(one), 1),
        ("pyroomacoustics MUSIC 0.1°", each(pra.music), lambda: pra.music(one), 1),
        ("doatools' MUSIC, refined", each(doatools.music), lambda: doatools.music(one), 1),
        ("doatools' Root-MUSIC", each(doatools.root_music), lambda: doatools.root_music(one), 1),
        ("KrakenSDR's MUSIC 1°, Numba", each(kraken.music), lambda: kraken.music(one), 1),
        (
            "batched NumPy ML",
            batched.maximum_likelihood,
            lambda: batched.maximum_likelihood(batch),
            TRIALS,
        ),
    ]
    for name, function in (
        ("MUSIC", aoa.music),
        ("Root-MUSIC", aoa.root_music),
        ("ESPRIT", aoa.esprit),
        ("ML", aoa.maximum_likelihood),
    ):
        angles = lambda snapshots, function=function: function(snapshots).angle_rad  # noqa: E731
        rows.append((f"access_av {name}", angles, lambda function=function: function(one), 1))
    ml = aoa.maximum_likelihood
    rows += [
        ("access_av ML, batch", lambda x: ml(x).angle_rad, lambda: ml(batch).angle_rad, TRIALS),
        (
            "access_av ML, batch complex64",
            lambda x: ml(x.astype(np.complex64)).angle_rad,
            lambda: ml(batch_single).angle_rad,
            TRIALS,
        ),
    ]

    table = Table(title=f"RMSE in degrees, {ANTENNAS} antennas, {SNAPSHOTS} snapshots")
    for heading in ("", *(f"{snr_db} dB" for snr_db in SNRS_DB), "µs per estimate"):
        table.add_column(heading, justify="left" if heading == "" else "right")
    bounds = [
        np.degrees(np.sqrt(np.mean(aoa.crb_rad(angles, snr_db) ** 2)))
        for snr_db, (_, angles) in data.items()
    ]
    table.add_row("√CRB (stochastic)", *(f"{bound:.3f}" for bound in bounds), "–")
    times = least_times_us({name: (call, count) for name, _, call, count in rows})
    for name, estimate, _, _ in rows:
        errors = [
            np.degrees(np.sqrt(np.mean((estimate(snapshots) - angles) ** 2)))
            for snapshots, angles in data.values()
        ]
        cells = (f"{error:.3f}" for error in errors)
        table.add_row(name, *cells, f"{times[name]:.3f}")
    console = Console(width=110)
    console.print(table)

    for ours, peer in (
        ("access_av Root-MUSIC", "doa_py Root-MUSIC"),
        ("access_av ESPRIT", "doa_py ESPRIT"),
        ("access_av MUSIC", "pyroomacoustics MUSIC 0.1°"),
        ("access_av MUSIC", "doatools' MUSIC, refined"),
        ("access_av Root-MUSIC", "doatools' Root-MUSIC"),
        ("access_av MUSIC", "KrakenSDR's MUSIC 1°, Numba"),
        ("access_av ML, batch", "batched NumPy ML"),
        ("access_av ML, batch complex64", "batched NumPy ML"),
    ):
        console.print(f"{ours}: {times[peer] / times[ours]:.0f} × as fast as {peer}")


if __name__ == "__main__":
    main()
