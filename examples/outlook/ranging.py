"""Ranging by SSBs: bounds of the delay, the carrier phase and the power.

    .venv/bin/python examples/outlook/ranging.py

The known elements of an SSB are the PSS and the SSS (127 each, in the middle) and the reference
signals of the broadcast channel (144 over all 240 subcarriers). Cramér–Rao bounds of the delay τ
and the phase φ of one path at N elements f_n of M antennas, with an SNR γ of each element:

    var(τ) = 1 / (2 M γ Σ (2π (f_n − f̄))²),   var(φ) = 1 / (2 M N γ)

(Kay, Estimation Theory, 3.11). The power gives the distance by Friis: σ_d = d ln(10)/20 σ_dB.
Fading of 3 dB is correlated over metres, so that averaging over SSBs does not reduce the error.
"""

import numpy as np

SPEED_OF_LIGHT_MPS, CARRIER_HZ, ANTENNAS, FADING_DB = 299_792_458.0, 3.5e9, 4, 3.0
MIDDLE = np.arange(-63, 64)
REFERENCES = np.concatenate([np.arange(-120, 120, 4), np.arange(-120, 120, 4),
                             np.arange(-120, -72, 4), np.arange(72, 120, 4)])  # fmt: skip


def bounds(snr_db: float, spacing_hz: float) -> tuple[float, float]:
    """Standard deviations of the delay (m) and of the carrier phase (mm)."""
    tones_hz = spacing_hz * np.concatenate([MIDDLE, MIDDLE, REFERENCES])
    gain = 2.0 * ANTENNAS * 10.0 ** (snr_db / 10.0)
    spread = np.sum((2.0 * np.pi * (tones_hz - tones_hz.mean())) ** 2)
    delay_m = SPEED_OF_LIGHT_MPS / np.sqrt(gain * spread)
    wavelength_mm = 1e3 * SPEED_OF_LIGHT_MPS / CARRIER_HZ
    return delay_m, wavelength_mm / (2.0 * np.pi) / np.sqrt(gain * tones_hz.size)


def main() -> None:
    """Prints the bounds."""
    print("SNR/dB   ToA m (15 kHz)   ToA m (30 kHz)   TDoA m (30 kHz)   phase mm")
    for snr_db in (10.0, 20.0, 30.0):
        (narrow_m, phase_mm), (wide_m, _) = (bounds(snr_db, hz) for hz in (15e3, 30e3))
        tdoa_m = np.sqrt(2.0) * wide_m
        print(f"{snr_db:6.0f} {narrow_m:15.3f} {wide_m:16.3f} {tdoa_m:17.3f} {phase_mm:10.3f}")
    distance_m = 100.0
    print(f"power: {distance_m * np.log(10.0) / 20.0 * FADING_DB:.0f} m at {distance_m:.0f} m")


if __name__ == "__main__":
    main()
