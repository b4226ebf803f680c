"""Roads and radio heads in CSV, also with semicolons and decimal commas."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from access_av.errors import InputError
from access_av.site_files.drawn import Drawn, Head
from access_av.tables import validation

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

# Largest physical cell identity.
MAX_PCI = 1007


def read_road(path: Path) -> Drawn:
    """Reads the columns ``x_m`` and ``y_m``: one point of the road per row.

    Raises
    ------
    InputError
        When a column or number is missing.
    """
    rows = validation.read(path, "table of points")
    validation.check(rows, str(path), numbers=("x_m", "y_m"), other=())
    points = rows.select(pl.col("x_m", "y_m").cast(pl.Float64)).rows()
    if len(points) < 2:
        raise InputError(f"{path}: {len(points)} points; a road needs at least two")
    return Drawn(road_m=points)


def read_heads(path: Path) -> Drawn:
    """Reads the columns ``x_m``, ``y_m``, ``z_m`` and optionally ``name`` and ``pci``.

    Raises
    ------
    InputError
        Missing column or number, or a PCI that is not an integer.
    """
    rows = validation.read(path, "table of radio heads", {"name": pl.String})
    validation.check(rows, str(path), numbers=("x_m", "y_m", "z_m"), other=())
    for index, value in enumerate(rows.get_column("pci", default=pl.Series(dtype=pl.Int64))):
        is_whole = isinstance(value, (int, float)) and float(value).is_integer()
        if value is not None and not (is_whole and 0 <= value <= MAX_PCI):
            raise InputError(
                f"{path}: pci is {value!r} in {validation.row_name(str(path), index)}; a whole "
                f"number from 0 to {MAX_PCI}, or nothing, is needed"
            )
    return Drawn(
        heads=[
            Head(
                name=str(row.get("name") or ""),
                x_m=float(row["x_m"]),
                y_m=float(row["y_m"]),
                z_m=float(row["z_m"]),
                pci=None if row.get("pci") is None else int(row["pci"]),
            )
            for row in rows.to_dicts()
        ]
    )


def road_text(points_m: Sequence[tuple[float, float]], *, decimal_comma: bool = False) -> str:
    """Returns points of a road as CSV; ``decimal_comma``: semicolons and decimal commas."""
    rows = [("x_m", "y_m"), *((f"{x_m:.4f}", f"{y_m:.4f}") for x_m, y_m in points_m)]
    return _text(rows, decimal_comma=decimal_comma)


def heads_text(heads: Sequence[Head], *, decimal_comma: bool = False) -> str:
    """Returns radio heads as CSV."""
    rows = [("name", "x_m", "y_m", "z_m", "pci")]
    for head in heads:
        pci = "" if head.pci is None else str(head.pci)
        name = '"' + head.name.replace('"', '""') + '"'
        rows.append((name, f"{head.x_m:.4f}", f"{head.y_m:.4f}", f"{head.z_m:.4f}", pci))
    return _text(rows, decimal_comma=decimal_comma)


def _text(rows: Sequence[Sequence[str]], *, decimal_comma: bool) -> str:
    def cell(text: str) -> str:
        return text.replace(".", ",") if decimal_comma and text[:1] in "-0123456789" else text

    separator = ";" if decimal_comma else ","
    return "".join(separator.join(map(cell, row)) + "\n" for row in rows)
