"""Learned estimators compared with calibration, for an array that differs from its model.

    .venv/bin/python examples/learned/imperfect.py        # half a minute

DeepMUSIC considers an array with coupling and with channel errors. Maximum likelihood with the
ideal manifold a(ω) is then biased; a network that was trained on the actual array need not be.
Here neighbouring antennas couple by 15 %, and the channel phases have errors of 0.2 rad (σ). The
antennas give B a(ω), where B is a matrix. A drive along a known road gives snapshots with a known
angle. They are used to estimate

- two numbers, the direction of the axis and one phase from antenna to antenna, as
  `access-av record survey` does;
- the whole matrix B, by alternating least squares over B and the complex amplitude of each
  snapshot;
- a network of two layers.

The references are maximum likelihood with the ideal and with the true manifold, and a network with
unlimited training snapshots. Angles are uniformly distributed from 20 to 160 degrees. Each snapshot
is one despread block of 127 pilots.
"""

from __future__ import annotations

import argparse

import numpy as np
from learn import ELEMENTS, GRID_RAD, PILOTS, Network, features, outer, steering

COUPLING, PHASE_STD_RAD, GAIN_STD = 0.15, 0.2, 0.05
SNRS_DB = (0.0, 10.0, 20.0)
TRAINED_AT_DB = (-5.0, 25.0)
EDGE_RAD = np.radians(20.0)


def imperfect_array(random):
    """Returns B: neighbours couple, and each channel has a phase and a gain error."""
    near = np.abs(np.subtract.outer(np.arange(ELEMENTS), np.arange(ELEMENTS)))
    turned = np.exp(2j * np.pi * random.random((ELEMENTS, ELEMENTS)))
    coupling = np.where(near == 1, COUPLING * np.triu(turned) + COUPLING * np.triu(turned).T, 0.0)
    gains = (1.0 + random.normal(0.0, GAIN_STD, ELEMENTS)) * np.exp(
        1j * random.normal(0.0, PHASE_STD_RAD, ELEMENTS)
    )
    return gains[:, None] * (np.eye(ELEMENTS) + coupling)


def looks(random, array, snr_db):
    """Returns electrical angles (rad) and channel vectors at the given SNRs."""
    phase_rad = np.pi * np.cos(random.uniform(EDGE_RAD, np.pi - EDGE_RAD, snr_db.size))
    noise = random.normal(size=(2, snr_db.size, ELEMENTS)) * np.sqrt(0.5 / PILOTS)
    amplitude = (10.0 ** (snr_db / 20.0) * np.exp(2j * np.pi * random.random(snr_db.size)))[:, None]
    return phase_rad, amplitude * (steering(phase_rad) @ array.T) + noise[0] + 1j * noise[1]


def maximum_likelihood(channels, array):
    """Returns ω at the maximum of |(B a(ω))ᴴ ĥ| / |B a(ω)|: grid search, parabolic refinement."""
    manifold = steering(GRID_RAD) @ array.T
    matched = np.abs(channels @ manifold.conj().T) / np.linalg.norm(manifold, axis=1)
    best = matched.argmax(axis=1)
    rows = np.arange(len(best))
    below, at, above = (matched[rows, (best + k) % GRID_RAD.size] for k in (-1, 0, 1))
    return GRID_RAD[best] + 0.5 * (GRID_RAD[1] - GRID_RAD[0]) * (above - below) / (
        2.0 * at - above - below
    )


def survey(phase_rad, channels):
    """Estimates axis rotation and phase from antenna to antenna (rad)."""
    cosine = phase_rad / np.pi
    off_rad = np.angle(np.exp(1j * (maximum_likelihood(channels, np.eye(ELEMENTS)) - phase_rad)))
    columns = np.stack([-np.pi * np.sqrt(1.0 - cosine**2), np.ones_like(cosine)], axis=1)
    turn_rad, ahead_rad = np.linalg.lstsq(columns, off_rad, rcond=None)[0]

    def corrected(found_rad):
        cosine = np.clip((found_rad - ahead_rad) / np.pi, -1.0, 1.0)
        return np.pi * np.cos(np.arccos(cosine) - turn_rad)

    return corrected


def calibrate(phase_rad, channels, rounds=30):
    """Estimates B by alternating least squares over B and the amplitudes of the snapshots."""
    ideal, array = steering(phase_rad), np.eye(ELEMENTS, dtype=complex)
    for _ in range(rounds):
        given = ideal @ array.T
        amplitude = np.sum(given.conj() * channels, axis=1) / np.sum(np.abs(given) ** 2, axis=1)
        # All snapshots have the same noise, so that the weight of each is its amplitude.
        array = np.linalg.lstsq(amplitude[:, None] * ideal, channels, rcond=None)[0].T
    return array


def rms(found_rad, phase_rad):
    """RMS of the wrapped error in radians."""
    return float(np.sqrt(np.mean(np.angle(np.exp(1j * (found_rad - phase_rad))) ** 2)))


def compare(random, count, known, steps):
    """Returns the RMS errors of each estimator at each SNR, for one imperfect array."""
    array = imperfect_array(random)
    snr_db = random.uniform(*TRAINED_AT_DB, known)
    labelled = looks(random, array, snr_db)
    corrected, calibrated = survey(*labelled), calibrate(*labelled)
    few, many = Network(random), Network(random)

    def of_labelled():
        chosen = random.integers(known, size=512)
        return labelled[0][chosen], labelled[1][chosen]

    few.train(random, steps, sample=of_labelled)
    many.train(
        random, steps, sample=lambda: looks(random, array, random.uniform(*TRAINED_AT_DB, 512))
    )
    ideal = np.eye(ELEMENTS)
    estimators = {
        "maximum likelihood, ideal manifold": lambda h: maximum_likelihood(h, ideal),
        "and two numbers, as survey finds them": lambda h: corrected(maximum_likelihood(h, ideal)),
        f"network, {known} known looks": lambda h: few(features(outer(h))),
        "network, looks without end": lambda h: many(features(outer(h))),
        f"maximum likelihood, B from {known} known looks": lambda h: maximum_likelihood(
            h, calibrated
        ),
        "maximum likelihood, true manifold": lambda h: maximum_likelihood(h, array),
    }
    tests = [looks(random, array, np.full(count, snr)) for snr in SNRS_DB]
    return {
        name: [rms(estimate(channels), phase_rad) for phase_rad, channels in tests]
        for name, estimate in estimators.items()
    }


def main():
    """Prints the RMS over several arrays."""
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--arrays", type=int, default=5)
    options.add_argument("--known", type=int, default=500, help="looks with a known angle")
    options.add_argument("--steps", type=int, default=3000, help="of the training")
    options.add_argument("--count", type=int, default=2000, help="looks an SNR")
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    random = np.random.default_rng(chosen.seed)
    found = [
        compare(random, chosen.count, chosen.known, chosen.steps) for _ in range(chosen.arrays)
    ]
    print(f"RMS error of ω in rad, {chosen.arrays} arrays; SNR of an element in dB")
    print(f"{'':46}" + "".join(f"{snr:>8.0f}" for snr in SNRS_DB))
    for name in found[0]:
        each = np.sqrt(np.mean(np.square([one[name] for one in found]), axis=0))
        print(f"{name:46}" + "".join(f"{value:8.4f}" for value in each))


if __name__ == "__main__":
    main()
