"""Plane curves of lines and arcs: joining, flattening, length and bends."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

from access_av.site_files.drawn import Segment

if TYPE_CHECKING:
    from collections.abc import Sequence

# A vertex: x and y in metres, and the bulge of the edge to the next vertex. The bulge is the
# tangent of a quarter of the arc's angle, positive to the left (DXF reference, group code 42).
Vertex = tuple[float, float, float]
Point = tuple[float, float]

# Largest distance between the ends of two curves that join, in metres.
JOIN_M = 0.01
# Largest angle between two edges that join without a kink, in radians.
SMOOTH_RAD = 1e-3
# Largest distance from a vertex to the same vertex of joined segments, in metres: many kinks below
# `SMOOTH_RAD` add up.
DRIFT_M = 0.002


class CurveError(ValueError):
    """Curves that do not form one road."""


def without_repeats(vertices: Sequence[Vertex]) -> list[Vertex]:
    """Removes edges of length zero."""
    kept: list[Vertex] = []
    for vertex in vertices:
        if kept and kept[-1][:2] == vertex[:2]:
            kept[-1] = vertex
        else:
            kept.append(vertex)
    return kept


def reverse(vertices: Sequence[Vertex]) -> list[Vertex]:
    """Returns the curve in the opposite direction.

    Examples
    --------
    >>> reverse([(0.0, 0.0, 1.0), (2.0, 0.0, 0.0)])
    [(2.0, 0.0, -1.0), (0.0, 0.0, 0.0)]
    """
    bulges = [0.0, *(bulge for *_, bulge in vertices[:-1])]
    turned = [(x, y, -bulge or 0.0) for (x, y, _), bulge in zip(vertices, bulges, strict=True)]
    return turned[::-1]


def join(curves: Sequence[Sequence[Vertex]]) -> list[Vertex]:
    """Joins curves at their ends into one; the first curve keeps its direction.

    Raises
    ------
    CurveError
        When more than two ends meet, or an end meets none.
    """
    joined, *others = [list(it) for it in curves]
    rest = others
    for _ in range(2):  # first beyond the end, then before the start
        while rest:
            end = joined[-1][:2]
            found = [
                (index, backwards)
                for index, curve in enumerate(rest)
                for backwards in (False, True)
                if math.dist(curve[-1 if backwards else 0][:2], end) <= JOIN_M
            ]
            if len(found) > 1:
                x_m, y_m = end
                raise CurveError(f"more than two of its curves meet at ({x_m:.2f}, {y_m:.2f}) m")
            if not found:
                break
            [(index, backwards)] = found
            curve = rest.pop(index)
            joined[-1:] = reverse(curve) if backwards else curve
        joined = reverse(joined)
    if rest:
        ends = [it[at][:2] for it in rest for at in (0, -1)]
        gap_m = min(math.dist(a, b[:2]) for a in ends for b in (joined[0], joined[-1]))
        raise CurveError(
            f"{len(rest)} of its {len(curves)} curves do not join the others; the smallest gap at "
            f"an end is {gap_m:.3g} m, and at most {JOIN_M:g} m are allowed"
        )
    return joined


def segments(vertices: Sequence[Vertex]) -> tuple[tuple[float, float, float], list[Segment]] | None:
    """Returns the start and the lines and arcs; ``None`` where edges join with a kink."""
    made: list[Segment] = []
    kinks: list[float] = []
    heading = end = drift_m = 0.0
    start = (0.0, 0.0, 0.0)
    x, y = vertices[0][:2]
    for (x0, y0, bulge), (x1, y1, _) in itertools.pairwise(vertices):
        chord_m, chord_rad = math.hypot(x1 - x0, y1 - y0), math.atan2(y1 - y0, x1 - x0)
        turn_rad = 4.0 * math.atan(bulge)
        begin = chord_rad - 0.5 * turn_rad
        if made:
            kinks.append(abs(math.remainder(begin - end, math.tau)))
        else:
            heading, start = begin, (x0, y0, begin)
        end = chord_rad + 0.5 * turn_rad
        arc_over_chord = 0.5 * turn_rad / math.sin(0.5 * turn_rad) if turn_rad else 1.0
        made.append(Segment(chord_m * arc_over_chord, turn_rad))
        # Follow the segments as a vehicle does, which knows no kinks.
        x += chord_m * math.cos(heading + 0.5 * turn_rad)
        y += chord_m * math.sin(heading + 0.5 * turn_rad)
        heading += turn_rad
        drift_m = max(drift_m, math.hypot(x - x1, y - y1))
    if drift_m > DRIFT_M or any(kink >= SMOOTH_RAD for kink in kinks):
        return None
    return start, made


def flatten(vertices: Sequence[Vertex], sagitta_m: float) -> list[Point]:
    """Returns points on the curve; chords of arcs deviate from them by at most ``sagitta_m``."""
    points = [(vertices[0][0], vertices[0][1])]
    for (x0, y0, bulge), (x1, y1, _) in itertools.pairwise(vertices):
        turn_rad = 4.0 * math.atan(bulge)
        if turn_rad != 0.0:
            half = 0.5 * turn_rad
            radius_m = 0.5 * math.hypot(x1 - x0, y1 - y0) / abs(math.sin(half))
            step_rad = 2.0 * math.acos(max(0.0, 1.0 - sagitta_m / radius_m))
            count = max(1, math.ceil(abs(turn_rad) / step_rad))
            # Centre: left of the chord for a positive turn of less than half a circle.
            along = 0.5 / math.tan(half)
            cx = 0.5 * (x0 + x1) - along * (y1 - y0)
            cy = 0.5 * (y0 + y1) + along * (x1 - x0)
            for index in range(1, count):
                cos, sin = (f(turn_rad * index / count) for f in (math.cos, math.sin))
                dx, dy = x0 - cx, y0 - cy
                points.append((cx + cos * dx - sin * dy, cy + sin * dx + cos * dy))
        points.append((x1, y1))
    return points


def length_m(points: Sequence[Point]) -> float:
    """Returns the length of a polyline in metres."""
    return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))
