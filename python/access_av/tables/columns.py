"""Columns of all written and returned tables: one name for one quantity.

:data:`GLOSSARY` contains unit and meaning of each name; :data:`TABLES` contains the names of each
table and the conditions of null values. ``glossary.toml`` and ``tables.toml`` define both. Tables
have no other columns and no NaN. ``docs/columns.md`` is generated from both, and tests compare
them with the produced tables.

Examples
--------
>>> from access_av import columns
>>> columns.TABLES["measurements"].null["angle_rad"]
'no angle could be estimated'
>>> columns.GLOSSARY["covariance_xy_m2"].unit
'm²'
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from textwrap import fill
from typing import TYPE_CHECKING, Any

from access_av.data import shipped
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

__all__ = ["GLOSSARY", "TABLES", "Column", "Table", "as_json", "markdown", "table"]


@dataclass(frozen=True)
class Column:
    """Name, unit and meaning of a column."""

    name: str
    unit: str
    meaning: str


GLOSSARY: Mapping[str, Column] = {
    name: Column(name, *entry) for name, entry in shipped("tables", "glossary.toml").items()
}


@dataclass(frozen=True)
class Table:
    """Table: meaning of a row, files, ordered columns, conditions of null values.

    Attributes
    ----------
    null
        Condition of null values, by column.
    absent
        Kinds of rows without the column, by column.
    """

    name: str
    row: str
    where: str
    columns: tuple[str, ...]
    null: Mapping[str, str]
    absent: Mapping[str, Sequence[str]]

    @classmethod
    def read(cls, name: str, entry: Mapping[str, Any]) -> Table:
        """Returns the table of an entry of the TOML file."""
        conditions, absent = _by_column(entry.get("null", {})), _by_column(entry.get("absent", {}))
        null = {column: " or ".join(it) for column, it in conditions.items()}
        kinds = {column: ", ".join(it).split(", ") for column, it in absent.items()}
        return cls(name, entry["row"], entry["where"], tuple(entry["columns"]), null, kinds)

    def of(self, *kinds: str) -> tuple[str, ...]:
        """Returns the columns of the table for rows of the given kinds.

        Examples
        --------
        >>> TABLES["runs"].of("`drives.parquet`")[:3]
        ('variant', 'run', 'seed')
        """
        return tuple(it for it in self.columns if not {*kinds} & {*self.absent.get(it, ())})

    def records(self) -> list[dict[str, str]]:
        """Returns name, unit, meaning and null condition of each column."""
        rows = []
        for name in self.columns:
            null, absent = self.null.get(name, "never"), self.absent.get(name, ())
            null += f"; absent: {', '.join(absent)}" if absent else ""
            rows.append({**vars(GLOSSARY[name]), "null": null})
        return rows

    def frame(self, columns: Mapping[str, Any] | pl.DataFrame) -> pl.DataFrame:
        """Returns columns in the order of this table, with null for NaN."""
        import polars as pl

        names = [name for name in self.columns if name in columns]
        texts = {name: pl.String for name in names if GLOSSARY[name].unit == "text"}
        return pl.DataFrame(columns, schema_overrides=texts).fill_nan(None).select(names)


def _by_column(columns_of: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for text, columns in columns_of.items():
        for column in columns:
            found.setdefault(column, []).append(text)
    return found


TABLES: Mapping[str, Table] = {
    name: Table.read(name, entry) for name, entry in shipped("tables", "tables.toml").items()
}


def table(name: str) -> Table:
    """Returns a table by its name, or the table of a file with the columns of this file.

    Raises
    ------
    InputError
        Unknown name; the message lists the valid ones, and contains the new name of an old one.

    Examples
    --------
    >>> table("masts.parquet").columns
    ('name', 'x_m', 'y_m', 'z_m', 'p90_bound_m')
    """
    if name in TABLES:
        return TABLES[name]
    file = f"`{name}`"
    found = [it for it in TABLES.values() if file in it.where]
    if len(found) == 1:
        return replace(found[0], name=name, columns=found[0].of(file), absent={})
    renamed = shipped("tables", "renamed.toml")["tables"]
    names = [it.name for it in found] or [renamed[it] for it in (name,) if it in renamed]
    hint = f"see {' or '.join(names)}; " if names else ""
    raise InputError(f"unknown table {name}: {hint}allowed: {', '.join(TABLES)}")


def as_json(tables: list[Table]) -> dict[str, Any]:
    """Returns tables as plain values."""
    return {
        table.name: {"row": table.row, "where": table.where, "columns": table.records()}
        for table in tables
    }


def markdown() -> str:
    """Returns the text of ``docs/columns.md``."""
    parts = [
        "# Columns of every table",
        "This page is generated by `make docs`. A column name has one unit and one meaning in all "
        "tables. Units are SI and part of the name; unit 1 is a count or a number without unit. "
        "Unknown values are null, never NaN. `access-av file columns TABLE` prints one table.",
    ]
    for table in TABLES.values():
        rows = [
            f"| `{one['name']}` | {one['unit']} | {one['meaning']} | {one['null']} |"
            for one in table.records()
        ]
        head = "| column | unit | meaning | null when |\n|---|---|---|---|"
        # An abbreviation keeps its capitals.
        of = table.row if table.row[:2].isupper() else table.row[0].lower() + table.row[1:]
        row = f"Row: {of}. {table.where}."
        parts += [f"## {table.name}", row]
        parts.append("\n".join([head, *rows]))
    # Wrap paragraphs, but no table rows.
    filled = (it if it.startswith("|") else fill(it, 120, break_on_hyphens=False) for it in parts)
    return "\n\n".join(filled) + "\n"
