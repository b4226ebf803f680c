"""Glossary of the columns: unit and meaning of each name, equal in all tables.

``glossary.toml`` contains the entries.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.data import shipped

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Column:
    """Name, unit and meaning of a column."""

    name: str
    unit: str
    meaning: str


GLOSSARY: Mapping[str, Column] = {
    name: Column(name, *entry)
    for name, entry in shipped("tables", "columns", "glossary.toml").items()
}
