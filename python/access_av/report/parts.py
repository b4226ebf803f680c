"""HTML fragments of the reports."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report.shown import Badge

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from access_av.report.shown import Shown


def badge(text: str, kind: str) -> str:
    """Returns a badge; ``kind`` is ``yes``, ``no``, ``fit``, ``arithmetic`` or ``construction``."""
    return f'<span class="badge {kind}">{escape(text)}</span>'


def tile(value: str, text: str) -> str:
    """Returns a tile with one number of the summary."""
    return f'<div class="tile"><b>{escape(value)}</b><span>{escape(text)}</span></div>'


def figure(chart_id: str, caption: str = "", title: str = "") -> str:
    """Returns the element of a chart."""
    heading = f"<h3>{escape(title)}</h3>" if title else ""
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure>{heading}<div class="chart" id="{chart_id}"></div>{below}</figure>'


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    numbers: Sequence[int] = (),
    kind: str = "cards",
) -> str:
    """Returns a table; ``numbers`` are the right-aligned columns. Cells contain HTML.

    On a narrow screen, each row of ``cards`` becomes a card with the column names; a ``matrix``
    keeps its columns, and hides the ``small`` and ``span`` elements of its cells.
    """

    def cell(tag: str, column: int, content: str) -> str:
        kind = ' class="number"' if column in numbers else ""
        name = f' data-label="{escape(head[column])}"' if tag == "td" and column else ""
        return f"<{tag}{kind}{name}>{content}</{tag}>"

    top = "".join(cell("th", column, escape(name)) for column, name in enumerate(head))
    body = "".join(
        "<tr>"
        + "".join(cell("td", column, content) for column, content in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return (
        f'<div class="table" tabindex="0"><table class="{kind}"><thead><tr>{top}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def shown(content: Shown) -> str:
    """Returns a table that the terminal shows, too."""
    rows = [
        [badge(*cell) if isinstance(cell, Badge) else escape(cell) for cell in row]
        for row in content.rows
    ]
    numbers = [it for it in range(len(content.head)) if it not in content.texts]
    return table(content.head, rows, numbers=numbers)


def section(title: str, text: str, body: str) -> str:
    """Returns a section with a heading and an optional paragraph."""
    lead = f"<p>{escape(text)}</p>" if text else ""
    return f"<section><h2>{escape(title)}</h2>{lead}{body}</section>"


def warnings(found: Iterable[object]) -> str:
    """Returns the section of plausibility warnings; empty without warnings."""
    items = "".join(f"<li>{escape(str(it))}</li>" for it in found)
    text = "These values are valid, but implausible:"
    return section("Check these settings first", text, f"<ul>{items}</ul>") if items else ""


def source(title: str, text: str) -> str:
    """Returns a file in a collapsed element."""
    # tabindex makes the scrolling text accessible by keyboard.
    shown = f'<pre tabindex="0">{escape(text)}</pre>'
    return f"<details><summary>{escape(title)}</summary>{shown}</details>"
