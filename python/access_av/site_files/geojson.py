"""Roads, radio heads, walls in GeoJSON: degrees, or metres where the file says so."""

from __future__ import annotations

import itertools
import json
import math
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError
from access_av.site_files.drawn import Drawn, Head
from access_av.tables.results_directory import regular

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

EARTH_RADIUS_M = 6_371_008.8  # mean (IUGG); a plant is small enough for a sphere
METRES_PER_DEGREE = math.radians(EARTH_RADIUS_M)
MOST_BYTES = 64 << 20
# Systems in degrees; any other that a file names is in metres.
IN_DEGREES = ("CRS84", "4326", "4258", "4979")
METRES_NAME = "urn:ogc:def:crs:OGC::Engineering"

Origin = tuple[float, float]


def read_walls(path: Path, origin: Origin | None, *, beside_road: bool) -> Drawn:
    """Read every ``LineString``, and the rings of every ``Polygon``, as walls.

    Parameters
    ----------
    path
        The file.
    origin
        As of :func:`read`.
    beside_road
        Whether the first ``LineString`` is the road.

    Raises
    ------
    InputError
        When it is no GeoJSON, holds none, or its coordinates cannot be those of a plant.
    """
    held = _held(path)
    shapes = [(geometry, where) for geometry, _, where in _shapes(held)]
    lines = [(_list(it), where) for it, where in shapes if it["type"] == "LineString"]
    rings = [(ring, where) for it, where in shapes if it["type"] == "Polygon" for ring in _list(it)]
    walls = [
        [_numbers(path, at, where) for at in line]
        for line, where in (*lines[beside_road:], *rings)
        if isinstance(line, list)
    ]
    walls = [wall for wall in walls if len(wall) > 1]
    if not walls:
        raise InputError(f"{path}: neither a LineString nor a Polygon (a wall) is in it")
    if not _in_metres(held):
        for at in itertools.chain(*walls):
            _check_degrees(path, at)
        zero = origin or (walls[0][0][1], walls[0][0][0])
        walls = [[_to_metres(at, zero) for at in wall] for wall in walls]
    return Drawn(walls_m=[[(at[0], at[1]) for at in wall] for wall in walls])


def is_in_degrees(path: Path) -> bool:
    """Whether a file's coordinates are longitude and latitude."""
    return not _in_metres(_held(path))


