"""Generated plans of plants with a known road, radio heads and walls: drawings and maps."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import BSpline

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

Points = Any  # of shape (points, 2)
HEADS = ((20.0, 8.0, 6.0), (90.0, -9.0, 7.0), (110.0, 60.0, 8.0))
WALL = ((30.0, 20.0), (80.0, 20.0), (80.0, 35.0))


def bend(radius_m: float = 20.0, count: int = 400) -> NDArray[np.float64]:
    """100 m to the east, a quarter circle to the left, 30 m to the north."""
    angles = np.linspace(-0.5 * np.pi, 0.0, count)
    arc = [100.0, radius_m] + radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    end = [[100.0 + radius_m, radius_m + 30.0]]
    return np.concatenate([[[0.0, 0.0]], arc, end])


CORNERS = np.array([[0.0, 0.0], [100.0, 0.0], [140.0, 30.0], [140.0, 70.0]])
CONTROL = np.array([[0.0, 0.0], [50.0, 0.0], [100.0, 0.0], [130.0, 30.0], [130.0, 80.0]])
KNOTS = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0])


def spline() -> NDArray[np.float64]:
    """A cubic B-spline of :data:`CONTROL`."""
    return np.asarray(BSpline(KNOTS, CONTROL, 3)(np.linspace(0.0, 2.0, 4000)))


def ellipse() -> NDArray[np.float64]:
    """A quarter of an ellipse of 120 m and 60 m, from its lowest point to the right one."""
    t = np.linspace(-0.5 * np.pi, 0.0, 4000)
    return np.column_stack([120.0 * np.cos(t), 60.0 + 60.0 * np.sin(t)])


def apart_m(a: Points, b: Points) -> float:
    """The larger of the distances from the points of one polyline to the other (Hausdorff)."""
    return max(_from(a, b), _from(b, a))


def _from(points: Points, line: Points) -> float:
    line = np.asarray(line, dtype=float)
    # Add points between the corners, so that the deviation of chords is measured.
    dense = np.concatenate([np.linspace(p, q, 20) for p, q in itertools.pairwise(points)])
    start, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-18)
    farthest = 0.0
    for chunk in np.array_split(dense, max(1, len(dense) * len(line) // 2_000_000)):
        from_start = chunk[:, None] - start
        share = np.clip((from_start * along).sum(axis=2) / square, 0.0, 1.0)
        distance = np.hypot(*np.moveaxis(from_start - share[..., None] * along, 2, 0))
        farthest = max(farthest, float(distance.min(axis=1).max()))
    return farthest


def course(road: dict[str, Any]) -> NDArray[np.float64]:
    """Points of a site's road, of segments or of points, to a millimetre."""
    if road.get("polyline_m"):
        return np.array(road["polyline_m"])
    x, y = road["start"]["x_m"], road["start"]["y_m"]
    heading = road["start"]["heading_rad"]
    points = [(x, y)]
    for segment in road["segments"]:
        length_m, turn_rad = segment["length_m"], segment["turn_rad"]
        parts = max(1, math.ceil(200 * abs(turn_rad)))
        for _ in range(parts):
            step_m, step_rad = length_m / parts, turn_rad / parts
            half = 0.5 * step_rad
            chord_m = step_m * (math.sin(half) / half if half else 1.0)
            x += chord_m * math.cos(heading + half)
            y += chord_m * math.sin(heading + half)
            heading += step_rad
            points.append((x, y))
    return np.array(points)


@dataclass(frozen=True)
class Drawing:
    """A drawing under construction.

    Attributes
    ----------
    unit_m
        Metres of its unit.
    down
        Whether entities are drawn on planes seen from below (extrusion 0, 0, −1).
    """

    document: Any
    unit_m: float
    down: bool

    @classmethod
    def new(cls, unit: int, unit_m: float, *, down: bool, version: str = "R2010") -> Drawing:
        """Returns an empty drawing."""
        import ezdxf

        made = ezdxf.new(version)
        made.header["$INSUNITS"] = unit
        return cls(made, unit_m, down)

    @property
    def model(self) -> Any:
        """Model space of the drawing."""
        return self.document.modelspace()

    def world(self, points: Points) -> list[tuple[float, ...]]:
        """World coordinates in units of the drawing."""
        return [tuple(float(it) / self.unit_m for it in point) for point in points]

    def flat(self, points: Points) -> list[tuple[float, ...]]:
        """Object coordinates in units of the drawing; x is mirrored if it is seen from below."""
        sign = -1.0 if self.down else 1.0
        return [(sign * x, *more) for x, *more in self.world(points)]

    def attributes(self, layer: str, **more: Any) -> dict[str, Any]:
        """Attributes of a flat entity."""
        extrusion = {"extrusion": (0.0, 0.0, -1.0)} if self.down else {}
        return {"layer": layer, **extrusion, **more}

    def bulge(self, turn_rad: float) -> float:
        """Returns the bulge of an arc with a given turn to the left."""
        return (-1.0 if self.down else 1.0) * math.tan(0.25 * turn_rad)


