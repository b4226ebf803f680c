"""Roads, radio heads, walls in GeoJSON: longitude and latitude, or the system of its `crs`."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError
from access_av.site_files import curves, georeference
from access_av.site_files.curves import CurveError
from access_av.site_files.drawn import Drawn, Head
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from access_av.site_files.georeference import Origin

MOST_BYTES = 64 << 20
# Largest depth of nested collections.
NESTED = 32
LINES = ("LineString", "MultiLineString")
AREAS = ("Polygon", "MultiPolygon")
POINTS = ("Point", "MultiPoint")


@dataclass
class Shape:
    """A geometry of a file, with checked numbers and without collections.

    Attributes
    ----------
    kind
        GeoJSON type of the geometry.
    lines
        Positions of each part: a point, a line, a ring.
    properties
        Properties of its feature.
    where
        Member of the file with its coordinates, for messages.
    used
        Whether it was imported.
    """

    kind: str
    lines: list[list[list[float]]]
    properties: dict[str, Any]
    where: str
    used: bool = False


@dataclass
class Map:
    """A GeoJSON file in memory.

    Attributes
    ----------
    system
        Name of its reference system; ``None`` for longitude and latitude.
    other
        Number of features and geometries without positions, by type.
    """

    path: Path
    shapes: list[Shape]
    system: str | None
    other: Counter[str] = field(default_factory=Counter)

    @classmethod
    def load(cls, path: Path) -> Map:
        """Reads a file.

        Raises
        ------
        InputError
            If the file is not GeoJSON, or a position is not two or three finite numbers.
        """
        try:
            held = json.loads(regular(path, MOST_BYTES).read_text(encoding="utf-8-sig"))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}: not GeoJSON: {error}") from error
        made = cls(path, [], georeference.name_of(held, str(path)))
        made.shapes = list(made._found(held, {}, "", 0))
        return made

    @property
    def is_in_metres(self) -> bool:
        """Whether the coordinates are metres in the plant's frame."""
        return georeference.is_metres(self.system)

    def first(self) -> list[float]:
        """Returns the first position of the road, otherwise of the file."""
        of_lines = [it for it in self.shapes if it.kind in LINES]
        return next(line[0] for it in (*of_lines, *self.shapes) for line in it.lines if line)

    def place(self, origin: Origin | None, *, given: bool) -> Origin | None:
        """Transforms all positions to metres of the plant's frame.

        Parameters
        ----------
        origin
            Latitude and longitude of the zero. ``None``: the first position.
        given
            Whether the origin was given by the user.

        Returns
        -------
        tuple or None
            The origin; ``None`` if the file is in metres of the plant's frame.

        Raises
        ------
        InputError
            If a position is not plausible for a plant, or the origin is far from it.
        """
        if self.is_in_metres or not self.shapes:
            return None
        transform = georeference.to_wgs84(self.system, str(self.path))
        places = [(it.where, at) for it in self.shapes for line in it.lines for at in line]
        for where, at in places:
            if transform is not None:
                at[:2] = transform(at)
            _check_degrees(self.path, where, at, named=self.system)
        first = self.first()
        if origin is None:
            origin = first[1], first[0]
        elif given:
            georeference.check_origin(origin, (first[0], first[1]), str(self.path))
        for _, at in places:
            at[:2] = georeference.to_plane(at[0], at[1], origin)
        return origin

    def road(self) -> list[tuple[float, float]]:
        """Returns the first line; the parts of a ``MultiLineString`` are joined at their ends.

        Raises
        ------
        InputError
            If there is no line, or the parts do not join.
        """
        for shape in self.shapes:
            if shape.kind not in LINES:
                continue
            shape.used = True
            parts = [[(x, y, 0.0) for x, y, *_ in line] for line in shape.lines if len(line) > 1]
            if not parts:
                raise InputError(f"{self.path}: {shape.where}: a road needs at least two points")
            try:
                return [(x, y) for x, y, _ in curves.without_repeats(curves.join(parts))]
            except CurveError as error:
                raise InputError(
                    f"{self.path}: {shape.where}: the road must be one line: {error}"
                ) from error
        raise InputError(f"{self.path}: the file contains no LineString (the road){self._held()}")

    def heads(self) -> list[Head]:
        """Returns every point as a radio head.

        Raises
        ------
        InputError
            If there is no point, or a point has no height or an invalid PCI.
        """
        found = []
        for shape in self.shapes:
            if shape.kind in POINTS:
                shape.used = True
                for [at] in shape.lines:
                    found.append(_head(self.path, at, shape.properties, shape.where))
        if not found:
            raise InputError(
                f"{self.path}: the file contains no Point (a radio head){self._held()}"
            )
        return found

    def walls(self) -> list[list[tuple[float, float]]]:
        """Returns the walls: lines other than the road, and the rings of polygons.

        Raises
        ------
        InputError
            When there is none.
        """
        walls = []
        for shape in self.shapes:
            if shape.kind in (*LINES, *AREAS) and not shape.used:
                shape.used = True
                walls += [[(at[0], at[1]) for at in it] for it in shape.lines if len(it) > 1]
        if not walls:
            raise InputError(
                f"{self.path}: the file contains neither a LineString nor a Polygon (a "
                f"wall){self._held()}"
            )
        return walls

    def skipped(self) -> dict[str, int]:
        """Returns the number of geometries that were not imported, by file and type."""
        unused = Counter(it.kind for it in self.shapes if not it.used) + self.other
        return {f"{self.path}: {what}": count for what, count in unused.items()}

    def _held(self) -> str:
        held = Counter(it.kind for it in self.shapes) + self.other
        return "; it has " + (", ".join(f"{n} {it}" for it, n in held.items()) or "no geometry")

    def _found(self, held: Any, properties: Any, where: str, depth: int) -> Iterator[Shape]:
        kind = held.get("type") if isinstance(held, dict) else None
        if not isinstance(kind, str) or depth > NESTED:
            self.other["member without a type" if depth <= NESTED else "nested collection"] += 1
            return
        if (
            depth
            and "crs" in held
            and georeference.name_of(held, f"{self.path}: {where}") != (self.system)
        ):
            raise InputError(
                f"{self.path}: {where}crs differs from that of the file; one system is allowed"
            )
        if kind == "FeatureCollection":
            for index, each in enumerate(_list(held, "features")):
                yield from self._found(each, {}, f"{where}features[{index}].", depth + 1)
        elif kind == "GeometryCollection":
            for index, each in enumerate(_list(held, "geometries")):
                yield from self._found(each, properties, f"{where}geometries[{index}].", depth + 1)
        elif kind == "Feature":
            geometry, its = held.get("geometry"), held.get("properties")
            if geometry is None:
                self.other["Feature without a geometry"] += 1
                return
            known = its if isinstance(its, dict) else {}
            yield from self._found(geometry, known, f"{where}geometry.", depth + 1)
        elif kind in (*LINES, *AREAS, *POINTS):
            coordinates, of = held.get("coordinates"), f"{where}coordinates"
            if coordinates == []:
                self.other[f"{kind} without coordinates"] += 1
                return
            lines = _lines(self.path, kind, coordinates, of)
            yield Shape(kind, lines, properties, of)
        else:
            self.other[kind[:80]] += 1


