"""Transmitter of a simulated drive: samples by ZeroMQ, odometry by TCP.

Samples: each antenna has a REP socket that answers every request by cf32 samples, as the drivers of
srsRAN, OCUDU and OpenAirInterface do. Between the recorded bursts there is noise. Odometry: newline
JSON to every connected client. Both run in real time from the first request for samples.
`Wheels` sends only odometry, and `RawTransmitter` sends samples by one TCP stream.

    python examples/live/transmitter.py DRIVE [--port 2000] [--odometry-port 2100] [--once]

DRIVE is a folder that `access-av record synth` wrote. Antenna k is at port + k.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import json
import math
import socket
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import zmq

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

FULL_SCALE = 32768.0
# Samples of each answer: 1 ms at 3.84 Msps, the duration of a slot.
ANSWER = 3840


def odometry_of(folder: Path) -> list[dict[str, float]]:
    """Returns the odometry of a drive that `access-av record synth` wrote."""
    with (folder / "odometry.csv").open(encoding="utf-8") as file:
        rows = csv.DictReader(file)
        return [{key: float(row[key]) for key in row if row[key]} for row in rows]


class Drive:
    """Samples and odometry of a drive that `access-av record synth` wrote."""

    def __init__(self, folder: Path) -> None:
        metadata = json.loads((folder / "iq.sigmf-meta").read_text(encoding="utf-8"))
        self.rate_hz = float(metadata["global"]["core:sample_rate"])
        self.centre_mhz = metadata["captures"][0]["core:frequency"] / 1e6
        self.antennas = int(metadata["global"]["core:num_channels"])
        if metadata["global"]["core:datatype"] != "ci16_le":
            raise SystemExit(f"{folder}: core:datatype must be ci16_le")
        self.samples = np.memmap(folder / "iq.sigmf-data", dtype="<i2", mode="r")
        self.samples = self.samples.reshape(-1, self.antennas, 2)
        starts = [it["core:sample_start"] for it in metadata["captures"]]
        indices = [it.get("core:global_index", 0) for it in metadata["captures"]]
        self.captures = list(zip(starts, indices, strict=True))
        ends = [start for start, _ in self.captures[1:]] + [len(self.samples)]
        self.ends = ends
        self.length = self.captures[-1][1] + ends[-1] - self.captures[-1][0]
        self.odometry = odometry_of(folder)
        # Noise between two SSBs: its power is estimated from the quieter half of the first burst.
        first = self.samples[: ends[0]].astype(np.float32) / FULL_SCALE
        power = np.sort((first**2).sum(axis=2).mean(axis=1))[: len(first) // 4].mean()
        random = np.random.default_rng(1)
        shape = (self.antennas, 1 << 18, 2)
        self.noise = (random.standard_normal(shape, np.float32) * np.sqrt(power / 2.0)).astype(
            np.float32
        )

    def answers(self) -> Iterator[tuple[int, list[NDArray[np.float32]]]]:
        """Yields the sample count up to the end of each answer, and the samples per antenna."""
        sent = 0
        for (first, index), end in zip(self.captures, self.ends, strict=True):
            for start in range(sent, index, ANSWER):
                count = min(ANSWER, index - start)
                phase = (start * 7919) % (self.noise.shape[1] - ANSWER)
                yield start + count, list(self.noise[:, phase : phase + count])
            recorded = self.samples[first:end].transpose(1, 0, 2).astype(np.float32) / FULL_SCALE
            for start in range(0, end - first, ANSWER):
                part = recorded[:, start : start + ANSWER]
                sent = index + start + part.shape[1]
                yield sent, list(part)


class Wheels:
    """Sends odometry as newline JSON to every connected client."""

    def __init__(self, odometry: list[dict[str, float]], port: int = 0) -> None:
        self.odometry = odometry
        self.sent = 0
        self.server = socket.create_server(("127.0.0.1", port))
        self.server.settimeout(0.0)
        self.peer: socket.socket | None = None
        self.stopped = threading.Event()

    @property
    def address(self) -> str:
        """Address for the node's messages."""
        host, port = self.server.getsockname()
        return f"tcp://{host}:{port}"

    def send_until(self, now_s: float) -> None:
        """Sends the odometry up to a time."""
        while self.sent < len(self.odometry) and self.odometry[self.sent]["time_s"] <= now_s:
            self._send(self.odometry[self.sent])
            self.sent += 1

    def run(self, *, began_s: float | None = None) -> None:
        """Sends all odometry in real time, from the first connection on, or from a given time."""
        self.server.settimeout(0.2)
        while self.peer is None and not self.stopped.is_set():
            with contextlib.suppress(TimeoutError):
                self.peer, _ = self.server.accept()
        began = time.time() if began_s is None else began_s
        for sample in self.odometry:
            ahead_s = sample["time_s"] - (time.time() - began)
            if self.stopped.wait(max(ahead_s, 0.0)):
                return
            self.send_until(sample["time_s"])

    def _send(self, sample: dict[str, float]) -> None:
        line = json.dumps({"type": "odometry", **sample}) + "\n"
        try:
            if self.peer is None:
                self.peer, _ = self.server.accept()
            self.peer.sendall(line.encode())
        except BlockingIOError:
            pass
        except OSError:
            self.peer = None

    def stop(self) -> None:
        """Ends `run`, from another thread."""
        self.stopped.set()

    def close(self) -> None:
        """Closes all sockets."""
        self.stop()
        if self.peer is not None:
            self.peer.close()
        self.server.close()