BEND_ROWS = (
    ((0.0, 0.0), 0.0),
    ((100.0, 0.0), 0.5 * math.pi),
    ((120.0, 20.0), 0.0),
    ((120.0, 50.0), 0.0),
)


def lwpolyline_with_arc(drawing: Drawing, target: Any = None, layer: str = "ROAD") -> Points:
    """A lightweight polyline with a bulge."""
    rows = [
        (*drawing.flat([at])[0], drawing.bulge(turn) if turn else 0.0) for at, turn in BEND_ROWS
    ]
    (drawing.model if target is None else target).add_lwpolyline(
        rows, format="xyb", dxfattribs=drawing.attributes(layer)
    )
    return bend()


def polyline2d_with_arc(drawing: Drawing) -> Points:
    """A polyline of R12 with a bulge."""
    rows = [
        (*drawing.flat([at])[0], drawing.bulge(turn) if turn else 0.0) for at, turn in BEND_ROWS
    ]
    drawing.model.add_polyline2d(rows, format="xyb", dxfattribs=drawing.attributes("ROAD"))
    return bend()


def lwpolyline(drawing: Drawing) -> Points:
    """A lightweight polyline with corners."""
    drawing.model.add_lwpolyline(drawing.flat(CORNERS), dxfattribs=drawing.attributes("ROAD"))
    return CORNERS


def polyline3d(drawing: Drawing) -> Points:
    """A polyline in space; its vertices are in world coordinates."""
    points = [(*at, 0.1 * index) for index, at in enumerate(CORNERS)]
    drawing.model.add_polyline3d(drawing.world(points), dxfattribs={"layer": "ROAD"})
    return CORNERS


def separate_lines_and_arc(drawing: Drawing) -> Points:
    """Two lines and an arc that join, the second line drawn backwards and first in the file."""
    a, b, c, d = (drawing.world([at])[0] for at, _ in BEND_ROWS)
    center = drawing.flat([(100.0, 20.0)])[0]
    angles = (180.0, 270.0) if drawing.down else (270.0, 360.0)
    model = drawing.model
    model.add_line(a, b, dxfattribs={"layer": "ROAD"})
    model.add_line(d, c, dxfattribs={"layer": "ROAD"})
    model.add_arc(center, 20.0 / drawing.unit_m, *angles, dxfattribs=drawing.attributes("ROAD"))
    return bend()


def control_spline(drawing: Drawing) -> Points:
    """A spline by control points."""
    made = drawing.model.add_spline(dxfattribs={"layer": "ROAD"})
    made.dxf.degree = 3
    made.control_points = [(x, y, 0.0) for x, y in drawing.world(CONTROL)]
    made.knots = KNOTS
    return spline()


def elliptic_arc(drawing: Drawing) -> Points:
    """An elliptic arc; with the extrusion down, its parameter runs clockwise."""
    [center] = drawing.world([(0.0, 60.0, 0.0)])
    [major] = drawing.world([(120.0, 0.0, 0.0)])
    limits = (0.0, 0.5 * math.pi) if drawing.down else (1.5 * math.pi, 2.0 * math.pi)
    drawing.model.add_ellipse(center, major, 0.5, *limits, dxfattribs=drawing.attributes("ROAD"))
    return ellipse()[::-1] if drawing.down else ellipse()


def spline_fit_polyline(drawing: Drawing) -> Points:
    """A polyline of R12 that was converted to a spline: control frame and curve are both
    vertices."""
    frame, curve = 16, 8
    made = drawing.model.add_polyline2d([], dxfattribs=drawing.attributes("ROAD", flags=4))
    points = spline()[::100]
    for at in drawing.flat(CONTROL):
        made.append_vertex((*at, 0.0), dxfattribs={"flags": frame})
    for at in drawing.flat(points):
        made.append_vertex((*at, 0.0), dxfattribs={"flags": curve})
    return points


def mirrored_block(drawing: Drawing) -> Points:
    """A block that holds the road on layer 0, mirrored and turned, in another block."""
    inner = drawing.document.blocks.new("INNER")
    outer = drawing.document.blocks.new("OUTER")
    plain = Drawing(drawing.document, drawing.unit_m, down=False)
    lwpolyline_with_arc(plain, inner, layer="0")
    outer.add_blockref("INNER", (5.0 / drawing.unit_m, 0.0), dxfattribs={"layer": "0"})
    attributes = drawing.attributes("ROAD", xscale=-1.0, rotation=90.0)
    drawing.model.add_blockref("OUTER", drawing.flat([(10.0, 4.0)])[0], dxfattribs=attributes)
    # Mirror, turn by a quarter; seen from below, x is mirrored again.
    x, y = (bend() + np.array([5.0, 0.0])).T
    turned = np.column_stack([-y, -x])
    if drawing.down:
        turned[:, 0] *= -1.0
    return turned + np.array([10.0, 4.0])


