"""Platforms, energy models, and comparison of the proposed method with the paper's adaptive
point."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av import Scenario, simulate
from access_av.device.platform import Platform
from access_av.paper.codesign import compare

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

ENGINE = "jetson-agx-xavier-engine"


def test_wall_power_equals_the_public_measurements(data: Path) -> None:
    file = data / "agx_xavier_mlperf_v11_power.csv"
    rows = [
        row
        for row in csv.DictReader(file.read_text(encoding="utf-8").splitlines())
        if row["fan"] == "cool" and row["model"] == "resnet50" and row["scenario"] == "offline"
        and row["division"] == "closed" and "armnn" in row["software"]
    ]  # fmt: skip
    measured_w = {int(row["mode"]): float(row["mean_W"]) for row in rows}
    board = Platform.load(ENGINE)
    assert {0, 2, 3, 4, 5} <= measured_w.keys()
    modes = {mode["mode"]: mode for mode in json.loads(board.core.to_json())["modes"]}
    for number in (0, 2, 3, 4, 5):
        modelled_w = board.core.busy_power_w(list(modes).index(number), modes[number]["cores"])
        assert modelled_w == pytest.approx(measured_w[number], rel=0.1), number


def test_each_measured_mode_is_predicted_by_the_others() -> None:
    """The model is fitted without a mode and predicts the power of this mode."""
    modes = json.loads(Platform.load(ENGINE).core.to_json())["modes"]
    points = np.array(
        [
            (mode["cores"], mode["cpu_mhz"] / 1200.0, mode["full_load_power_w"]["value"])
            for mode in modes
            if "full_load_power_w" in mode
        ]
    )
    for left_out in range(len(points)):
        cores, clock, power_w = np.delete(points, left_out, axis=0).T
        best = np.inf, np.zeros(2), 0.0
        for exponent in np.arange(1.0, 6.0, 0.02):
            basis = np.stack([np.ones_like(cores), cores * clock**exponent], axis=1)
            relative = basis / power_w[:, None]
            factors = np.linalg.lstsq(relative, np.ones_like(cores), rcond=None)[0]
            miss = float(np.sum((relative @ factors - 1.0) ** 2))
            if miss < best[0]:
                best = miss, factors, exponent
        _, (idle_w, core_w), exponent = best
        cores_out, clock_out, power_out = points[left_out]
        assert idle_w + core_w * cores_out * clock_out**exponent == pytest.approx(
            power_out, rel=0.1
        )


@pytest.mark.parametrize("name", Platform.names())
def test_shipped_platforms_have_sources(name: str) -> None:
    board = json.loads(Platform.load(name).core.to_json())
    if name != "jetson-agx-xavier":
        cycles = board["cpu"]["cycles_per_execution"].values()
        assert {each["provenance"] for each in cycles} == {"projected"}
        assert board["receiver"]["counted"]
        for each in cycles:
            assert each["low"] <= each["value"] < each["high"]


@pytest.mark.parametrize("name", [name for name in Platform.names() if name != "jetson-agx-xavier"])
def test_energy_of_a_trip_grows_with_every_parameter(name: str) -> None:
    board = Platform.load(name).core
    vehicle = Scenario.load("paper").vehicle
    totals_j = []
    for extent in ("low", "value", "high"):
        energy = board.energy_j(vehicle, 30, 30, 80.33, extent)
        assert energy is not None
        assert energy[3] == "marginal"
        totals_j.append(sum(energy[:3]))
    assert totals_j == sorted(totals_j)
    assert totals_j[0] < totals_j[2]
    result = simulate("paper", platform=Platform.load(name))
    assert result.runs["energy_listening_j"][0] > result.runs["energy_aoa_estimates_j"][0] > 0.0


def test_the_proposed_method_has_less_error_and_energy_in_every_mode() -> None:
    found = compare("gate", runs=4, seed=5)
    assert [each.mode for each in found] == list(range(8))
    for each in found:
        assert each.policy.rms_error_m < each.paper.rms_error_m
        assert each.policy_ratio <= 0.1
        assert each.engine_ratio <= 0.01
        assert each.paper.bursts_received == 4018


def test_json_of_a_single_run_has_no_interval(access_av: Callable[..., Finished]) -> None:
    done = access_av("paper", "codesign", "--runs", "1", "--json")
    records = json.loads(done.out)
    assert [each["mode"] for each in records] == list(range(8))
    assert {each["is_better"] for each in records} == {False}
    mean_m, low_m, high_m = records[0]["rms_error_reduction_m"]
    assert mean_m > 0.0
    assert (low_m, high_m) == (None, None)


def test_the_power_model_is_within_10_percent_of_the_measurements(
    access_av: Callable[..., Finished],
) -> None:
    done = access_av("design", "power", ENGINE)
    rows = [line for line in done.out.splitlines() if line.rstrip().endswith(tuple("0123456789"))]
    off = [float(line.split()[-1]) for line in rows]
    assert len(off) == 5
    assert max(map(abs, off)) < 10.0
