"""Angles of the tracker in a channel with strong scatter, compared with the bound."""

from __future__ import annotations

import json

import numpy as np
import pytest

import access_av


@pytest.mark.parametrize(("k_db", "most"), [(10.0, 1.1), (5.0, 1.1), (3.0, 1.1), (0.0, 1.3)])
def test_used_angles_are_near_the_bound(k_db: float, most: float) -> None:
    scenario = access_av.Scenario.load("paper-real-odometry-4").with_overrides(
        {"site.rician_k_db": k_db, "vehicle.integrity.enabled": False}
    )
    result = access_av.simulate(scenario, runs=3, seed=5, keep_trajectories=True)
    looks = result.aoa_estimates.join(result.trajectories, on=["run", "time_s"])
    heads = {
        head["pci"]: head["position_m"]
        for head in json.loads(scenario.site.to_json())["radio_heads"]
    }
    away_m = np.array([heads[pci][:2] for pci in looks["pci"]]) - np.column_stack(
        [looks["true_x_m"], looks["true_y_m"]]
    )
    azimuth_rad = np.arctan2(away_m[:, 1], away_m[:, 0]) - looks["true_heading_rad"].to_numpy()
    error_rad = looks["phase_rad"].to_numpy() - np.pi * np.cos(azimuth_rad)
    error_rad = (error_rad + np.pi) % (2.0 * np.pi) - np.pi
    # Scatter and noise: 1/(2KA) with A = N (N² - 1) / 12 for four antennas, and the reported noise.
    bound_rad = np.sqrt(0.1 * 10.0 ** (-0.1 * k_db) + looks["phase_sigma_rad"].to_numpy() ** 2)
    used = looks["accepted"].to_numpy()
    ratio = float(np.sqrt(((error_rad / bound_rad)[used] ** 2).mean()))
    assert 0.95 < ratio < most, ratio
    assert used.mean() > 0.8
