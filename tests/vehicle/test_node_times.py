"""Faults of input, clocks and process on the running node: reported, and the pose resumed."""

from __future__ import annotations

import json
import math
import signal
import socket
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from attack.node.node import free_port

import access_av
from access_av.drives.recorded import log_angles
from conftest import ROOT
from node import NODE, command, wake_up_every

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

sys.path.insert(0, str(ROOT / "examples/live"))
from day import messages_of

DURATION_S = 20.0
# 99.9 % quantile of χ² with 2 degrees of freedom.
LARGEST_NEES = 13.8
# Maximum time by which a message may arrive before the time of the drive, in seconds.
EARLY_S = 0.05

pytestmark = pytest.mark.skipif(
    not NODE.exists(), reason=f"no {NODE}: `cargo build -p access-av-node` makes it"
)

Message = dict[str, Any]


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    one_clock = {"vehicle.receiver.angle_time_offset_std_s": 0.0}
    scenario = access_av.Scenario.load("yard").with_overrides(one_clock)
    log_angles(scenario, folder, duration_s=DURATION_S)
    wake_up_every(folder, 0.02)
    return folder


class Run:
    """Sends a drive to a node in real time, and compares its poses with the truth."""

    def __init__(self, drive: Path, folder: Path) -> None:
        self.drive, self.folder = drive, folder
        self.port = free_port()
        self.settings = folder / "node.toml"
        self.settings.write_text(
            f'name = "faults"\nmessages = ["tcp-listen://127.0.0.1:{self.port}"]\n'
            f'state_file = "state.json"\n[output.json]\naddress = "-"\n',
            encoding="utf-8",
        )
        self.messages = [(float(it["time_s"]), it) for it in messages_of(drive)]
        self.truth = np.loadtxt(drive / "truth.tum")
        self.records: list[tuple[float, Message]] = []
        # Differences between odometry time stamp and drive time that were sent.
        self.offsets_s = {0.0}
        self.began_s = 0.0
        self.peer: socket.socket | None = None
        self.start()

    def start(self) -> None:
        """Starts the node and connects to it."""
        if self.peer is not None:
            self.peer.close()
        self.node = subprocess.Popen(
            command(self.drive, self.settings), stdout=subprocess.PIPE, text=True
        )
        self.reading = threading.Thread(target=self.read, args=[self.node])
        self.reading.start()
        for _ in range(200):
            try:
                self.peer = socket.create_connection(("127.0.0.1", self.port))
                break
            except ConnectionRefusedError:
                time.sleep(0.05)

    def read(self, node: subprocess.Popen[str]) -> None:
        """Reads the output of the node, with the time of the drive."""
        assert node.stdout is not None
        with node.stdout:
            for line in node.stdout:
                self.records.append((time.monotonic() - self.began_s, json.loads(line)))

    def send(
        self,
        until_s: float,
        change: Callable[[Message], Iterator[Message]] = lambda it: iter([it]),
    ) -> None:
        """Sends the drive in real time up to the given time."""
        if self.began_s == 0.0:
            self.began_s = time.monotonic() - self.messages[0][0]
        while self.messages and self.messages[0][0] <= until_s:
            time_s, rest = self.messages.pop(0)
            time.sleep(max(0.0, self.began_s + time_s - time.monotonic()))
            for message in change({**rest, "time_s": time_s}):
                assert self.peer is not None
                if message["type"] == "odometry":
                    self.offsets_s.add(round(message["time_s"] - time_s, 3))
                self.peer.sendall(json.dumps(message).encode() + b"\n")

    def pause(self, until_s: float) -> None:
        """Continues the drive without messages."""
        self.messages = [it for it in self.messages if it[0] > until_s]
        time.sleep(max(0.0, self.began_s + until_s - time.monotonic()))

    def end(self) -> None:
        """Ends the node."""
        self.node.terminate()
        assert self.node.wait(10.0) == 0
        self.reading.join(10.0)

    def events(self, source: str, since_s: float = 0.0) -> list[str]:
        """Texts of a source's events."""
        return [
            it["text"]
            for at_s, it in self.records
            if it["type"] == "event" and it["source"] == source and at_s >= since_s
        ]

    def poses(self, since_s: float, until_s: float = math.inf) -> list[tuple[float, Message]]:
        """Poses between two times of the drive, with their error in metres.

        The error is that at the time of the pose, however late a busy computer reports it: with
        several clocks, the latest time of the drive before the arrival that has this time stamp.
        """
        found = []
        for at_s, it in self.records:
            if it["type"] == "pose" and it.get("x_m") is not None and since_s <= at_s < until_s:
                times_s = [it["time_s"] - offset_s for offset_s in self.offsets_s]
                time_s = max((one for one in times_s if one <= at_s + EARLY_S), default=at_s)
                x_m, y_m = (np.interp(time_s, self.truth[:, 0], self.truth[:, k]) for k in (1, 2))
                found.append((math.hypot(it["x_m"] - x_m, it["y_m"] - y_m), it))
        return found

    def assert_truthful(self, since_s: float = 0.0) -> None:
        """No error of an `ok` pose exceeds its level, except 0.3 m that are driven during a late
        arrival."""
        wrong = [
            (error_m, it["protection_level_m"])
            for error_m, it in self.poses(since_s)
            if it["state"] == "ok" and error_m > it["protection_level_m"] + 0.3
        ]
        assert not wrong, wrong[:3]

    def assert_recovered(self, *states: str) -> None:
        """The last pose has one of these states (default: `ok`) and is correct."""
        self.assert_truthful()
        error_m, last = self.poses(0.0)[-1]
        assert last["state"] in (states or ("ok",)), (last["state"], last["reason"])
        assert error_m < last["protection_level_m"] + 0.3


