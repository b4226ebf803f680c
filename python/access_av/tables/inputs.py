"""Size and checksum of the files that a command was given."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

# Larger files have no checksum, because reading them takes seconds (bytes).
MAX_CHECKSUM_BYTES = 256 * 2**20
# Maximum number of files of an input folder.
MAX_FILES = 200
# The data of a SigMF recording are named after its metadata.
META, DATA = ".sigmf-meta", ".sigmf-data"


def described(file: Path) -> dict[str, Any]:
    """Returns size and SHA-256 of a file; no checksum above :data:`MAX_CHECKSUM_BYTES`."""
    size = file.stat().st_size
    if size > MAX_CHECKSUM_BYTES:
        return {"bytes": size}
    with file.open("rb") as opened:
        return {"bytes": size, "sha256": hashlib.sha256(opened.read()).hexdigest()}


def inputs(arguments: Sequence[str], out: Path) -> dict[str, dict[str, Any]]:
    """Returns size and SHA-256 of every file that the arguments of a command name.

    Parameters
    ----------
    arguments
        Arguments of the command, also ``KEY=FILE`` and ``FILE:NAME``.
    out
        Directory of the results, whose files are no inputs.
    """
    found = {}
    for file in _named(arguments):
        if out.resolve() not in file.resolve().parents:
            found[str(file)] = described(file)
    return found


def _named(arguments: Sequence[str]) -> Iterator[Path]:
    for argument in arguments:
        for text in (argument, argument.partition("=")[2], argument.rpartition(":")[0]):
            text = text.rpartition("=")[2]
            try:
                path = Path(text)
                if not text or not path.exists():
                    continue
                if path.is_dir():
                    yield from [it for it in sorted(path.iterdir()) if it.is_file()][:MAX_FILES]
                elif path.is_file():
                    yield path
                    if path.suffix == META and path.with_suffix(DATA).is_file():
                        yield path.with_suffix(DATA)
            except (OSError, ValueError):
                continue  # not a file name
