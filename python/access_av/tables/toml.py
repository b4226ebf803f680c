"""Reading of TOML files, including those of the package."""

from __future__ import annotations

import sys
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError
from access_av.tables.results_directory import regular

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

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


@cache
def shipped(*path: str) -> dict[str, Any]:
    """Reads a TOML file of this package, by its path in the package.

    Examples
    --------
    >>> shipped("economics", "cost.toml")["roadside_unit"]["yearly_usd"]
    2400
    """
    text = resources.files("access_av").joinpath(*path).read_text(encoding="utf-8")
    return tomllib.loads(text)
