"""`access-av-node` with independent peers: ZeroMQ, MQTT, MCAP, Prometheus, a browser."""

from __future__ import annotations

import csv
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np
import pytest
from attack.node.node import free_port
from mcap.reader import make_reader
from prometheus_client.parser import text_string_to_metric_families
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import access_av
import layout
from access_av.drives.recorded import log_angles
from browser import Browser
from conftest import ROOT
from node import NODE, SCHEMAS, Broker, command, wake_up_every

if TYPE_CHECKING:
    from collections.abc import Iterator

sys.path.insert(0, str(ROOT / "examples/live"))
from transmitter import Drive, Transmitter, Wheels, node_toml, odometry_of, settings_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DURATION_S = 5.0
# Chunk size of the MCAP writer: the size of a file is checked after each chunk.
CHUNK_BYTES = 768 << 10

pytestmark = pytest.mark.skipif(
    not NODE.exists(), reason=f"no {NODE}: `cargo build -p access-av-node` makes it"
)


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    # Only the evaluation of a log estimates a time offset; live operation does not.
    one_clock = {"vehicle.receiver.angle_time_offset_std_s": 0.0}
    scenario = access_av.Scenario.load("yard").with_overrides(one_clock)
    access_av.synthesize(scenario, folder, duration_s=DURATION_S)
    return folder


