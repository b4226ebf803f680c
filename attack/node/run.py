"""One run: a node drives through a fault, and everything that it reports is recorded."""

from __future__ import annotations

import json
import os
import time
import zlib
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from attack.node import environment, odometry, transmitter
from attack.node.fault import Context, Fault, Window
from attack.node.message import Message, merged
from attack.node.node import Client, Node, Resources, free_port, main_program
from attack.node.recorder import Arrival, Recorder

if TYPE_CHECKING:
    from collections.abc import Callable

# Drive time after a fault (s): recovery is required within 5 s.
AFTER_S = 7.0
# Time from the start of the process to drive time 0 (s): sockets are open by then.
SETTLE_S = 1.0
# Period of MQTT messages (s).
MQTT_PERIOD_S = 0.1


class HasPose(Protocol):
    """True motion."""

    def pose(self, time_s: float) -> environment.Pose:
        """Pose at a drive time (s)."""


@dataclass
class Recorded:
    """Everything that is known after a run. All times are Unix times in seconds."""

    fault: Fault
    motion: HasPose
    epoch_s: float
    window: Window
    ended_s: float
    arrivals: list[Arrival]
    exits: list[int]
    is_hung: bool
    resources: list[Resources | None]
    errors: str
    # Maximum delay of a message against its time of sending, and of a received item (s).
    lateness_s: float
    # Times at which the sink under test was found working again.
    # Folder of the run.
    folder: Path = Path()
    sink_works_s: list[float] = field(default_factory=list)


