"""Fragments of the report's HTML."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from access_av.run.service_levels import Verdict


# Kind of badge by how a service level was judged.
OUTCOMES = {"reached": "yes", "too few drives": "fit", "not reached": "no"}


def badge(text: str, kind: str) -> str:
    """A small label: ``kind`` is ``yes``, ``no``, ``fit``, ``arithmetic`` or ``construction``."""
    return f'<span class="badge {kind}">{escape(text)}</span>'


def tile(value: str, text: str) -> str:
    """One number of the summary."""
    return f'<div class="tile"><b>{escape(value)}</b><span>{escape(text)}</span></div>'


def figure(chart_id: str, caption: str = "", title: str = "") -> str:
    """A place for a chart."""
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
    """A table; ``numbers`` are the columns set to the right. Cells are HTML already.

    On a narrow screen each row of ``cards`` becomes a card whose lines are named after the head; a
    ``matrix`` keeps its columns, and leaves out of its cells what is small or in a ``span``.
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


def service_levels(verdicts: Iterable[Verdict]) -> str:
    """A table of 3GPP's positioning service levels, and which are reached."""
    rows = [
        (
            escape(verdict.level.name),
            f"{verdict.level.accuracy_m:g} m",
            f"{verdict.level.availability:.1%}",
            f"{verdict.share:.2%}",
            f"{verdict.least_share:.2%}",
            badge(verdict.outcome, OUTCOMES[verdict.outcome]),
        )
        for verdict in verdicts
    ]
    head = ("3GPP service level", "accuracy", "asked", "within", "at least (95 %)", "")
    return table(head, rows, numbers=(1, 2, 3, 4))


def section(title: str, text: str, body: str) -> str:
    """A part of the page, with a heading and a paragraph where there is text."""
    lead = f"<p>{escape(text)}</p>" if text else ""
    return f"<section><h2>{escape(title)}</h2>{lead}{body}</section>"


def warnings(found: Iterable[object]) -> str:
    """What of the settings is most likely not what was meant; nothing where all is plausible."""
    items = "".join(f"<li>{escape(str(it))}</li>" for it in found)
    text = "Each of these can be, and is most likely not what was meant:"
    return section("Check these settings first", text, f"<ul>{items}</ul>") if items else ""


def source(title: str, text: str) -> str:
    """A file to unfold."""
    # What scrolls can be reached by keyboard.
    shown = f'<pre tabindex="0">{escape(text)}</pre>'
    return f"<details><summary>{escape(title)}</summary>{shown}</details>"
