"""Results: equal by content, saved to one file and loaded again, with version and commit."""

from __future__ import annotations

import dataclasses
import enum
import io
import json
import math
import zipfile
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.errors import InputError
from access_av.tables.results_directory import commit, write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping

    from typing_extensions import Self

FORMAT = 1
CONTENT = "result.json"
# Time of every member of the archive, so that equal results have equal bytes.
TIME = (1980, 1, 1, 0, 0, 0)
# Names of the package of which a result file may contain objects.
PACKAGE = "access_av"


@dataclass(frozen=True)
class Origin:
    """Version and commit that computed a result.

    Attributes
    ----------
    version
        Version of the package.
    commit
        Commit of the checkout, with ``-dirty`` for changed files; ``None`` for an installed wheel.
    """

    version: str
    commit: str | None


@cache
def origin() -> Origin:
    """Returns version and commit of this package; computed once per process."""
    return Origin(version("access-av"), commit())


@dataclass(frozen=True, eq=False)
class Result:
    """Base class of results: a frozen dataclass whose fields are data.

    Two results are equal if all fields are equal that a dataclass compares. Version and commit are
    not compared, so that a result equals one that another version reproduced.

    Attributes
    ----------
    origin
        Version and commit that computed the result.
    """

    origin: Origin = field(default_factory=origin, compare=False, repr=False, kw_only=True)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return same(self, other)

    def __hash__(self) -> int:
        return hash((type(self).__qualname__, repr(self)))

    def save(self, path: str | Path) -> Path:
        """Writes the result to one file: a ZIP archive of JSON, Parquet and NumPy arrays.

        Equal results give equal bytes if version and commit are equal.

        Parameters
        ----------
        path
            File to write, for example ``drives.zip``.

        Raises
        ------
        TypeError
            If a field has a type that cannot be saved; the message contains the type.
        OSError
            If the file cannot be written.
        """
        writer = _Writer()
        content = {"format": FORMAT, "result": writer.encode(self)}
        writer.members[CONTENT] = json.dumps(content, indent=1, ensure_ascii=False).encode()
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted(writer.members.items()):
                archive.writestr(zipfile.ZipInfo(name, TIME), data, zipfile.ZIP_DEFLATED)
        return write_whole(Path(path), held.getbuffer())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Reads a result that :meth:`save` wrote.

        Raises
        ------
        InputError
            If the file is not a result of this class; the message contains its class.
        OSError
            If the file cannot be read.
        """
        made = load(path)
        if not isinstance(made, cls):
            raise InputError(
                f"{path}: contains a {type(made).__name__}, not a {cls.__name__}; load it with "
                f"{type(made).__name__}.load"
            )
        return made


def load(path: str | Path) -> Any:
    """Reads a result of any class.

    Raises
    ------
    InputError
        If the file is not a result.
    OSError
        If the file cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        content = json.loads(members[CONTENT])
        if content["format"] != FORMAT:
            raise InputError(
                f"{path}: format {content['format']}; this version reads format {FORMAT}"
            )
        return _Reader(members).decode(content["result"])
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, AttributeError, EOFError) as error:
        raise InputError(
            f"{path}: not a result that `save` wrote ({type(error).__name__}: {error})"
        ) from error


def same(first: Any, second: Any) -> bool:
    """Returns whether two values have equal content; NaN equals NaN.

    Examples
    --------
    >>> same({"a": np.array([1.0, np.nan])}, {"a": np.array([1.0, np.nan])})
    True
    >>> same(pl.DataFrame({"a": [1]}), pl.DataFrame({"a": [2]}))
    False
    """
    if first is second:
        return True
    first, second = (it.item() if isinstance(it, np.generic) else it for it in (first, second))
    if isinstance(first, float) and isinstance(second, float):
        return first == second or (math.isnan(first) and math.isnan(second))
    if type(first) is not type(second):
        return False
    if isinstance(first, pl.DataFrame):
        return bool(first.schema == second.schema and first.equals(second))
    if isinstance(first, np.ndarray):
        equal_nan = first.dtype.kind in "fc"
        return first.dtype == second.dtype and bool(
            np.array_equal(first, second, equal_nan=equal_nan)
        )
    if dataclasses.is_dataclass(first):
        return all(
            same(getattr(first, it.name), getattr(second, it.name))
            for it in dataclasses.fields(first)
            if it.compare
        )
    if isinstance(first, dict):
        return [*first] == [*second] and all(same(it, second[key]) for key, it in first.items())
    if isinstance(first, (list, tuple)):
        return len(first) == len(second) and all(map(same, first, second))
    if hasattr(first, "to_toml"):
        return bool(first.to_toml() == second.to_toml())
    return bool(first == second)


