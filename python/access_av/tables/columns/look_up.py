"""Tables by name, and what is printed of them."""

from __future__ import annotations

from textwrap import fill
from typing import Any

from access_av.errors import InputError
from access_av.tables.columns.tables import TABLES, Table


def table(name: str) -> Table:
    """A table by its name.

    Raises
    ------
    InputError
        When there is none; names those there are.
    """
    if name not in TABLES:
        raise InputError(f"no table {name}; there are: {', '.join(TABLES)}")
    return TABLES[name]


def as_json(tables: list[Table]) -> dict[str, Any]:
    """Tables as plain values."""
    return {
        table.name: {"row": table.row, "where": table.where, "columns": table.records()}
        for table in tables
    }


def markdown() -> str:
    """The text of ``docs/columns.md``."""
    parts = [
        "# Columns of every table",
        "Made by `make docs`. The same quantity has the same name, unit and meaning everywhere. "
        "Units are SI and stand in the name; a unit of 1 is a count or a number without one. What "
        "is not known is null, never NaN. `access-av columns TABLE` prints the same.",
    ]
    for table in TABLES.values():
        rows = [
            f"| `{one['name']}` | {one['unit']} | {one['meaning']} | {one['null']} |"
            for one in table.records()
        ]
        head = "| column | unit | meaning | null when |\n|---|---|---|---|"
        row = f"Row: {table.row[0].lower()}{table.row[1:]}. {table.where}."
        parts += [f"## {table.name}", row]
        parts.append("\n".join([head, *rows]))
    # A line of a table cannot be broken.
    filled = (it if it.startswith("|") else fill(it, 120, break_on_hyphens=False) for it in parts)
    return "\n\n".join(filled) + "\n"
