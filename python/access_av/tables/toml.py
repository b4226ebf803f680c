"""Reading of TOML files, including those of the package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from access_av.data import shipped, tomllib
from access_av.errors import InputError
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from pathlib import Path


__all__ = ["read", "shipped", "tomllib"]

MOST_BYTES = 4 << 20


def read(file: Path) -> dict[str, Any]:
    """Reads a TOML file.

    Raises
    ------
    InputError
        Invalid TOML, not a regular file, or larger than ``MOST_BYTES``.
    """
    try:
        return tomllib.loads(regular(file, MOST_BYTES).read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{file}: invalid TOML: {error}") from error
