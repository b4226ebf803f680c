"""Sample faults: a recorded drive whose samples are changed, played back or sent in real time.

The samples come from `access-av record synth`; the changes are made here. The line of sight is
strong (K = 20 dB, no shadowing), so that the fault-free state is always `ok`.
"""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import zmq

import access_av
from attack.node.environment import Pose
from attack.node.node import ROOT, main_program
from attack.node.recorder import Arrival

sys.path.insert(0, str(ROOT / "examples/live"))
from transmitter import Drive, odometry_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    Samples = NDArray[np.int16]
    SampleChange = Callable[["Part", np.random.Generator], None]

__all__ = ["Drive", "odometry_of"]

OVERRIDES = {
    "vehicle.receiver.angle_time_offset_std_s": 0.0,
    "vehicle.wake_up.policy": "fixed",
    "vehicle.wake_up.interval_ms": 20.0,
    "site.rician_k_db": 20.0,
    "channel.shadowing_std_db": 0.0,
}
# Duration of a recorded drive (s).
DURATION_S = 16.0
# PCI that a second radio head repeats, and the position of that radio head (m): about as far from
# the vehicle as the radio head of the site, in a direction that differs by 70°.
DUPLICATE_PCI = 12
DUPLICATE_M = (-120.0, 250.0, 7.0)
# Wavelength (m) and antenna spacing (wavelengths) of the drive.
WAVELENGTH_M = 299.792458 / 3500.0
SPACING = 0.5


class Ssb(NamedTuple):
    """SSB of a part of a recording, and the vehicle's true pose."""

    pci: int
    first: int
    count: int
    x_m: float
    y_m: float
    heading_rad: float


class Part(NamedTuple):
    """Samples `[sample, channel, I/Q]` of a part of a recording, and its SSBs."""

    samples: Samples
    ssbs: list[Ssb]


class Trajectory:
    """True motion of a recorded drive, interpolated."""

    def __init__(self, folder: Path) -> None:
        self.table = np.loadtxt(folder / "truth.tum")

    def pose(self, time_s: float) -> Pose:
        """Position at a time (s); the heading is not needed."""
        times_s = self.table[:, 0]
        x_m, y_m = (float(np.interp(time_s, times_s, self.table[:, k])) for k in (1, 2))
        return Pose(x_m, y_m, math.nan)


def record(folder: Path, duration_s: float = DURATION_S) -> Path:
    """Records the drive, unless the folder has it."""
    if not (folder / "vehicle.toml").exists():
        scenario = access_av.Scenario.load("yard").with_overrides(OVERRIDES)
        access_av.synthesize(scenario, folder, duration_s=duration_s)
    return folder


def dead_channel(part: Part, random: np.random.Generator) -> None:
    """Writes zeros to one channel."""
    part.samples[:, random.integers(part.samples.shape[1])] = 0


def noisy_channel(part: Part, random: np.random.Generator) -> None:
    """Replaces one channel by noise of the same power, as a broken cable does."""
    channel = part.samples[:, random.integers(part.samples.shape[1])]
    power = float(np.mean(channel.astype(np.float32) ** 2))
    channel[:] = np.rint(random.normal(0.0, power**0.5, channel.shape)).astype(np.int16)


def exchanged_channels(part: Part, random: np.random.Generator) -> None:
    """Exchanges two channels."""
    one, other = random.choice(part.samples.shape[1], 2, replace=False)
    part.samples[:, [one, other]] = part.samples[:, [other, one]]


def inverted_channel(part: Part, random: np.random.Generator) -> None:
    """Inverts the sign of one channel."""
    channel = part.samples[:, random.integers(part.samples.shape[1])]
    np.negative(np.maximum(channel, -32767), out=channel)


def duplicate_pci(part: Part, random: np.random.Generator) -> None:
    """Adds a second radio head that sends the SSB of another one, with the same power.

    The signal of one antenna is the transmitted signal. The second radio head adds it to every
    antenna with the phase of its distance and its direction.
    """
    ratio = 10.0 ** (random.uniform(-1.0, 1.0) / 20.0)
    for ssb in (it for it in part.ssbs if it.pci == DUPLICATE_PCI):
        offset_m = np.array(DUPLICATE_M) - (ssb.x_m, ssb.y_m, 1.8)
        distance_m = float(np.linalg.norm(offset_m))
        forward = (math.cos(ssb.heading_rad), math.sin(ssb.heading_rad), 0.0)
        along_m = SPACING * WAVELENGTH_M * float(np.dot(offset_m, forward)) / distance_m
        antennas = np.arange(part.samples.shape[1])
        turns = (along_m * antennas - distance_m) / WAVELENGTH_M
        block = part.samples[ssb.first : ssb.first + ssb.count]
        received = block[:, :, 0] + 1j * block[:, :, 1]
        received = received + ratio * np.outer(received[:, 0], np.exp(2j * np.pi * turns))
        pairs = np.stack([received.real, received.imag], axis=2)
        block[:] = np.clip(np.rint(pairs), -32768, 32767).astype(np.int16)


