"""Curves of DXF entities in plan: object coordinates, splines, arcs, faces (extra ``cad``)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from access_av.site_files import curves

if TYPE_CHECKING:
    from access_av.site_files.curves import Vertex

# Group code 70 of a VERTEX: a control point of the spline frame, which is not on the curve.
SPLINE_FRAME = 16
# Minimum number of chords of an ellipse, and of a spline between two knots, so that no curve is
# symmetric about every one of its checked chords.
MINIMUM_CHORDS = 16
# Largest tilt of an extrusion direction that counts as vertical (sine).
VERTICAL = 1e-9
QUADRILATERALS = ("SOLID", "TRACE", "3DFACE")


class UnsupportedError(ValueError):
    """Entity without a curve in plan."""


def vertices(entity: Any, scale_m: float, sagitta_m: float) -> list[list[Vertex]]:
    """Returns the curves of an entity in metres, without edges of length zero.

    Arcs remain arcs where their plane is horizontal. Splines, ellipses and tilted arcs become
    chords that deviate from them by at most ``sagitta_m``.

    Raises
    ------
    UnsupportedError
        If the entity is not a curve.
    """
    made = [
        curves.without_repeats([(scale_m * x, scale_m * y, bulge) for x, y, bulge in curve])
        for curve in _vertices(entity, sagitta_m / scale_m)
    ]
    made = [curve for curve in made if len(curve) > 1]
    if not all(math.isfinite(number) for curve in made for at in curve for number in at):
        raise UnsupportedError("coordinates that are not finite")
    if not made:
        raise UnsupportedError("no length in plan")
    return made


def _vertices(entity: Any, sagitta: float) -> list[list[Vertex]]:
    kind = entity.dxftype()
    if kind == "LINE":
        return [[(it.x, it.y, 0.0) for it in (entity.dxf.start, entity.dxf.end)]]
    if kind == "LWPOLYLINE":
        return _in_plan(entity, list(entity.get_points("xyb")), entity.dxf.elevation, sagitta)
    if kind == "POLYLINE":
        return _polyline(entity, sagitta)
    if kind in ("ARC", "CIRCLE"):
        return _arc(entity, sagitta)
    if kind == "ELLIPSE":
        return [_flat(entity.flattening(sagitta, MINIMUM_CHORDS))]
    if kind in ("SPLINE", "HELIX"):
        return [_flat(entity.flattening(sagitta, MINIMUM_CHORDS))]
    if kind in QUADRILATERALS:
        return [_outline(_flat(entity.wcs_vertices()))]
    if kind == "MLINE":
        return [curve for part in entity.virtual_entities() for curve in _vertices(part, sagitta)]
    raise UnsupportedError("no line in plan")


def _flat(points: Any) -> list[Vertex]:
    return [(it.x, it.y, 0.0) for it in points]


def _outline(corners: list[Vertex]) -> list[Vertex]:
    """Closes an outline; a vertical face, which has no area in plan, becomes one line."""
    area = 0.5 * sum(
        a[0] * b[1] - b[0] * a[1]
        for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True)
    )
    pairs = [(a, b) for a in corners for b in corners]
    longest = max(pairs, key=lambda pair: math.dist(*pair))
    span = math.dist(*longest)
    if abs(area) <= 1e-9 * span * span:
        return list(longest)
    return [*corners, corners[0]]


def _polyline(entity: Any, sagitta: float) -> list[list[Vertex]]:
    if not (entity.is_2d_polyline or entity.is_3d_polyline):
        raise UnsupportedError("a mesh")
    on_curve = [it for it in entity.vertices if not it.dxf.get("flags", 0) & SPLINE_FRAME]
    rows = [(it.dxf.location.x, it.dxf.location.y, it.dxf.get("bulge", 0.0)) for it in on_curve]
    if entity.is_3d_polyline:
        rows = [(x, y, 0.0) for x, y, _ in rows]
        return [[*rows, rows[0]] if entity.is_closed and rows else rows]
    elevation = entity.dxf.get("elevation", (0.0, 0.0, 0.0))[2]
    return _in_plan(entity, rows, elevation, sagitta)


def _in_plan(
    entity: Any, rows: list[Vertex], elevation: float, sagitta: float
) -> list[list[Vertex]]:
    """Converts object to plan coordinates; an arc seen from below changes its direction."""
    if entity.is_closed and rows:
        rows = [*rows, (*rows[0][:2], 0.0)]
    return [_to_plan(entity, rows, elevation, sagitta)]


def _to_plan(entity: Any, rows: list[Vertex], elevation: float, sagitta: float) -> list[Vertex]:
    ocs = entity.ocs()
    if not ocs.transform:
        return rows
    if abs(math.hypot(ocs.uz.x, ocs.uz.y)) > VERTICAL and any(bulge for *_, bulge in rows):
        rows = [(x, y, 0.0) for x, y in curves.flatten(rows, sagitta)] if rows else rows
    sign = math.copysign(1.0, ocs.uz.z)
    world = ocs.points_to_wcs((x, y, elevation) for x, y, _ in rows)
    return [(at.x, at.y, sign * row[2]) for at, row in zip(world, rows, strict=True)]


def _arc(entity: Any, sagitta: float) -> list[list[Vertex]]:
    """Returns an arc or circle as edges with a bulge, each at most half a circle."""
    if entity.dxftype() == "ARC":
        start = math.radians(entity.dxf.start_angle)
        turn = math.radians(entity.dxf.end_angle) - start
        turn = turn % math.tau or math.tau
    else:
        start, turn = 0.0, math.tau
    center, radius = entity.dxf.center, abs(entity.dxf.radius)
    count = 2 if turn > 0.5 * math.tau else 1
    bulge = math.tan(0.25 * turn / count)
    rows = [
        (
            center.x + radius * math.cos(start + turn * index / count),
            center.y + radius * math.sin(start + turn * index / count),
            bulge if index < count else 0.0,
        )
        for index in range(count + 1)
    ]
    return [_to_plan(entity, rows, center.z, sagitta)]
