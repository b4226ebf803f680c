"""Reports of `access-av-node`: faults and site on the page, truncated inputs, removed tones."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
import urllib.request
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import access_av
from node import NODE, command, free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

DURATION_S = 4.0
# Longest wait for a change of the page (s); a change takes less than 1 s on an idle computer.
LONGEST_S = 20.0
# Frequency of the tone above the centre (Hz), and its amplitude relative to the full scale.
TONE_HZ, AMPLITUDE = 432e3, 0.1

pytestmark = pytest.mark.skipif(
    not NODE.exists(), reason=f"no {NODE}: `cargo build -p access-av-node` makes it"
)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded drive that begins in motion."""
    folder = tmp_path_factory.mktemp("reports")
    changes = {"vehicle.receiver.angle_time_offset_std_s": 0.0, "vehicle.acceleration_mps2": 2.0}
    scenario = access_av.Scenario.load("yard").with_overrides(changes)
    access_av.synthesize(scenario, folder, duration_s=DURATION_S)
    return folder


def played(drive: Path, folder: Path, inputs: str) -> list[dict[str, Any]]:
    """Plays files as fast as possible and returns the JSON output."""
    out, settings = folder / "out.jsonl", folder / "node.toml"
    text = f'name = "reports"\npace = "fast"\n{inputs}\n[output]\njson.address = "{out}"\n'
    text += f'mcap.folder = "{folder}/log"\n'
    settings.write_text(text, encoding="utf-8")
    done = subprocess.run(command(drive, settings), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]


def test_tones_that_are_removed_are_in_the_status(drive: Path, tmp_path: Path) -> None:
    metadata = json.loads((drive / "iq.sigmf-meta").read_text(encoding="utf-8"))
    metadata["global"].pop("core:sha512", None)
    channels = metadata["global"]["core:num_channels"]
    samples = np.fromfile(drive / "iq.sigmf-data", dtype="<i2").astype(float)
    samples = samples.reshape(-1, channels, 2)
    turn = 2 * np.pi * TONE_HZ / metadata["global"]["core:sample_rate"] * np.arange(len(samples))
    samples += 32768 * AMPLITUDE * np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None, :]
    clipped = np.clip(np.rint(samples), -32768, 32767).astype("<i2")
    clipped.tofile(tmp_path / "iq.sigmf-data")
    (tmp_path / "iq.sigmf-meta").write_text(json.dumps(metadata), encoding="utf-8")
    records = played(
        drive,
        tmp_path,
        f'samples = {{ source = "sigmf", recording = "{tmp_path}/iq" }}\n'
        f'odometry.file = "{drive}/odometry.csv"',
    )
    statuses = [it for it in records if it["type"] == "status"]
    assert statuses
    centre_hz = metadata["captures"][0]["core:frequency"]
    (tone,) = statuses[-1]["tones"]
    assert tone["frequency_hz"] == pytest.approx(centre_hz + TONE_HZ, abs=2e3)
    assert tone["power_dbfs"] == pytest.approx(20 * np.log10(AMPLITUDE), abs=1.0)
    # SSBs are received through the tone.
    assert any(it["type"] == "verdict" and it["accepted"] for it in records)


def test_a_truncated_log_is_reported_and_read_up_to_its_end(drive: Path, tmp_path: Path) -> None:
    (tmp_path / "whole").mkdir()
    samples = f'samples = {{ source = "sigmf", recording = "{drive}/iq" }}\n'
    inputs = f'{samples}odometry.file = "{drive}/odometry.csv"'
    whole = played(drive, tmp_path / "whole", inputs)
    (log,) = (tmp_path / "whole/log").glob("*.mcap")
    cut = tmp_path / "cut.mcap"
    content = log.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    (tmp_path / "again").mkdir()
    again = played(drive, tmp_path / "again", f'{samples}odometry.file = "{cut}"')
    reports = [it for it in again if it["type"] == "event" and "not closed" in it["text"]]
    assert [(it["source"], it["level"]) for it in reports] == [("odometry", "warn")]
    assert "cut.mcap" in reports[0]["text"]
    counts = [sum(it["type"] == "pose" for it in records) for records in (again, whole)]
    assert 0 < counts[0] < counts[1]


