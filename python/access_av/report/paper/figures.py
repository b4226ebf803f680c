"""Charts of the report as SVG, for pages without scripts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import vl_convert

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.report.chart import Spec

WIDTH = 640
# Figures that need the whole study; the last two need the sensitivity analysis.
NAMES = ("ablation", "front", "sobol", "share")


def figures(specs: Mapping[str, Spec]) -> dict[str, str]:
    """Returns these charts as SVG, by their names."""
    return {
        name: vl_convert.vegalite_to_svg(specs[name] | {"width": WIDTH, "background": "white"})
        for name in NAMES
        if name in specs
    }
