"""Facts shipped with the product: what the paper states, prices, carbon factors."""

from __future__ import annotations

import sys
from functools import cache
from importlib import resources
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


__all__ = ["load", "tomllib", "trips_per_day"]


@cache
def load(name: str) -> dict[str, Any]:
    """Read one of the shipped fact files: ``"paper"``, ``"cost"`` or ``"carbon"``.

    Examples
    --------
    >>> load("paper")["trip"]["duration_s"]
    80.33
    """
    text = resources.files(__package__).joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def trips_per_day() -> float:
    """Trips that follow one another without a break in 24 hours."""
    return 86_400.0 / float(load("paper")["trip"]["duration_s"])
