"""A learned angle estimator, compared with maximum likelihood and with the Bayesian bound.

    .venv/bin/python examples/learned/learn.py            # half a minute
    .venv/bin/python examples/learned/learn.py --drive    # and a drive with each estimator

The paper's outlook proposes learning. Here a network of two layers learns the electrical angle ω of
one source from four antennas, despread by known pilots: ĥ = √κ e^{jφ} a(ω) + √v n. The noise n is
white and normal, κ = K/(K+1), v = 1/(K+1) + 1/(M SNR), φ is uniform, and θ is uniform. The bound is
exact: p(ω | ĥ) ∝ p(ω) I₀(2 √κ |a(ω)ᴴ ĥ| / v). The direction of the mean of e^{jω} under this
posterior minimizes the mean of 1 − cos(error) (Van Trees, Optimum Array Processing, 8).
"""

from __future__ import annotations

import argparse
from itertools import pairwise

import numpy as np

ELEMENTS, PILOTS = 4, 127
K = 10.0
SNRS_DB = (-25.0, -20.0, -15.0, -10.0, 0.0, 10.0)
GRID_RAD = np.linspace(-np.pi, np.pi, 720, endpoint=False)
UPPER = np.triu_indices(ELEMENTS, 1)


def steering(phase_rad):
    """Steering vectors, shape (n, ELEMENTS)."""
    return np.exp(1j * np.multiply.outer(phase_rad, np.arange(ELEMENTS)))


def variance(snr_db):
    """Variance of each element of ĥ: scattering, and noise after despreading."""
    return 1.0 / (K + 1.0) + 10.0 ** (-0.1 * snr_db) / PILOTS


def draw(random, snr_db):
    """Draws angles ω (rad) and channels ĥ of shape (n, ELEMENTS), one for each SNR."""
    phase_rad = np.pi * np.cos(random.uniform(0.0, np.pi, snr_db.size))
    parts = (
        random.normal(size=(2, snr_db.size, ELEMENTS)) * np.sqrt(0.5 * variance(snr_db))[:, None]
    )
    rotation = np.exp(2j * np.pi * random.random(snr_db.size))[:, None]
    amplitude = np.sqrt(K / (K + 1.0))
    return phase_rad, amplitude * rotation * steering(phase_rad) + parts[0] + 1j * parts[1]


def features(covariance):
    """Network inputs from covariances (n, ELEMENTS, ELEMENTS), normalized to remove their scale."""
    scale = np.trace(covariance, axis1=1, axis2=2).real[:, None]
    upper = covariance[:, UPPER[0], UPPER[1]] / scale * ELEMENTS
    return np.hstack([upper.real, upper.imag])


def outer(channels):
    """Covariances of single channel vectors."""
    return channels[:, :, None] * channels[:, None, :].conj()


class Network:
    """Network from features to (cos ω, sin ω): two hidden layers, trained by Adam."""

    def __init__(self, random, widths=(12, 64, 64, 2)):
        self.layers = [
            [random.normal(size=(one, other)) / np.sqrt(one), np.zeros(other)]
            for one, other in pairwise(widths)
        ]

    def __call__(self, inputs):
        """Returns electrical angles in radians."""
        out = self._forward(inputs)[-1]
        return np.arctan2(out[:, 1], out[:, 0])

    def _forward(self, inputs):
        kept = [inputs]
        for number, (weight, bias) in enumerate(self.layers):
            made = kept[-1] @ weight + bias
            kept.append(np.tanh(made) if number + 1 < len(self.layers) else made)
        return kept

    def train(self, random, steps, batch=512, rate=2e-3, sample=None):
        """Trains on new samples in every step (no overfitting), or on those of ``sample``."""
        sample = sample or (lambda: draw(random, random.uniform(-25.0, 15.0, batch)))
        moments = [
            [[np.zeros_like(part), np.zeros_like(part)] for part in it] for it in self.layers
        ]
        for step in range(1, steps + 1):
            phase_rad, channels = sample()
            kept = self._forward(features(outer(channels)))
            wanted = np.stack([np.cos(phase_rad), np.sin(phase_rad)], axis=1)
            slope = (kept[-1] - wanted) / phase_rad.size
            here = rate * 0.5 * (1.0 + np.cos(np.pi * step / steps))
            for number in reversed(range(len(self.layers))):
                weight, _ = self.layers[number]
                gradients = [kept[number].T @ slope, slope.sum(axis=0)]
                slope = (slope @ weight.T) * (1.0 - kept[number] ** 2)
                for part, (gradient, moment) in enumerate(
                    zip(gradients, moments[number], strict=True)
                ):
                    moment[0] = 0.9 * moment[0] + 0.1 * gradient
                    moment[1] = 0.999 * moment[1] + 0.001 * gradient**2
                    first = moment[0] / (1.0 - 0.9**step)
                    second = moment[1] / (1.0 - 0.999**step)
                    self.layers[number][part] = self.layers[number][part] - here * first / (
                        np.sqrt(second) + 1e-8
                    )


