"""The benchmark of drives with ranges: conversion of libRSF's files, and the simulated car."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from conftest import benchmark

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def bench() -> Any:
    return benchmark("range_drives")


def converted(bench: Any, folder: Path, measured: list[str], truth: list[str]) -> Path:
    (folder / "Input.txt").write_text("\n".join(measured), encoding="utf-8")
    (folder / "GT.txt").write_text("\n".join(truth), encoding="utf-8")
    bench.convert(folder / "Input.txt", folder / "GT.txt", folder / "drive")
    return folder / "drive"


def row_of(table: str, name: str) -> list[float]:
    *_, line = table.splitlines()
    assert line.startswith(name)
    return [float(value) for value in line.split()[1:]]


def test_a_robot_with_two_wheels_is_converted_and_located(
    bench: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    random = np.random.default_rng(1)
    anchors = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
    radius, speed, half_track = 1.2, 0.3, 0.0785
    measured, truth = [], []
    for number in range(500):
        time = 0.1 * number
        angle = speed * time / radius
        x, y = 2 + radius * math.cos(angle), 2 + radius * math.sin(angle)
        place = anchors[number % 4]
        value = math.dist((x, y), place) + 0.05 * random.standard_normal()
        left, right = (speed * (1 + side * half_track / radius) for side in (-1, 1))
        measured.append(f"range2 {time} {value} 0.01 {place[0]} {place[1]} {number % 4} 0")
        measured.append(f"odom2diff {time} {left} {right} 0 {half_track} 1e-4 1e-4 1e-4")
        truth.append(f"point2 {time} {x} {y} 0 0 0 0")
    bench.table([converted(bench, tmp_path, measured, truth)], "")
    rms_m, _, _, ok, beyond = row_of(capsys.readouterr().out, "drive")
    assert rms_m < 0.1
    assert ok > 0.8
    assert beyond == 0.0


def test_pseudoranges_keep_their_errors(bench: Any, tmp_path: Path) -> None:
    """The earth's rotation delays a signal as in ICD-GPS-200: the satellite is rotated."""
    random = np.random.default_rng(2)
    start = np.array([3785108.1, 899901.5, 5037234.5])
    up = start / np.hypot.reduce(start)
    errors_m = 5.0 * random.standard_normal(50)
    measured, truth = [], []
    for number, error_m in enumerate(errors_m):
        place = start + np.cross(up, [0.0, 0.0, 1.0]) * number
        satellite = 2e7 * up + 1e7 * random.standard_normal(3)
        flight_s = np.hypot.reduce(satellite - place) / bench.SPEED_OF_LIGHT_MPS
        turn = bench.EARTH_RATE_RADPS * flight_s
        turned = satellite + turn * np.array([satellite[1], -satellite[0], 0.0])
        value = np.hypot.reduce(turned - place) + 100.0 + error_m
        at = f"{value:.6f} 25 {satellite[0]:.6f} {satellite[1]:.6f} {satellite[2]:.6f}"
        measured.append(f"pseudorange3 {number} {at} {number} 1 45 40")
        measured.append(f"odom3 {number} 1 0 0 0 0 0 1 1 1 1 1 1")
        truth.append(f"point3 {number} {place[0]:.6f} {place[1]:.6f} {place[2]:.6f} 0")
    drive = converted(bench, tmp_path, measured, truth)
    site = (drive / "site.toml").read_text(encoding="utf-8")
    found = re.findall(r"pci = (\d+)\nposition_m = \[(.*)\]", site)
    heads = {int(pci): [float(value) for value in place.split(",")] for pci, place in found}
    path = np.loadtxt(drive / "truth.tum")
    ranges = np.loadtxt(drive / "ranges.csv", delimiter=",", skiprows=1)
    left_m = [
        1e-9 * bench.SPEED_OF_LIGHT_MPS * delay_ns - math.dist(heads[int(pci)], (*at[1:3], 0.0))
        for (_, pci, delay_ns, _), at in zip(ranges, path, strict=True)
    ]
    assert np.allclose(left_m - np.mean(left_m), errors_m - np.mean(errors_m), atol=0.02)


@pytest.mark.parametrize("kind", ["one-way", "two-way"])
def test_a_car_with_blocked_paths_is_located(
    bench: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], kind: str
) -> None:
    arguments = ["car", str(tmp_path / "car"), "--kind", kind, "--duration-s", "100"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["range_drives.py", *arguments, "--seed", "7"])
        bench.main()
        patch.setattr("sys.argv", ["range_drives.py", "table", str(tmp_path / "car")])
        bench.main()
    rms_m, _, _, ok, beyond = row_of(capsys.readouterr().out, "car")
    assert rms_m < 2.0
    assert ok > 0.8
    assert beyond < 1e-2
