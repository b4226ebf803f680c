"""Charts of the report as pictures, for a page that runs no code."""

from __future__ import annotations

from typing import TYPE_CHECKING

import vl_convert

from access_av.paper.report import controller, unknowns

if TYPE_CHECKING:
    from access_av.paper.study import Study
    from access_av.report.chart import Spec

WIDTH = 640


def figures(study: Study) -> dict[str, str]:
    """The charts that need the whole study, as SVG by their names."""
    specs: dict[str, Spec] = {}
    controller.contribution(study, specs)
    unknowns.unknowns(study, specs)
    return {
        name: vl_convert.vegalite_to_svg(spec | {"width": WIDTH, "background": "white"})
        for name, spec in specs.items()
    }