class Transmitter:
    """Sends a drive once or repeatedly."""

    def __init__(self, drive: Drive, port: int = 0, odometry_port: int = 0) -> None:
        self.drive = drive
        self.context = zmq.Context()
        self.sockets = []
        for antenna in range(drive.antennas):
            rep = self.context.socket(zmq.REP)
            rep.setsockopt(zmq.LINGER, 0)
            rep.setsockopt(zmq.RCVTIMEO, 200)
            rep.bind(f"tcp://127.0.0.1:{port + antenna if port else '*'}")
            self.sockets.append(rep)
        self.wheels = Wheels(drive.odometry, odometry_port)
        self.stopped = threading.Event()

    @property
    def endpoints(self) -> list[str]:
        """ZeroMQ endpoints of the samples, one for each antenna."""
        return [rep.getsockopt_string(zmq.LAST_ENDPOINT) for rep in self.sockets]

    @property
    def odometry(self) -> str:
        """Address of the odometry."""
        return self.wheels.address

    def run(self, *, speed: float = 1.0) -> None:
        """Sends the drive once, at a multiple of real time; slower if the computer is too slow."""
        if not all(self._asked(rep) for rep in self.sockets):
            return
        began = time.monotonic()
        for sent, block in self.drive.answers():
            now_s = sent / self.drive.rate_hz
            ahead_s = now_s / speed - (time.monotonic() - began)
            if ahead_s > 0.0:
                time.sleep(ahead_s)
            for rep, samples in zip(self.sockets, block, strict=True):
                rep.send(np.ascontiguousarray(samples))
            self.wheels.send_until(now_s)
            if not all(self._asked(rep) for rep in self.sockets):
                return
        self.wheels.send_until(math.inf)

    def _asked(self, rep: zmq.Socket[bytes]) -> bool:
        while not self.stopped.is_set():
            try:
                rep.recv()
            except zmq.Again:
                continue
            return True
        return False

    def stop(self) -> None:
        """Ends `run`, from another thread."""
        self.stopped.set()

    def close(self) -> None:
        """Closes all sockets."""
        self.stop()
        for rep in self.sockets:
            rep.close()
        self.context.term()
        self.wheels.close()


