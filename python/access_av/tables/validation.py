"""Validation of given tables: readable, required columns, valid values."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.errors import InputError
from access_av.tables import csv_text, renamed
from access_av.tables.columns import GLOSSARY, TABLES
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from collections.abc import Iterable

# Code of the separate process that reads a table first.
TRY = "import sys, polars; polars.read_parquet(sys.argv[1], glob=False)"

# Maximum file size in bytes.
MOST_BYTES = 4 << 30


def read(path: Path, what: str, schema: dict[str, Any] | None = None) -> pl.DataFrame:
    """Reads CSV or Parquet, by the file extension; ``schema`` overrides types of CSV columns.

    Raises
    ------
    InputError
        Not a table (``what`` in the message), not a regular file, or too large.
    """
    regular(path, MOST_BYTES)
    try:
        if path.suffix.lower() == ".csv":
            return csv_text.read(path, schema)
        _try(path, what)
        return pl.read_parquet(path, glob=False)
    # Polars panics for some damaged files.
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise InputError(f"{path}: not a {what}: {error}") from None


def _try(path: Path, what: str) -> None:
    """Reads Parquet in another process first, because some damaged files abort the process."""
    done = subprocess.run([sys.executable, "-c", TRY, str(path)], capture_output=True, check=False)
    if done.returncode < 0:
        raise InputError(f"{path}: not a {what}: it is damaged")


def check(
    rows: pl.DataFrame, where: str, *, numbers: Iterable[str], other: Iterable[str] = ()
) -> None:
    """Rejects a table with a missing column, or missing values in ``numbers`` or ``other``.

    Raises
    ------
    InputError
        The message names the table (``where``), the column and the row.

    Examples
    --------
    >>> check(pl.DataFrame({"x_m": [1.0, None]}), "masts.csv", numbers=["x_m"])
    Traceback (most recent call last):
        ...
    access_av.errors.InputError: masts.csv: x_m is empty in row 2; a number is needed
    """
    numbers, other = list(numbers), list(other)
    for name in (*other, *numbers):
        if name not in rows.columns:
            hint = renamed.column_hint(name, rows.columns) or _advice(name, rows.columns)
            named = ", ".join(rows.columns)
            raise InputError(f"{where}: column {name} is missing; there are {named}{hint}")
    for name in other:
        if len(empty := rows[name].is_null().arg_true()):
            raise InputError(f"{where}: {name} is empty in {row_name(where, empty[0])}")
    for name in numbers:
        finite = rows[name].cast(pl.Float64, strict=False).is_finite()
        bad = (~finite).fill_null(value=True).arg_true()
        if len(bad):
            value = rows[name][bad[0]]
            is_empty = value is None or value == ""
            says = "is empty" if is_empty else f"is {str(value)[:40]!r}"
            grouped = isinstance(value, str) and csv_text.has_thousands_separators(value)
            hint = " without thousands separators" if grouped else ""
            raise InputError(
                f"{where}: {name} {says} in {row_name(where, bad[0])}; a number{hint} is needed"
            )


def _advice(name: str, columns: list[str]) -> str:
    """Returns the advice for a missing column that a table has in another notation."""
    for column in columns:
        start, rest = column[: len(name)], column[len(name) :]
        is_it = start.lower() == name.lower() and (not rest or rest[0] in " [(/")
        if is_it and (len(columns) > 1 or "[" in rest or not rest):
            return f"; write {name} instead of {column}"
    if len(columns) == 1 and name in columns[0] and any(it in columns[0] for it in " |:"):
        return "; separate the columns by commas, semicolons or tabs"
    if any(csv_text.is_number(column) for column in columns):
        return "; the first line must be the header, without #"
    return ""


def row_name(where: str, index: int) -> str:
    """Returns the line of a CSV file, or the row of another table, counted from 1."""
    path = Path(where)
    if path.suffix.lower() == ".csv" and path.is_file():
        return f"line {csv_text.line_of(path, index)}"
    return f"row {index + 1}"


def check_types(rows: pl.DataFrame, where: str, what: str, kind: str) -> None:
    """Rejects a table without a column of a ``kind`` of :data:`access_av.columns.TABLES`.

    Raises
    ------
    InputError
        The message names the table (``where``) and the column.
    """
    for name in TABLES[what].of(kind):
        found = rows.schema.get(name, pl.Unknown())
        is_text = GLOSSARY[name].unit == "text"
        fine = found == pl.String if is_text else found.is_numeric() or found == pl.Boolean
        if not (fine or found == pl.Null()):
            hint = "" if name in rows.columns else renamed.column_hint(name, rows.columns)
            raise InputError(f"{where}: not a table of {what}; `{name}` is {found}{hint}")
