"""Self-contained HTML page with style, charts and their code."""

from __future__ import annotations

import json
from importlib import resources
from importlib.metadata import version
from string import Template
from typing import TYPE_CHECKING

from access_av.report.chart_code import chart_code

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.report.chart import Spec


def sheet(specs: Mapping[str, Spec], **fields: object) -> str:
    """Returns a page of sections; the fields are those of ``sheet.html``."""
    return fill(_read("sheet.html"), specs, **fields)


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
