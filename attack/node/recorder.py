"""Recorder: everything that the node reports, with the time of arrival."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import threading
import time
import urllib.request
from typing import TYPE_CHECKING, Any, NamedTuple

from attack.node.broker import Broker

if TYPE_CHECKING:
    from pathlib import Path

# Pause between two reads of all sockets (s): the resolution of arrival times, and a part of the
# tolerance of the verdict. With 5 ms, the recorder needed more CPU time than the node.
PAUSE_S = 0.02
# Pause between two attempts to connect (s).
RETRY_S = 0.1
# Pause between two requests of `/state.json` (s).
PAGE_PERIOD_S = 0.25


class Arrival(NamedTuple):
    """One received item."""

    # Unix time of arrival (s).
    at_s: float
    # `json`, `mqtt` or `page`.
    output: str
    content: dict[str, Any]


class Recorder:
    """Reads newline JSON (TCP or a FIFO), MQTT and the page until it is stopped."""

    def __init__(self, json_port: int, page_port: int, fifo: Path | None = None) -> None:
        self.arrivals: list[Arrival] = []
        self.broker = Broker(lambda content: self._take("mqtt", content))
        self.json_port, self.page_port, self.fifo = json_port, page_port, fifo
        # Whether the JSON output is read.
        self.reads_json = True
        self._json_fd: int | None = None
        self._socket: socket.socket | None = None
        self._begun = b""
        self._retry_s = 0.0
        # Longest time between two reads of the sockets (s).
        self.pause_s = 0.0
        self._stopped = threading.Event()
        self._lock = threading.Lock()
        self._calls: list[str] = []
        self._threads = [threading.Thread(target=it) for it in (self._read, self._look)]

    def start(self) -> None:
        """Starts to record."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stops, and closes all sockets."""
        self._stopped.set()
        for thread in self._threads:
            thread.join()
        self._close_json()
        self.broker.kill()

    def call(self, action: str) -> None:
        """Runs `kill-broker`, `restart-broker`, `close-json` or `open-json`."""
        with self._lock:
            self._calls.append(action)

    def _take(self, output: str, content: dict[str, Any]) -> None:
        self.arrivals.append(Arrival(time.time(), output, content))

    def _read(self) -> None:
        last_s = time.monotonic()
        while not self._stopped.wait(PAUSE_S):
            self.pause_s = max(self.pause_s, time.monotonic() - last_s)
            last_s = time.monotonic()
            with self._lock:
                calls, self._calls = self._calls, []
            for call in calls:
                self._run(call)
            self.broker.poll()
            if self.reads_json:
                self._read_json()

    def _run(self, call: str) -> None:
        if call == "kill-broker":
            self.broker.kill()
        elif call == "restart-broker":
            self.broker.restart()
        elif call == "close-json":
            self.reads_json = False
            self._close_json()
        elif call == "open-json":
            self.reads_json = True

    def _read_json(self) -> None:
        if self._json_fd is None and not self._open_json():
            return
        assert self._json_fd is not None
        while True:
            try:
                received = os.read(self._json_fd, 1 << 16)
            except BlockingIOError:
                return
            except OSError:
                received = b""
            if not received:
                # A FIFO without a writer reads as its end; it stays open for the next writer.
                if self.fifo is None:
                    self._close_json()
                return
            *lines, self._begun = (self._begun + received).split(b"\n")
            for line in lines:
                try:
                    self._take("json", json.loads(line))
                except ValueError:
                    self._take("json", {"type": "malformed", "line": line.decode(errors="replace")})

    def _open_json(self) -> bool:
        if time.monotonic() < self._retry_s:
            return False
        self._retry_s = time.monotonic() + RETRY_S
        self._begun = b""
        try:
            if self.fifo is not None:
                self._json_fd = os.open(self.fifo, os.O_RDONLY | os.O_NONBLOCK)
                return True
            peer = socket.socket()
            peer.setblocking(False)
            failed = peer.connect_ex(("127.0.0.1", self.json_port))
            if failed not in (0, errno.EINPROGRESS):
                peer.close()
                return False
            self._socket, self._json_fd = peer, peer.fileno()
        except OSError:
            return False
        return True

    def _close_json(self) -> None:
        with contextlib.suppress(OSError):
            if self._socket is not None:
                self._socket.close()
            elif self._json_fd is not None:
                os.close(self._json_fd)
        self._socket, self._json_fd = None, None

    def _look(self) -> None:
        address = f"http://127.0.0.1:{self.page_port}/state.json"
        while not self._stopped.wait(PAGE_PERIOD_S):
            with (
                contextlib.suppress(OSError, ValueError),
                urllib.request.urlopen(address, timeout=1.0) as answer,
            ):
                self._take("page", json.load(answer))