class RawTransmitter:
    """Sends a drive by one TCP stream of 16-bit integers, at an integer multiple of its rate."""

    def __init__(self, drive: Drive, times: int) -> None:
        self.drive = drive
        self.times = times
        # The stream is prepared in advance, because resampling takes longer than the drive.
        self.parts = self._parts()
        self.wheels = Wheels(drive.odometry)
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.settimeout(0.2)
        self.stopped = threading.Event()

    @property
    def address(self) -> str:
        """Address of the samples."""
        host, port = self.server.getsockname()
        return f"tcp://{host}:{port}"

    def _parts(self) -> list[tuple[float, bytes | memoryview]]:
        """Yields the stream in parts: end time and bytes of each part."""
        noise = memoryview(self._integers(self.drive.noise[:, : 1 << 16]))
        sample_bytes = 4 * self.drive.antennas * self.times
        parts: list[tuple[float, bytes | memoryview]] = []
        before = 0
        for sent, block in self.drive.answers():
            count = sent - before
            before = sent
            is_noise = np.shares_memory(block[0], self.drive.noise)
            part = noise[: count * sample_bytes] if is_noise else self._integers(np.stack(block))
            parts.append((sent / self.drive.rate_hz, part))
        return parts

    def _integers(self, samples: NDArray[np.float32]) -> bytes:
        """Interleaved samples of all antennas, [antenna, sample, part], at the higher rate."""
        finer = samples
        if self.times > 1:
            # This import takes a second.
            from scipy.signal import resample_poly

            finer = resample_poly(samples, self.times, 1, axis=1)
        scaled = np.clip(np.rint(finer * FULL_SCALE), -FULL_SCALE, FULL_SCALE - 1)
        return scaled.astype("<i2").transpose(1, 0, 2).tobytes()

    def run(self, *, speed: float = 1.0) -> None:
        """Sends the drive once, at a multiple of real time; slower if the computer is too slow."""
        peer: socket.socket | None = None
        while peer is None and not self.stopped.is_set():
            with contextlib.suppress(TimeoutError):
                peer, _ = self.server.accept()
        began = time.monotonic()
        for now_s, part in self.parts:
            ahead_s = now_s / speed - (time.monotonic() - began)
            if ahead_s > 0.0:
                time.sleep(ahead_s)
            if peer is None or self.stopped.is_set():
                break
            try:
                peer.sendall(part)
            except OSError:
                break
            self.wheels.send_until(now_s)
        if peer is not None:
            peer.close()

    def close(self) -> None:
        """Closes all sockets."""
        self.stopped.set()
        self.server.close()
        self.wheels.close()


def settings_of(samples: str, messages: str, page: str) -> str:
    """Returns node settings with the given samples, odometry by `messages`, and a page."""
    return f"""\
name = "simulated"
messages = ["{messages}"]

[samples]
{samples}
[page]
listen = "{page}"
"""


def stream_toml(drive: Drive, times: int = 1) -> str:
    """Returns the settings of the sample stream of a drive."""
    return f"""
[samples.stream]
rate_msps = {times * drive.rate_hz / 1e6}
centre_mhz = {drive.centre_mhz}
antennas = {list(range(drive.antennas))}
clock.start-time-s = 0.0
"""


def node_toml(transmitter: Transmitter, page: str) -> str:
    """Returns the settings of a node that receives from a transmitter."""
    samples = f'source = "zeromq"\nendpoints = {json.dumps(transmitter.endpoints)}\n'
    samples += stream_toml(transmitter.drive)
    return settings_of(samples, transmitter.odometry, page)


def main() -> None:
    """Sends a drive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("drive", type=Path, metavar="DRIVE")
    parser.add_argument("--port", type=int, default=2000)
    parser.add_argument("--odometry-port", type=int, default=2100)
    parser.add_argument("--once", action="store_true")
    arguments = parser.parse_args()
    drive = Drive(arguments.drive)
    while True:
        transmitter = Transmitter(drive, arguments.port, arguments.odometry_port)
        try:
            transmitter.run()
        finally:
            transmitter.close()
        if arguments.once:
            return


if __name__ == "__main__":
    main()
