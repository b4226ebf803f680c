"""Coordinate reference systems of maps, and metres of a plant's own frame (extra ``geo``)."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

# Ellipsoid of WGS 84 (EPSG:7030).
SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
# Maximum distance (m) between the origin of a plant's map and the first point of a file. The
# tangent plane shortens
# lengths at this distance by 5 millionths.
FARTHEST_ORIGIN_M = 20_000.0
# Name of the frame of a plant in metres, as `export` writes it.
METRES_NAME = "urn:ogc:def:crs:OGC::Engineering"
# Last parts of names of WGS 84 in degrees, which needs no transformation: of OGC, and of EPSG.
WGS84_OGC = ("crs84", "crs84h")
WGS84_EPSG = ("4326", "4979")
# Margin of a system's area of use, in degrees: surveys cross its edge by a few kilometres.
AREA_MARGIN_DEG = 1.0

Origin = tuple[float, float]
Place = tuple[float, float]


def to_plane(longitude: float, latitude: float, origin: Origin) -> Place:
    """Returns metres east and north of an origin, on the tangent plane of the WGS 84 ellipsoid.

    Parameters
    ----------
    longitude, latitude
        Position in degrees.
    origin
        Latitude and longitude of the zero in degrees.

    Examples
    --------
    >>> east_m, north_m = to_plane(11.576, 48.138, (48.137, 11.575))
    >>> f"{east_m:.2f} {north_m:.2f}"
    '74.43 111.19'
    """
    x, y, z = _geocentric(longitude, latitude)
    x0, y0, z0 = _geocentric(origin[1], origin[0])
    dx, dy, dz = x - x0, y - y0, z - z0
    sin_lat, cos_lat = math.sin(math.radians(origin[0])), math.cos(math.radians(origin[0]))
    sin_lon, cos_lon = math.sin(math.radians(origin[1])), math.cos(math.radians(origin[1]))
    east_m = cos_lon * dy - sin_lon * dx
    north_m = cos_lat * dz - sin_lat * (cos_lon * dx + sin_lon * dy)
    return east_m, north_m


def to_degrees(east_m: float, north_m: float, origin: Origin) -> Place:
    """Returns longitude and latitude of a position in the frame of :func:`to_plane`.

    Examples
    --------
    >>> origin = (60.0, 25.0)
    >>> east_m, north_m = to_plane(*to_degrees(3000.0, -4000.0, origin), origin)
    >>> f"{east_m:.4f} {north_m:.4f}"
    '3000.0000 -4000.0000'
    """
    latitude, longitude = origin
    sin = math.sin(math.radians(latitude))
    curve = 1.0 - ECCENTRICITY_SQUARED * sin * sin
    normal_m = SEMI_MAJOR_M / math.sqrt(curve)
    meridian_m = normal_m * (1.0 - ECCENTRICITY_SQUARED) / curve
    east_per_degree = math.radians(normal_m) * math.cos(math.radians(latitude))
    # Each step reduces the relative error by the ratio of distance and Earth radius.
    for _ in range(8):
        x_m, y_m = to_plane(longitude, latitude, origin)
        longitude += (east_m - x_m) / east_per_degree
        latitude += (north_m - y_m) / math.radians(meridian_m)
    return longitude, latitude


def _geocentric(longitude: float, latitude: float) -> tuple[float, float, float]:
    sin, cos = math.sin(math.radians(latitude)), math.cos(math.radians(latitude))
    normal_m = SEMI_MAJOR_M / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sin * sin)
    return (
        normal_m * cos * math.cos(math.radians(longitude)),
        normal_m * cos * math.sin(math.radians(longitude)),
        normal_m * (1.0 - ECCENTRICITY_SQUARED) * sin,
    )


def check_origin(origin: Origin, first: Place, where: str) -> None:
    """Rejects an origin that is not at the plant.

    Parameters
    ----------
    origin
        Latitude and longitude.
    first
        Longitude and latitude of the file's first point.
    where
        The file, for the message.

    Raises
    ------
    InputError
        If origin and first point are more than :data:`FARTHEST_ORIGIN_M` apart.
    """
    away_m = _apart_m(origin, (first[1], first[0]))
    if away_m <= FARTHEST_ORIGIN_M:
        return
    exchanged = (origin[1], origin[0])
    hint = ""
    if abs(origin[1]) <= 90.0 and _apart_m(exchanged, (first[1], first[0])) <= FARTHEST_ORIGIN_M:
        hint = f"; latitude comes first: write --origin {origin[1]:g},{origin[0]:g}"
    raise InputError(
        f"--origin {origin[0]:g},{origin[1]:g}: {away_m / 1000.0:,.0f} km from the first point of "
        f"{where}, [{first[0]:.6f}, {first[1]:.6f}] (longitude, latitude); at most "
        f"{FARTHEST_ORIGIN_M / 1000.0:g} km are allowed{hint}"
    )


def _apart_m(a: Origin, b: Origin) -> float:
    """Returns the chord between two positions, in metres."""
    return math.dist(_geocentric(a[1], a[0]), _geocentric(b[1], b[0]))


def name_of(held: Any, where: str) -> str | None:
    """Returns the name of the reference system in ``crs`` (GeoJSON 2008).

    ``None`` without ``crs``, and for ``null``: GeoJSON of RFC 7946 has longitude and latitude only.
    Coordinates beyond their limits are rejected later.

    Raises
    ------
    InputError
        If ``crs`` contains no name.
    """
    if not isinstance(held, dict) or held.get("crs") is None:
        return None
    crs = held["crs"]
    properties = crs.get("properties") if isinstance(crs, dict) else None
    if isinstance(properties, dict):
        name, code = properties.get("name"), properties.get("code")
        if isinstance(name, str) and name.strip():
            return name.strip()
        if isinstance(code, (int, str)) and not isinstance(code, bool):
            return f"EPSG:{code}"
    raise InputError(
        f"{where}: crs is {str(crs)[:120]}, which names no reference system; write "
        '"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}, or leave '
        "it out for longitude and latitude"
    )


def is_metres(name: str | None) -> bool:
    """Returns whether coordinates are metres in a plant's frame."""
    return name is not None and name.lower() == METRES_NAME.lower()


