"""A plant's road, radio heads and walls out of the files that it has, each by its ending."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from access_av import _core
from access_av.errors import InputError
from access_av.run.error_bound import along_route
from access_av.site_files import csv_file, dxf, geojson
from access_av.site_files.drawn import Drawn, Head, checked

if TYPE_CHECKING:
    from pathlib import Path

    from access_av.site_files.geojson import Origin

# Points of a written road, so near each other that a bend of 5 m radius is a bend to a millimetre.
WRITTEN_STEP_M = 0.2


@dataclass(frozen=True)
class Options:
    """What files alone do not say.

    Attributes
    ----------
    origin
        Latitude and longitude of the map's zero, of GeoJSON in degrees.
    road_layer, heads_layer, walls_layer
        Layers of a DXF drawing.
    scale_m
        Metres of a unit of it, confirmed.
    """

    origin: Origin | None = None
    road_layer: str = "ROAD"
    heads_layer: str = "HEADS"
    walls_layer: str = "WALLS"
    scale_m: float | None = None


def read(
    road: Path | None, heads: Path | None, options: Options, walls: Path | None = None
) -> Drawn:
    """Road, radio heads and walls, in one frame.

    Raises
    ------
    InputError
        Where a file cannot be read, is of another kind, or the two are of different places.
    """
    drawn, origin = Drawn(), options.origin
    in_degrees = False
    if road is not None:
        drawn, found = _read(road, "road", options, origin)
        in_degrees = found is not None
        origin = found or origin
        if not drawn.road_m and not drawn.segments:
            raise InputError(f"{road}: no road is in it")
    for file in filter(None, (heads, walls)):
        in_metres = road is not None and not in_degrees and options.origin is None
        if in_metres and _ending(file) == "geojson" and geojson.is_in_degrees(file):
            raise InputError(
                f"{file}: in degrees, and {road} in metres: say where the metres’ zero is, "
                "--origin LATITUDE,LONGITUDE"
            )
    if heads is not None:
        held, found = _read(heads, "heads", options, origin)
        origin = found or origin
        if not held.heads:
            raise InputError(f"{heads}: no radio head is in it")
        drawn = replace(drawn, heads=held.heads)
    if walls is not None:
        if _ending(walls) == "geojson":
            held = geojson.read_walls(walls, origin, beside_road=walls == road)
        else:
            held, _ = _read(walls, "walls", options, origin)
        drawn = replace(drawn, walls_m=held.walls_m)
    return checked(drawn, str(road), str(heads or road), str(walls))


def _ending(path: Path) -> str:
    ending = path.suffix.lower().lstrip(".")
    return "geojson" if ending == "json" else ending


def _read(
    path: Path, what: str, options: Options, origin: Origin | None
) -> tuple[Drawn, Origin | None]:
    ending = _ending(path)
    if ending == "geojson":
        return geojson.read(path, origin)
    if ending == "dxf":
        layer = {f"{what}_layer": getattr(options, f"{what}_layer")}
        return dxf.read(path, **layer, scale_m=options.scale_m), None
    if ending == "csv" and what != "walls":
        return (csv_file.read_road if what == "road" else csv_file.read_heads)(path), None
    csv = "" if what == "walls" else ".csv, "
    raise InputError(f"{path}: its name must end in {csv}.geojson, .json or .dxf")


def of_site(site: _core.Site) -> Drawn:
    """A site's road, as points so near each other that its bends stay bends, and radio heads.

    Examples
    --------
    >>> drawn = of_site(_core.Site.load("yard"))
    >>> len(drawn.heads), len(drawn.road_m) > 100
    (4, True)
    """
    settings = json.loads(site.to_json())
    heads = [
        Head(one["name"], x_m, y_m, z_m, one["pci"])
        for one in settings["radio_heads"]
        for x_m, y_m, z_m in [one["position_m"]]
    ]
    walls = [[(x_m, y_m) for x_m, y_m in it["points_m"]] for it in settings.get("walls", ())]
    if settings.get("road") is None:
        return Drawn(heads=heads, walls_m=walls)
    scenario = _core.Scenario.from_toml('name = "road"\nsite = "yard"\nvehicle = "tugger"\n')
    slow = {"site": settings, "motion.top_speed_kmh": 10.0, "motion.acceleration_mps2": 20.0}
    route = along_route(scenario.with_overrides(slow))
    along_m, x_m, y_m = (route[name].to_numpy() for name in ("along_m", "x_m", "y_m"))
    step = np.floor(along_m / WRITTEN_STEP_M)
    kept = np.concatenate([[True], np.diff(step) > 0.0])
    kept[-1] = True
    points = list(zip(x_m[kept].tolist(), y_m[kept].tolist(), strict=True))
    return Drawn(road_m=points, heads=heads, walls_m=walls)
