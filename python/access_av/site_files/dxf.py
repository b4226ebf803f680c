"""Roads, radio heads, walls in DXF (extra ``cad``): layers are chosen, the scale confirmed."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError
from access_av.site_files.drawn import Drawn, Head, Segment
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from pathlib import Path

MOST_BYTES = 256 << 20
# $INSUNITS of a drawing, by its number (ezdxf's documentation): name and metres.
UNITS = {
    1: ("inches", 0.0254),
    2: ("feet", 0.3048),
    4: ("millimetres", 0.001),
    5: ("centimetres", 0.01),
    6: ("metres", 1.0),
}
# Directions of two segments that meet, nearer than this, make no corner (rad).
SMOOTH_RAD = 1e-3
# Round walls become straight ones that leave them by no more.
SAGITTA_M = 0.05


def metres_per_unit(points: tuple[float, float, float, float], length_m: float) -> float:
    """The drawing's scale, by two of its points and the length between them.

    Raises
    ------
    InputError
        When the points are one.
    """
    drawn = math.dist(points[:2], points[2:])
    if not (drawn > 0.0 and math.isfinite(drawn) and length_m > 0.0):
        raise InputError("--two-points: two different points and a length above 0 are needed")
    return length_m / drawn


def read(
    path: Path,
    *,
    road_layer: str | None = None,
    heads_layer: str | None = None,
    walls_layer: str | None = None,
    scale_m: float | None = None,
) -> Drawn:
    """Read a polyline as the road, points or block references as radio heads, lines as walls.

    Arcs of a polyline that join its lines without a kink stay what they are; elsewhere its corners
    become points. A radio head's name is the block's attribute ``NAME``, or the block's own name.

    Parameters
    ----------
    path
        The drawing.
    road_layer, heads_layer, walls_layer
        Layers; ``None`` for none.
    scale_m
        Metres of a unit of the drawing. What the drawing itself says is often wrong and has to be
        confirmed.

    Raises
    ------
    InputError
        Without ezdxf, for a file that is no DXF, a layer that there is not or that holds nothing
        of the kind, and a scale that nobody confirmed.
    """
    try:
        from ezdxf.filemanagement import readfile
        from ezdxf.lldxf.const import DXFError
        from ezdxf.path import make_path
    except ImportError as error:
        raise InputError(f"{path}: DXF needs the extra: pip install 'access-av[cad]'") from error
    try:
        drawing = readfile(regular(path, MOST_BYTES))
    except (DXFError, UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{path}: not a DXF drawing: {error}") from error
    if scale_m is None:
        raise InputError(f"{path}: {_unconfirmed(drawing)}")
    model = drawing.modelspace()
    layers = sorted({entity.dxf.layer for entity in model})
    start = (0.0, 0.0, 0.0)
    segments: list[Segment] = []
    points: list[tuple[float, float]] = []
    if road_layer is not None:
        found = [
            entity
            for entity in model.query("LWPOLYLINE POLYLINE LINE")
            if entity.dxf.layer == road_layer
        ]
        if len(found) != 1:
            raise InputError(
                f"{path}: layer {road_layer!r} holds {len(found)} polylines and lines; the road is "
                f"exactly one. Layers: {', '.join(map(repr, layers))}"
            )
        vertices = _vertices(found[0], scale_m)
        start, segments, points = _shape(path, vertices)
    heads = [] if heads_layer is None else _heads(path, model, heads_layer, scale_m, layers)
    walls = [
        [
            (scale_m * it.x, scale_m * it.y)
            for it in make_path(entity).flattening(SAGITTA_M / scale_m)
        ]
        for entity in model.query("LINE LWPOLYLINE POLYLINE ARC CIRCLE")
        if entity.dxf.layer == walls_layer
    ]
    if walls_layer is not None and not walls:
        raise InputError(
            f"{path}: layer {walls_layer!r} holds no lines, polylines or arcs; walls are such. "
            f"Layers: {', '.join(map(repr, layers))}"
        )
    return Drawn(points, start, segments, heads, walls)


def _unconfirmed(drawing: Any) -> str:
    number = int(drawing.header.get("$INSUNITS", 0))
    name, metres = UNITS.get(number, (f"no unit that is known here ({number})", None))
    says = f"it says that it is in {name} ($INSUNITS)"
    write = "--two-points X1,Y1,X2,Y2 --length-m L with a length that was measured"
    if metres is not None:
        write += f", or --metres-per-unit {metres:g} if that is right"
    return f"{says}, which is often wrong; confirm its scale: {write}"


def _vertices(entity: Any, scale_m: float) -> list[tuple[float, float, float]]:
    """Points in metres, each with its bulge: the tangent of a quarter of the arc that follows."""
    if entity.dxftype() == "LINE":
        ends = (entity.dxf.start, entity.dxf.end)
        return [(scale_m * end.x, scale_m * end.y, 0.0) for end in ends]
    if entity.dxftype() == "LWPOLYLINE":
        rows = [(x, y, bulge) for x, y, bulge in entity.get_points("xyb")]
    else:
        rows = [
            (it.dxf.location.x, it.dxf.location.y, it.dxf.get("bulge", 0.0))
            for it in entity.vertices
        ]
    if getattr(entity, "is_closed", False) and rows:
        rows.append((*rows[0][:2], 0.0))
    return [(scale_m * x, scale_m * y, bulge) for x, y, bulge in rows]


def _shape(
    path: Path, vertices: list[tuple[float, float, float]]
) -> tuple[tuple[float, float, float], list[Segment], list[tuple[float, float]]]:
    """Lines and arcs where they join without a kink, else points."""
    segments, ends = [], []
    for (x0, y0, bulge), (x1, y1, _) in itertools.pairwise(vertices):
        chord_m = math.hypot(x1 - x0, y1 - y0)
        if chord_m == 0.0:
            continue
        turn_rad = 4.0 * math.atan(bulge)
        chord_rad = math.atan2(y1 - y0, x1 - x0)
        length_m = chord_m if bulge == 0.0 else chord_m * 0.5 * turn_rad / math.sin(0.5 * turn_rad)
        segments.append(Segment(length_m, turn_rad))
        ends.append((chord_rad - 0.5 * turn_rad, chord_rad + 0.5 * turn_rad))
    if not segments:
        raise InputError(f"{path}: the road’s polyline has no length")
    start = (vertices[0][0], vertices[0][1], ends[0][0])
    kinks = (
        abs(math.remainder(begin - end, 2.0 * math.pi))
        for (_, end), (begin, _) in itertools.pairwise(ends)
    )
    if all(kink < SMOOTH_RAD for kink in kinks):
        return start, segments, []
    if any(segment.turn_rad for segment in segments):
        raise InputError(
            f"{path}: the road’s polyline has arcs, and corners beside them; let its arcs join its "
            "lines without a kink, or draw it of straight lines alone"
        )
    return (0.0, 0.0, 0.0), [], [(x, y) for x, y, _ in vertices]


def _heads(path: Path, model: Any, layer: str, scale_m: float, layers: list[str]) -> list[Head]:
    found = []
    for entity in model.query("POINT INSERT"):
        if entity.dxf.layer != layer:
            continue
        is_block = entity.dxftype() == "INSERT"
        at = entity.dxf.insert if is_block else entity.dxf.location
        named = entity.get_attrib_text("NAME", "") if is_block else ""
        name = named or (entity.dxf.name if is_block else "")
        found.append(Head(name, scale_m * at.x, scale_m * at.y, scale_m * at.z))
    if not found:
        raise InputError(
            f"{path}: layer {layer!r} holds no points and no blocks; radio heads are one or the "
            f"other. Layers: {', '.join(map(repr, layers))}"
        )
    return found
