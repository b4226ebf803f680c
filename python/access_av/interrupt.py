"""Ctrl-C ends the program within a second, without partially written files.

Python raises ``KeyboardInterrupt`` only between two of its instructions; a long computation or the
drawing of a chart delays it. Therefore a thread of the Rust core, which needs no interpreter, ends
the program after the timeout.
"""

from __future__ import annotations

import os
import signal
import sys
import time

from access_av._core.interrupt import INTERRUPTED, came, clean, end, watch, writing

__all__ = ["INTERRUPTED", "clean", "end", "guard", "may_have_come", "writing"]


def guard() -> None:
    """Makes Ctrl-C end the program: by an exception, otherwise after the timeout."""
    sys.unraisablehook = _ignore
    tells = watch()
    os.set_blocking(tells, False)
    signal.set_wakeup_fd(tells, warn_on_full_buffer=False)


def may_have_come() -> bool:
    """Returns whether Ctrl-C was pressed, including the present moment."""
    try:
        time.sleep(0.1)
    except KeyboardInterrupt:
        return True
    return came()


def _ignore(unraisable: sys.UnraisableHookArgs) -> None:
    """Suppresses the report of an interruption in code whose exceptions are ignored."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