def maximum_likelihood(channels):
    """Returns ω at the maximum of |a(ω)ᴴ ĥ| on the grid."""
    return GRID_RAD[np.abs(channels @ steering(GRID_RAD).conj().T).argmax(axis=1)]


def bayes(channels, snr_db):
    """Returns the estimate with the minimum mean of 1 − cos(error), which is the bound."""
    matched = np.abs(channels @ steering(GRID_RAD).conj().T)
    argument = 2.0 * np.sqrt(K / (K + 1.0)) * matched / variance(snr_db)
    # ln I₀(x) = x + ln(e^{−x} I₀(x)) neither overflows nor underflows.
    log_likelihood = (
        argument + np.log(np.i0(np.minimum(argument, 500.0))) - np.minimum(argument, 500.0)
    )
    # θ is uniform: p(ω) = 1/(π √(π² − ω²)).
    log_prior = -0.5 * np.log(np.pi**2 - np.minimum(np.abs(GRID_RAD), np.pi - 1e-3) ** 2)
    log_posterior = log_likelihood + log_prior
    weight = np.exp(log_posterior - log_posterior.max(axis=1, keepdims=True))
    return np.angle(weight @ np.exp(1j * GRID_RAD))


def cost(found_rad, phase_rad):
    """Returns the mean of 2 (1 − cos(error)) as an RMS error (rad), and its standard error."""
    each = 2.0 * (1.0 - np.cos(found_rad - phase_rad))
    mean = each.mean()
    return np.sqrt(mean), 0.5 * each.std() / np.sqrt(each.size * mean)


def compare(network, random, count):
    """Returns rows of SNR and (cost, standard error) of each estimator, with the same samples."""
    for snr_db in SNRS_DB:
        phase_rad, channels = draw(random, np.full(count, snr_db))
        yield (
            snr_db,
            cost(network(features(outer(channels))), phase_rad),
            cost(maximum_likelihood(channels), phase_rad),
            cost(bayes(channels, snr_db), phase_rad),
        )


def drive(network):
    """Runs the same drive with each estimator."""
    import access_av

    def learned(snapshots):
        covariance = snapshots @ snapshots.conj().T
        phase_rad = float(network(features(covariance[None]))[0])
        return float(np.arccos(np.clip(phase_rad / np.pi, -1.0, 1.0))), 0.05

    scenario = access_av.Scenario.load("paper-real-odometry-2")
    by_network = access_av.simulate(scenario, runs=1, estimator=learned)
    built_in = access_av.simulate(scenario, runs=1)
    print(f"a drive: learned {by_network.rms_error_m:.3f} m, built in {built_in.rms_error_m:.3f} m")


def main():
    """Trains the network, compares the estimators and runs the drives."""
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--steps", type=int, default=4000, help="of the training")
    options.add_argument("--count", type=int, default=2000, help="draws an SNR")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--drive", action="store_true")
    chosen = options.parse_args()
    random = np.random.default_rng(chosen.seed)
    network = Network(random)
    network.train(random, chosen.steps)
    print("RMS error of ω in rad (2 (1 − cos) mean), ± its standard error")
    print(f"{'SNR dB':>7} {'learned':>17} {'ML':>17} {'ceiling':>17}")
    for snr_db, *found in compare(network, random, chosen.count):
        print(f"{snr_db:7.0f} " + " ".join(f"{each:8.4f} ± {std:6.4f}" for each, std in found))
    if chosen.drive:
        drive(network)


if __name__ == "__main__":
    main()
