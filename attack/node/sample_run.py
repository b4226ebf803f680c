"""Runs whose node processes samples: a changed recording played back, or a real-time stream."""

from __future__ import annotations

import shutil
import subprocess
import threading
import time
import zlib
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import access_av
from attack.node import samples
from attack.node.fault import Fault, Window
from attack.node.message import Message
from attack.node.node import Client, Node, Resources, free_port, main_program
from attack.node.recorder import Recorder
from attack.node.run import MQTT_PERIOD_S, Recorded

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from attack.node.recorder import Arrival

# Drive time before a fault (s); a random part of 1 s is added. The SSBs are found by then.
BEFORE_S = 4.0
# Time from the start of the process to drive time 0 of a stream (s).
SETTLE_S = 1.0
# Time in which a playback must end (s).
PLAYBACK_S = 120.0
# Wake-up policy of a stream: that of `tugger`, so that the receiver sleeps between bursts.
SLEEPING = {
    "wake_up.policy": "uncertainty",
    "wake_up.target_error_m": 0.3,
    "wake_up.confidence": 0.9,
}


def _drawn(fault: Fault, seed: int, repetition: int) -> tuple[np.random.Generator, Window]:
    random = np.random.default_rng([seed, zlib.crc32(fault.name.encode()), repetition])
    begin_s = BEFORE_S + float(random.uniform(0.0, 1.0))
    return random, Window(begin_s, begin_s + fault.lasts_s)


def play(fault: Fault, seed: int, repetition: int, folder: Path, recorded: Path) -> Recorded:
    """Plays a recording with changed samples; all times are drive times."""
    change = fault.samples
    assert change is not None
    random, window = _drawn(fault, seed, repetition)
    folder.mkdir(parents=True)
    samples.changed(recorded, folder, window, lambda part: change(part, random))
    command, out = samples.played_back(recorded, folder)
    exits, is_hung, errors = [], False, ""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PLAYBACK_S, check=False
        )
        errors = done.stderr
        if done.returncode:
            exits.append(done.returncode)
    except subprocess.TimeoutExpired:
        is_hung = True
    (folder / "iq.sigmf-data").unlink()
    return Recorded(
        fault=fault,
        motion=samples.Trajectory(recorded),
        epoch_s=0.0,
        window=window,
        ended_s=samples.DURATION_S,
        arrivals=samples.arrivals(out) if out.exists() else [],
        exits=exits,
        is_hung=is_hung,
        resources=[],
        errors=errors,
        lateness_s=0.0,
    )


class Transmission(NamedTuple):
    """Result of samples and odometry that were sent in real time; times are Unix times (s)."""

    epoch_s: float
    ended_s: float
    arrivals: list[Arrival]
    node: Node
    resources: list[Resources | None]
    lateness_s: float


def transmit(
    folder: Path,
    recorded: Path,
    is_withheld: Callable[[float], bool],
    begin_s: float,
    settings: str = "",
    *,
    counts_samples: bool = False,
) -> Transmission:
    """Sends a drive, without the samples at the drive times of `is_withheld`.

    The resources of the process are measured before `begin_s` (drive time) and at the end.
    `settings` are further top-level keys of the node's file. With `counts_samples`, the node's
    clock counts samples from 0, and so do the times of the odometry.
    """
    folder.mkdir(parents=True)
    ports = {name: free_port() for name in ("messages", "json", "page")}
    recorder = Recorder(ports["json"], ports["page"])
    sender = samples.Stream(samples.Drive(recorded))
    for name in ("site.toml", "vehicle.toml"):
        shutil.copy(recorded / name, folder)
    sleeping = access_av.Vehicle.load(str(folder / "vehicle.toml")).with_overrides(SLEEPING)
    (folder / "vehicle.toml").write_text(sleeping.to_toml(), encoding="utf-8")
    clock = "clock.start-time-s = 0.0\n" if counts_samples else ""
    text = f"""\
name = "campaign"
messages = ["tcp-listen://127.0.0.1:{ports["messages"]}"]
page.listen = "127.0.0.1:{ports["page"]}"
{settings}
{sender.toml(clock)}
[output]
json.address = "tcp-listen://127.0.0.1:{ports["json"]}"
[output.mqtt]
host = "127.0.0.1"
port = {recorder.broker.port}
topic = "fleet/position"
map_id = "campaign"
rate_hz = {1.0 / MQTT_PERIOD_S}
"""
    (folder / "node.toml").write_text(text, encoding="utf-8")
    files = [str(folder / name) for name in ("site.toml", "vehicle.toml", "node.toml")]
    command = [*main_program(), "--site", files[0], "--vehicle", files[1], files[2]]
    node, client = Node(folder, command), Client(ports["messages"])
    recorder.start()
    resources: list[Resources | None] = []
    lateness_s = 0.0
    epoch_s = time.time() + SETTLE_S
    origin_s = 0.0 if counts_samples else epoch_s
    sending = threading.Thread(target=sender.run, args=(epoch_s, is_withheld))
    try:
        node.start()
        sending.start()
        for sample in samples.odometry_of(recorded):
            message = Message(sample["time_s"], {"type": "odometry", **sample})
            time.sleep(max(0.0, epoch_s + message.send_s - time.time()))
            lateness_s = max(lateness_s, time.time() - epoch_s - message.send_s)
            client.send(message.encode(origin_s))
            if not resources and message.send_s > begin_s - 0.5:
                resources.append(node.resources())
            node.watch()
        resources.append(node.resources())
        ended_s = time.time()
    finally:
        node.end()
        client.close()
        sender.stopped.set()
        sending.join()
        sender.close()
        recorder.stop()
    arrivals = [it for it in recorder.arrivals if it.at_s <= ended_s]
    lateness_s = max(lateness_s, recorder.pause_s)
    return Transmission(epoch_s, ended_s, arrivals, node, resources, lateness_s)


def stream(fault: Fault, seed: int, repetition: int, folder: Path, recorded: Path) -> Recorded:
    """Sends samples and odometry in real time; the samples of the fault are withheld."""
    withheld = fault.withheld
    assert withheld is not None
    _, window = _drawn(fault, seed, repetition)

    def is_withheld(now_s: float) -> bool:
        return now_s in window and withheld(now_s - window.begin_s)

    sent = transmit(folder, recorded, is_withheld, window.begin_s)
    return Recorded(
        fault=fault,
        motion=samples.Trajectory(recorded),
        epoch_s=sent.epoch_s,
        window=window,
        ended_s=sent.ended_s,
        arrivals=sent.arrivals,
        exits=sent.node.unexpected_exits,
        is_hung=sent.node.is_hung,
        resources=sent.resources,
        errors=sent.node.errors(),
        lateness_s=sent.lateness_s,
    )


def execute(fault: Fault, seed: int, repetition: int, folder: Path, recorded: Path) -> Recorded:
    """Runs a fault of samples; `recorded` is a folder of `samples.record`."""
    run = play if fault.samples is not None else stream
    return run(fault, seed, repetition, folder, recorded)
