"""The node under test: its settings, its process and its input socket."""

from __future__ import annotations

import contextlib
import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PROGRAM = Path(os.environ.get("ACCESS_AV_NODE", ROOT / "target/debug/access-av-node"))
# Time in which the node must end after SIGTERM (s).
END_S = 5.0
# Capacity of the small disk in MiB.
DISK_MIB = 4
# Ports of the campaign: the first one, their number in each process, and the number of processes.
FIRST_PORT = 20_000
PORTS_EACH = 12
PROCESSES = 1000
_chosen = itertools.count()


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A free TCP or UDP port that no other process of the campaign chooses.

    A port that the system proposes is free only until somebody opens it: two nodes that start at
    the same time can get the same one. Each process therefore has ports of its own, below the
    ports of outgoing connections.
    """
    first = FIRST_PORT + PORTS_EACH * (os.getpid() % PROCESSES)
    for _ in range(PORTS_EACH):
        port = first + next(_chosen) % PORTS_EACH
        with socket.socket(type=kind) as probe, contextlib.suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", port))
            return port
    sys.exit(f"error: ports {first} to {first + PORTS_EACH - 1} are in use")


def has_small_disk() -> bool:
    """Whether a tmpfs can be mounted in a namespace of its own."""
    command = ["unshare", "-rm", "mount", "-t", "tmpfs", "none", "/mnt"]
    if shutil.which("unshare") is None:
        return False
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


class Resources(NamedTuple):
    """Memory and open files of a process."""

    resident_mib: float
    files: int


class Node:
    """A node process, started as often as needed with the same settings."""

    def __init__(self, folder: Path, command: list[str], *, small_disk: bool = False) -> None:
        self.folder = folder
        self.disk = folder / "disk"
        self.disk.mkdir(exist_ok=True)
        self.command = command
        if small_disk:
            mount = f'mount -t tmpfs -o size={DISK_MIB}m none "$0" && exec "$@"'
            self.command = ["unshare", "-rm", "sh", "-c", mount, str(self.disk), *command]
        self.process: subprocess.Popen[bytes] | None = None
        # Exit codes that no fault has caused.
        self.unexpected_exits: list[int] = []
        self.is_hung = False

    def start(self) -> None:
        """Starts the process."""
        with (self.folder / "stderr.txt").open("ab") as errors:
            self.process = subprocess.Popen(
                self.command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors
            )

    @property
    def pid(self) -> int:
        """Process identifier."""
        assert self.process is not None
        return self.process.pid

    def disk_path(self) -> Path:
        """Path of the small disk in the mount namespace of the node."""
        return Path(f"/proc/{self.pid}/root{self.disk}")

    def kill(self) -> None:
        """Kills the node with SIGKILL."""
        assert self.process is not None
        self.process.kill()
        self.process.wait()

    def signal(self, number: signal.Signals) -> None:
        """Sends a signal."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.pid, number)

    def watch(self) -> None:
        """Records once that the process has exited although no fault requires it."""
        if self.process is not None and self.process.poll() is not None:
            self.unexpected_exits.append(self.process.returncode)
            self.process = None

    def resources(self) -> Resources | None:
        """Memory and open files; `None` if the process is gone."""
        try:
            pages = int(Path(f"/proc/{self.pid}/statm").read_text(encoding="ascii").split()[1])
            files = sum(1 for _ in Path(f"/proc/{self.pid}/fd").iterdir())
        except (OSError, AssertionError, IndexError):
            return None
        return Resources(pages * os.sysconf("SC_PAGE_SIZE") / 2**20, files)

    def end(self) -> None:
        """Ends the node with SIGTERM; a node that does not end is killed and counts as hung."""
        self.watch()
        if self.process is None:
            return
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        try:
            code = self.process.wait(END_S)
            if code != 0:
                self.unexpected_exits.append(code)
        except subprocess.TimeoutExpired:
            self.is_hung = True
            self.kill()
        self.process = None

    def errors(self) -> str:
        """Standard error of the process."""
        return (self.folder / "stderr.txt").read_text(encoding="utf-8", errors="replace")


class Client:
    """TCP connection to the node's message input, opened again whenever it is lost."""

    # Pause between two attempts (s).
    RETRY_S = 0.05

    def __init__(self, port: int) -> None:
        self.port = port
        self.peer: socket.socket | None = None
        self._retry_s = 0.0

    def send(self, content: bytes) -> bool:
        """Sends bytes; returns `False` where there is no connection, and the bytes are lost."""
        if self.peer is None and time.monotonic() >= self._retry_s:
            self._retry_s = time.monotonic() + self.RETRY_S
            with contextlib.suppress(OSError):
                self.peer = socket.create_connection(("127.0.0.1", self.port), timeout=0.2)
        if self.peer is None:
            return False
        try:
            self.peer.sendall(content)
        except OSError:
            self.close()
            return False
        return True

    def close(self) -> None:
        """Closes the connection."""
        if self.peer is not None:
            self.peer.close()
            self.peer = None


def main_program() -> list[str]:
    """Returns the path of the program; an error names the build command if it is missing."""
    if not PROGRAM.exists():
        sys.exit(f"error: no {PROGRAM}: `cargo build -p access-av-node` makes it")
    return [str(PROGRAM)]
