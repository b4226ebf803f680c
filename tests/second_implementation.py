"""Independent implementation of the paper's simulation: NumPy only, from the paper's text.

Equations and line numbers are those of the paper; other choices are those of the shipped scenario.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

LENGTH_M, TURN_RAD, HEAD_M = 300.0, np.radians(14.32), np.array([[205.0], [100.0]])
TOP_MPS, RAMP_MPS2, PERIOD_S = 15.0 / 3.6, 0.5, 0.02
ANTENNAS, SNAPSHOTS, TX_RX_GAIN_DB, FADING_DB = 4, 20, 15.0, 3.0
KP, KI, KD, W_SNR, W_VELOCITY, T_MAX_S = 0.75, 0.08, 0.195, 0.6, 0.4, 0.24
NOISE_DBM = 10.0 * np.log10(1.38e-23 * 290.0 * 3.6e6 * 1e3) + 5.0
# Chosen: transmit power, carrier, Rician K, set point and scale of the SNR error; u is in seconds.
POWER_DBM, CARRIER_HZ, RICIAN_K, OFFSET_DB, SCALE_DB = -27.3, 3.5e9, 1e4, 3.0, 10.0
# Whether to use an SSB's angle, by SSB number, SNR (dB) and expected SNR (dB) at the estimate.
Wanted = Callable[[int, np.ndarray, np.ndarray], np.ndarray]


def friis_db(xy_m: np.ndarray) -> np.ndarray:
    """SNR (dB) by the link budget at positions of shape (2, ...)."""
    loss_db = 20.0 * np.log10(4.0 * np.pi * np.hypot(*(HEAD_M - xy_m)) * CARRIER_HZ / 299792458.0)
    return np.asarray(POWER_DBM + TX_RX_GAIN_DB - loss_db - NOISE_DBM)


class Trip:
    """Many vehicles on the paper's track: the received signal of every SSB."""

    def __init__(self, runs: int, seed: int) -> None:
        rng, ramp_s = np.random.default_rng(seed), TOP_MPS / RAMP_MPS2
        end_s = LENGTH_M / TOP_MPS + ramp_s
        self.t = np.arange(np.ceil(end_s / PERIOD_S) + 1) * PERIOD_S
        early_s, left_s = np.minimum(self.t, ramp_s), np.clip(end_s - self.t, 0.0, ramp_s)
        self.v = RAMP_MPS2 * np.minimum(early_s, left_s)
        cruise_s = np.clip(self.t, ramp_s, end_s - ramp_s) - ramp_s
        self.s = 0.5 * RAMP_MPS2 * (early_s**2 + ramp_s**2 - left_s**2) + TOP_MPS * cruise_s
        turn = self.s / LENGTH_M * TURN_RAD
        self.xy = LENGTH_M / TURN_RAD * np.array([np.sin(turn), 1.0 - np.cos(turn)])
        phase = np.pi * np.cos(np.arctan2(*(HEAD_M - self.xy)[::-1]) - turn)  # λ/2 apart, ahead
        line = np.exp(1j * phase[:, None] * np.arange(ANTENNAS))
        self.snr_db = friis_db(self.xy) + rng.normal(0.0, FADING_DB, (runs, len(self.t)))
        self.signal = np.empty((*self.snr_db.shape, ANTENNAS), complex)
        for run, snr_db in enumerate(self.snr_db):
            normal = rng.normal(0.0, 0.5**0.5, (2, len(self.t), ANTENNAS, 1 + SNAPSHOTS))
            scatter, noise = np.split(normal[0] + 1j * normal[1], [1], axis=2)
            amplitude = np.sqrt(10.0 ** (snr_db / 10.0) / (RICIAN_K + 1.0))[:, None, None]
            gain = amplitude * (np.sqrt(RICIAN_K) * line[..., None] + scatter)
            received = gain * 1j ** rng.integers(4, size=(len(self.t), 1, SNAPSHOTS)) + noise
            covariance = received @ received.conj().swapaxes(1, 2)
            self.signal[run] = np.linalg.eigh(covariance)[1][..., -1]  # largest eigenvalue
            self.snr_db[run] = 10.0 * np.log10(np.mean(abs(gain[..., 0]) ** 2, axis=1))

    def music(self, points: int = 16384) -> np.ndarray:
        """AoA (rad) at the maximum of the pseudospectrum, by stepwise refinement of a grid."""
        n, coarse = np.arange(ANTENNAS), 2.0 * np.pi * (np.arange(64) + 0.5) / 64
        steering, step = np.exp(-1j * np.outer(n, coarse)), (coarse[1] - coarse[0]) / 3.0
        omega = coarse[np.array([abs(e @ steering).argmax(axis=1) for e in self.signal])]
        while step > 2.0 * np.pi / points:
            phases = omega[..., None] + step * np.array([-1.0, 0.0, 1.0])
            turned = np.exp(-1j * phases[..., None] * n)
            best = abs(np.einsum("rtcn,rtn->rtc", turned, self.signal)).argmax(axis=2)
            omega, step = omega + step * (best - 1), step / 3.0
        return np.asarray(np.arccos(np.angle(np.exp(1j * omega)) / np.pi))

    def esprit(self) -> np.ndarray:
        """AoA (rad) by the rotation from the first three antennas to the last three."""
        rotation = np.sum(self.signal[..., 1:] * self.signal[..., :-1].conj(), axis=-1)
        return np.asarray(np.arccos(np.angle(rotation) / np.pi))

    def drive(self, aoa: np.ndarray, wanted: Wanted) -> tuple[float, np.ndarray]:
        """Mean angle estimates, and errors (m) of shape (2, runs, SSBs): AoA → AoH → position."""
        anchor, heading, since_m = np.zeros((2, len(aoa))), np.zeros(len(aoa)), np.zeros(len(aoa))
        errors, count = np.empty((2, *aoa.shape)), 0
        for k, step_m in enumerate(np.diff(self.s, prepend=0.0)):
            since_m = since_m + step_m
            here = anchor + since_m * np.array([np.cos(heading), np.sin(heading)])
            now = wanted(k, self.snr_db[:, k], friis_db(here))
            aois = np.arctan2(*(HEAD_M - here)[::-1])  # equation 1
            turned = aois - np.copysign(aoa[:, k], np.sin(aois - heading)) - heading  # equation 2
            turned = np.where(now, np.angle(np.exp(1j * turned)), 0.0)
            mean = heading + 0.5 * turned  # mean heading since the last estimate (chosen)
            here = anchor + since_m * np.array([np.cos(mean), np.sin(mean)])
            anchor, since_m = np.where(now, here, anchor), np.where(now, 0.0, since_m)
            heading, count = heading + turned, count + np.count_nonzero(now)
            errors[:, :, k] = here - self.xy[:, k, None]
        return count / len(aoa), errors

    def fixed(self, interval_s: float) -> Wanted:
        """Selects the first SSB after each interval."""
        every = int(np.ceil(interval_s / PERIOD_S - 1e-9))
        return lambda k, snr_db, _: np.full(len(snr_db), k % every == 0)

    def algorithm_1(self, t_base_s: float, *, asleep: bool = False, clamp: float = np.inf,
                    gate_db: float = -np.inf) -> Wanted:  # fmt: skip
        """Algorithm 1 at every SSB or at wake-ups; gate and clamp are not from the paper."""
        before, integral, wt_s, sensed = np.zeros((4, len(self.snr_db)))
        last = np.full(len(self.snr_db), -np.inf)

        def wanted(k: int, snr_db: np.ndarray, expected_db: np.ndarray) -> np.ndarray:
            t_s = k * PERIOD_S
            awake = (t_s - last >= wt_s - 1e-9) | (not asleep)
            delta_t_s = np.maximum(t_s - sensed, PERIOD_S)
            e_snr = (expected_db + OFFSET_DB - snr_db) / SCALE_DB
            error = W_SNR * e_snr + W_VELOCITY * (1.0 - self.v[k] / TOP_MPS)  # line 10
            total = np.clip(integral + error * delta_t_s, -clamp, clamp)  # 11
            u_s = KP * error + KI * total + KD * (error - before) / delta_t_s  # 12, 13
            new_s = np.clip(t_base_s + u_s, t_base_s, T_MAX_S)  # 15, 16
            for state, new in ((integral, total), (before, error), (wt_s, new_s), (sensed, t_s)):
                np.copyto(state, new, where=awake & (k > 0))
            due = awake if asleep else t_s - last >= wt_s - 1e-9
            now = np.asarray(due & (snr_db >= expected_db + gate_db))
            np.copyto(last, t_s, where=now)
            return now

        return wanted
