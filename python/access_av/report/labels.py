"""Positions of the labels of points, so that no label covers another one or a point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import altair as alt
import numpy as np
import polars as pl

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# Widths of a chart's plot for which positions are computed, from a telephone to a wide page (px).
WIDTHS_PX = (280.0, 310.0, 420.0, 540.0, 640.0, 1000.0)
# Points that are closer at every width cover each other and have one label (px).
COINCIDENT_PX = 3.0
# Size of a label, and radius of a point with its margin (px).
CHARACTER_PX, HEIGHT_PX, POINT_PX = 6.6, 13.0, 7.0
# Distances and directions of a label from its point, in the order in which they are tried.
RADII_PX = (14.0, 19.0, 26.0, 34.0, 44.0, 56.0, 70.0, 86.0)
DIRECTIONS = 16
# Distance from which on a line connects label and point (px).
LEADER_PX = 18.0
# Share of an axis that stays free at each end.
MARGIN = 0.09


@dataclass(frozen=True)
class Axis:
    """Axis of a chart of labelled points: column, title, values that it contains, scale.

    Examples
    --------
    >>> Axis("x", "x / m", [0.0, 100.0]).domain
    [-9.0, 109.0]
    """

    column: str
    title: str
    values: Sequence[float]
    log: bool = False
    axis: Any = alt.Undefined

    @property
    def domain(self) -> list[float]:
        """Domain that contains the values, with a margin at both ends."""
        values = list(self.values) or [1.0 if self.log else 0.0]
        low, high = min(values), max(values)
        if self.log:
            low, high = math.log(low), math.log(high)
        margin = MARGIN * ((high - low) or abs(high) or 1.0)
        ends = (low - margin, high + margin)
        return [math.exp(it) if self.log else it for it in ends]

    def share(self, points: pl.DataFrame) -> NDArray[np.float64]:
        """Returns relative positions of points on the axis, from 0 to 1."""
        values, ends = points[self.column].cast(pl.Float64).to_numpy(), np.array(self.domain)
        if self.log:
            values, ends = np.log(values), np.log(ends)
        return np.asarray((values - ends[0]) / (ends[1] - ends[0]), dtype=np.float64)

    def of(self, channel: Any, column: str = "") -> Any:
        """Returns the axis as ``alt.X`` or ``alt.Y``, also of another column."""
        kind = {"type": "log"} if self.log else {"zero": False}
        scale = alt.Scale(domain=self.domain, nice=False, **kind)
        field = f"{column or self.column}:Q"
        return channel(field, title=self.title, scale=scale, axis=self.axis)


def labelled(
    points: pl.DataFrame,
    name: str,
    x: Axis,
    y: Axis,
    height_px: float,
    *,
    group: str | None = None,
    **encodings: Any,
) -> tuple[alt.Chart, alt.Chart, alt.Chart]:
    """Returns the chart of points without marks, the lines to distant labels, and the labels."""
    found = placed(points, name, x, y, height_px, group=group)
    base = alt.Chart(found).encode(x=x.of(alt.X), y=y.of(alt.Y), **encodings)
    return base, *layers(base)


def placed(
    points: pl.DataFrame,
    name: str,
    x: Axis,
    y: Axis,
    height_px: float,
    *,
    group: str | None = None,
) -> pl.DataFrame:
    """Adds the columns ``label``, ``dx`` and ``dy``: text, and its offset from the point in pixels.

    Parameters
    ----------
    points
        The points.
    name
        Column of the names. A point without a name has no label, but no label covers it.
    x, y
        Axes.
    height_px
        Height of the plot.
    group
        Column within which coincident points have one label.

    Examples
    --------
    >>> rows = pl.DataFrame({"mode": [1, 2, 3], "x": [0.0, 0.0, 1.0], "y": [0.0, 0.0, 1.0]})
    >>> axes = Axis("x", "x", [0.0, 1.0]), Axis("y", "y", [0.0, 1.0])
    >>> placed(rows, "mode", *axes, 200.0)["label"].to_list()
    ['1, 2', '', '3']
    """
    across, upward = x.share(points), y.share(points)
    # Shape (widths, points, 2), y downwards.
    at = np.stack([np.stack([w * across, height_px * (1.0 - upward)], 1) for w in WIDTHS_PX])
    groups = [""] * points.height if group is None else points[group].to_list()
    names: dict[int, list[str]] = {}
    for number, text in enumerate(points[name].cast(pl.String)):
        if text is None:
            continue
        close = (
            it
            for it in names
            if groups[it] == groups[number]
            and np.hypot(*(at[:, it] - at[:, number]).T).max() < COINCIDENT_PX
        )
        names.setdefault(next(close, number), []).append(text)
    labels = {it: listed(texts) for it, texts in names.items()}
    offsets = _offsets(at, labels, height_px)
    return points.with_columns(
        label=pl.Series([labels.get(it, "") for it in range(points.height)], dtype=pl.String),
        dx=pl.Series([offsets.get(it, (0.0, 0.0))[0] for it in range(points.height)]),
        dy=pl.Series([offsets.get(it, (0.0, 0.0))[1] for it in range(points.height)]),
    )


def listed(names: Sequence[str]) -> str:
    """Returns names with commas; three or more consecutive numbers become a range.

    Examples
    --------
    >>> listed(["1", "3", "4", "5", "7", "8"])
    '1, 3–5, 7, 8'
    >>> listed(["gate", "2"])
    'gate, 2'
    """
    runs: list[list[str]] = []
    for name in names:
        last = runs[-1][-1] if runs else ""
        if last.isdecimal() and name.isdecimal() and int(name) == int(last) + 1:
            runs[-1].append(name)
        else:
            runs.append([name])
    texts = [f"{it[0]}–{it[-1]}" if len(it) > 2 else ", ".join(it) for it in runs]
    return ", ".join(texts)


def layers(base: alt.Chart) -> tuple[alt.Chart, alt.Chart]:
    """Returns the lines to distant labels, and the labels, of a chart of placed points."""
    dx, dy = alt.ExprRef("datum.dx"), alt.ExprRef("datum.dy")
    far = f"datum.label != '' && sqrt(datum.dx * datum.dx + datum.dy * datum.dy) > {LEADER_PX}"
    # A rule between the point and 0.7 of the way to its label.
    ends = alt.ExprRef("0.7 * datum.dx"), alt.ExprRef("0.7 * datum.dy")
    x, y = (base.encoding[it] for it in ("x", "y"))
    ends_at = {"x2": str(x.shorthand).split(":")[0], "y2": str(y.shorthand).split(":")[0]}
    lines = (
        base.transform_filter(far)
        .mark_rule(strokeWidth=0.8, opacity=0.7, x2Offset=ends[0], y2Offset=ends[1])
        .encode(**ends_at)
    )
    texts = base.mark_text(fontSize=11, dx=dx, dy=dy, baseline="middle").encode(text="label:N")
    return lines, texts


def _offsets(
    at: NDArray[np.float64], labels: dict[int, str], height_px: float
) -> dict[int, tuple[float, float]]:
    """Selects the offset with least overlap for each label, beginning at the most crowded point."""
    angles = np.pi / 4.0 + 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    tried = [
        (radius * math.cos(angle), -radius * math.sin(angle))
        for radius in RADII_PX
        for angle in angles
    ]
    narrow = at[0]
    crowd = {it: np.hypot(*(narrow - narrow[it]).T).__lt__(40.0).sum() for it in labels}
    found: dict[int, tuple[float, float]] = {}
    boxes: list[NDArray[np.float64]] = []
    for number in sorted(labels, key=lambda it: (-crowd[it], it)):
        half = np.array([0.5 * CHARACTER_PX * len(labels[number]) + 2.0, 0.5 * HEIGHT_PX])
        costs = []
        for offset in tried:
            centre = at[:, number] + np.array(offset)
            box = np.concatenate([centre - half, centre + half], axis=1)
            costs.append(_cost(box, boxes, at, height_px))
            if costs[-1] == 0.0:
                break
        best = int(np.argmin(costs))
        found[number] = tried[best]
        centre = at[:, number] + np.array(tried[best])
        boxes.append(np.concatenate([centre - half, centre + half], axis=1))
    return found


def _cost(
    box: NDArray[np.float64],
    others: Sequence[NDArray[np.float64]],
    at: NDArray[np.float64],
    height_px: float,
) -> float:
    """Returns the overlap (px) of a label with labels, points and the margin, over all widths."""
    total = 0.0
    for other in others:
        depth = np.minimum(box[:, 2:], other[:, 2:]) - np.maximum(box[:, :2], other[:, :2])
        total += float(np.clip(depth.min(axis=1), 0.0, None).sum())
    nearest = np.clip(at, box[:, None, :2], box[:, None, 2:])
    gap_px = np.hypot(*np.moveaxis(nearest - at, -1, 0))
    total += float(np.clip(POINT_PX - gap_px, 0.0, None).sum())
    limits = np.stack([np.array(WIDTHS_PX), np.full(len(WIDTHS_PX), height_px)], axis=1)
    outside = np.clip(-box[:, :2], 0.0, None) + np.clip(box[:, 2:] - limits, 0.0, None)
    return total + float(outside.sum())