def _held(path: Path) -> Any:
    try:
        return json.loads(regular(path, MOST_BYTES).read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not GeoJSON: {error}") from error


def read(path: Path, origin: Origin | None = None) -> tuple[Drawn, Origin | None]:
    """Read the first ``LineString`` as the road, and every ``Point`` as a radio head.

    A point's properties ``name``, ``pci`` and ``height_m`` are taken over; the height may also be
    its third coordinate.

    Parameters
    ----------
    path
        The file.
    origin
        Latitude and longitude in degrees of the map's zero. Without, the road's first point is it,
        or the first radio head where there is no road.

    Returns
    -------
    tuple
        What was drawn, and the origin; ``None`` where the file is in metres.

    Raises
    ------
    InputError
        When it is no GeoJSON, holds neither, or its coordinates cannot be those of a plant.
    """
    held = _held(path)
    shapes = list(_shapes(held))
    lines = [(geometry, where) for geometry, _, where in shapes if geometry["type"] == "LineString"]
    points = [it for it in shapes if it[0]["type"] == "Point"]
    if not lines and not points:
        raise InputError(
            f"{path}: neither a LineString (the road) nor a Point (a radio head) is in it"
        )
    road = [_numbers(path, at, where) for geometry, where in lines[:1] for at in _list(geometry)]
    places = [_numbers(path, geometry.get("coordinates"), where) for geometry, _, where in points]
    if _in_metres(held):
        origin = None
        road_m, places_m = road, places
    else:
        for at in (*road, *places):
            _check_degrees(path, at)
        if origin is None:
            first = (road or places)[0]
            origin = first[1], first[0]
        road_m, places_m = ([_to_metres(at, origin) for at in it] for it in (road, places))
    heads = [
        _head(path, at, properties, where)
        for at, (_, properties, where) in zip(places_m, points, strict=True)
    ]
    return Drawn(road_m=[(at[0], at[1]) for at in road_m], heads=heads), origin


def _shapes(held: Any, where: str = "") -> Iterator[tuple[dict[str, Any], dict[str, Any], str]]:
    if not isinstance(held, dict):
        return
    if held.get("type") == "FeatureCollection":
        for index, each in enumerate(_list(held, "features")):
            yield from _shapes(each, f"features[{index}].")
    elif held.get("type") == "Feature":
        geometry = held.get("geometry")
        if isinstance(geometry, dict):
            properties = held.get("properties")
            known = properties if isinstance(properties, dict) else {}
            yield {"type": None, **geometry}, known, f"{where}geometry.coordinates"
    elif "type" in held:
        yield held, {}, f"{where}coordinates"


def _list(table: dict[str, Any], key: str = "coordinates") -> list[Any]:
    found = table.get(key)
    return found if isinstance(found, list) else []


def _numbers(path: Path, at: Any, where: str) -> list[float]:
    numbers = at if isinstance(at, list) else []
    if len(numbers) < 2 or not all(
        isinstance(it, (int, float)) and not isinstance(it, bool) and math.isfinite(it)
        for it in numbers
    ):
        raise InputError(f"{path}: {where}: {at!r}; two or three finite numbers are needed")
    return [float(it) for it in numbers]


def _in_metres(held: Any) -> bool:
    crs = held.get("crs") if isinstance(held, dict) else None
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return isinstance(name, str) and not name.endswith(IN_DEGREES)


def _check_degrees(path: Path, at: Sequence[float]) -> None:
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
            f"{path}: [{longitude:g}, {latitude:g}] is no [longitude, latitude] in degrees; a file "
            'in metres names its system: "crs": {"type": "name", "properties": {"name": '
            '"urn:ogc:def:crs:EPSG::25832"}}'
        )
    raise InputError(
        f"{path}: [{longitude:g}, {latitude:g}] {why}; if latitude and longitude are exchanged, "
        "write [longitude, latitude]"
    )


def _to_metres(at: Sequence[float], origin: Origin) -> list[float]:
    """East and north of the origin on its tangent plane; a third coordinate stays."""
    latitude, longitude = origin
    shrink = math.cos(math.radians(latitude))
    return [
        (at[0] - longitude) * METRES_PER_DEGREE * shrink,
        (at[1] - latitude) * METRES_PER_DEGREE,
        *at[2:],
    ]


def _head(path: Path, at: Sequence[float], properties: dict[str, Any], where: str) -> Head:
    height = properties.get("height_m", at[2] if len(at) > 2 else None)
    pci = properties.get("pci")
    if not isinstance(height, (int, float)) or isinstance(height, bool):
        raise InputError(
            f"{path}: {where}: {height!r} is no height; a radio head needs one, as property "
            "`height_m` or third coordinate, in metres"
        )
    if pci is not None and (not isinstance(pci, int) or isinstance(pci, bool)):
        raise InputError(f"{path}: {where}: pci {pci!r} is no whole number")
    return Head(str(properties.get("name") or ""), at[0], at[1], float(height), pci)


def text(drawn: Drawn, origin: Origin | None) -> str:
    """A road, radio heads and walls as GeoJSON.

    Parameters
    ----------
    drawn
        What is written; its road as points.
    origin
        Latitude and longitude of the map's zero; metres, so named, where ``None``.
    """

    def place(x_m: float, y_m: float) -> list[float]:
        if origin is None:
            return [round(x_m, 4), round(y_m, 4)]
        latitude, longitude = origin
        shrink = math.cos(math.radians(latitude))
        return [
            round(longitude + x_m / (METRES_PER_DEGREE * shrink), 10),
            round(latitude + y_m / METRES_PER_DEGREE, 10),
        ]

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
        collection["crs"] = {"type": "name", "properties": {"name": METRES_NAME}}
    return json.dumps({**collection, "features": features}, ensure_ascii=False, indent=1) + "\n"


def _feature(kind: str, coordinates: list[Any], properties: dict[str, Any]) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}