def _list(table: dict[str, Any], key: str) -> list[Any]:
    found = table.get(key)
    return found if isinstance(found, list) else []


def _lines(path: Path, kind: str, coordinates: Any, where: str) -> list[list[list[float]]]:
    """Returns the positions of each part of a geometry: a point, a line, a ring (RFC 7946, 3.1)."""

    def parts(held: Any) -> list[Any]:
        if not isinstance(held, list):
            raise InputError(f"{path}: {where}: {str(held)[:80]}; it must be a list of positions")
        return held

    if kind == "Point":
        lines = [[coordinates]]
    elif kind == "MultiPoint":
        lines = [[at] for at in parts(coordinates)]
    elif kind == "LineString":
        lines = [parts(coordinates)]
    elif kind == "MultiPolygon":
        lines = [parts(ring) for area in parts(coordinates) for ring in parts(area)]
    else:
        lines = [parts(line) for line in parts(coordinates)]
    return [[_numbers(path, at, where) for at in line] for line in lines]


def _numbers(path: Path, at: Any, where: str) -> list[float]:
    numbers = at if isinstance(at, list) else []
    if len(numbers) < 2 or not all(map(_is_finite, numbers)):
        raise InputError(f"{path}: {where}: {str(at)[:80]}; it must be two or three finite numbers")
    return [float(it) for it in numbers]