class Run:
    """One repetition of a fault."""

    def __init__(
        self, fault: Fault, seed: int, repetition: int, folder: Path, before_s: float
    ) -> None:
        self.fault, self.folder = fault, folder
        folder.mkdir(parents=True)
        named = zlib.crc32(fault.name.encode())
        self.random = np.random.default_rng([seed, named, repetition])
        begin_s = before_s + fault.further_s + float(self.random.uniform(0.0, fault.spread_s))
        self.window = Window(begin_s, begin_s + fault.lasts_s)
        self.duration_s = self.window.end_s + AFTER_S
        stop_s = (begin_s, self.window.end_s) if fault.stands else None
        self.motion = environment.Motion.draw(self.random, stop_s)
        if fault.starts_at_m is not None:
            self.motion = replace(self.motion, start_m=fault.starts_at_m)
        self.messages = self._messages()
        self.ports = {name: free_port() for name in ("messages", "json", "page")}
        fifo = folder / "json.fifo" if "fifo" in fault.outputs else None
        self.recorder = Recorder(self.ports["json"], self.ports["page"], fifo)
        self.node = Node(folder, self._command(), small_disk="disk" in fault.outputs)
        self.client = Client(self.ports["messages"])
        self.sink_works_s: list[float] = []
        self.lateness_s = 0.0

    def _messages(self) -> list[Message]:
        made = merged(
            odometry.messages(self.motion, self.duration_s, self.random),
            transmitter.messages(self.motion, self.duration_s, self.random),
        )
        if self.fault.change is None:
            return made
        context = Context(self.window, self.motion, self.duration_s, self.random)
        return merged(self.fault.change(made, context))

    def _command(self) -> list[str]:
        outputs, disk = self.fault.outputs, self.folder / "disk"
        for name, text in (
            ("site.toml", environment.site_toml()),
            ("vehicle.toml", environment.vehicle_toml(self.motion, self.random)),
        ):
            (self.folder / name).write_text(text, encoding="utf-8")
        json_address = f"tcp-listen://127.0.0.1:{self.ports['json']}"
        if "fifo" in outputs:
            json_address = str(self.folder / "json.fifo")
            os.mkfifo(json_address)
        settings = f"""\
name = "campaign"
messages = ["tcp-listen://127.0.0.1:{self.ports["messages"]}"]
state_file = "{self.folder}/state.json"
page.listen = "127.0.0.1:{self.ports["page"]}"
[output]
{f'tum = "{disk}/poses.tum"' if "tum" in outputs else ""}
json.address = "{json_address}"
{f'mcap = {{ folder = "{disk}/log", pose_hz = 50.0 }}' if "mcap" in outputs else ""}
[output.mqtt]
host = "127.0.0.1"
port = {self.recorder.broker.port}
topic = "fleet/position"
map_id = "campaign"
rate_hz = {1.0 / MQTT_PERIOD_S}
"""
        (self.folder / "node.toml").write_text(settings, encoding="utf-8")
        files = [str(self.folder / name) for name in ("site.toml", "vehicle.toml", "node.toml")]
        return [*main_program(), "--site", files[0], "--vehicle", files[1], files[2]]

    def execute(self) -> Recorded:
        """Drives in real time; takes as long as the drive."""
        self.recorder.start()
        resources: list[Resources | None] = []
        try:
            self.node.start()
            epoch_s = time.time() + SETTLE_S
            actions: list[tuple[float, Callable[[], object]]] = [
                (self.window.begin_s - 0.5, lambda: resources.append(self.node.resources())),
            ]
            if self.fault.begin is not None:
                begin = self.fault.begin
                actions.append((self.window.begin_s, lambda: begin(self)))
            if self.fault.end is not None:
                end = self.fault.end
                actions.append((self.window.end_s, lambda: end(self)))
            self._send(epoch_s, actions)
            resources.append(self.node.resources())
            ended_s = time.time()
        finally:
            self.node.end()
            self.client.close()
            self.recorder.stop()
        self._keep(epoch_s)
        return Recorded(
            fault=self.fault,
            motion=self.motion,
            epoch_s=epoch_s,
            window=self.window,
            ended_s=ended_s,
            # The end of the process is not part of the run.
            arrivals=[it for it in self.recorder.arrivals if it.at_s <= ended_s],
            exits=self.node.unexpected_exits,
            is_hung=self.node.is_hung,
            resources=resources,
            errors=self.node.errors(),
            lateness_s=max(self.lateness_s, self.recorder.pause_s),
            folder=self.folder,
            sink_works_s=self.sink_works_s,
        )

    def _keep(self, epoch_s: float) -> None:
        """Writes all arrivals to a file of the folder, with drive time instead of Unix time."""
        with (self.folder / "arrivals.jsonl").open("w", encoding="utf-8") as file:
            for at_s, output, content in self.recorder.arrivals:
                if output != "page":
                    item = {"at_s": round(at_s - epoch_s, 3), "output": output, **content}
                    file.write(json.dumps(item) + "\n")

    def _send(self, epoch_s: float, actions: list[tuple[float, Callable[[], object]]]) -> None:
        """Sends every message at its time, and runs every action at its own."""
        number, looked_s = 0, 0.0
        while number < len(self.messages) or actions:
            is_last = number >= len(self.messages)
            next_s = self.duration_s if is_last else self.messages[number].send_s
            if actions and actions[0][0] <= next_s:
                time_s, action = actions.pop(0)
                time.sleep(max(0.0, epoch_s + time_s - time.time()))
                action()
                continue
            if is_last:
                break
            time.sleep(max(0.0, epoch_s + next_s - time.time()))
            due = bytearray()
            while number < len(self.messages) and self.messages[number].send_s <= next_s + 1e-3:
                due += self.messages[number].encode(epoch_s)
                number += 1
            late_s = time.time() - epoch_s - next_s
            self.lateness_s = max(self.lateness_s, late_s)
            self.client.send(bytes(due))
            if next_s - looked_s > 0.1:
                looked_s = next_s
                self.look()
        time.sleep(max(0.0, epoch_s + self.duration_s - time.time()))

    def look(self) -> None:
        """Records whether the process and the sink under test still work."""
        if not self.fault.stops_node:
            self.node.watch()
            if self.node.process is None:
                # A supervisor starts the node again.
                self.node.start()
        if self.fault.sink in ("mcap", "tum"):
            self._look_at_disk()

    def _look_at_disk(self) -> None:
        try:
            place = self.node.disk_path()
            files = [it for it in place.rglob("*") if it.suffix == f".{self.fault.sink}"]
            newest = max((it.stat().st_mtime for it in files), default=0.0)
        except (OSError, AssertionError):
            return
        if newest > 0.0 and (not self.sink_works_s or newest > self.sink_works_s[-1]):
            self.sink_works_s.append(newest)
