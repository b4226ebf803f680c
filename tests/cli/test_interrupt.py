"""Ctrl-C at a random time ends within a second with exit code 130 and without partial files."""

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
from conftest import commands

if TYPE_CHECKING:
    from pathlib import Path

# Commands with arguments with which they run longer than the latest interruption.
LONG: list[tuple[str, ...]] = [
    ("run", "paper-real-odometry-4", "--runs", "400", "--out", "out"),
    ("rerun", "earlier"),
    ("study", "bends", "--out", "out"),
    ("paper", "evaluate", "--out", "out"),
    ("paper", "interpretations"),
    ("paper", "assumptions", "--runs", "2000"),
    ("paper", "search-controllers"),
    ("paper", "fit", "--runs", "100000"),
    ("paper", "explore"),
    ("paper", "codesign"),
    ("design", "bound", "campus-handover", "--map-step-m", "3", "--out", "out"),
    ("design", "plan", "yard", "--masts", "masts.csv", "--out", "out"),
    (
        *("design", "import-paths", "nowhere.csv", "--site", "yard", "--carrier-mhz", "3500"),
        *("--out", "x.npz"),
    ),
    ("design", "integrity", "yard", "--out", "out"),
    ("design", "balance"),
    ("design", "sweep", "paper", "--space", "space.toml", "--out", "out"),
    ("design", "select", "nowhere"),
    ("design", "tune", "yard", "--max-rms-m", "0.1", "--out", "out"),
    ("design", "profile", "--out", "profiled.toml"),
    ("design", "power", "jetson-agx-xavier-engine"),
    ("record", "scan", "drive/iq.sigmf-meta"),
    ("record", "aoa", "drive/iq.sigmf-meta"),
    (
        *("record", "angles", "drive/iq.sigmf-meta", "--site", "drive/site.toml"),
        *("--vehicle", "drive/vehicle.toml", "--out", "out"),
    ),
    ("record", "synth", "paper-real-odometry-4", "--out", "out"),
    (
        *("record", "locate", "--recording", "drive/iq.sigmf-meta"),
        *("--odometry", "drive/odometry.csv", "--site", "drive/site.toml"),
        *("--vehicle", "drive/vehicle.toml", "--out", "out"),
    ),
    (
        *("record", "survey", *["logged"] * 8, "--site", "yard"),
        *("--vehicle", "logged/vehicle.toml", "--out", "out"),
    ),
    ("file", "new", "plant", "new-plant.toml"),
    ("file", "export", "yard", "exported.geojson"),
    ("file", "list"),
    ("file", "show", "--kind", "scenario", "yard"),
    ("file", "check", "--kind", "scenario", *access_av.Scenario.names() * 40),
    ("file", "schema", "scenario"),
    ("file", "columns"),
]
LATEST_S = 2.0
# A process that ends this soon (s) had finished when the signal was sent.
LATE_S = 0.1
# Time (s) of the interpreter's start, during which Python handles Ctrl-C.
PYTHON_S = 0.15


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("interrupted")
    access_av.synthesize("paper-real-odometry-4", folder / "drive", duration_s=20.0)
    access_av.drives.log_angles("yard", folder / "logged", duration_s=60.0)
    earlier = ["run", "yard", "--runs", "1", "--out", "earlier"]
    subprocess.run([sys.executable, "-m", "access_av", *earlier], cwd=folder, check=True)
    masts = "".join(f"mast-{n},{20 * n},{(-1) ** n * 45},8\n" for n in range(-5, 9))
    (folder / "masts.csv").write_text("name,x_m,y_m,z_m\n" + masts)
    (folder / "space.toml").write_text(
        "[vehicle.wake_up.trigger]\nbase_ms = [80.0, 100.0, 150.0]\n"
    )
    return folder


def test_every_command_has_an_interruption_test() -> None:
    known = commands()
    named = {" ".join(words[:2]) if words[0] not in known else words[0] for words in LONG}
    assert named == {*known}


@pytest.mark.parametrize("words", LONG, ids=lambda words: "-".join(words[:2]))
def test_ctrl_c_ends_every_command_within_a_second(words: tuple[str, ...], place: Path) -> None:
    stream = random.Random("-".join(words[:2]))
    before = {path for path in place.rglob("*") if path.is_file()}
    python_s = PYTHON_S * (1.0 + busy_s())
    times_s = [python_s + stream.random() * (LATEST_S - python_s) for _ in range(TIMES)]
    for after_s in times_s:
        process = subprocess.Popen(
            [sys.executable, "-m", "access_av", *words],
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
        # Before and after the program, the signal ends the interpreter (also 130), or it arrives
        # after the end.
        ended = process.returncode in (130, -signal.SIGINT) or took_s < LATE_S * (1.0 + busy_s())
        assert finished or ended, (after_s, process.returncode, said)
        assert finished or took_s < 1.0 + busy_s(), (after_s, took_s)
        assert "Traceback" not in said, (after_s, said)
        partial = list(place.rglob("*.partial"))
        assert not partial, (after_s, partial)
    for written in {path for path in place.rglob("*") if path.is_file()} - before:
        assert written.stat().st_size > 0


# `ACCESS_AV_INTERRUPTIONS=20` is the complete test.
TIMES = int(os.environ.get("ACCESS_AV_INTERRUPTIONS", "1"))


def busy_s() -> float:
    """Returns the time (s) after which a loaded computer schedules this process again."""
    waiting = os.getloadavg()[0] / (os.cpu_count() or 1)
    return waiting if waiting > 1.0 else 0.0
