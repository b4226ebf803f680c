"""A page that loads nothing: style, charts and the code that draws them are inside."""

from __future__ import annotations

import json
from importlib import resources
from importlib.metadata import version
from string import Template
from typing import TYPE_CHECKING

import vl_convert

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.report.chart import Spec


def sheet(specs: Mapping[str, Spec], **fields: object) -> str:
    """A page of sections under a headline; the fields are those of ``sheet.html``."""
    return fill(_read("sheet.html"), specs, **fields)


def fill(template: str, specs: Mapping[str, Spec], **fields: object) -> str:
    """A template with its fields, its charts, style and code filled in.

    Parameters
    ----------
    template
        The template's text.
    specs
        Charts by the ``id`` of their place.
    fields
        What goes into the template's other fields, as HTML.
    """
    return Template(template).substitute(
        fields,
        style=_read("style.css"),
        footer=f"ACCESS-AV {version('access-av')}. This localizer is not a safety function "
        "in the sense of ISO 3691-4.",
        bundle=bundle(),
        specs=json.dumps(specs, separators=(",", ":")).replace("<", "\\u003c"),
        script=_read("page.js"),
    )


def bundle() -> str:
    """The code that draws charts; made once in a process, which takes a second or two."""
    return vl_convert.javascript_bundle()  # type: ignore[call-arg]  # its stub errs


def _read(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
