"""Space of designs: keys of a scenario and their values."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from access_av.errors import InputError
from access_av.tables import toml

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

MOST_DESIGNS = 100_000
# Table of a space file with the environments, and keys that cannot be chosen.
WORLD = "world"
NOT_CHOSEN = ("channel", "truth", "faults", "site.rician_k_db")


@dataclass(frozen=True)
class Dimension:
    """One key and its values: a list of choices, or a range.

    Attributes
    ----------
    label
        Display name.
    low, high
        Range; logarithmic if ``is_log``.
    choices
        Values, if it is not a range.
    """

    key: str
    label: str = ""
    low: float = 0.0
    high: float = 1.0
    is_log: bool = False
    choices: tuple[Any, ...] = ()

    # Significant digits of values of a range.
    digits: ClassVar[int] = 6

    def at(self, coordinate: float) -> Any:
        """Returns the value at a coordinate from 0 to 1.

        Examples
        --------
        >>> Dimension("a", low=1.0, high=100.0, is_log=True).at(0.5)
        10.0
        """
        if self.choices:
            return self.choices[min(int(coordinate * len(self.choices)), len(self.choices) - 1)]
        value = self.low + (self.high - self.low) * coordinate
        if self.is_log:
            value = self.low * (self.high / self.low) ** coordinate
        return float(f"{value:.{self.digits}g}")

    @property
    def range_text(self) -> str:
        """Returns the choices or the range as text."""
        return ", ".join(self.choices) if self.choices else f"{self.low:g} to {self.high:g}"


def named(dimensions: Sequence[Dimension], coordinates: Sequence[float]) -> dict[str, Any]:
    """Returns the values at coordinates by the keys of the dimensions."""
    return {
        dimension.key: dimension.at(float(coordinate))
        for dimension, coordinate in zip(dimensions, coordinates, strict=True)
    }


@dataclass(frozen=True)
class Space:
    """Dimensions of the designs, and the environments in which each design is rated.

    Attributes
    ----------
    dimensions
        Keys of the scenario that can be chosen.
    worlds
        Fixed keys of each environment, by its name. Default: one environment without changes.
    """

    dimensions: tuple[Dimension, ...]
    worlds: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: {"": {}})

    @classmethod
    def read(cls, file: Path) -> Space:
        """Reads a space file.

        Raises
        ------
        InputError
            When it cannot be used; names the key and what is allowed.
        """
        table = toml.read(file)
        try:
            return cls.of(table)
        except InputError as error:
            raise InputError(f"{file}: {error}") from error

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Space:
        """Returns a space from nested tables: lists are choices, ``low`` and ``high`` a range.

        The table ``world`` contains the environments as lists.

        Raises
        ------
        InputError
            When it cannot be used; names the key and what is allowed.

        Examples
        --------
        >>> space = Space.of(
        ...     {
        ...         "vehicle": {"platform": {"mode": [0, 2]}},
        ...         "world": {"site": {"rician_k_db": [5.0, 15.0]}},
        ...     }
        ... )
        >>> space.grid()
        [{'vehicle.platform.mode': 0}, {'vehicle.platform.mode': 2}]
        >>> list(space.worlds)
        ['rician_k_db 5', 'rician_k_db 15']
        """
        chosen = {key: value for key, value in table.items() if key != WORLD}
        found = tuple(_dimensions(chosen, ""))
        if not found:
            raise InputError(
                "the file contains no key with a list of values, or with `low` and `high`"
            )
        for dimension in found:
            if any(f"{dimension.key}.".startswith(f"{key}.") for key in NOT_CHOSEN):
                raise InputError(
                    f"{dimension.key}: this key cannot be chosen; write [{WORLD}] "
                    f"{dimension.key} = […], and every design is rated in its worst environment"
                )
        return cls(found, _worlds(table[WORLD])) if WORLD in table else cls(found)

    def as_record(self) -> dict[str, Any]:
        """Returns the values of each key and the environments as plain data."""
        keys = {
            each.key: list(each.choices)
            if each.choices
            else {"low": each.low, "high": each.high, "log": each.is_log}
            for each in self.dimensions
        }
        return {"keys": keys, "worlds": {name: dict(given) for name, given in self.worlds.items()}}

    def grid(self) -> list[dict[str, Any]]:
        """Returns every combination of the choices.

        Raises
        ------
        InputError
            A range in place of choices, or too many combinations.
        """
        return _combinations(self.dimensions)

    def sobol(self, count: int) -> list[dict[str, Any]]:
        """Returns designs at the points of a Sobol sequence, without duplicates."""
        points = sobol(count, len(self.dimensions))
        found: dict[str, dict[str, Any]] = {}
        for point in points:
            design = named(self.dimensions, point.tolist())
            found.setdefault(repr(design), design)
        return list(found.values())


def sobol(count: int, dimensions: int) -> NDArray[np.float64]:
    """Returns points of a Sobol sequence from 0 to 1, shape (count, dimensions).

    Examples
    --------
    >>> sobol(4, 2).tolist()
    [[0.0, 0.0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.75]]
    """
    from scipy.stats import qmc

    # Draw a power of two, because SciPy warns otherwise, and keep the first points.
    drawn = qmc.Sobol(dimensions, scramble=False, bits=32).random_base2(
        max(count - 1, 0).bit_length()
    )
    return np.asarray(drawn[:count])


def shown(values: Mapping[str, Any]) -> str:
    """Returns the values as text, with the last part of their keys.

    Examples
    --------
    >>> platform = {"name": "a", "mode": 2}
    >>> shown({"vehicle.wake_up.target_error_m": 0.25, "vehicle.platform": platform})
    'target_error_m 0.25, platform a 2'
    """
    return ", ".join(f"{key.rpartition('.')[2]} {_shown(value)}" for key, value in values.items())


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return " ".join(map(_shown, value.values()))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _combinations(dimensions: Sequence[Dimension]) -> list[dict[str, Any]]:
    for dimension in dimensions:
        if not dimension.choices:
            raise InputError(f"{dimension.key}: a grid needs a list of values, not a range")
    count = math.prod(len(dimension.choices) for dimension in dimensions)
    if count > MOST_DESIGNS:
        raise InputError(f"the grid has {count} designs; at most {MOST_DESIGNS} are allowed")
    keys = [dimension.key for dimension in dimensions]
    combined = itertools.product(*(dimension.choices for dimension in dimensions))
    return [dict(zip(keys, values, strict=True)) for values in combined]


def _worlds(table: Any) -> dict[str, dict[str, Any]]:
    """Returns every combination of the fixed keys, by its name."""
    found = _dimensions(table, "") if isinstance(table, dict) else []
    if not found:
        raise InputError(f"{WORLD}: no key with a list of values")
    try:
        return {shown(world): world for world in _combinations(found)}
    except InputError as error:
        raise InputError(f"{WORLD}.{error}") from None


def _dimensions(table: Mapping[str, Any], path: str) -> list[Dimension]:
    found = []
    for name, value in table.items():
        key = f"{path}.{name}" if path else name
        if isinstance(value, list):
            if not value:
                raise InputError(f"{key}: the list is empty")
            found.append(Dimension(key, choices=tuple(value)))
        elif isinstance(value, dict) and {"low", "high"} <= value.keys():
            found.append(_range(key, value))
        elif isinstance(value, dict):
            found += _dimensions(value, key)
        else:
            raise InputError(f"{key}: {value!r} is one value; write a list, or `low` and `high`")
    return found


def _range(key: str, table: Mapping[str, Any]) -> Dimension:
    if unknown := table.keys() - {"low", "high", "log"}:
        raise InputError(f"{key}.{min(unknown)}: unknown; allowed are low, high, log")
    low, high, is_log = table["low"], table["high"], table.get("log", False)
    if not all(isinstance(value, (int, float)) and math.isfinite(value) for value in (low, high)):
        raise InputError(f"{key}: `low` and `high` must be numbers")
    if not low < high or (is_log and low <= 0):
        raise InputError(f"{key}: `low` must be below `high`, and positive if `log` is true")
    return Dimension(key, low=float(low), high=float(high), is_log=bool(is_log))