def lines(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def test_a_recording_played_back_gives_the_poses_of_locate(drive: Path, tmp_path: Path) -> None:
    settings = tmp_path / "node.toml"
    settings.write_text(
        f"""
        name = "playback"
        pace = "fast"
        samples = {{ source = "sigmf", recording = "{drive}/iq" }}
        odometry.file = "{drive}/odometry.csv"
        output.tum = "{tmp_path}/node.tum"
        """,
        encoding="utf-8",
    )
    done = subprocess.run(command(drive, settings), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    located = access_av.locate(
        recording=drive / "iq",
        odometry=drive / "odometry.csv",
        site=str(drive / "site.toml"),
        vehicle=str(drive / "vehicle.toml"),
    )
    located.write_tum(tmp_path / "located.tum")
    assert (tmp_path / "node.tum").read_bytes() == (tmp_path / "located.tum").read_bytes()


def played(folder: Path, messages: list[dict[str, Any]], more: str) -> None:
    """Sends messages to a node as fast as possible."""
    drive = folder / "drive.jsonl"
    drive.write_text("".join(json.dumps(it) + "\n" for it in messages), encoding="utf-8")
    settings = folder / "node.toml"
    settings.write_text(
        f'name = "day"\npace = "fast"\nmessages = ["{drive}"]\n{more}', encoding="utf-8"
    )
    done = subprocess.run(
        [str(NODE), "--site", "yard", "--vehicle", "tugger", str(settings)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("rotation", ["rotate_s = 30.0", "rotate_mb = 0.1"])
def test_the_files_of_a_day_are_complete_and_contain_all_messages(
    tmp_path: Path, rotation: str
) -> None:
    start = {"type": "set-pose", "x_m": -100.0, "y_m": 0.0, "heading_rad": 0.0}
    # A wheel speed that never repeats is the worst case for compression.
    wheels = [
        {"type": "odometry", "time_s": 0.02 * k, "speed_mps": 1.0 + 0.1 * float(np.sin(k * k))}
        for k in range(10_001)
    ]
    more = f'[output.mcap]\nfolder = "{tmp_path}/mcap"\npose_hz = 50.0\n{rotation}\n'
    played(tmp_path, [wheels[0], start, *wheels[1:]], more)
    files = sorted((tmp_path / "mcap").iterdir())
    assert len(files) >= 3
    counts: dict[str, int] = {}
    times_s: list[float] = []
    for file in files:
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            assert summary is not None
            assert summary.statistics is not None
            read = 0
            for _, channel, message in reader.iter_messages():
                counts[channel.topic] = counts.get(channel.topic, 0) + 1
                times_s.append(message.log_time * 1e-9)
                read += 1
            assert read == summary.statistics.message_count
        if rotation.startswith("rotate_mb"):
            assert file.stat().st_size < 1e5 + CHUNK_BYTES
    # Every pose, and a status a second.
    assert abs(counts["/access_av/odometry"] - 10_000) <= 1
    assert counts["/tf"] == counts["/access_av/odometry"]
    assert abs(counts["/diagnostics"] - 200) <= 2
    assert times_s == sorted(times_s)


def test_angles_recorded_by_a_node_are_played_back(tmp_path: Path) -> None:
    source = tmp_path / "source"
    log_angles("yard", source, duration_s=20.0)
    wake_up_every(source, 0.02)
    # Times of MCAP are whole nanoseconds: an angle of the same time as odometry may come before it.
    odometry = [{**it, "time_s": it["time_s"] + 0.007} for it in odometry_of(source)]
    with (source / "odometry.csv").open("w", encoding="utf-8") as file:
        writer = csv.DictWriter(file, odometry[0])
        writer.writeheader()
        writer.writerows(odometry)
    trajectories = []
    for name, angles in (("first", source / "angles.csv"), ("again", tmp_path / "first")):
        settings = tmp_path / f"{name}.toml"
        settings.write_text(
            f"""
            name = "{name}"
            pace = "fast"
            angles.file = "{angles}"
            odometry.file = "{source}/odometry.csv"
            output.tum = "{tmp_path}/{name}.tum"
            output.mcap = {{ folder = "{tmp_path}/{name}", verdict_hz = 10000.0, rotate_s = 6.0 }}
            """,
            encoding="utf-8",
        )
        done = subprocess.run(command(source, settings), capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        trajectories.append(np.loadtxt(tmp_path / f"{name}.tum"))
    assert len(list((tmp_path / "first").iterdir())) >= 3
    first, again = trajectories
    # In a nanosecond the vehicle drives a nanometre.
    assert np.abs(first - again).max() < 1e-6


def test_a_real_time_recording_is_read_only_for_requested_bursts(tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    access_av.synthesize("yard", drive, duration_s=9.0)
    wake_up_every(drive, 3.0)
    wheels, page = Wheels(odometry_of(drive)), free_port()
    settings = tmp_path / "node.toml"
    samples = f'source = "sigmf"\nrecording = "{drive}/iq"\n'
    configuration = settings_of(samples, wheels.address, f"127.0.0.1:{page}")
    settings.write_text(configuration + f'[output.json]\naddress = "{tmp_path}/node.jsonl"\n')
    node = subprocess.Popen(command(drive, settings), stderr=subprocess.PIPE, text=True)
    wheels.run()
    with urllib.request.urlopen(f"http://127.0.0.1:{page}/state.json") as answer:
        state = json.load(answer)
    node.terminate()
    _, said = node.communicate(timeout=10.0)
    wheels.close()
    assert node.returncode == 0, said
    records = lines(tmp_path / "node.jsonl")
    received = sorted({round(it["time_s"]) for it in records if it["type"] == "verdict"})
    # SSBs are found at the start, and in the only window after three seconds of sleep.
    assert received[0] == 0
    assert received[-2:] == [received[-1] - 3, received[-1]]
    later = [it for it in records if it["type"] == "verdict" and it["time_s"] > 1.0]
    assert all(it["accepted"] for it in later), later
    # Each radio head is found by the search at the start, then at its expected time.
    assert state["found_by_search"] == 4
    # A source that is switched off is not silent.
    silent = [it for it in records if "no data has arrived" in it.get("text", "")]
    assert not [it for it in silent if it["source"] == "samples" and it["time_s"] < 8.5], silent


class Live:
    """A node that receives from a transmitter, and all of its output."""

    def __init__(self, drive: Path, folder: Path) -> None:
        self.drive = drive
        self.folder = folder
        self.mqtt: list[dict[str, Any]] = []
        self.state: dict[str, Any] = {}
        self.metrics = ""
        self.page = ""
        self.widths: dict[int, list[int]] = {}
        port = free_port()
        broker = Broker()
        transmitter = Transmitter(Drive(drive))
        settings = folder / "node.toml"
        settings.write_text(
            node_toml(transmitter, f"127.0.0.1:{port}")
            + f"""
[output.json]
address = "{folder}/node.jsonl"
[output.mcap]
folder = "{folder}/mcap"
[output.mqtt]
host = "127.0.0.1"
port = {broker.port}
topic = "fleet/position"
map_id = "yard"
rate_hz = 20.0
localized_after_s = 0.5
""",
            encoding="utf-8",
        )
        node = subprocess.Popen(command(drive, settings), stderr=subprocess.PIPE, text=True)
        sending = threading.Thread(target=transmitter.run)
        sending.start()
        time.sleep(0.4 * DURATION_S)
        address = f"http://127.0.0.1:{port}"
        if CHROMIUM:
            self.browse(address)
        sending.join(60.0)
        with urllib.request.urlopen(f"{address}/metrics") as answer:
            self.metrics = answer.read().decode()
        with urllib.request.urlopen(f"{address}/state.json") as answer:
            self.state = json.load(answer)
        # Silence is named within a second.
        transmitter.close()
        time.sleep(1.5)
        node.terminate()
        _, self.said = node.communicate(timeout=10.0)
        self.exit_code = node.returncode
        self.mqtt = broker.received()
        self.records = lines(folder / "node.jsonl")

    def browse(self, address: str) -> None:
        """Text of the page, and its width and that of the window at some sizes."""
        assert CHROMIUM is not None
        with Browser(CHROMIUM, f"{address}/") as browser:
            browser.wait_for("document.querySelectorAll('#rows tr').length === 4")
            browser.wait_for("document.getElementById('link')?.textContent === 'live'")
            for width in (400, 900, 1600):
                browser.resize(width, 900, look="dark" if width == 900 else "light")
                root = "document.documentElement"
                self.widths[width] = browser.evaluate(f"[{root}.scrollWidth, {root}.clientWidth]")
            self.page = browser.text()
            assert not browser.errors


@pytest.fixture(scope="module")
def live(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Live:
    folder = tmp_path_factory.mktemp("live")
    # The default wake-up policy may skip bursts for seconds.
    copy = Path(shutil.copytree(drive, folder / "drive"))
    wake_up_every(copy, 0.3)
    return Live(copy, folder)


def test_every_radio_head_is_received_through_sockets(live: Live) -> None:
    assert live.exit_code == 0, live.said
    heads = live.state["heads"]
    assert [head["pci"] for head in heads] == [11, 12, 13, 14]
    assert all(head["accepted"] >= 3 for head in heads), heads
    # At most 0.1 s of samples wait: on a busy computer, blocks of samples are dropped.
    dropped = live.state["dropped"]
    assert (dropped["messages"], dropped["records"]) == (0, 0)
    # The samples between the bursts were not processed.
    assert live.state["duty"] < 0.5
    poses = [it for it in live.records if it["type"] == "pose" and it["by"] == "odometry"]
    # Without gap; on a busy computer, samples may be processed before the first odometry message.
    numbers = [round(it["time_s"] / 0.02) for it in poses]
    assert numbers[0] in (0, 1)
    assert numbers == list(range(numbers[0], round(DURATION_S / 0.02) + 1))
    truth = [
        [float(value) for value in line.split()]
        for line in (live.drive / "truth.tum").read_text().splitlines()
    ]
    last = poses[-1]
    _, x_m, y_m, *_ = truth[-1]
    error_m = ((last["x_m"] - x_m) ** 2 + (last["y_m"] - y_m) ** 2) ** 0.5
    assert error_m < last["protection_level_m"], last


def test_silent_sources_are_reported(live: Live) -> None:
    events = [it for it in live.records if it["type"] == "event"]
    silent = {it["source"] for it in events if it["text"].startswith("no data has arrived for")}
    assert silent == {"samples", "messages"}
    assert events[-1]["text"].endswith("ends")


def test_mcap_is_complete_and_readable_by_other_tools(live: Live) -> None:
    (file,) = (live.folder / "mcap").iterdir()
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/access_av/odometry", "/tf", "/diagnostics", "/access_av/verdicts"}
    with AnyReader([file], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        read: dict[str, list[Any]] = {}
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            read.setdefault(connection.topic, []).append(message)
    transforms = read["/tf"][-1].transforms
    frames = [(it.header.frame_id, it.child_frame_id) for it in transforms]
    assert frames == [("map", "odom"), ("odom", "base_link")]
    odometry = read["/access_av/odometry"][-1]
    assert odometry.header.frame_id == "map"
    assert odometry.twist.twist.linear.x > 0.0
    names = {status.name for message in read["/diagnostics"] for status in message.status}
    assert names == {"access_av: localizer", "access_av: input", "access_av: outputs"}


@pytest.mark.skipif(not SCHEMAS.exists(), reason=f"no {SCHEMAS} (ACCESS_AV_DATA)")
def test_the_position_is_one_of_vda_5050(live: Live) -> None:
    schema = json.loads((SCHEMAS / "state-3.0.schema").read_text(encoding="utf-8"))
    position = {
        "$ref": "#/definitions/mobileRobotPosition",
        "definitions": schema["definitions"],
    }
    assert len(live.mqtt) > 10
    validator = jsonschema.Draft7Validator(position)
    for message in live.mqtt:
        validator.validate(message)
    assert live.mqtt[0]["localized"] is False
    assert any(message["localized"] for message in live.mqtt)


def test_metrics_are_read_by_prometheus(live: Live) -> None:
    families = {it.name: it for it in text_string_to_metric_families(live.metrics)}
    assert families["access_av_ssb_to_pose_seconds"].type == "histogram"
    states = families["access_av_state"].samples
    assert sum(sample.value for sample in states) == 1.0
    accepted = families["access_av_head_accepted"].samples
    assert {sample.labels["head"] for sample in accepted} == {"gate", "hall", "dock", "store"}


def test_all_messages_match_the_schema_that_the_program_prints(live: Live) -> None:
    printed = subprocess.run(
        [str(NODE), "schema", "--outputs"], capture_output=True, text=True, check=True, timeout=30
    )
    schema = json.loads(printed.stdout)
    jsonschema.Draft202012Validator.check_schema(schema)

    def of_type(name: str) -> jsonschema.Draft202012Validator:
        return jsonschema.Draft202012Validator({**schema["$defs"][name], "$defs": schema["$defs"]})

    names = {it: f"{it.capitalize()}Message" for it in ("pose", "verdict", "status", "event")}
    validators = {kind: of_type(name) for kind, name in names.items()}
    assert {it["type"] for it in live.records} == set(validators)
    for record in live.records:
        validators[record["type"]].validate(record)
    position = of_type("MobileRobotPosition")
    for message in live.mqtt:
        position.validate(message)
    whole = jsonschema.Draft202012Validator(schema)
    for message in (live.records[0], live.records[-1], live.mqtt[0]):
        whole.validate(message)
    # A value out of range, a field that is missing and a field that is unknown are found.
    pose = next(it for it in live.records if it["type"] == "pose")
    without = {key: value for key, value in pose.items() if key != "state"}
    for wrong in ({**pose, "heading_rad": 4.0}, without, {**pose, "more": 1}):
        assert not validators["pose"].is_valid(wrong)
        assert not whole.is_valid(wrong)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_page_shows_the_drive_in_a_browser(live: Live) -> None:
    for words in ("live", "gate", "hall", "dock", "store", "Protection level", "simulated"):
        assert words.lower() in live.page.lower(), words
    for width, (page, window) in live.widths.items():
        assert page <= window == width
    source = (ROOT / "crates/node/src/web/page.html").read_bytes()
    assert len(source) <= 200_000
    # Nothing is loaded from elsewhere: the only address in it is the name of SVG.
    assert source.count(b"http") == source.count(b"http://www.w3.org/2000/svg")


@contextmanager
def driven_by_udp(drive: Path, folder: Path, page: int, broker: Broker) -> Iterator[None]:
    """A node that receives only odometry, and publishes VDA 5050 2.1 messages to a broker."""
    messages = free_port(socket.SOCK_DGRAM)
    settings = folder / "node.toml"
    settings.write_text(
        f"""
        name = "wheels alone"
        messages = ["udp://127.0.0.1:{messages}"]
        page.listen = "127.0.0.1:{page}"
        [output.mqtt]
        host = "127.0.0.1"
        port = {broker.port}
        topic = "fleet/position"
        map_id = "yard"
        vda5050 = "2.1"
        rate_hz = 20.0
        """,
        encoding="utf-8",
    )
    node = subprocess.Popen(command(drive, settings), stderr=subprocess.PIPE, text=True)
    ended = threading.Event()

    def wheels() -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            while not ended.wait(0.02):
                odometry = {"type": "odometry", "speed_mps": 1.0, "yaw_rate_radps": 0.0}
                sender.sendto(json.dumps(odometry).encode(), ("127.0.0.1", messages))

    sending = threading.Thread(target=wheels)
    sending.start()
    try:
        assert node.stderr is not None
        assert "page:" in node.stderr.readline()
        yield
    finally:
        ended.set()
        sending.join()
        node.terminate()
        _, said = node.communicate(timeout=10.0)
        assert node.returncode == 0, said


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_two_tabs_reconnect_after_a_restart(drive: Path, tmp_path: Path) -> None:
    page, broker = free_port(), Broker()
    live = "document.getElementById('link')?.textContent === 'live'"
    lost = "document.getElementById('link')?.className === 'lost'"
    assert CHROMIUM is not None
    with ExitStack() as tabs:
        with driven_by_udp(drive, tmp_path, page, broker):
            address = f"http://127.0.0.1:{page}/"
            both = [tabs.enter_context(Browser(CHROMIUM, address)) for _ in range(2)]
            for tab in both:
                tab.wait_for(live)
        for tab in both:
            tab.wait_for(lost)
            # Data that are not current are grey, and their age is shown.
            tab.wait_for("document.body.className === 'stale'")
            assert "s old" in tab.text()
            assert "No current data" in tab.text()
        with driven_by_udp(drive, tmp_path, page, broker):
            for tab in both:
                tab.wait_for(live, seconds=15.0)
                assert tab.evaluate("document.body.className") == ""
                assert not tab.errors
                if "ACCESS_AV_AXE" in os.environ:
                    assert layout.hindrances(tab) == []
    broker.received()


@pytest.mark.skipif(not SCHEMAS.exists(), reason=f"no {SCHEMAS} (ACCESS_AV_DATA)")
def test_the_position_is_one_of_vda_5050_2_1(drive: Path, tmp_path: Path) -> None:
    broker = Broker()
    with driven_by_udp(drive, tmp_path, free_port(), broker):
        time.sleep(1.5)
    positions = broker.received()
    schema = json.loads((SCHEMAS / "state-2.1.schema").read_text(encoding="utf-8"))
    # The time stamp is that of the header of a message of VDA 5050.
    position = schema["properties"]["agvPosition"]
    properties = {**position["properties"], "timestamp": schema["properties"]["timestamp"]}
    required = [*position["required"], "timestamp"]
    strict = {"properties": properties, "required": required, "additionalProperties": False}
    validator = jsonschema.Draft7Validator({**position, **strict})
    assert len(positions) > 10
    for position in positions:
        validator.validate(position)
    assert positions[0]["positionInitialized"] is False


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("rate_msps = 3.84", "rate_msps"),
        ("antennas = [0, 1, 1, 3]", "samples.stream.antennas"),
        ("antennas = [0, 1, 2]", "3 channels"),
        ('format = "ci12"', "ci12"),
        ('address = "udp://127.0.0.1:5"', "samples.address"),
        ('adress = "x"', "did you mean `address`"),
    ],
)
def test_implausible_settings_are_rejected(
    drive: Path, tmp_path: Path, change: str, said: str
) -> None:
    stream = {"rate_msps": "3.84", "centre_mhz": "3500.0", "antennas": "[0, 1, 2, 3]"}
    samples = {"address": '"tcp://127.0.0.1:5"', "format": '"ci16_le"'}
    key, value = change.split(" = ", 1)
    if key == "rate_msps":
        del stream[key]
    elif key in stream:
        stream[key] = value
    else:
        samples[key] = value
    text = 'name = "bad"\nmessages = ["-"]\n[samples]\nsource = "raw"\n'
    text += "".join(f"{key} = {value}\n" for key, value in samples.items())
    text += "[samples.stream]\n" + "".join(f"{key} = {value}\n" for key, value in stream.items())
    settings = tmp_path / "node.toml"
    settings.write_text(text, encoding="utf-8")
    done = subprocess.run(
        command(drive, settings, "--dry-run"), capture_output=True, text=True, timeout=30
    )
    assert done.returncode == 2
    assert said in done.stderr, done.stderr
    assert "panicked" not in done.stderr
