"""Reflections within one beamwidth: detection rate, and error of undetected reflections.

Four antennas half a wavelength apart, 20 snapshots, direct path at 90 degrees. The beamwidth (3 dB)
is 26 degrees.
"""

from __future__ import annotations

import argparse

import numpy as np

from access_av import aoa


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=4000)
    trials = parser.parse_args().trials
    rng = np.random.default_rng(1)
    print("snr_db echo_db apart_deg doubted rms_error_deg z_rms_of_reliable")
    for snr_db in (10, 20, 30):
        for echo_db in (-6, -12):
            for apart_deg in (2, 5, 10, 20, 40):
                echo = 10 ** (echo_db / 20) * np.exp(2j * np.pi * rng.random((trials, 1, 1)))
                steering = [
                    np.exp(1j * np.pi * np.cos(np.radians(it)) * np.arange(4))[:, None]
                    for it in (90, 90 - apart_deg)
                ]
                waveform = np.exp(2j * np.pi * rng.random((trials, 1, 20))) * 10 ** (snr_db / 20)
                noise = rng.normal(size=(trials, 4, 20, 2)) @ [1, 1j] / np.sqrt(2)
                received = (steering[0] + echo * steering[1]) * waveform + noise
                found = aoa.maximum_likelihood(np.ascontiguousarray(received))
                errors = found.angle_rad - np.pi / 2
                z = errors[found.reliable] / found.sigma_rad[found.reliable]
                z_rms = np.sqrt(np.mean(z**2)) if len(z) else np.nan
                rms_deg = np.degrees(np.sqrt(np.mean(errors**2)))
                print(
                    f"{snr_db} {echo_db} {apart_deg} {1 - found.reliable.mean():.3f} "
                    f"{rms_deg:.2f} {z_rms:.1f}"
                )


if __name__ == "__main__":
    main()
