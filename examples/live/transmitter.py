"""A simulated drive sent as radios and wheels would: samples by ZeroMQ, odometry by TCP.

Samples: a REP socket for each antenna, which answers every request by cf32 samples, as the drivers
of srsRAN, OCUDU and OpenAirInterface do; between the recorded bursts there is noise. Odometry:
newline JSON to whoever connects. Both run in real time from when the first samples are asked for.

    python examples/live/transmitter.py DRIVE [--port 2000] [--odometry-port 2100] [--once]

DRIVE is a folder that `access-av synth` wrote. Antenna k is at port + k.
"""

from __future__ import annotations

import argparse
import csv
import json
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
# Samples of each answer: 1 ms at 3.84 Msps, as a base station's slot.
ANSWER = 3840


class Drive:
    """Samples and odometry of a drive that was written by `access-av synth`."""

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
        with (folder / "odometry.csv").open(encoding="utf-8") as file:
            rows = csv.DictReader(file)
            self.odometry = [{key: float(row[key]) for key in row if row[key]} for row in rows]
        # Noise as it stands between two SSBs: the quieter half of the first burst tells its power.
        first = self.samples[: ends[0]].astype(np.float32) / FULL_SCALE
        power = np.sort((first**2).sum(axis=2).mean(axis=1))[: len(first) // 4].mean()
        random = np.random.default_rng(1)
        shape = (self.antennas, 1 << 18, 2)
        self.noise = (random.standard_normal(shape, np.float32) * np.sqrt(power / 2.0)).astype(
            np.float32
        )

    def answers(self) -> Iterator[tuple[int, list[NDArray[np.float32]]]]:
        """Number of samples up to each answer's end, and the samples of every antenna."""
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


class Transmitter:
    """Sends a drive, again and again or once."""

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
        self.server = socket.create_server(("127.0.0.1", odometry_port))
        self.server.settimeout(0.0)
        self.peer: socket.socket | None = None
        self.stopped = threading.Event()

    @property
    def endpoints(self) -> list[str]:
        """What the node connects to for samples, antenna by antenna."""
        return [rep.getsockopt_string(zmq.LAST_ENDPOINT) for rep in self.sockets]

    @property
    def odometry(self) -> str:
        """What the node connects to for odometry."""
        host, port = self.server.getsockname()
        return f"tcp://{host}:{port}"

    def run(self, *, speed: float = 1.0) -> None:
        """Sends the drive once, at so many times real time; slower where the computer is."""
        if not all(self._asked(rep) for rep in self.sockets):
            return
        began = time.monotonic()
        odometry = iter(self.drive.odometry)
        sample = next(odometry, None)
        for sent, block in self.drive.answers():
            now_s = sent / self.drive.rate_hz
            ahead_s = now_s / speed - (time.monotonic() - began)
            if ahead_s > 0.0:
                time.sleep(ahead_s)
            for rep, samples in zip(self.sockets, block, strict=True):
                rep.send(np.ascontiguousarray(samples))
            while sample is not None and sample["time_s"] <= now_s:
                self._send(sample)
                sample = next(odometry, None)
            if not all(self._asked(rep) for rep in self.sockets):
                return
        while sample is not None:
            self._send(sample)
            sample = next(odometry, None)

    def _asked(self, rep: zmq.Socket[bytes]) -> bool:
        while not self.stopped.is_set():
            try:
                rep.recv()
            except zmq.Again:
                continue
            return True
        return False

    def _send(self, sample: dict[str, float]) -> None:
        """Odometry to whoever has connected."""
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
        for rep in self.sockets:
            rep.close()
        self.context.term()
        if self.peer is not None:
            self.peer.close()
        self.server.close()


def node_toml(transmitter: Transmitter, page: str) -> str:
    """Settings of a node that listens to a transmitter."""
    antennas = list(range(transmitter.drive.antennas))
    return f"""\
name = "simulated"
messages = ["{transmitter.odometry}"]

[samples]
source = "zeromq"
endpoints = {json.dumps(transmitter.endpoints)}

[samples.stream]
rate_msps = {transmitter.drive.rate_hz / 1e6}
centre_mhz = {transmitter.drive.centre_mhz}
antennas = {antennas}
clock.start-time-s = 0.0

[page]
listen = "{page}"
"""


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
