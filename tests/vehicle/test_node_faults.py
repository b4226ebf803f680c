"""Faults of the MQTT output of `access-av-node`: killed broker, killed node, clean end."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import threading
import time
from datetime import UTC, datetime
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest
from attack.node.node import free_port
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import access_av
from node import NODE, SCHEMAS, Broker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

pytestmark = pytest.mark.skipif(
    not NODE.exists(), reason=f"no {NODE}: `cargo build -p access-av-node` makes it"
)


class Driven:
    """A node with odometry in real time, a known pose and no integrity monitor."""

    def __init__(self, folder: Path, broker: Broker) -> None:
        self.json = folder / "node.jsonl"
        vehicle = access_av.Vehicle.load("tugger")
        vehicle = vehicle.with_overrides({"integrity.enabled": False})
        (folder / "vehicle.toml").write_text(vehicle.to_toml(), encoding="utf-8")
        self.port = free_port(socket.SOCK_DGRAM)
        settings = folder / "node.toml"
        settings.write_text(
            f"""
            name = "faults"
            messages = ["udp://127.0.0.1:{self.port}"]
            [output.json]
            address = "{self.json}"
            [output.mcap]
            folder = "{folder}/mcap"
            pose_hz = 50.0
            [output.mqtt]
            host = "127.0.0.1"
            port = {broker.port}
            topic = "fleet/position"
            map_id = "yard"
            rate_hz = 20.0
            localized_after_s = 0.2
            """,
            encoding="utf-8",
        )
        arguments = ["--site", "yard", "--vehicle", str(folder / "vehicle.toml"), str(settings)]
        self.node = subprocess.Popen(
            [str(NODE), *arguments], stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True
        )
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self.drive)
        self.thread.start()

    def drive(self) -> None:
        """Sends odometry at 50 Hz on a circle, and the pose as soon as the node accepts it."""
        with socket.socket(type=socket.SOCK_DGRAM) as sender:
            number = 0
            while not self.ended.wait(0.02):
                odometry = {"type": "odometry", "time_s": 0.02 * number, "speed_mps": 1.0}
                messages: list[dict[str, Any]] = [{**odometry, "yaw_rate_radps": 2.0}]
                if number == 25:
                    pose = {"x_m": 10.0, "y_m": 0.0, "heading_rad": 0.0}
                    messages.append({"type": "set-pose", **pose})
                for message in messages:
                    sender.sendto(json.dumps(message).encode(), ("127.0.0.1", self.port))
                number += 1

    def records(self) -> list[dict[str, Any]]:
        """Complete lines of the JSON output."""
        if not self.json.exists():
            return []
        text = self.json.read_text(encoding="utf-8")
        return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]

    def wait_for(self, wanted: Callable[[list[dict[str, Any]]], bool], *, limit_s: float) -> float:
        """Waits until the JSON output fulfils the condition; returns the waiting time."""
        began = time.monotonic()
        while not wanted(self.records()):
            assert time.monotonic() - began < limit_s, self.records()[-3:]
            time.sleep(0.05)
        return time.monotonic() - began

    def end(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Ends the node by a signal; returns its exit code."""
        self.node.send_signal(number)
        self.node.communicate(timeout=15.0)
        self.stop()
        return self.node.returncode

    def stop(self) -> None:
        """Ends everything."""
        self.ended.set()
        self.thread.join()
        if self.node.poll() is None:
            self.node.kill()
            self.node.communicate(timeout=10.0)


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[[Broker], Driven]]:
    started: list[Driven] = []

    def begin(broker: Broker) -> Driven:
        started.append(Driven(tmp_path, broker))
        return started[-1]

    yield begin
    for driven in started:
        driven.stop()


def events(records: list[dict[str, Any]], level: str) -> list[dict[str, Any]]:
    """Events of the MQTT output."""
    return [it for it in records if it.get("source") == "mqtt" and it["level"] == level]


def valid(messages: list[dict[str, Any]]) -> None:
    """Every message is a position of VDA 5050 3.0 with the present time."""
    for message in messages:
        written = datetime.fromisoformat(message["timestamp"])
        assert abs((datetime.now(UTC) - written).total_seconds()) < 60.0
        assert abs(message["theta"]) <= 3.14159265359
    if SCHEMAS.exists():
        schema = json.loads((SCHEMAS / "state-3.0.schema").read_text(encoding="utf-8"))
        position = {"$ref": "#/definitions/mobileRobotPosition", **schema}
        validator = jsonschema.Draft7Validator(position["definitions"]["mobileRobotPosition"])
        for message in messages:
            validator.validate(message)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_broker_publishes_not_localized_after_the_node_has_ended(
    start: Callable[[Broker], Driven], number: signal.Signals
) -> None:
    broker = Broker()
    driven = start(broker)
    # More than half a turn on the circle: headings are wrapped.
    driven.wait_for(lambda it: sum(r["type"] == "pose" for r in it) > 200, limit_s=30.0)
    assert driven.end(number) == (0 if number == signal.SIGTERM else -signal.SIGKILL)
    time.sleep(1.0)
    retained = broker.retained()
    messages = broker.received()
    assert any(it["localized"] for it in messages[:-1])
    assert max(it["theta"] for it in messages) > 2.5
    assert min(it["theta"] for it in messages) < -2.5
    assert messages[-1]["localized"] is False
    assert retained is not None
    assert retained["localized"] is False
    assert retained["mapId"] == "yard"
    valid([*messages, retained])