def is_wgs84(name: str) -> bool:
    """Returns whether a name means longitude and latitude of WGS 84.

    Examples
    --------
    >>> [is_wgs84(it) for it in ("urn:ogc:def:crs:OGC:1.3:CRS84", "EPSG:4326", "EPSG:3857")]
    [True, True, False]
    """
    *before, last = re.split(r"[:/]+", name.lower())
    return last in WGS84_OGC or (last in WGS84_EPSG and "epsg" in before)


def to_wgs84(name: str | None, where: str) -> Callable[[Sequence[float]], Place] | None:
    """Returns the function from coordinates of a system to longitude and latitude of WGS 84.

    Returns
    -------
    callable or None
        ``None`` if the coordinates are longitude and latitude of WGS 84.

    Raises
    ------
    InputError
        Unknown system, system that is neither geographic nor projected, or pyproj not installed.
    """
    if name is None or is_wgs84(name):
        return None
    try:
        import pyproj
        from pyproj.exceptions import CRSError, ProjError
    except ImportError as error:
        raise InputError(
            f"{where}: its reference system is {name}; systems other than WGS 84 in degrees need "
            "the extra: pip install 'access-av[geo]'"
        ) from error
    try:
        system = pyproj.CRS.from_user_input(GOOGLE.get(name.upper(), name))
    except CRSError as error:
        raise InputError(
            f"{where}: crs {name!r} is not a known reference system; write an EPSG code, for "
            "example urn:ogc:def:crs:EPSG::25832, or remove crs for longitude and latitude"
        ) from error
    if system.is_compound:
        system = system.sub_crs_list[0]
    if system.is_bound and system.source_crs is not None:
        system = system.source_crs
    if not (system.is_geographic or system.is_projected):
        raise InputError(
            f"{where}: crs {name!r} ({system.name}) is neither geographic nor projected; metres of "
            f"the plant's own frame are named {METRES_NAME}"
        )
    step = pyproj.Transformer.from_crs(system, "EPSG:4326", always_xy=True)
    area = system.area_of_use

    def transform(at: Sequence[float]) -> Place:
        try:
            longitude, latitude = step.transform(at[0], at[1], errcheck=True)
        except ProjError as error:
            raise InputError(_outside(where, at, name, system.name)) from error
        if not (math.isfinite(longitude) and math.isfinite(latitude)):
            raise InputError(_outside(where, at, name, system.name))
        if area is not None and not _within(area, longitude, latitude):
            raise InputError(_outside(where, at, name, system.name))
        return longitude, latitude

    return transform


# Old names of the web-map projection EPSG:3857.
GOOGLE = {
    f"{prefix}{code}": "EPSG:3857"
    for prefix in ("EPSG:", "ESRI:", "URN:OGC:DEF:CRS:EPSG::", "URN:OGC:DEF:CRS:ESRI::")
    for code in (900913, 102100, 102113, 3785)
}


def _within(area: Any, longitude: float, latitude: float) -> bool:
    west, east = area.west - AREA_MARGIN_DEG, area.east + AREA_MARGIN_DEG
    inside = west <= longitude <= east
    if area.west > area.east:  # the area crosses the antimeridian
        inside = longitude >= west or longitude <= east
    return bool(inside and area.south - AREA_MARGIN_DEG <= latitude <= area.north + AREA_MARGIN_DEG)


def _outside(where: str, at: Sequence[float], name: str, title: str) -> str:
    return (
        f"{where}: [{at[0]:g}, {at[1]:g}] is outside of the area of use of {name} ({title}); are "
        "the coordinates exchanged, or of another system?"
    )
