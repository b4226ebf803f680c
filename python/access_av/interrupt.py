"""Ctrl-C ends the program within a second, whatever it is doing, and leaves nothing half written.

Python raises ``KeyboardInterrupt`` between two of its own instructions only; a long computation or
a chart that is being drawn lets it wait. So a thread waits too, and ends the program where nothing
else has by then. This module imports next to nothing: it is there before anything else is.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

# What shells expect of a program that Ctrl-C ended.
INTERRUPTED = 130
# How long an exception may take to come up.
GRACE_S = 0.2

# Whether Ctrl-C has come.
came = threading.Event()

# Folders whose partial files are this program's.
_writing: set[Path] = set()


def guard() -> None:
    """From here on Ctrl-C ends the program, be it by an exception or without."""
    sys.unraisablehook = _ignore
    told, tells = os.pipe()
    os.set_blocking(tells, False)
    signal.set_wakeup_fd(tells, warn_on_full_buffer=False)

    def wait() -> None:
        while os.read(told, 1) != bytes([signal.SIGINT]):
            pass  # another signal
        came.set()
        threading.Event().wait(GRACE_S)
        end()

    threading.Thread(target=wait, daemon=True).start()


def _ignore(unraisable: sys.UnraisableHookArgs) -> None:
    """Say nothing of an interruption that came where exceptions go nowhere; the thread ends it."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)


def writing(folder: Path) -> None:
    """Remember a folder in which files are written beside their places."""
    _writing.add(folder.absolute())


def clean() -> None:
    """Leave no partial file behind, and no folder with nothing in it."""
    for folder in list(_writing):
        for partial in folder.glob(".*.partial"):
            partial.unlink(missing_ok=True)
        with suppress(OSError):
            folder.rmdir()


def end() -> None:
    """End the program now."""
    clean()
    cursor = "\x1b[?25h" if sys.stderr.isatty() else ""  # a bar has hidden it
    os.write(2, f"{cursor}error: interrupted; what was finished is kept\n".encode())
    os._exit(INTERRUPTED)