def test_every_mcap_reader_reads_the_file_of_a_killed_node(
    start: Callable[[Broker], Driven], tmp_path: Path
) -> None:
    broker = Broker()
    driven = start(broker)
    driven.wait_for(lambda it: sum(r["type"] == "pose" for r in it) > 200, limit_s=30.0)
    driven.end(signal.SIGKILL)
    broker.kill()
    last_s = max(it["time_s"] for it in driven.records() if it["type"] == "pose")
    (file,) = (tmp_path / "mcap").iterdir()
    with file.open("rb") as stream:
        messages = [it for _, _, it in make_reader(stream, validate_crcs=True).iter_messages()]
    assert messages[-1].log_time * 1e-9 > last_s - 2.0
    with AnyReader([file], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        assert reader.message_count == len(messages) > 200


def test_a_pipeline_without_records_is_not_localized(tmp_path: Path) -> None:
    """The time without a record is a gap in a recording that is played in real time."""
    broker = Broker()
    known = {"integrity.enabled": False, "start.pose": {"x_m": 0.0, "y_m": 0.0, "heading_rad": 0.0}}
    vehicle = access_av.Vehicle.load("tugger").with_overrides(known)
    (tmp_path / "vehicle.toml").write_text(vehicle.to_toml(), encoding="utf-8")
    times_s = [0.02 * it for it in (*range(150), *range(400, 402))]
    rows = [f"{it:.2f},{it:.2f},1.0,0.0" for it in times_s]
    columns = "time_s,distance_m,speed_mps,yaw_rate_radps"
    (tmp_path / "odometry.csv").write_text("\n".join([columns, *rows]), encoding="utf-8")
    angles = "time_s,pci,phase_rad,phase_sigma_rad\n100.0,11,0.1,0.1\n"
    (tmp_path / "angles.csv").write_text(angles, encoding="utf-8")
    settings = tmp_path / "node.toml"
    settings.write_text(
        f"""
        name = "gap"
        odometry.file = "{tmp_path}/odometry.csv"
        angles.file = "{tmp_path}/angles.csv"
        output.mqtt = {{ host = "127.0.0.1", port = {broker.port}, topic = "fleet/position",
          map_id = "yard", rate_hz = 10.0, localized_after_s = 0.2 }}
        """,
        encoding="utf-8",
    )
    arguments = ["--site", "yard", "--vehicle", str(tmp_path / "vehicle.toml"), str(settings)]
    node = subprocess.Popen([str(NODE), *arguments], stderr=subprocess.DEVNULL)
    time.sleep(6.5)
    node.terminate()
    node.wait(timeout=10.0)
    messages = broker.received()
    times = [datetime.fromisoformat(it["timestamp"]).timestamp() for it in messages]
    last = max(k for k, it in enumerate(messages) if it["localized"])
    assert last > 10
    # Published during the gap, long before the message of the clean end.
    assert 1.4 < times[last + 1] - times[last] < 2.5


def test_a_killed_broker_is_reported_and_connected_again(
    start: Callable[[Broker], Driven],
) -> None:
    broker = Broker()
    driven = start(broker)
    driven.wait_for(lambda it: sum(r["type"] == "pose" for r in it) > 50, limit_s=30.0)
    broker.kill()
    # Required is a report within 2 s; the rest is for a loaded computer.
    driven.wait_for(lambda it: len(events(it, "warn")) == 1, limit_s=4.0)
    time.sleep(3.0)
    again = Broker(broker.port)
    driven.wait_for(lambda it: len(events(it, "info")) == 1, limit_s=5.0)
    time.sleep(1.0)
    assert driven.end() == 0
    messages = again.received()
    assert len(messages) > 5
    assert messages[-1]["localized"] is False
    valid(messages)
    records = driven.records()
    poses = [it["time_s"] for it in records if it["type"] == "pose" and it["by"] == "odometry"]
    steps = [later - earlier for earlier, later in pairwise(poses)]
    assert max(steps) < 0.03, "a gap in the JSON output"
    assert len(events(records, "warn")) == len(events(records, "info")) == 1
    outputs = [{it["name"]: it for it in r["outputs"]} for r in records if r["type"] == "status"]
    assert any(not it["mqtt"]["ok"] and it["mqtt"]["failed_for_s"] > 1.0 for it in outputs)
    assert all(it["json"]["ok"] for it in outputs)
    assert outputs[-1]["mqtt"]["ok"]
    assert outputs[-1]["mqtt"]["failures"] == 1
