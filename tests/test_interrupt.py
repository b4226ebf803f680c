"""Ctrl-C at a random time: within a second, exit code 130, nothing half written."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

import access_av

if TYPE_CHECKING:
    from pathlib import Path

# What each command has to do for longer than the latest interruption.
LONG: dict[str, list[str]] = {
    "run": ["run", "paper-real-odometry-4", "--runs", "400", "--out", "out"],
    "evaluate": ["evaluate", "--out", "out"],
    "search": ["search"],
    "fit": ["fit", "--runs", "100000"],
    "explore": ["explore"],
    "bound": ["bound", "campus-handover", "--map-step-m", "2", "--out", "out"],
    "synth": ["synth", "paper-real-odometry-4", "--out", "out"],
    "locate": [
        "locate", "--recording", "drive/iq.sigmf-meta", "--odometry", "drive/odometry.csv",
        "--site", "drive/site.toml", "--vehicle", "drive/vehicle.toml", "--out", "out",
    ],
    "scan": ["scan", "drive/iq.sigmf-meta"],
    "aoa": ["aoa", "drive/iq.sigmf-meta"],
    "profile": ["profile", "--out", "profiled.toml"],
    "readings": ["readings"],
    "columns": ["columns"],
    "scenario": ["scenario", "check", *access_av.Scenario.names() * 40],
    "site": ["site", "check", *access_av.Site.names() * 40],
    "vehicle": ["vehicle", "check", *access_av.Vehicle.names() * 40],
    "platform": ["platform", "check", *access_av.Platform.names() * 40],
}  # fmt: skip
LATEST_S = 2.0
# The interpreter starts before the program does; what Ctrl-C does then is Python's own.
PYTHON_S = 0.15


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("interrupted")
    access_av.synthesize("paper-real-odometry-4", folder / "drive", duration_s=20.0)
    return folder


@pytest.mark.parametrize("command", LONG)
def test_ctrl_c_ends_it_within_a_second(command: str, place: Path) -> None:
    stream = random.Random(command)
    before = {path for path in place.rglob("*") if path.is_file()}
    times_s = [PYTHON_S + stream.random() * (LATEST_S - PYTHON_S) for _ in range(TIMES)]
    for after_s in times_s:
        process = subprocess.Popen(
            [sys.executable, "-m", "access_av", *LONG[command]],
            cwd=place,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        time.sleep(after_s)
        finished = process.poll() is not None
        process.send_signal(signal.SIGINT)
        sent_s = time.monotonic()
        _, said = process.communicate(timeout=20.0)
        took_s = time.monotonic() - sent_s
        assert finished or process.returncode == 130, (after_s, process.returncode, said)
        assert finished or took_s < 1.0 + BUSY_S, (after_s, took_s)
        assert "Traceback" not in said, (after_s, said)
        partial = list(place.rglob("*.partial"))
        assert not partial, (after_s, partial)
    for written in {path for path in place.rglob("*") if path.is_file()} - before:
        assert written.stat().st_size > 0


# `ACCESS_AV_INTERRUPTIONS=20` is the whole of it.
TIMES = int(os.environ.get("ACCESS_AV_INTERRUPTIONS", "1"))
# A machine that does much else takes its time to give the processor back.
BUSY_S = 1.0 if os.getloadavg()[0] > (os.cpu_count() or 1) else 0.0
