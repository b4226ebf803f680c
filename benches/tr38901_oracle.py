"""Quantiles of TR 38.901 drops by Sionna: reference for the simulator.

Requires ``pip install sionna-no-rt`` (Apache-2.0; it depends on torch, so that it is in no extra).
Writes the table that ``crates/simulate/tests/all/tr38901.rs`` reads::

    python benches/tr38901_oracle.py > crates/simulate/tests/all/data/tr38901_sionna.txt
"""

from __future__ import annotations

import sys

import numpy as np
import torch
from sionna.phy.channel import tr38901
from sionna.phy.channel.tr38901.metrics import angular_spreads_from_rays, delay_spread_from_rays

DROPS = 100_000
BATCH = 5_000
CARRIER_HZ = 3.5e9
PROBABILITIES = (0.05, 0.25, 0.5, 0.75, 0.95)
# Heights of radio head and array in each model (m), and horizontal distances (m).
MODELS = {
    "umi": (10.0, 1.5, 20.0, 120.0),
    "inf-sl": (1.5, 1.5, 5.0, 60.0),
    "inf-dl": (1.5, 1.5, 1.0, 10.0),
    "inf-sh": (8.0, 1.5, 5.0, 120.0),
    "inf-dh": (8.0, 1.5, 1.0, 15.0),
}


def drops(model: str) -> dict[str, np.ndarray]:
    """Returns line-of-sight state and parameters of every drop."""
    head_m, array_m, least_m, most_m = MODELS[model]
    antenna = {
        "num_rows_per_panel": 1,
        "num_cols_per_panel": 1,
        "polarization": "single",
        "polarization_type": "V",
        "antenna_pattern": "omni",
        "carrier_frequency": CARRIER_HZ,
    }
    array = tr38901.PanelArray(**antenna)
    common = {"ut_array": array, "bs_array": array, "direction": "downlink"}
    if model == "umi":
        channel = tr38901.UMi(CARRIER_HZ, "low", **common)
    else:
        channel = tr38901.InF(
            carrier_frequency=CARRIER_HZ, factory_scenario=model.removeprefix("inf-"), **common
        )
    parts = []
    for _ in range(DROPS // BATCH):
        level_m = least_m + (most_m - least_m) * torch.rand(BATCH, 1)
        place = torch.stack(
            [level_m, torch.zeros(BATCH, 1), torch.full((BATCH, 1), array_m)], dim=-1
        )
        head = torch.tensor([0.0, 0.0, head_m]).repeat(BATCH, 1, 1)
        nothing = torch.zeros(BATCH, 1, 3)
        channel.set_topology(
            ut_loc=place,
            bs_loc=head,
            ut_orientations=nothing,
            bs_orientations=nothing,
            ut_velocities=nothing,
            in_state=torch.full((BATCH, 1), model != "umi"),
        )
        scenario = channel._scenario
        lsp = channel._lsp_sampler()
        rays = channel._ray_sampler(lsp)
        found = {
            "line_of_sight": scenario.los,
            "path_loss_db": scenario.basic_pathloss,
            "shadowing_db": 10.0 * torch.log10(lsp.sf),
            "k_db": 10.0 * torch.log10(lsp.k_factor),
            "delay_spread_ns": 1e9 * lsp.ds,
            "azimuth_spread_deg": lsp.asa,
            "zenith_spread_deg": lsp.zsa,
            "paths_delay_spread_ns": 1e9 * delay_spread_from_rays(rays, lsp, scenario),
            "paths_azimuth_spread_deg": torch.rad2deg(
                angular_spreads_from_rays(rays, lsp, scenario)["asa"]
            ),
        }
        # The next topology overwrites this one.
        parts.append({name: value.numpy().ravel().copy() for name, value in found.items()})
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def main() -> None:
    """Prints one row per model, state and quantity."""
    torch.manual_seed(1)
    print("model state quantity", *PROBABILITIES)
    for model in sys.argv[1:] or MODELS:
        found = drops(model)
        clear = found.pop("line_of_sight").astype(bool)
        print(model, "all line_of_sight", *[f"{clear.mean():.4f}"] * len(PROBABILITIES))
        for state, mask in (("clear", clear), ("hidden", ~clear)):
            for name, values in found.items():
                # Sionna also adds the line of sight to the subclusters of a strong cluster.
                if (name, state) in {("k_db", "hidden"), ("paths_delay_spread_ns", "clear")}:
                    continue
                quantiles = np.quantile(values[mask], PROBABILITIES)
                print(model, state, name, *(f"{value:.4f}" for value in quantiles))


if __name__ == "__main__":
    main()
