"""Self-contained HTML page with style, charts and their code."""

from __future__ import annotations

import json
from html import escape
from importlib import resources
from importlib.metadata import version
from itertools import starmap
from string import Template
from typing import TYPE_CHECKING

from access_av.report.chart_code import chart_code
from access_av.report.parts import tile

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from access_av.report.chart import Spec


VERSION = f"version {version('access-av')}"


def sheet(
    specs: Mapping[str, Spec],
    kind: str,
    name: str = "",
    *,
    headline: str,
    lead: str,
    tiles: Iterable[tuple[str, str]],
    meta: str,
    sections: Iterable[str],
    kicker: str = "",
) -> str:
    """Returns a page of sections.

    Parameters
    ----------
    specs
        Charts by the ``id`` of their element.
    kind, name
        Kind of the result, and name of the scenario or plant.
    headline, lead, meta, kicker
        Texts of the head; the kicker is the kind unless given.
    tiles
        Values of the summary, each with its description.
    sections
        HTML of the sections.
    """
    title = f"ACCESS-AV {kind}: {name}" if name else f"ACCESS-AV {kind}"
    texts = {"title": title, "kicker": kicker or f"ACCESS-AV {kind}", "headline": headline}
    return fill(
        _read("sheet.html"),
        specs,
        **{key: escape(it) for key, it in {**texts, "lead": lead, "meta": meta}.items()},
        tiles="".join(starmap(tile, tiles)),
        sections="".join(sections),
    )


def fill(template: str, specs: Mapping[str, Spec], **fields: object) -> str:
    """Fills fields, charts, style and code into a template.

    Parameters
    ----------
    template
        Text of the template.
    specs
        Charts by the ``id`` of their element.
    fields
        HTML of the other fields.
    """
    return Template(template).substitute(
        fields,
        style=_read("style.css"),
        footer=f"ACCESS-AV {version('access-av')}. This localizer is not a safety function "
        "in the sense of ISO 3691-4.",
        bundle=chart_code(),
        specs=json.dumps(specs, separators=(",", ":")).replace("<", "\\u003c"),
        script=_read("page.js"),
    )


def _read(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
