"""`access-av-node` on another processor, emulated: `make test-aarch64` builds and runs it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import access_av
from access_av.drives.recorded import log_angles
from conftest import ROOT
from node import NODE

EMULATED_NODE = ROOT / "target/aarch64-unknown-linux-gnu/debug/access-av-node"
EMULATOR = shutil.which("qemu-aarch64")
# Where the other processor's libraries are: Debian's cross compiler, or a system of both.
LIBRARIES = next(it for it in ("/usr/aarch64-linux-gnu", "/") if Path(it).exists())
# Tolerance (m) for single-precision samples that are processed in another order.
SAMPLES_M = 2e-8

pytestmark = pytest.mark.skipif(
    EMULATOR is None or not (NODE.exists() and EMULATED_NODE.exists()),
    reason=f"no emulator, {NODE} or {EMULATED_NODE}: `make test-aarch64` says what is needed",
)


def poses(command: list[str | Path], drive: Path, folder: Path, sources: str) -> bytes:
    """Returns the trajectory that a node writes in fast playback."""
    settings, tum = folder / "node.toml", folder / "node.tum"
    odometry = f'odometry.file = "{drive}/odometry.csv"\n'
    text = f'name = "played"\npace = "fast"\n{odometry}{sources}output.tum = "{tum}"\n'
    settings.write_text(text, encoding="utf-8")
    nominal = ["--site", drive / "site.toml", "--vehicle", drive / "vehicle.toml"]
    subprocess.run([*command, *nominal, settings], check=True, timeout=120)
    return tum.read_bytes()


def test_poses_are_equal_on_another_processor(tmp_path: Path) -> None:
    emulated = [str(EMULATOR), "-L", LIBRARIES, EMULATED_NODE]
    log_angles("yard", tmp_path / "log", duration_s=60.0)
    angles = f'angles.file = "{tmp_path}/log/angles.csv"\n'
    by_angles = poses([NODE], tmp_path / "log", tmp_path, angles)
    assert poses(emulated, tmp_path / "log", tmp_path, angles) == by_angles

    access_av.synthesize("yard", tmp_path / "iq", duration_s=10.0)
    samples = f'samples = {{ source = "sigmf", recording = "{tmp_path}/iq/iq" }}\n'
    by_samples, there = (
        np.loadtxt(poses(node, tmp_path / "iq", tmp_path, samples).decode().splitlines())
        for node in ([NODE], emulated)
    )
    assert np.abs(by_samples - there).max() < SAMPLES_M