class _Writer:
    """Encodes values as JSON; tables and arrays are members of the archive."""

    def __init__(self) -> None:
        self.members: dict[str, bytes] = {}

    def encode(self, value: Any) -> Any:
        if value is None or isinstance(value, (bool, str)):
            return value
        if isinstance(value, enum.Enum):
            return {"$": "enum", "class": _name(type(value)), "name": value.name}
        if isinstance(value, np.generic):
            return self.encode(value.item())
        if isinstance(value, int):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else {"$": "float", "value": repr(value)}
        if isinstance(value, Path):
            return {"$": "path", "value": str(value)}
        if isinstance(value, (list, tuple)):
            items = [self.encode(it) for it in value]
            return items if isinstance(value, list) else {"$": "tuple", "items": items}
        if isinstance(value, pl.DataFrame):
            held = io.BytesIO()
            value.write_parquet(held, compression="zstd")
            return {"$": "table", "member": self._add("parquet", held)}
        if isinstance(value, np.ndarray):
            held = io.BytesIO()
            np.save(held, value, allow_pickle=False)
            return {"$": "array", "member": self._add("npy", held)}
        if dataclasses.is_dataclass(value):
            fields = {
                it.name: self.encode(getattr(value, it.name))
                for it in dataclasses.fields(value)
                if it.init
            }
            return {"$": "object", "class": _name(type(value)), "fields": fields}
        if hasattr(value, "to_toml"):
            return {"$": "toml", "class": _name(type(value)), "text": value.to_toml()}
        if hasattr(value, "items"):
            pairs = [[self.encode(key), self.encode(it)] for key, it in value.items()]
            return {"$": "dict", "items": pairs}
        raise TypeError(f"a {type(value).__name__} cannot be saved: it is no data")

    def _add(self, suffix: str, held: io.BytesIO) -> str:
        name = f"{len(self.members):04}.{suffix}"
        self.members[name] = held.getvalue()
        return name


def _name(kind: type) -> str:
    module = "access_av._core" if kind.__module__ in ("builtins", "_core") else kind.__module__
    return f"{module}:{kind.__qualname__}"


class _Reader:
    """Decodes the output of :class:`_Writer`; creates only classes of this package."""

    def __init__(self, members: Mapping[str, bytes]) -> None:
        self.members = members

    def decode(self, value: Any) -> Any:
        if isinstance(value, list):
            return [self.decode(it) for it in value]
        if not isinstance(value, dict):
            return value
        kind = value["$"]
        if kind == "float":
            return float(value["value"])
        if kind == "path":
            return Path(value["value"])
        if kind == "tuple":
            return tuple(self.decode(it) for it in value["items"])
        if kind == "dict":
            return {_key(self.decode(key)): self.decode(it) for key, it in value["items"]}
        if kind == "table":
            return pl.read_parquet(io.BytesIO(self.members[value["member"]]))
        if kind == "array":
            return np.load(io.BytesIO(self.members[value["member"]]), allow_pickle=False)
        found = _class(value["class"])
        if kind == "enum" and issubclass(found, enum.Enum):
            return found[value["name"]]
        if kind == "toml" and hasattr(found, "from_toml"):
            return found.from_toml(value["text"])
        if kind == "object" and dataclasses.is_dataclass(found):
            return found(**{name: self.decode(it) for name, it in value["fields"].items()})
        raise ValueError(f"unknown entry {kind!r} of class {value['class']!r}")


def _key(key: Any) -> Any:
    return tuple(key) if isinstance(key, list) else key


def _class(name: str) -> type:
    module, _, qualified = name.partition(":")
    if module != PACKAGE and not module.startswith(f"{PACKAGE}."):
        raise ValueError(f"class {name!r} is not of this package")
    found: Any = import_module(module)
    for part in qualified.split("."):
        found = getattr(found, part)
    if not isinstance(found, type):
        raise ValueError(f"{name!r} is no class")
    return found
