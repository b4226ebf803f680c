"""Ctrl-C, without the interpreter."""

from os import PathLike
from typing import NoReturn

__all__ = ["INTERRUPTED", "came", "clean", "end", "watch", "writing"]

INTERRUPTED: int
"""Exit code of a program that Ctrl-C ended."""

def watch() -> int:
    """Start the thread that ends the program after Ctrl-C.

    Returns
    -------
    int
        Descriptor to which signal numbers are to be written (``signal.set_wakeup_fd``).
    """

def came() -> bool:
    """Whether Ctrl-C has come."""

def writing(folder: str | PathLike[str]) -> None:
    """Register a folder that contains temporary files of a write."""

def clean() -> None:
    """Leave no partial file behind, and no folder with nothing in it."""

def end() -> NoReturn:
    """End the program now, with a message and the exit code."""
