"""Roads, radio heads, walls in DXF (extra ``cad``): layers are chosen, the scale confirmed."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError
from access_av.site_files import curves, dxf_curves
from access_av.site_files.curves import CurveError, Point, Vertex
from access_av.site_files.drawn import Drawn, Head
from access_av.site_files.dxf_curves import UnsupportedError
from access_av.site_files.dxf_layer import Layer, TooManyError, layer_of
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


MOST_BYTES = 256 << 20
US_SURVEY_FOOT_M = 1200.0 / 3937.0
# $INSUNITS of a drawing, by its number (ezdxf's documentation): name and metres.
UNITS = {
    1: ("inches", 0.0254),
    2: ("feet", 0.3048),
    3: ("miles", 1609.344),
    4: ("millimetres", 0.001),
    5: ("centimetres", 0.01),
    6: ("metres", 1.0),
    7: ("kilometres", 1000.0),
    8: ("microinches", 2.54e-8),
    9: ("mils", 2.54e-5),
    10: ("yards", 0.9144),
    11: ("angstroms", 1e-10),
    12: ("nanometres", 1e-9),
    13: ("micrometres", 1e-6),
    14: ("decimetres", 0.1),
    15: ("decametres", 10.0),
    16: ("hectometres", 100.0),
    17: ("gigametres", 1e9),
    18: ("astronomical units", 149_597_870_700.0),
    19: ("light years", 9.460_730_472_580_8e15),
    20: ("parsecs", 3.085_677_581_491_367e16),
    21: ("US survey feet", US_SURVEY_FOOT_M),
    22: ("US survey inches", US_SURVEY_FOOT_M / 12.0),
    23: ("US survey yards", 3.0 * US_SURVEY_FOOT_M),
    24: ("US survey miles", 5280.0 * US_SURVEY_FOOT_M),
}
# Largest distance between a spline or an ellipse of the road and its chords, in metres.
ROAD_SAGITTA_M = 0.002
# Largest distance between a round wall and its chords, in metres.
WALL_SAGITTA_M = 0.005
# Points of walls count as equal below this distance, in metres.
SAME_M = 0.001
# First bytes of a DWG file.
DWG = b"AC10"
# Codes of ezdxf's auditor (ezdxf.audit.AuditError) for entities that it removed.
REMOVED = {
    "REMOVED_INVALID_GRAPHIC_ENTITY",
    "REMOVED_ENTITY_WITH_INVALID_OWNER_HANDLE",
    "UNDEFINED_BLOCK",
    "UNDEFINED_BLOCK_NAME",
    "INVALID_BLOCK_REFERENCE_CYCLE",
    "ORPHANED_LAYOUT_ENTITY",
    "INVALID_MAJOR_AXIS",
    "INVALID_ELLIPSE_RATIO",
    "INVALID_VERTEX_COUNT",
    "INVALID_MLINE_VERTEX",
    "INVALID_SPLINE_DEFINITION",
    "INVALID_SPLINE_CONTROL_POINT_COUNT",
    "INVALID_SPLINE_FIT_POINT_COUNT",
    "INVALID_SPLINE_KNOT_VALUE_COUNT",
    "INVALID_SPLINE_WEIGHT_COUNT",
    "INVALID_MESH_DATA",
}


def metres_per_unit(points: tuple[float, float, float, float], length_m: float) -> float:
    """Returns the scale of a drawing, from two points and the length between them.

    Raises
    ------
    InputError
        If both points are equal.
    """
    drawn = math.dist(points[:2], points[2:])
    if not (drawn > 0.0 and math.isfinite(drawn) and length_m > 0.0):
        raise InputError("--two-points: the two points must differ, and --length-m must be above 0")
    return length_m / drawn


def read(path: Path, what: str, name: str, scale_m: float | None) -> Drawn:
    """Reads curves as the road, points or block references as radio heads, lines as walls.

    The curves of the road join at their ends. Arcs of a road without kinks remain arcs; otherwise
    the road becomes points. A radio head's name is the attribute ``NAME`` of the block reference,
    or the name of the block. Block references are resolved, also arrays and nested ones. Layers are
    compared without regard to case.

    Parameters
    ----------
    path
        The drawing.
    what, name
        ``road``, ``heads`` or ``walls``, and its layer.
    scale_m
        Metres per unit of the drawing. The unit in the drawing itself is often wrong and has to be
        confirmed.

    Returns
    -------
    Drawn
        ``skipped`` counts every entity of the layer that was not imported, by type.

    Raises
    ------
    InputError
        Without ezdxf, for a file that is not DXF, a missing layer or one without an entity of the
        required types, and a scale that was not confirmed.
    """
    drawing, removed = _load(path)
    if scale_m is None:
        raise InputError(f"{path}: {_unconfirmed(drawing)}")
    reader = _Reader(path, drawing, scale_m)
    readers = {"road": reader.road, "heads": reader.heads, "walls": reader.walls}
    try:
        found = readers[what](name)
    except TooManyError as error:
        raise InputError(f"{path}: {error}") from error
    return replace(found, skipped={**reader.skipped, **removed}, notes=reader.notes)


def _load(path: Path) -> tuple[Any, dict[str, int]]:
    """Reads a drawing; returns it with the damaged entities that ezdxf removed."""
    try:
        from ezdxf import recover
        from ezdxf.audit import AuditError
    except ImportError as error:
        raise InputError(f"{path}: DXF needs the extra: pip install 'access-av[cad]'") from error
    with regular(path, MOST_BYTES).open("rb") as file:
        begin = file.read(4)
    if begin == DWG:
        raise InputError(f"{path}: a DWG file; save it as DXF")
    try:
        drawing, auditor = recover.readfile(path)
    # A damaged file raises any error of the code that reads its values.
    except Exception as error:
        raise InputError(f"{path}: not a DXF drawing: {str(error)[:300]}") from error
    codes = {getattr(AuditError, name, None) for name in REMOVED}
    found = [it for it in (*auditor.errors, *auditor.fixes) if it.code in codes]
    return drawing, {f"{path}: {it.message.rstrip('.')}": 1 for it in found}


def _unconfirmed(drawing: Any) -> str:
    number = drawing.header.get("$INSUNITS", 0)
    name, metres = UNITS.get(number, (None, None))
    says = (
        f"its unit is not specified ($INSUNITS is {number})"
        if name is None
        else f"it says that it is in {name} ($INSUNITS), which is often wrong"
    )
    write = "--two-points X1,Y1,X2,Y2 --length-m L with a length that was measured"
    if metres is not None:
        write += f", or --metres-per-unit {metres:.12g} if that is right"
    return f"{says}; confirm its scale: {write}"


class _Reader:
    """A drawing, and its entities that were not imported."""

    def __init__(self, path: Path, drawing: Any, scale_m: float) -> None:
        self.path, self.drawing, self.scale_m = path, drawing, scale_m
        self.model = drawing.modelspace()
        self.skipped: Counter[str] = Counter()
        self.notes: list[str] = []

    def road(self, name: str) -> Drawn:
        """Returns the road: all curves of a layer, joined."""
        layer = Layer(name)
        found = list(self._curves(layer, ROAD_SAGITTA_M))
        if not found:
            raise InputError(
                f"{self.path}: layer {name!r} contains no polylines, lines, arcs or splines; "
                f"the road must be one of them, or several that join. {self._held(layer, name)}"
            )
        self._report(layer, name)
        try:
            joined = curves.without_repeats(curves.join([curve for _, curve in found]))
        except CurveError as error:
            raise InputError(
                f"{self.path}: layer {name!r} contains {len(found)} curves; the road must be "
                f"one curve, or several that join: {error}"
            ) from error
        if len(found) > 1:
            self.notes.append(
                f"{self.path}: the road is joined from {len(found)} curves; it begins where the "
                "first one of the drawing does"
            )
        smooth = curves.segments(joined)
        if smooth is not None:
            return Drawn(start=smooth[0], segments=smooth[1])
        return Drawn(road_m=curves.flatten(joined, ROAD_SAGITTA_M))

    def heads(self, name: str) -> Drawn:
        """Returns the radio heads: points and block references of a layer."""
        layer = Layer(name, whole=("POINT", "INSERT"))
        found = []
        for entity in layer.entities(self.model):
            if entity.dxftype() == "POINT":
                at, named = entity.dxf.location, ""
            elif entity.dxftype() == "INSERT":
                at = entity.ocs().to_wcs(entity.dxf.insert)
                named = entity.get_attrib_text("NAME", "") or entity.dxf.name
            else:
                layer.skip(entity)
                continue
            found.append(Head(named, *(self.scale_m * it for it in (at.x, at.y, at.z))))
        if not found:
            raise InputError(
                f"{self.path}: layer {name!r} contains no points and no blocks; radio heads "
                f"must be points or blocks. {self._held(layer, name)}"
            )
        self._report(layer, name)
        return Drawn(heads=found)

    def walls(self, name: str) -> Drawn:
        """Returns the walls: curves of a layer, without duplicates."""
        layer = Layer(name)
        walls: dict[tuple[tuple[int, int], ...], list[Point]] = {}
        for kind, curve in self._curves(layer, WALL_SAGITTA_M):
            wall = curves.flatten(curve, WALL_SAGITTA_M)
            key = tuple((round(x / SAME_M), round(y / SAME_M)) for x, y in wall)
            if min(key, key[::-1]) in walls:
                layer.skip(kind, "drawn twice")
            walls.setdefault(min(key, key[::-1]), wall)
        if not walls:
            raise InputError(
                f"{self.path}: layer {name!r} contains no lines, polylines, arcs or splines; "
                f"walls must be one of them. {self._held(layer, name)}"
            )
        self._report(layer, name)
        return Drawn(walls_m=list(walls.values()))

    def _curves(self, layer: Layer, sagitta_m: float) -> Iterator[tuple[str, list[Vertex]]]:
        """Returns curves with their types."""
        from ezdxf.lldxf.const import DXFError

        for entity in layer.entities(self.model):
            try:
                found = dxf_curves.vertices(entity, self.scale_m, sagitta_m)
            except UnsupportedError as error:
                layer.skip(entity, str(error))
            except (DXFError, ValueError, ArithmeticError, LookupError, TypeError) as error:
                layer.skip(entity, f"damaged: {error}")
            else:
                yield from ((entity.dxftype(), curve) for curve in found)

    def _report(self, layer: Layer, name: str) -> None:
        """Counts the entities of a layer that were not imported, in all layouts."""
        for layout in self.drawing.layouts:
            if not layout.is_modelspace:
                for entity in layout:
                    if layer_of(entity) == layer.name and entity.dxftype() != "VIEWPORT":
                        layer.skip(entity, "in paper space")
        for what, count in layer.skipped.items():
            self.skipped[f"{self.path}, layer {name!r}: {what}"] += count

    def _held(self, layer: Layer, name: str) -> str:
        """Describes the entities of a layer, or all layers, for an error message."""
        if layer.skipped:
            listed = ", ".join(f"{count} {what}" for what, count in layer.skipped.items())
            return f"Not importable on layer {name!r}: {listed}"
        layers = sorted({str(entity.dxf.get("layer", "0")) for entity in self.model})
        return f"Layers: {', '.join(map(repr, layers))}"
