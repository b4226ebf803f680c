"""Ray-traced street: angles alone, with delays, and with delays and carrier phases.

    ACCESS_AV_DATA=… python benches/street_delays.py [--runs 4] [--seed 1] [--interval-ms 100]

The SSBs are simulated as samples along the paths of ``$ACCESS_AV_DATA/street``. The radio heads
share an oscillator: unknown offsets of 50 ns (σ), and the printed random walk. The vehicle knows
neither the K factor (it assumes 10 dB) nor the lines of sight. ``beyond`` is the share of the
``ok`` epochs whose error exceeds the protection level.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

import street_site
from access_av import Scenario, simulate

WANDERS_NS = (0.0, 0.05)
WITHOUT_ROAD = {
    "vehicle.localizer.map": False,
    "vehicle.gyroscope": {"noise_rad_per_sqrt_s": 0.003, "bias_std_radps": 0.002},
}


def scenario_file(street: Path, folder: Path, interval_ms: float) -> Path:
    """Writes site, paths and scenario of the street; returns the scenario file."""
    clock = "clock_group = 1\nclock_offset_std_ns = 50.0\nclock_frequency_std_ppb = 20.0\n"
    street_site.write(street, folder, rician_k_db=10.0, of_each_head=clock)
    file = folder / "drive.toml"
    file.write_text(
        'name = "drive"\nsite = "street.toml"\nfidelity = "iq"\n'
        '[vehicle]\nextends = "carrier"\nname = "street"\n'
        "[vehicle.array]\nposition_m = [0.0, 0.0, 1.5]\n"
        f'[vehicle.wake_up]\npolicy = "fixed"\ninterval_ms = {interval_ms}\n'
        '[channel]\nmodel = "paths"\npaths = "street.npz"\n'
    )
    return file


def with_kinds(scenario: Scenario, phases: bool, wander_ns: float) -> Scenario:
    """Returns the scenario with delays, and with carrier phases if ``phases``."""
    changed: dict[str, Any] = {
        f"site.radio_heads[{index}].clock_wander_ns_per_sqrt_s": wander_ns for index in range(4)
    }
    changed["vehicle.ranging"] = {"kind": "one-way", "carrier_phase": phases}
    return scenario.with_overrides(changed)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--interval-ms", type=float, default=100.0)
    asked = parser.parse_args()
    data = os.environ.get("ACCESS_AV_DATA")
    if data is None or not (Path(data) / "street").is_dir():
        print("$ACCESS_AV_DATA contains no folder street", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        file = scenario_file(Path(data) / "street", Path(folder), asked.interval_ms)
        base = Scenario.load(str(file))
        print("road  measurements      walk, ns/√s  RMS, m  95 %, m  ok %   beyond")
        for road in (True, False):
            there = base if road else base.with_overrides(WITHOUT_ROAD)
            rows = [("angles", "–", there)]
            for name, phases in (("delays", False), ("delays, phases", True)):
                rows += [(name, str(it), with_kinds(there, phases, it)) for it in WANDERS_NS]
            for name, wander, scenario in rows:
                found = simulate(scenario, runs=asked.runs, seed=asked.seed)
                kept = found.integrity
                if kept is None:
                    raise RuntimeError("the street states no protection level")
                rms_m = float(np.sqrt(np.mean(found.runs["rms_error_m"].to_numpy() ** 2)))
                print(
                    f"{'yes' if road else 'no':5} {name:17} {wander:>11}  {rms_m:6.3f}  "
                    f"{found.error_quantiles_m[0.95]:7.2f}  {100.0 * kept.availability:5.1f}  "
                    f"{kept.exceedance_share:7.1e}",
                    flush=True,
                )
    return 0


if __name__ == "__main__":
    sys.exit(main())
