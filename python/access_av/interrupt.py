"""Ctrl-C ends the program within a second, whatever it is doing, and leaves nothing half written.

Python raises ``KeyboardInterrupt`` between two of its own instructions only; a long computation or
a chart that is being drawn lets it wait. So a thread of the core, which needs no interpreter, waits
too, and ends the program where nothing else has by then.
"""

from __future__ import annotations

import os
import signal
import sys
import time

from access_av._core.interrupt import INTERRUPTED, came, clean, end, watch, writing

__all__ = ["INTERRUPTED", "clean", "end", "guard", "may_have_come", "writing"]


def guard() -> None:
    """From here on Ctrl-C ends the program, be it by an exception or without."""
    sys.unraisablehook = _ignore
    tells = watch()
    os.set_blocking(tells, False)
    signal.set_wakeup_fd(tells, warn_on_full_buffer=False)


def may_have_come() -> bool:
    """Whether Ctrl-C has come, or does at this moment."""
    try:
        time.sleep(0.1)
    except KeyboardInterrupt:
        return True
    return came()


def _ignore(unraisable: sys.UnraisableHookArgs) -> None:
    """Say nothing of an interruption that came where exceptions go nowhere; the thread ends it."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
