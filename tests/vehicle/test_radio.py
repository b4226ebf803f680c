"""`access-av-node` with a radio that SoapySDR drives: `make test-radio` builds and runs it."""

from __future__ import annotations

import json
import subprocess
import sys
import time
import urllib.request
from typing import TYPE_CHECKING

import pytest

import access_av
from conftest import ROOT
from node import NODE, command, wake_up_every

sys.path.insert(0, str(ROOT / "examples/live"))
from transmitter import settings_of

from radio import Radio

if TYPE_CHECKING:
    from pathlib import Path

DURATION_S = 8.0
INTERVAL_S = 0.5


def can_soapy(settings: Path, options: list[str]) -> bool:
    """Returns whether the node was built with the feature `soapy`."""
    done = subprocess.run([NODE, *options, "--dry-run", settings], capture_output=True, text=True)
    return "without the feature" not in done.stderr


@pytest.mark.skipif(not NODE.exists(), reason=f"no {NODE}: `make test-radio` makes it")
def test_a_radio_is_switched_on_only_for_bursts(tmp_path: Path) -> None:
    settings = tmp_path / "node.toml"
    drive = tmp_path / "drive"
    nominal = ["--site", "yard", "--vehicle", "carrier"]
    stub = (
        'name = "radio"\nmessages = ["-"]\n[samples]\nsource = "soapy"\ndevice = "driver=replay"\n'
    )
    stub += "[samples.stream]\nrate_msps = 3.84\ncentre_mhz = 3500.0\nantennas = [0, 1, 2, 3]\n"
    settings.write_text(stub, encoding="utf-8")
    if not can_soapy(settings, nominal):
        pytest.skip(f"{NODE} is built without the feature `soapy`; `make test-radio` builds it")
    access_av.synthesize("yard", drive, duration_s=DURATION_S, continuous=True)
    wake_up_every(drive, INTERVAL_S)
    radio = Radio(drive, tmp_path)
    configuration = settings_of(radio.samples, radio.odometry, "127.0.0.1:0")
    settings.write_text(configuration + f'[output.json]\naddress = "{tmp_path}/node.jsonl"\n')
    node = subprocess.Popen(command(drive, settings), stderr=subprocess.PIPE, text=True)
    assert node.stderr is not None
    page = node.stderr.readline().split()[-1].rstrip("/")
    radio.run()
    time.sleep(0.1)
    with urllib.request.urlopen(f"{page}/state.json") as answer:
        state = json.load(answer)
    node.terminate()
    _, said = node.communicate(timeout=10.0)
    radio.close()
    assert node.returncode == 0, said
    records = [json.loads(line) for line in (tmp_path / "node.jsonl").read_text().splitlines()]

    # Each radio head was found by the search at the start, then at its expected time by the radio's
    # clock.
    assert state["found_by_search"] == 4
    assert all(head["accepted"] >= 8 for head in state["heads"]), state["heads"]
    assert state["dropped"] == {"blocks": 0, "messages": 0, "records": 0}
    # After the search, the radio is on before each burst and off after it.
    sleeping = [it for it in radio.on() if it[0] > 2.0]
    on_s = sum(ended - began for began, ended in sleeping)
    assert len(sleeping) >= (DURATION_S - 2.0) / INTERVAL_S - 2
    assert on_s < 0.2 * (DURATION_S - 2.0), sleeping
    # A radio that is off is not silent.
    assert not [it for it in records if "no data has arrived" in it.get("text", "")]
    # The odometry is of this computer's clock, and so are the samples.
    last = [it for it in records if it["type"] == "pose" and it["by"] == "odometry"][-1]
    truth = [float(it) for it in (drive / "truth.tum").read_text().splitlines()[-1].split()]
    error_m = ((last["x_m"] - truth[1]) ** 2 + (last["y_m"] - truth[2]) ** 2) ** 0.5
    assert error_m < last["protection_level_m"], last