class Page:
    """A running node with a page, whose odometry is sent through its standard input."""

    def __init__(self, drive: Path, folder: Path) -> None:
        self.address = f"127.0.0.1:{free_port()}"
        settings = folder / "node.toml"
        settings.write_text(
            f'name = "page"\nmessages = ["-"]\npage.listen = "{self.address}"\n', encoding="utf-8"
        )
        self.site = folder / "site.toml"
        shutil.copy(drive / "site.toml", self.site)
        shutil.copy(drive / "vehicle.toml", folder)
        self.process = subprocess.Popen(
            command(folder, settings), stdin=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self.sent = 0

    def send(self, speed_mps: float) -> None:
        """Sends one odometry message with the next multiple of 20 ms."""
        self.sent += 1
        message = {"type": "odometry", "time_s": 0.02 * self.sent, "speed_mps": speed_mps}
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(message).encode() + b"\n")
        self.process.stdin.flush()

    def get(self, path: str) -> str:
        with urllib.request.urlopen(f"http://{self.address}/{path}", timeout=LONGEST_S) as answer:
            return str(answer.read().decode())

    def until(self, path: str, wanted: Callable[[Any], bool]) -> Any:
        """Reads JSON messages until one fulfils the condition."""
        end_s, content = time.monotonic() + LONGEST_S, None
        while time.monotonic() < end_s:
            try:
                content = json.loads(self.get(path))
            except OSError:  # not open yet
                time.sleep(0.05)
                continue
            if wanted(content):
                return content
            time.sleep(0.05)
        raise AssertionError(f"{path} does not fulfil the condition: {content}")


@pytest.fixture
def page(drive: Path, tmp_path: Path) -> Iterator[Page]:
    page = Page(drive, tmp_path)
    yield page
    page.process.terminate()
    page.process.communicate(timeout=20.0)


def test_the_page_and_the_metrics_contain_active_faults(page: Page) -> None:
    page.until("state.json", lambda _: True)
    for _ in range(10):
        page.send(2.0)
    state = page.until("state.json", lambda it: "pose" in it)
    assert state["pose"]["faults"] == []
    # No tyre stops a vehicle within 20 ms.
    page.send(0.0)
    state = page.until("state.json", lambda it: bool(it["pose"]["faults"]))
    (fault,) = state["pose"]["faults"]
    assert fault["fault"] == "odometry_frozen"
    assert "frozen" in fault["description"]
    assert fault["since_s"] == pytest.approx(0.02 * page.sent)
    (line,) = [it for it in page.get("metrics").splitlines() if it.startswith("access_av_fault{")]
    assert 'fault="odometry_frozen"' in line
    assert float(line.split()[-1]) == 1.0
    # The page itself displays this list.
    assert "pose.faults.map" in page.get("")


def test_the_page_shows_the_site_that_was_loaded_again(page: Page) -> None:
    site = page.until("site.json", lambda _: True)
    number = page.until("state.json", lambda _: True)["site_number"]
    assert site["number"] == number
    x_m, y_m = (site["heads"][0][key] for key in ("x_m", "y_m"))
    moved = access_av.Site.load(str(page.site)).with_overrides(
        {"radio_heads[0].position_m": [x_m + 1.5, y_m, 5.0]}
    )
    page.site.write_text(moved.to_toml(), encoding="utf-8")
    os.kill(page.process.pid, signal.SIGHUP)
    state = page.until("state.json", lambda it: it["site_number"] != number)
    again = json.loads(page.get("site.json"))
    assert again["number"] == state["site_number"] == number + 1
    assert again["heads"][0]["x_m"] == pytest.approx(x_m + 1.5)
