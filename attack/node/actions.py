"""Faults of processes, files and connections: actions at the begin or the end of a fault."""

from __future__ import annotations

import contextlib
import shutil
import signal
import socket
from typing import TYPE_CHECKING

from attack.node.environment import HEADS

if TYPE_CHECKING:
    from attack.node.fault import Action
    from attack.node.run import Run

# Displacement of a radio head in the site file (m).
MOVED_M = 30.0
FILLING = "filling"
BROKEN_SITE = 'name = "campaign"\nssb.period_ms = 41\n'


def kill(run: Run) -> None:
    """Kills the node with SIGKILL."""
    run.node.kill()


def start(run: Run) -> None:
    """Starts the node again."""
    run.node.start()


def stop(run: Run) -> None:
    """Stops the process (SIGSTOP)."""
    run.node.signal(signal.SIGSTOP)


def resume(run: Run) -> None:
    """Continues the process (SIGCONT)."""
    run.node.signal(signal.SIGCONT)


def fill_disk(run: Run) -> None:
    """Writes to the disk until it is full."""
    with (run.node.disk_path() / FILLING).open("wb", buffering=0) as file:
        for size in (1 << 16, 1 << 8, 1):
            with contextlib.suppress(OSError):
                while file.write(bytes(size)) == size:
                    pass


def empty_disk(run: Run) -> None:
    """Removes everything that `fill_disk` has written."""
    (run.node.disk_path() / FILLING).unlink()


def remove_logs(run: Run) -> None:
    """Removes the folder of the MCAP files."""
    shutil.rmtree(run.node.disk_path() / "log")


def call(action: str) -> Action:
    """Has the recorder run an action: see `Recorder.call`."""
    return lambda run: run.recorder.call(action)


def break_site(run: Run) -> None:
    """Replaces the site file by an invalid one, and asks the node to read it (SIGHUP)."""
    site = run.folder / "site.toml"
    site.rename(run.folder / "site.good")
    site.write_text(BROKEN_SITE, encoding="utf-8")
    run.node.signal(signal.SIGHUP)


def restore_site(run: Run) -> None:
    """Restores the site file."""
    (run.folder / "site.good").rename(run.folder / "site.toml")


def move_head(run: Run) -> None:
    """Moves the third radio head of the site file, and asks the node to read it (SIGHUP)."""
    site = run.folder / "site.toml"
    text = site.read_text(encoding="utf-8")
    site.rename(run.folder / "site.good")
    _, x_m, y_m, z_m = HEADS[2]
    moved = text.replace(f"[{x_m}, {y_m}, {z_m}]", f"[{x_m + MOVED_M}, {y_m}, {z_m}]")
    assert moved != text
    site.write_text(moved, encoding="utf-8")
    run.node.signal(signal.SIGHUP)


def move_head_back(run: Run) -> None:
    """Restores the site file, and asks the node to read it (SIGHUP)."""
    restore_site(run)
    run.node.signal(signal.SIGHUP)


def reconnect(run: Run) -> None:
    """Closes the message connection ten times, half a line sent each time."""
    import threading
    import time

    def work() -> None:
        for _ in range(10):
            run.client.send(b'{"type": "odometry", "time_s"')
            run.client.close()
            time.sleep(0.4)

    threading.Thread(target=work, daemon=True).start()


def garbage_everywhere(run: Run) -> None:
    """Sends random bytes to the page and to the JSON output."""
    for name in ("page", "json"):
        with (
            contextlib.suppress(OSError),
            socket.create_connection(("127.0.0.1", run.ports[name]), timeout=0.5) as peer,
        ):
            peer.sendall(run.random.bytes(1 << 16))
