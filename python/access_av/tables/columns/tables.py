"""Tables: meaning of a row, columns, and conditions of null values.

``tables.toml`` contains the tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.data import shipped
from access_av.tables.columns.glossary import GLOSSARY

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Table:
    """Table: meaning of a row, files, ordered columns, conditions of null values."""

    name: str
    row: str
    where: str
    columns: tuple[str, ...]
    null: Mapping[str, str]

    @classmethod
    def of(cls, name: str, entry: Mapping[str, Any]) -> Table:
        """Returns the table of an entry of the TOML file."""
        null = {
            column: condition
            for condition, columns in entry.get("null", {}).items()
            for column in columns
        }
        return cls(name, entry["row"], entry["where"], tuple(entry["columns"]), null)

    def records(self) -> list[dict[str, str]]:
        """Returns name, unit, meaning and null condition of each column."""
        return [
            {**vars(GLOSSARY[name]), "null": self.null.get(name, "never")} for name in self.columns
        ]


TABLES: Mapping[str, Table] = {
    name: Table.of(name, entry)
    for name, entry in shipped("tables", "columns", "tables.toml").items()
}
