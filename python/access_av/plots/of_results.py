"""Charts of results as Altair objects, which notebooks display and ``.save()`` writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import altair as alt

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

WIDTH_PX, HEIGHT_PX = 560, 260
# Maximum number of points of a line.
POINTS = 400


def _thinned(rows: pl.DataFrame) -> pl.DataFrame:
    return rows.gather_every(max(1, rows.height // POINTS))


def lines(rows: pl.DataFrame, x: str, columns: Sequence[str], *, titles: tuple[str, str]) -> Any:
    """Draws columns against another one, a line each.

    Parameters
    ----------
    rows
        The table.
    x
        Column of the horizontal axis.
    columns
        Columns of the vertical axis.
    titles
        Titles of the horizontal and of the vertical axis, with units.
    """
    long = _thinned(rows.select(x, *columns)).unpivot(on=columns, index=x, variable_name="quantity")
    chart = (
        alt.Chart(long)
        .mark_line()
        .encode(
            x=alt.X(f"{x}:Q", title=titles[0]),
            y=alt.Y("value:Q", title=titles[1]),
            color=alt.Color("quantity:N", sort=list(columns), legend=alt.Legend(title=None)),
            tooltip=["quantity:N", f"{x}:Q", "value:Q"],
        )
    )
    return chart.properties(width=WIDTH_PX, height=HEIGHT_PX)


def scatter(rows: pl.DataFrame, x: str, y: str, name: str, *, titles: tuple[str, str]) -> Any:
    """Draws a point per row, coloured by its name.

    Parameters
    ----------
    rows
        The table.
    x, y, name
        Columns of the axes and of the names.
    titles
        Titles of the horizontal and of the vertical axis, with units.
    """
    chart = (
        alt.Chart(rows)
        .mark_point(filled=True, size=80)
        .encode(
            x=alt.X(f"{x}:Q", title=titles[0], scale=alt.Scale(zero=False)),
            y=alt.Y(f"{y}:Q", title=titles[1]),
            color=alt.Color(f"{name}:N", sort=None, legend=alt.Legend(title=None)),
            tooltip=[f"{name}:N", f"{x}:Q", f"{y}:Q"],
        )
    )
    return chart.properties(width=WIDTH_PX, height=HEIGHT_PX)


def intervals(rows: pl.DataFrame, name: str, columns: tuple[str, str, str], *, title: str) -> Any:
    """Draws a value with its interval per row.

    Parameters
    ----------
    rows
        The table.
    name
        Column of the names.
    columns
        Value, and the ends of its interval.
    title
        Title of the axis, with its unit.
    """
    value, low, high = columns
    base = alt.Chart(rows).encode(y=alt.Y(f"{name}:N", sort=None, title=None))
    x = alt.X(f"{low}:Q", title=title, scale=alt.Scale(zero=False))
    spans = base.mark_rule(strokeWidth=2).encode(x=x, x2=f"{high}:Q")
    dots = base.mark_point(filled=True, size=80).encode(
        x=f"{value}:Q", tooltip=[f"{name}:N", f"{value}:Q", f"{low}:Q", f"{high}:Q"]
    )
    return (spans + dots).properties(width=WIDTH_PX, height=30 * max(rows.height, 2))