def _ssbs(meta: dict[str, Any], begin: int, end: int) -> list[Ssb]:
    """SSBs whose samples are within `[begin, end)`, relative to `begin`."""
    found = []
    for it in meta["annotations"]:
        first, count = it["core:sample_start"], it["core:sample_count"]
        truth = it["access_av:truth"]
        if begin <= first and first + count <= end:
            pose = (truth["x_m"], truth["y_m"], truth["heading_rad"])
            found.append(Ssb(it["nr:ssb"]["pci"], first - begin, count, *pose))
    return found


def changed(
    recorded: Path, folder: Path, window: tuple[float, float], change: Callable[[Part], None]
) -> None:
    """Writes a copy of a recording whose samples are changed within a window of drive time (s)."""
    drive = Drive(recorded)
    samples = np.array(drive.samples)
    begin_s, end_s = window
    inside = [
        (first, end)
        for (first, index), end in zip(drive.captures, drive.ends, strict=True)
        if begin_s <= index / drive.rate_hz < end_s
    ]
    meta = json.loads((recorded / "iq.sigmf-meta").read_text(encoding="utf-8"))
    if inside:
        begin, end = inside[0][0], inside[-1][1]
        change(Part(samples[begin:end], _ssbs(meta, begin, end)))
    samples.tofile(folder / "iq.sigmf-data")
    meta["global"].pop("core:sha512", None)
    (folder / "iq.sigmf-meta").write_text(json.dumps(meta), encoding="utf-8")


def played_back(recorded: Path, folder: Path) -> tuple[list[str], Path]:
    """Writes the settings of a playback; returns the node's command and its JSON file."""
    out = folder / "out.jsonl"
    (folder / "node.toml").write_text(
        f'name = "campaign"\npace = "fast"\n'
        f'samples = {{ source = "sigmf", recording = "{folder}/iq" }}\n'
        f'odometry.file = "{recorded}/odometry.csv"\noutput.json.address = "{out}"\n',
        encoding="utf-8",
    )
    files = ["--site", str(recorded / "site.toml"), "--vehicle", str(recorded / "vehicle.toml")]
    return [*main_program(), *files, str(folder / "node.toml")], out


def arrivals(out: Path) -> list[Arrival]:
    """Items of a playback: each arrives at its drive time, or at that of the item before it."""
    items, now_s = [], 0.0
    for line in out.read_text(encoding="utf-8").splitlines():
        content: dict[str, Any] = json.loads(line)
        if content.get("time_s") is not None:
            now_s = max(now_s, float(content["time_s"]))
        items.append(Arrival(now_s, "json", content))
    return items


class Stream:
    """Sends the samples of a drive in real time by ZeroMQ; blocks of a window can be withheld."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.context = zmq.Context()
        self.sockets = []
        for _ in range(drive.antennas):
            rep = self.context.socket(zmq.REP)
            rep.setsockopt(zmq.LINGER, 0)
            rep.setsockopt(zmq.RCVTIMEO, 100)
            rep.bind("tcp://127.0.0.1:*")
            self.sockets.append(rep)
        self.endpoints = [it.getsockopt_string(zmq.LAST_ENDPOINT) for it in self.sockets]
        self.stopped = threading.Event()

    def toml(self, clock: str = "") -> str:
        """`[samples]` of the node, with its default clock or a line that configures another."""
        return (
            f'[samples]\nsource = "zeromq"\nendpoints = {json.dumps(self.endpoints)}\n'
            f"[samples.stream]\nrate_msps = {self.drive.rate_hz / 1e6}\n"
            f"centre_mhz = {self.drive.centre_mhz}\n"
            f"antennas = {list(range(self.drive.antennas))}\n{clock}"
        )

    def run(self, epoch_s: float, is_withheld: Callable[[float], bool]) -> None:
        """Sends everything from Unix time `epoch_s` on (s)."""
        for sent, block in self.drive.answers():
            now_s = sent / self.drive.rate_hz
            time.sleep(max(0.0, epoch_s + now_s - time.time()))
            if is_withheld(now_s):
                continue
            for rep, samples in zip(self.sockets, block, strict=True):
                if not self._was_asked(rep):
                    return
                rep.send(samples.tobytes())

    def _was_asked(self, rep: Any) -> bool:
        while not self.stopped.is_set():
            try:
                rep.recv()
            except zmq.Again:
                continue
            return True
        return False

    def close(self) -> None:
        """Closes all sockets."""
        self.stopped.set()
        for rep in self.sockets:
            rep.close()
        self.context.term()
