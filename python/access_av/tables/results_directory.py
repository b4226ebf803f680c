"""Results on disk: a directory per command, a ``latest`` link, tables, trajectories."""

from __future__ import annotations

import fcntl
import io
import json
import math
import os
import shlex
import stat
import subprocess
import sys
import warnings
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

from access_av import interrupt
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import polars as pl
    from numpy.typing import ArrayLike

RESULTS = Path("results")


class Lock:
    """Keeps a folder from being written by two at a time, as long as this object is there."""

    def __init__(self, folder: Path):
        self._descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            message = f"{folder}: another run is writing here; give another --out"
            raise InputError(message) from error
        except OSError:
            pass  # a file system without locks

    def __del__(self) -> None:
        os.close(self._descriptor)


@dataclass(frozen=True)
class ResultsDirectory:
    """Where one command's results go. Files appear whole: written beside, then renamed."""

    path: Path
    lock: Lock

    @classmethod
    def create(cls, command: str, out: Path | None = None) -> ResultsDirectory:
        """Make the directory: ``out``, or a new one under ``results/``."""
        if out is None:
            out = _new(command)
        if out.exists() and not out.is_dir():
            raise NotADirectoryError(f"{out}: is a file; --out takes a directory")
        out.mkdir(parents=True, exist_ok=True)
        lock = Lock(out)
        interrupt.writing(out)
        return cls(out, lock)

    def link_latest(self) -> None:
        """Point ``results/latest`` here, if this directory is one under ``results``.

        With ``--out`` elsewhere the working directory stays as it is.
        """
        if RESULTS.resolve() not in self.path.resolve().parents:
            return
        fresh = RESULTS / f".latest-{os.getpid()}"
        try:
            RESULTS.mkdir(parents=True, exist_ok=True)
            here = os.path.relpath(self.path.resolve(), RESULTS.resolve())
            fresh.symlink_to(here, target_is_directory=True)
            fresh.replace(RESULTS / "latest")
        except OSError as error:
            # The work is done and written; only its short name is missing.
            warnings.warn(f"{RESULTS / 'latest'}: {error.strerror}", stacklevel=2)
            fresh.unlink(missing_ok=True)

    def write_text(self, name: str, text: str) -> Path:
        """Write a text file."""
        return write_whole(self.path / name, text)

    def write_json(self, name: str, value: object) -> Path:
        """Write a JSON file."""
        return self.write_text(name, json_text(value) + "\n")

    def write_table(self, name: str, table: pl.DataFrame) -> Path:
        """Write a Parquet file."""
        held = io.BytesIO()
        table.write_parquet(held, compression="zstd")
        return write_whole(self.path / name, held.getbuffer())

    def write_manifest(
        self, *, repeat: Sequence[object] = (), warnings: Iterable[object] = (), **settings: Any
    ) -> Path:
        """Write ``manifest.json``: version, commit where known, command, settings, their warnings.

        ``command`` is what was typed; ``repeat``, where a command gives it, is what is to be typed
        in this directory, so that what it was given is still what it was.
        """
        return self.write_json(
            "manifest.json",
            {
                "version": version("access-av"),
                "commit": commit(),
                "command": ["access-av", *sys.argv[1:]],
                "written": datetime.now(timezone.utc).isoformat(timespec="seconds"),
                **({"repeat": _typed(repeat)} if repeat else {}),
                **settings,
                "warnings": [*map(str, warnings)],
            },
        )


def _typed(command: Sequence[object]) -> str:
    return shlex.join(["access-av", *map(str, command)])


def commit() -> str | None:
    """The commit of a checkout that runs where it lies, ``-dirty`` where it was changed since."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists() or not (root / "crates").is_dir():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40"]
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
        return done.stdout.strip()
    return None


def regular(path: Path, most_bytes: int) -> Path:
    """The path of a regular file of at most so many bytes: a pipe or a device has no end.

    Raises
    ------
    InputError
        When it is something else.
    OSError
        When there is none.
    """
    if not stat.S_ISREG((found := path.stat()).st_mode):
        raise InputError(f"{path}: not a regular file")
    if found.st_size > most_bytes:
        raise InputError(f"{path}: {found.st_size} bytes; at most {most_bytes} are allowed")
    return path


def write_whole(target: Path, content: str | bytes | memoryview, *, durable: bool = False) -> Path:
    """Write a file beside its place and put it there; nothing is left of a failure.

    Several may write the same file at once: it is then that of one of them. A ``durable`` one is on
    the disk before it is in its place. Devices and pipes are written to: a file put in the place of
    one would be its end, and it may be ``/dev/null``.
    """
    if isinstance(content, str):
        # What names a file may hold bytes that are no text.
        content = content.encode("utf-8", "backslashreplace")
    place = target.resolve() if target.is_symlink() else target
    if place.exists() and not place.is_file():
        place.write_bytes(content)
        return target
    partial = place.with_name(f".{place.name}.{uuid4().hex[:8]}.partial")
    try:
        with partial.open("wb") as file:
            file.write(content)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        partial.replace(place)
    except BaseException as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(target)) from error
        raise
    return target


def json_text(value: Any) -> str:
    """JSON, with null for what is no finite number.

    Examples
    --------
    >>> json.loads(json_text({"found_s": [1.5, float("nan")]}))
    {'found_s': [1.5, None]}
    """

    def finite(part: Any) -> Any:
        if isinstance(part, dict):
            return {key: finite(item) for key, item in part.items()}
        if isinstance(part, list | tuple):
            return [finite(item) for item in part]
        return None if isinstance(part, float) and not math.isfinite(part) else part

    return json.dumps(finite(value), indent=2, ensure_ascii=False, allow_nan=False)


def _new(command: str) -> Path:
    """A folder of its own, also for runs that begin at the same time."""
    while True:
        now = datetime.now(timezone.utc).strftime("%Y-%m-%dT%H%M%S.%f")[:-3]
        with suppress(FileExistsError):
            out = RESULTS / f"{now}-{command}"
            out.mkdir(parents=True)
            return out


def tum_trajectory(
    time_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, heading_rad: ArrayLike
) -> str:
    r"""Trajectory in the TUM format: ``t x y z qx qy qz qw`` a line, time to the nanosecond.

    Parameters
    ----------
    time_s, x_m, y_m, heading_rad
        Arrays of shape (n,): seconds, metres, and the heading counter-clockwise from +x.

    Returns
    -------
    str
        n lines of exactly eight fields, single spaces, nothing trailing.

    Examples
    --------
    >>> tum_trajectory([0.02], [1.0], [2.0], [0.0])
    '0.020000000 1.000000 2.000000 0.000000 0.000000000 0.000000000 0.000000000 1.000000000\n'
    """
    half = np.asarray(heading_rad, dtype=float) / 2.0
    columns = np.broadcast_arrays(
        np.asarray(time_s, dtype=float),
        np.asarray(x_m, dtype=float),
        np.asarray(y_m, dtype=float),
        np.sin(half),
        np.cos(half),
    )
    line = "{:.9f} {:.6f} {:.6f} 0.000000 0.000000000 0.000000000 {:.9f} {:.9f}\n"
    return "".join(line.format(*row) for row in zip(*(c.tolist() for c in columns), strict=True))
