"""Results on disk: one directory per command, a ``latest`` link, tables, trajectories."""

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

from access_av import interrupt
from access_av.errors import InputError
from access_av.tables.inputs import inputs

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import polars as pl
    from numpy.typing import ArrayLike

# Directory of results in the working directory, or another one given by the environment.
RESULTS = Path(os.environ.get("ACCESS_AV_RESULTS") or "results")


class Lock:
    """Locks a folder against a second writer during the lifetime of the object."""

    def __init__(self, folder: Path):
        self._descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            message = f"{folder}: another run is writing here; give another --out"
            raise InputError(message) from error
        except OSError:
            pass  # The file system has no locks.

    def __del__(self) -> None:
        os.close(self._descriptor)


@dataclass(frozen=True)
class ResultsDirectory:
    """Results directory of one command. Files are written to a temporary name, then renamed."""

    path: Path
    lock: Lock

    @classmethod
    def create(cls, command: str, out: Path | None = None) -> ResultsDirectory:
        """Creates the directory: ``out``, or a new one in ``results/``."""
        if out is None:
            out = _new(command)
        if out.exists() and not out.is_dir():
            raise NotADirectoryError(f"{out}: is a file; --out takes a directory")
        out.mkdir(parents=True, exist_ok=True)
        lock = Lock(out)
        interrupt.writing(out)
        return cls(out, lock)

    def link_latest(self) -> None:
        """Sets the link ``results/latest`` to this directory, if it is in ``results``.

        With another ``--out``, the link is unchanged.
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
            # Ignore the error, because only the link is missing.
            warnings.warn(f"{RESULTS / 'latest'}: {error.strerror}", stacklevel=2)
            fresh.unlink(missing_ok=True)

    def write_text(self, name: str, text: str) -> Path:
        """Writes a text file."""
        return write_whole(self.path / name, text)

    def write_json(self, name: str, value: object) -> Path:
        """Writes a JSON file."""
        return self.write_text(name, json_text(value) + "\n")

    def write_table(self, name: str, table: pl.DataFrame) -> Path:
        """Writes a Parquet file."""
        held = io.BytesIO()
        table.write_parquet(held, compression="zstd")
        return write_whole(self.path / name, held.getbuffer())

    def write_manifest(
        self, *, repeat: Sequence[object] = (), warnings: Iterable[object] = (), **settings: Any
    ) -> Path:
        """Writes ``manifest.json``: version, commit if known, command, settings, warnings.

        ``command`` is the given command line, ``directory`` its working directory, and ``inputs``
        are size and checksum of the files that it names. ``repeat`` is the command line that
        repeats the run in this directory, with the stored inputs.
        """
        return self.write_json(
            "manifest.json",
            {
                "version": version("access-av"),
                "commit": commit(),
                "command": ["access-av", *sys.argv[1:]],
                "directory": str(Path.cwd()),
                "inputs": inputs(sys.argv[1:], self.path),
                "written": datetime.now(timezone.utc).isoformat(timespec="seconds"),
                **({"repeat": shlex.join(["access-av", *map(str, repeat)])} if repeat else {}),
                **settings,
                "warnings": [*map(str, warnings)],
            },
        )


def commit() -> str | None:
    """Returns the commit of a source checkout, with ``-dirty`` after changes."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists() or not (root / "crates").is_dir():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40"]
    with suppress(OSError, subprocess.SubprocessError):
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
        return done.stdout.strip()
    return None


def regular(path: Path, most_bytes: int) -> Path:
    """Returns the path of a regular file with a maximum size; rejects pipes and devices.

    Raises
    ------
    InputError
        Not a regular file, or too large.
    OSError
        Missing file.
    """
    if not stat.S_ISREG((found := path.stat()).st_mode):
        raise InputError(f"{path}: not a regular file")
    if found.st_size > most_bytes:
        raise InputError(f"{path}: {found.st_size} bytes; at most {most_bytes} are allowed")
    return path


def write_whole(target: Path, content: str | bytes | memoryview, *, durable: bool = False) -> Path:
    """Writes a file to a temporary name and renames it; a failure leaves no file.

    With several simultaneous writers, the file is that of one of them. A ``durable`` file is
    synchronized to disk before it is renamed. Devices and pipes such as ``/dev/null`` are written
    directly, because renaming would replace them.
    """
    if isinstance(content, str):
        # File names may contain bytes that are not valid text.
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
    """Returns JSON, with null for numbers that are not finite.

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
    """Creates a new folder, unique also for runs with equal start times."""
    while True:
        now = datetime.now(timezone.utc).strftime("%Y-%m-%dT%H%M%S.%f")[:-3]
        with suppress(FileExistsError):
            out = RESULTS / f"{now}-{command}"
            out.mkdir(parents=True)
            return out


def tum_trajectory(
    time_s: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, heading_rad: ArrayLike
) -> str:
    r"""Returns a trajectory in TUM format: lines ``t x y z qx qy qz qw``, time resolution 1 ns.

    Parameters
    ----------
    time_s, x_m, y_m, heading_rad
        Arrays of shape (n,): seconds, metres, and the heading counter-clockwise from +x.

    Examples
    --------
    >>> tum_trajectory([0.02], [1.0], [2.0], [0.0])
    '0.020000000 1.000000 2.000000 0.000000 0.000000000 0.000000000 0.000000000 1.000000000\n'
    """
    import numpy as np  # here, because its import takes a sixth of the start of a command

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
