"""Names and colours of the lines in the charts of the evaluation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from access_av.paper.statements import ADAPTIVE_LABEL, METHODS
from access_av.report.chart import PURPLE, colours
from access_av.signal.methods import LABELS, label

if TYPE_CHECKING:
    import altair as alt

    from access_av.paper.evaluation import Evaluation

EVERY_SSB = "MUSIC, 20 ms"
# Colours of the paper: black, red, green and blue; black is a slate that is visible on dark pages.
COLOURS = {
    LABELS["music"]: "#5b6470",
    LABELS["esprit"]: "#d62728",
    LABELS["root_music"]: "#2ca02c",
    ADAPTIVE_LABEL: "#1f77e0",
    EVERY_SSB: PURPLE,
}
# Names in the order of the legend.
NAMES = [*(LABELS[method] for method in METHODS), ADAPTIVE_LABEL]


def coloured(names: list[str]) -> alt.Color:
    """Returns the colours of these lines."""
    return colours("line:N", {name: COLOURS[name] for name in names})


def by_mode(evaluation: Evaluation) -> pl.DataFrame:
    """Returns the operating points of a power mode, with the name of their ``line``."""
    return evaluation.points.filter(pl.col("mode").is_not_null()).with_columns(
        pl.struct("method", "adaptive")
        .map_elements(
            lambda row: label(row["method"], adaptive=row["adaptive"]), return_dtype=pl.String
        )
        .alias("line")
    )
