"""Reader of CSV tables: separators, quotes, comments, decimal commas, encodings."""

from __future__ import annotations

import codecs
import csv
import io
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

# Separators of columns, in the order of preference for equal counts in the header.
SEPARATORS = (",", ";", "\t")
DECIMAL_COMMA = r"^[+-]?\d+(,\d+)?([eE][+-]?\d+)?$"
THOUSANDS = re.compile(r"[+-]?\d{1,3}([,.'\u2019 \u00a0\u202f]\d{3})+([.,]\d+)?")
# First line of CSV files of Excel, which contains the separator.
SEPARATOR_LINE = re.compile(rb'"?sep=([,;|\t])"?', re.IGNORECASE)
UTF32 = (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)
UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
# First bytes of files of other formats.
OTHER_FORMATS = {
    b"PAR1": "Parquet",
    b"PK\x03\x04": "a zip file or a spreadsheet",
    b"\x1f\x8b": "compressed (gzip)",
    b"\x28\xb5\x2f\xfd": "compressed (zstd)",
    b"\x89HDF": "HDF5",
    b"\x89MCAP0": "MCAP",
    b"#ROSBAG": "a bag of ROS 1",
    b"SQLite format 3": "sqlite3",
}


@dataclass(frozen=True)
class Lines:
    """Header and rows of a file.

    Attributes
    ----------
    separator
        Separator of the columns.
    names
        Names of the columns, without blanks around them.
    rows
        Lines of the rows.
    numbers
        Line number of each row, from 1.
    """

    separator: str
    names: list[str]
    rows: list[bytes]
    numbers: list[int]


def read(path: Path, schema: dict[str, Any] | None = None) -> pl.DataFrame:
    """Reads a CSV file in UTF-8 or UTF-16, in the format of the logs of `locate`.

    Columns are separated by commas, semicolons or tabs; with semicolons and tabs, numbers may have
    a decimal comma. Blanks around cells, blank lines and lines that begin with ``#`` are ignored.

    Parameters
    ----------
    path
        The file.
    schema
        Column types that override the inferred ones.

    Raises
    ------
    InputError
        Another encoding, a repeated column, or a row whose number of cells differs from the header.
    """
    lines = _lines(path)
    text_schema = {str(index): pl.String for index in range(len(lines.names))}
    text = pl.DataFrame(schema=text_schema)
    if lines.rows:
        body = io.BytesIO(b"\n".join(lines.rows))
        text = pl.read_csv(body, has_header=False, schema=text_schema, separator=lines.separator)
    cells = pl.all().str.strip_chars()
    text = text.select(pl.when(cells != "").then(cells).name.keep())
    # Drop the unnamed column caused by a separator at the end of each line.
    kept = [
        index
        for index, name in enumerate(lines.names)
        if name or text[str(index)].null_count() < text.height
    ]
    for index in kept:
        if not lines.names[index]:
            raise InputError(f"{path}: column {index + 1} has no name in the header")
    columns = [text[str(index)].alias(lines.names[index]) for index in kept]
    known = schema or {}
    rows = pl.DataFrame(
        [it.cast(known[it.name]) if it.name in known else _inferred(it) for it in columns]
    )
    return _with_decimal_commas(path, rows, lines.separator, known)


def line_of(path: Path, row: int) -> int:
    """Returns the line number (from 1) of a row (from 0)."""
    return _lines(path).numbers[row]


def has_thousands_separators(text: str) -> bool:
    """Returns whether a cell is a number in groups of three digits.

    Examples
    --------
    >>> [has_thousands_separators(it) for it in ("1,234.5", "1.234,5", "1 234", "12345", "a")]
    [True, True, True, False, False]
    """
    return THOUSANDS.fullmatch(text.strip()) is not None


def _lines(path: Path) -> Lines:
    data: bytes = path.read_bytes()
    for beginning, name in OTHER_FORMATS.items():
        if data.startswith(beginning):
            raise InputError(f"{path}: the file is {name}, not CSV; save it as CSV UTF-8")
    if data.startswith(UTF16) and not data.startswith(UTF32):
        data = data.decode("utf-16", errors="replace").encode("utf-8")
    elif data.startswith(UTF32) or b"\0" in data[:1000]:
        raise InputError(
            f"{path}: UTF-32 text, UTF-16 without a byte order mark, or binary; save it as "
            "CSV UTF-8"
        )
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        of = data.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{path}: byte 0x{data[error.start]:02X} in line {of} is not UTF-8, probably "
            f"Latin-1 or Windows-1252 text; save it as CSV UTF-8"
        ) from error
    separator: str | None = None
    names: list[str] | None = None
    rows: list[bytes] = []
    numbers: list[int] = []
    for number, line in enumerate(data.splitlines(), 1):
        if not line.strip() or line.lstrip().startswith(b"#"):
            continue
        if names is None:
            given = SEPARATOR_LINE.fullmatch(line.strip(b" \r"))
            if given is not None and separator is None:
                separator = given[1].decode("ascii")
                continue
            separator = separator or max(SEPARATORS, key=line.decode("utf-8").count)
            names = _header(path, line, separator)
            continue
        cells = _count(path, line, separator or ",", number)
        if cells != len(names):
            hint = ""
            if cells > len(names) and separator == ",":
                hint = "; with decimal commas, separate the columns by semicolons"
            raise InputError(
                f"{path}: line {number} has {cells} cells instead of {len(names)}{hint}"
            )
        rows.append(line)
        numbers.append(number)
    if names is None or separator is None:
        raise InputError(f"{path}: the file is empty; the first line names the columns")
    return Lines(separator, names, rows, numbers)


def _header(path: Path, line: bytes, separator: str) -> list[str]:
    names = [it.strip() for it in _cells(path, line, separator, 1)]
    for name in names:
        if name and names.count(name) > 1:
            if is_number(name):
                raise InputError(
                    f"{path}: the first line holds the number {name}; it must name the columns, "
                    "without #"
                )
            raise InputError(f"{path}: column {name} occurs twice; each column may occur only once")
    return names


def is_number(text: str) -> bool:
    """Returns whether a cell is a number with a decimal point."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _count(path: Path, line: bytes, separator: str, number: int) -> int:
    """Returns the number of cells of a line."""
    if b'"' not in line:
        return line.count(separator.encode()) + 1
    if line.count(b'"') % 2:
        raise InputError(f"{path}: line {number} has a quote that is not closed on the line")
    return len(_cells(path, line, separator, number))


def _cells(path: Path, line: bytes, separator: str, number: int) -> list[str]:
    text = line.decode("utf-8")
    try:
        return next(csv.reader([text], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(f"{path}: line {number}: {error}") from error


def _inferred(column: pl.Series) -> pl.Series:
    """Converts a text column to numbers or Booleans if all its cells permit it."""
    if column.null_count() == len(column):
        return column
    for kind in (pl.Int64, pl.Float64):
        numbers = column.cast(kind, strict=False)
        if numbers.null_count() == column.null_count():
            return numbers
    words = column.str.to_lowercase()
    if words.drop_nulls().is_in(["true", "false"]).all():
        return words == "true"
    return column


def _with_decimal_commas(
    path: Path, rows: pl.DataFrame, separator: str, known: dict[str, Any]
) -> pl.DataFrame:
    text = [it for it in rows.select(pl.col(pl.String)).columns if it not in known]
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
