"""TOML files of this package."""

from __future__ import annotations

import sys
from functools import cache
from importlib import resources
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["shipped", "tomllib"]


@cache
def shipped(*path: str) -> dict[str, Any]:
    """Reads a TOML file of this package, by its path in the package.

    Examples
    --------
    >>> shipped("economics", "prices.toml")["lidar"]["value"]
    4000.0
    """
    text = resources.files("access_av").joinpath(*path).read_text(encoding="utf-8")
    return tomllib.loads(text)