ROADS: tuple[Callable[[Drawing], Points], ...] = (
    lwpolyline_with_arc,
    polyline2d_with_arc,
    lwpolyline,
    polyline3d,
    separate_lines_and_arc,
    control_spline,
    elliptic_arc,
    spline_fit_polyline,
    mirrored_block,
)
# $INSUNITS and metres: millimetres, metres, inches, decimetres, US survey feet, unitless (mm).
UNITS = ((4, 1e-3), (6, 1.0), (1, 0.0254), (14, 0.1), (21, 1200.0 / 3937.0), (0, 1e-3))


def add_heads_and_wall(drawing: Drawing) -> None:
    """Adds a point, a block, a mirrored block; a wall of two entities, and a text next to it."""
    model = drawing.model
    block = drawing.document.blocks.new("MAST")
    block.add_circle((0.0, 0.0), 1.0)
    model.add_point(drawing.world([HEADS[0]])[0], dxfattribs={"layer": "HEADS"})
    for x_m, y_m, z_m in HEADS[1:]:
        [(x, y)] = drawing.flat([(x_m, y_m)])
        # Seen from below, heights are negative.
        z = (-z_m if drawing.down else z_m) / drawing.unit_m
        model.add_blockref("MAST", (x, y, z), dxfattribs=drawing.attributes("heads"))
    first, corner, last = WALL
    model.add_line(
        drawing.world([first])[0], drawing.world([corner])[0], dxfattribs={"layer": "WALLS"}
    )
    rows = drawing.flat([corner, last])
    if drawing.document.dxfversion == "AC1009":
        model.add_polyline2d(rows, dxfattribs=drawing.attributes("walls"))
    else:
        model.add_lwpolyline(rows, dxfattribs=drawing.attributes("walls"))
    model.add_text("hall", dxfattribs={"layer": "WALLS"})


def write_map(
    path: Path,
    road: Sequence[Sequence[float]] | Points,
    crs: str | None,
    origin: tuple[float, float],
    *,
    kind: str,
) -> None:
    """Writes the plant as GeoJSON in a reference system, by `pyproj`.

    ``kind`` is one of ``features``, ``multi``, ``collection``.
    """
    import pyproj

    latitude, longitude = origin
    plane = f"+proj=aeqd +lat_0={latitude} +lon_0={longitude} +ellps=WGS84 +units=m"
    system = {"EPSG:900913": "EPSG:3857"}.get(crs or "EPSG:4326", crs or "EPSG:4326")
    to_degrees = pyproj.Transformer.from_crs(plane, "EPSG:4326", always_xy=True)
    to_system = pyproj.Transformer.from_crs("EPSG:4326", system, always_xy=True)

    def place(x_m: float, y_m: float, *z_m: float) -> list[float]:
        return [*map(float, to_system.transform(*to_degrees.transform(x_m, y_m))), *z_m]

    line = [place(*at) for at in road]
    wall = [place(*at) for at in (*WALL, WALL[0])]
    heads = [place(*at) for at in HEADS]

    def feature(geometry: dict[str, Any], **properties: Any) -> dict[str, Any]:
        return {"type": "Feature", "properties": properties, "geometry": geometry}

    def geometry(kind: str, coordinates: Any) -> dict[str, Any]:
        return {"type": kind, "coordinates": coordinates}

    if kind == "features":
        made = [
            feature(geometry("LineString", line)),
            *(feature(geometry("Point", at)) for at in heads),
            feature(geometry("Polygon", [wall])),
        ]
    elif kind == "multi":
        middle = len(line) // 2
        # The second part is written first, and backwards.
        parts = [line[: middle + 1], line[middle:][::-1]]
        made = [
            feature(geometry("MultiPolygon", [[wall]])),
            feature(geometry("MultiLineString", parts)),
            feature(geometry("MultiPoint", heads), name="mast"),
        ]
    else:
        geometries = [
            geometry("LineString", line),
            geometry("MultiPoint", heads),
            {"type": "GeometryCollection", "geometries": [geometry("Polygon", [wall])]},
        ]
        made = [feature({"type": "GeometryCollection", "geometries": geometries})]
    whole: dict[str, Any] = {"type": "FeatureCollection", "features": made}
    if crs is not None:
        name = f"urn:ogc:def:crs:{crs.replace(':', '::')}"
        whole["crs"] = {"type": "name", "properties": {"name": name}}
    path.write_text(json.dumps(whole), "utf-8")
