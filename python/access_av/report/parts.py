"""HTML fragments of the reports."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from access_av.report.shown import Badge, Shown, compared

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from access_av.study.compare import Compared


class Html(str):
    """HTML of a table cell; other text of cells is escaped."""

    __slots__ = ()


def badge(text: str, kind: str) -> Html:
    """Returns a badge; ``kind`` is ``yes``, ``no``, ``fit``, ``arithmetic`` or ``construction``."""
    return Html(f'<span class="badge {kind}">{escape(text)}</span>')


def small(text: str, *below: str) -> Html:
    """Returns a cell with smaller lines below its text."""
    return Html(_html(text) + "".join(f"<small>{_html(it)}</small>" for it in below))


def code(text: str) -> Html:
    """Returns a cell with a key or a command."""
    return Html(f"<code>{escape(text)}</code>")


def _html(cell: str | Badge) -> str:
    if isinstance(cell, Badge):
        return badge(*cell)
    return cell if isinstance(cell, Html) else escape(cell)


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
    rows: Iterable[Sequence[str | Badge]],
    *,
    numbers: Sequence[int] = (),
    kind: str = "cards",
) -> str:
    """Returns a table; ``numbers`` are the right-aligned columns.

    On a narrow screen, each row of ``cards`` becomes a card with the column names; a ``matrix``
    keeps its columns, and hides the ``small`` and ``span`` elements of its cells.
    """

    def cell(tag: str, column: int, content: str | Badge) -> str:
        kind = ' class="number"' if column in numbers else ""
        name = f' data-label="{escape(head[column])}"' if tag == "td" and column else ""
        return f"<{tag}{kind}{name}>{_html(content)}</{tag}>"

    top = "".join(cell("th", column, name) for column, name in enumerate(head))
    body = "".join(
        f"<tr>{''.join(cell('td', column, content) for column, content in enumerate(row))}</tr>"
        for row in rows
    )
    return (
        f'<div class="table" tabindex="0"><table class="{kind}"><thead><tr>{top}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def records(rows: Sequence[Mapping[str, str | Badge]], *, numbers: Sequence[int] = ()) -> str:
    """Returns a table of rows with equal columns: cells by the name of their column."""
    return table(list(rows[0]), [list(it.values()) for it in rows], numbers=numbers) if rows else ""


def shown(content: Shown) -> str:
    """Returns a table that the terminal shows, too."""
    numbers = [it for it in range(len(content.head)) if it not in content.texts]
    return table(content.head, content.rows, numbers=numbers)


def folded(title: str, content: str) -> str:
    """Returns a collapsed element."""
    return f"<details><summary>{escape(title)}</summary>{content}</details>"


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
    return folded(title, f'<pre tabindex="0">{escape(text)}</pre>')


def compared_section(found: Sequence[Compared], combined: str = "") -> str:
    """Returns a section of the report; empty without variants.

    ``combined`` states the combinations of the variants.
    """
    if not found:
        return ""
    return section(
        "Comparison of variants",
        (f"{combined}. " if combined else "")
        + f"Percentiles of the horizontal error, {found[0].driven.runs} {found[0].driven.rows} "
        "each, in equal environments. Differences to the first variant are paired, with 95 % "
        "intervals.",
        shown(compared(found)),
    )