@pytest.fixture
def run(drive: Path, tmp_path: Path) -> Iterator[Run]:
    made = Run(drive, tmp_path)
    yield made
    made.node.kill()
    made.node.wait()
    made.reading.join(10.0)
    assert made.peer is not None
    made.peer.close()


def test_a_killed_node_resumes_its_pose_within_its_covariance(run: Run) -> None:
    run.send(7.0)
    assert run.poses(0.0)[0][1]["state"] != "ok"
    assert run.poses(6.0)[-1][1]["state"] == "ok", run.poses(6.0)[-1]
    run.node.kill()
    run.node.wait()
    run.reading.join(10.0)
    killed_s = time.monotonic() - run.began_s
    run.start()
    run.pause(time.monotonic() - run.began_s + 0.1)
    run.send(15.0)
    time.sleep(0.3)
    run.end()
    assert any("is resumed" in it for it in run.events("state", killed_s)), run.events("state")
    first = next(it for _, it in run.poses(killed_s))
    assert first["state"] == "unavailable", first
    where = np.array([first["x_m"], first["y_m"]])
    true = [np.interp(first["time_s"], run.truth[:, 0], run.truth[:, k]) for k in (1, 2)]
    covariance = np.array(first["covariance"])[:2, :2]
    error = where - np.array(true)
    assert error @ np.linalg.solve(covariance, error) < LARGEST_NEES, (error, covariance)
    # Confirmed; a level above the alert limit is `degraded`.
    run.assert_recovered("ok", "degraded")


def test_implausible_stamps_are_rejected_and_reported(run: Run) -> None:
    run.send(6.0)
    newest: list[Message] = []

    def odd(message: Message) -> Iterator[Message]:
        if message["type"] == "odometry":
            time_s = message["time_s"]
            for wrong in (time_s + 2.0, 1e300, 1e3 * (1.7e9 + time_s)):
                yield {**message, "time_s": wrong}
            yield from newest[:1] * 3
            newest[:] = [message]
        yield message

    run.send(9.0, odd)
    run.send(10.0)
    time.sleep(0.3)
    run.end()
    texts = run.events("odometry", 6.0)
    for said in ("after its expected time", "at most 1e11", "milliseconds", "is a copy"):
        assert any(said in it for it in texts), (said, texts)
    # Repetitions of a cause are counted.
    assert len(texts) <= 3 * 6, texts
    assert not any("stepped" in it for it in texts)
    # Harmless, apart from pauses of a busy computer. At the start of the road the protection level
    # is near the alert limit.
    reasons = {it["reason"] for _, it in run.poses(6.0) if it["state"] != "ok"}
    harmless = ("no odometry for", "the protection level")
    assert all(it.startswith(harmless) for it in reasons), reasons
    run.assert_recovered()


def test_a_clock_that_steps_back_by_five_seconds_resumes_the_pose(run: Run) -> None:
    run.send(6.0)

    def behind(message: Message) -> Iterator[Message]:
        late_s = 5.0 if message["type"] == "odometry" else 0.0
        yield {**message, "time_s": message["time_s"] - late_s}

    run.send(12.0, behind)
    time.sleep(0.3)
    run.end()
    stepped = [it for it in run.events("odometry") if "the clock has stepped by -5.0" in it]
    assert len(stepped) == 1, run.events("odometry")
    # The pose is resumed with the new clock.
    first = next(it for it in run.poses(6.1) if it[1]["time_s"] < 5.0)
    assert first[0] < 1.0, first
    run.assert_recovered()


def test_clocks_that_differ_are_reported_and_the_pose_is_not_localized(run: Run) -> None:
    def ahead(message: Message) -> Iterator[Message]:
        more_s = 60.0 if message["type"] == "odometry" else 0.0
        yield {**message, "time_s": message["time_s"] + more_s}

    run.send(5.0, ahead)
    time.sleep(0.3)
    run.end()
    reports = [at_s for at_s, it in run.records if it.get("source") == "clocks"]
    assert reports, run.events("clocks")
    assert reports[0] < run.messages[0][0] - 5.0 + 2.5
    assert "60.0 s behind the odometry" in run.events("clocks")[0]
    states = {it["state"] for _, it in run.poses(0.0)}
    assert states == {"unavailable"}


def test_sighup_loads_a_good_vehicle_and_keeps_the_old_one_for_a_bad_one(
    run: Run, drive: Path
) -> None:
    file = drive / "vehicle.toml"
    before = file.read_text(encoding="utf-8")
    try:
        run.send(6.0)
        file.write_text("name = 3\n", encoding="utf-8")
        run.node.send_signal(signal.SIGHUP)
        run.send(8.0)
        bad = run.events("node", 6.0)
        assert any("vehicle.toml" in it and "name" in it and "remain active" in it for it in bad), (
            bad
        )
        assert run.poses(7.0)[-1][1]["state"] == "ok"
        wider = access_av.Vehicle.from_toml(before).with_overrides({"integrity.alert_limit_m": 9.0})
        file.write_text(wider.to_toml(), encoding="utf-8")
        run.node.send_signal(signal.SIGHUP)
        # A busy computer: the node is late for its inputs.
        run.node.send_signal(signal.SIGSTOP)
        run.send(8.8)
        run.node.send_signal(signal.SIGCONT)
        run.send(12.0)
        time.sleep(0.3)
        run.end()
    finally:
        file.write_text(before, encoding="utf-8")
    good = run.events("node", 8.0)
    assert any("were reloaded" in it for it in good), good
    run.assert_recovered()
