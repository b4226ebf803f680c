"""Handling of Ctrl-C without the Python interpreter."""

from os import PathLike
from typing import NoReturn

__all__ = ["INTERRUPTED", "came", "clean", "end", "watch", "writing"]

INTERRUPTED: int
"""Exit code after Ctrl-C."""

def watch() -> int:
    """Starts the thread that ends the program after Ctrl-C.

    Returns
    -------
    int
        Descriptor to which signal numbers are to be written (``signal.set_wakeup_fd``).
    """

def came() -> bool:
    """Whether Ctrl-C was pressed."""

def writing(folder: str | PathLike[str]) -> None:
    """Registers a folder that contains temporary files of an unfinished write."""

def clean() -> None:
    """Removes partially written files and empty folders of registered writes."""

def end() -> NoReturn:
    """Ends the program immediately with a message and its exit code."""