def _is_finite(value: Any) -> bool:
    """Returns whether a value is a finite number within the range of floats."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _check_degrees(path: Path, where: str, at: Sequence[float], *, named: str | None) -> None:
    longitude, latitude = at[0], at[1]
    if abs(longitude) <= 180.0 and -60.0 <= latitude <= 72.0:
        is_off_somalia = 41.0 <= longitude <= 60.0 and -6.0 <= latitude <= 16.0
        if not is_off_somalia:
            return
        why = "is off the Horn of Africa"
    elif abs(longitude) <= 90.0 and abs(latitude) <= 180.0:
        why = "is no [longitude, latitude] of a plant"
    else:
        raise InputError(
            f"{path}: {where}: [{longitude:g}, {latitude:g}] is no [longitude, latitude] in degrees"
            f"{'' if named is None else f' of {named}'}; a file in another system names it: "
            '"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}'
        )
    raise InputError(
        f"{path}: {where}: [{longitude:g}, {latitude:g}] {why}; if latitude and longitude are "
        "exchanged, write [longitude, latitude]"
    )


def _head(path: Path, at: Sequence[float], properties: dict[str, Any], where: str) -> Head:
    height: Any = properties.get("height_m", at[2] if len(at) > 2 else None)
    pci = properties.get("pci")
    if not _is_finite(height):
        raise InputError(
            f"{path}: {where}: {str(height)[:80]!r} is not a height; write the height of the "
            f"radio head in metres, as property `height_m` or third coordinate"
        )
    if isinstance(pci, float) and pci.is_integer():
        pci = int(pci)
    if pci is not None and (not isinstance(pci, int) or isinstance(pci, bool)):
        raise InputError(f"{path}: {where}: pci {pci!r} is not an integer")
    return Head(str(properties.get("name") or ""), at[0], at[1], float(height), pci)


def text(drawn: Drawn, origin: Origin | None) -> str:
    """Returns road, radio heads and walls as GeoJSON.

    Parameters
    ----------
    drawn
        Site; its road is written as points.
    origin
        Latitude and longitude of the map's zero. ``None``: coordinates are written in metres, and
        the file names this reference system.

    Raises
    ------
    InputError
        If the origin is not plausible for a plant, or the plant is far from its zero.
    """
    if origin is not None:
        _check_zero(drawn, origin)

    def place(x_m: float, y_m: float) -> list[float]:
        if origin is None:
            return [round(x_m, 4), round(y_m, 4)]
        return [round(it, 10) for it in georeference.to_degrees(x_m, y_m, origin)]

    features: list[dict[str, Any]] = []
    if drawn.road_m:
        line = [place(*at) for at in drawn.road_m]
        features.append(_feature("LineString", line, {"name": "road"}))
    for wall in drawn.walls_m:
        features.append(_feature("LineString", [place(*at) for at in wall], {"name": "wall"}))
    for head in drawn.heads:
        properties: dict[str, Any] = {"name": head.name, "height_m": head.z_m}
        if head.pci is not None:
            properties["pci"] = head.pci
        features.append(_feature("Point", place(head.x_m, head.y_m), properties))
    collection: dict[str, Any] = {"type": "FeatureCollection"}
    if origin is None:
        name = georeference.METRES_NAME
        collection["crs"] = {"type": "name", "properties": {"name": name}}
    return json.dumps({**collection, "features": features}, ensure_ascii=False, indent=1) + "\n"


def _check_zero(drawn: Drawn, origin: Origin) -> None:
    from pathlib import Path

    _check_degrees(Path("--origin"), "longitude, latitude", (origin[1], origin[0]), named=None)
    places = [*drawn.road_m, *((it.x_m, it.y_m) for it in drawn.heads)]
    away_m = max((math.hypot(*it) for it in places), default=0.0)
    if away_m > georeference.FARTHEST_ORIGIN_M:
        raise InputError(
            f"--origin: the plant reaches {away_m / 1000.0:,.0f} km from the zero of its map; at "
            f"most {georeference.FARTHEST_ORIGIN_M / 1000.0:g} km are allowed with degrees: "
            "subtract an offset from its coordinates, or write metres (without --origin)"
        )


def _feature(kind: str, coordinates: list[Any], properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}
