"""Maps of a site to scale: background image, walls, radio heads, and the frame."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

import altair as alt
import polars as pl

from access_av.report.chart import GREEN, GREY, to_scale
from access_av.settings import as_dict
from access_av.site_files.picture import underlay

if TYPE_CHECKING:
    from access_av import _core

Chart = TypeVar("Chart", bound=alt.Chart)


@dataclass(frozen=True)
class Frame:
    """Range of a map's axes, with equal scales.

    Attributes
    ----------
    across, upward
        Scales of x and y.
    height_px
        Height of the map.
    """

    across: alt.Scale
    upward: alt.Scale
    height_px: int

    @classmethod
    def about(cls, places: list[pl.DataFrame], margin_m: float, tallest_px: float) -> Frame:
        """Returns the frame that contains the positions (``x_m``, ``y_m``) and a margin."""
        every = pl.concat(it.select(pl.col("x_m", "y_m").cast(pl.Float64)) for it in places)
        (x_low, y_low), (x_high, y_high) = every.min().row(0), every.max().row(0)
        return cls.between(
            (x_low - margin_m, x_high + margin_m), (y_low - margin_m, y_high + margin_m), tallest_px
        )

    @classmethod
    def between(
        cls, x_m: tuple[float, float], y_m: tuple[float, float], tallest_px: float
    ) -> Frame:
        """Returns the frame, enlarged to the given minimum extent."""
        *domains, height_px = to_scale(x_m, y_m, tallest_px)
        across, upward = (alt.Scale(domain=it, nice=False, zero=False) for it in domains)
        return cls(across, upward, height_px)

    def put(self, chart: Chart, *, ends: bool = False, **more: Any) -> Chart:
        """Encodes ``x_m`` and ``y_m`` of a chart, and with ``ends`` also ``x2_m`` and ``y2_m``."""
        if ends:
            more |= {"x2": "x2_m:Q", "y2": "y2_m:Q"}
        return chart.encode(
            x=alt.X("x_m:Q", title="x / m", scale=self.across),
            y=alt.Y("y_m:Q", title="y / m", scale=self.upward),
            **more,
        )

    def beneath(self, site: _core.Site) -> list[alt.Chart]:
        """Returns the lowest layers of a map: background image, if any, and walls."""
        made = []
        if (it := underlay(site)) is not None:
            edges = {"x_m": it.left_m, "x2_m": it.right_m, "y_m": it.low_m, "y2_m": it.high_m}
            picture = alt.Chart(pl.DataFrame([edges]))
            made.append(
                self.put(
                    picture.mark_image(url=it.url, aspect=False, opacity=0.55, clip=True), ends=True
                )
            )
        walls = [
            {"x_m": x_m, "y_m": y_m, "x2_m": x2_m, "y2_m": y2_m}
            for wall in as_dict(site).get("walls", ())
            for (x_m, y_m), (x2_m, y2_m) in pairwise(wall["polyline_m"])
        ]
        if walls:
            lines = alt.Chart(pl.DataFrame(walls)).mark_rule(strokeWidth=3, color=GREY)
            made.append(self.put(lines, ends=True))
        return made

    def masts(self, heads: pl.DataFrame, colour: str = GREEN) -> list[alt.Chart]:
        """Returns the layer of radio heads with names."""
        places = alt.Chart(heads)
        mark = places.mark_point(
            shape="triangle-up", filled=True, size=170, color=colour, stroke="#ffffff", opacity=1.0
        )
        name = places.mark_text(dy=-15, fontSize=12, fontWeight="bold")
        return [self.put(mark, tooltip=["name:N", "pci:Q"]), self.put(name, text="name:N")]


def heads_of(site: _core.Site) -> pl.DataFrame:
    """Returns the radio heads of a site: ``name``, ``pci``, ``ssb_index``, ``x_m``, ``y_m``."""
    heads = as_dict(site)["radio_heads"]
    return pl.DataFrame(
        [
            {
                "name": head["name"] or f"PCI {head['pci']}",
                "pci": head["pci"],
                "ssb_index": head["ssb_index"],
                "x_m": float(head["position_m"][0]),
                "y_m": float(head["position_m"][1]),
            }
            for head in heads
        ]
    )
