"""Tables that a user gives: whether they can be read and hold what is needed of them."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.errors import InputError
from access_av.tables.columns.glossary import GLOSSARY
from access_av.tables.columns.tables import TABLES
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

# Reads a table and forgets it.
TRY = "import sys, polars; polars.read_parquet(sys.argv[1], glob=False)"

# What may stand between the columns of CSV; of equally many the first is meant.
SEPARATORS = (",", ";", "\t")
DECIMAL_COMMA = r"^[+-]?\d+(,\d+)?([eE][+-]?\d+)?$"

# Bytes of a file; a year of paths through a plant has less.
MOST_BYTES = 4 << 30


def read(path: Path, what: str, schema: dict[str, Any] | None = None) -> pl.DataFrame:
    """Read CSV or Parquet, by the name's ending; ``schema`` overrides the types of CSV columns.

    Raises
    ------
    InputError
        When the file is no table, and so not ``what``; no regular file; or too large.
    """
    regular(path, MOST_BYTES)
    try:
        if path.suffix == ".csv":
            return _read_csv(path, schema)
        _try(path, what)
        return pl.read_parquet(path, glob=False)
    # Of some damage Polars makes a panic of its own.
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise InputError(f"{path}: not a {what}: {error}") from None


def _read_csv(path: Path, schema: dict[str, Any] | None) -> pl.DataFrame:
    """Read CSV; where semicolons or tabs separate the columns, a comma may be the decimal one."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        header = file.readline()
    separator = max(SEPARATORS, key=header.count)
    rows = pl.read_csv(path, schema_overrides=schema, separator=separator, glob=False)
    text = [name for name in rows.select(pl.col(pl.String)).columns if name not in (schema or {})]
    commas = [
        name
        for name in text
        if separator != ","
        and rows[name].str.contains(",", literal=True).any()
        and rows[name].str.contains(DECIMAL_COMMA).all()
    ]
    points = rows.select(pl.col(pl.Float64)).columns
    if commas and points:
        raise InputError(
            f"{path}: {commas[0]} has commas and {points[0]} decimal points, which is ambiguous; "
            "write all numbers with a point, or all with a comma"
        )
    decimal = pl.col(commas).str.replace(",", ".", literal=True).cast(pl.Float64)
    return rows.with_columns(decimal) if commas else rows


def _try(path: Path, what: str) -> None:
    """Let another process read Parquet first: some damage ends the one that reads it."""
    done = subprocess.run([sys.executable, "-c", TRY, str(path)], capture_output=True, check=False)
    if done.returncode < 0:
        raise InputError(f"{path}: not a {what}: it is damaged")


def check(
    rows: pl.DataFrame, where: str, *, numbers: Iterable[str], other: Iterable[str] = ()
) -> None:
    """Refuse a table that lacks a column, a number in ``numbers``, or anything in ``other``.

    Raises
    ------
    InputError
        Naming the table as ``where``, the column and the row.

    Examples
    --------
    >>> check(pl.DataFrame({"x_m": [1.0, None]}), "masts.csv", numbers=["x_m"])
    Traceback (most recent call last):
        ...
    access_av.errors.InputError: masts.csv: x_m is not a number in row 1
    """
    numbers, other = list(numbers), list(other)
    for name in (*other, *numbers):
        if name not in rows.columns:
            raise InputError(f"{where}: column {name} is missing; there are {rows.columns}")
    for name in other:
        if len(empty := rows[name].is_null().arg_true()):
            raise InputError(f"{where}: {name} is empty in row {empty[0]}")
    for name in numbers:
        finite = rows[name].cast(pl.Float64, strict=False).is_finite()
        bad = (~finite).fill_null(value=True).arg_true()
        if len(bad):
            raise InputError(f"{where}: {name} is not a number in row {bad[0]}")


def check_types(rows: pl.DataFrame, where: str, what: str) -> None:
    """Refuse a table that lacks a column of :data:`access_av.columns.TABLES`.

    Raises
    ------
    InputError
        Naming the table as ``where``, and the column.
    """
    for name in TABLES[what].columns:
        found = rows.schema.get(name, pl.Unknown())
        is_text = GLOSSARY[name].unit == "text"
        fine = found == pl.String if is_text else found.is_numeric() or found == pl.Boolean
        if not (fine or found == pl.Null()):
            raise InputError(f"{where}: not a table of {what}; `{name}` is {found}")
