"""Tables that a user gives: whether they hold what is needed of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterable


def check(
    rows: pl.DataFrame, where: str, *, numbers: Iterable[str], other: Iterable[str] = ()
) -> None:
    """Refuse a table that lacks a column, or in which one of ``numbers`` is none.

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
    numbers = list(numbers)
    for name in (*other, *numbers):
        if name not in rows.columns:
            raise InputError(f"{where}: column {name} is missing; there are {rows.columns}")
    for name in numbers:
        finite = rows[name].cast(pl.Float64, strict=False).is_finite()
        bad = (~finite).fill_null(value=True).arg_true()
        if len(bad):
            raise InputError(f"{where}: {name} is not a number in row {bad[0]}")
