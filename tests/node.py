"""The node that tests run, and the drives that it is given."""

from __future__ import annotations

import os
from pathlib import Path

import access_av
from conftest import ROOT

NODE = Path(os.environ.get("ACCESS_AV_NODE", ROOT / "target/debug/access-av-node"))


def command(drive: Path, settings: Path, *options: str) -> list[str]:
    """How it is started for a drive that was written by `access-av synth`."""
    believed = ["--site", str(drive / "site.toml"), "--vehicle", str(drive / "vehicle.toml")]
    return [str(NODE), *believed, *options, str(settings)]


def wake_up_every(drive: Path, interval_s: float) -> None:
    """Has the drive's vehicle wake up at a fixed interval."""
    file = drive / "vehicle.toml"
    fixed = {"wake_up.policy": "fixed", "wake_up.interval_ms": 1e3 * interval_s}
    vehicle = access_av.Vehicle.load(str(file)).with_overrides(fixed)
    file.write_text(vehicle.to_toml(), encoding="utf-8")
