"""Import of road, radio heads and walls, by the extension of each file."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from access_av import _core
from access_av.errors import InputError
from access_av.run.error_bound import along_route
from access_av.settings import as_dict
from access_av.site_files import csv_file, dxf, geojson
from access_av.site_files.drawn import Drawn, Head, checked, numbered

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from access_av.site_files.georeference import Origin

# Point spacing of an exported road (m): a bend of 5 m radius is exact to a millimetre.
WRITTEN_STEP_M = 0.2
# Attributes of `Drawn` that contain a part of a plant.
PARTS = {"road": ("road_m", "start", "segments"), "heads": ("heads",), "walls": ("walls_m",)}


@dataclass(frozen=True)
class Options:
    """Settings of an import that the files do not contain.

    Attributes
    ----------
    origin
        Latitude and longitude of the map origin, for GeoJSON in degrees.
    road_layer, heads_layer, walls_layer
        Layers of a DXF drawing.
    scale_m
        Confirmed unit of a DXF drawing, in metres.
    """

    origin: Origin | None = None
    road_layer: str = "ROAD"
    heads_layer: str = "HEADS"
    walls_layer: str = "WALLS"
    scale_m: float | None = None


def read(
    road: Path | None, heads: Path | None, options: Options, walls: Path | None = None
) -> Drawn:
    """Reads road, radio heads and walls into one frame.

    Returns
    -------
    Drawn
        ``skipped`` counts all that was not imported.

    Raises
    ------
    InputError
        Unreadable file, unknown format, or files of different places.
    """
    files = _Files(options)
    files.check_frames([it for it in (road, heads, walls) if it is not None])
    drawn = Drawn()
    for path, what in ((road, "road"), (heads, "heads"), (walls, "walls")):
        if path is not None:
            drawn = files.add(drawn, path, what)
    for each in files.maps.values():
        drawn = replace(drawn, skipped={**drawn.skipped, **each.skipped()})
    road_m = [at for at, _ in itertools.groupby(drawn.road_m)]
    if repeated := len(drawn.road_m) - len(road_m):
        skipped = {**drawn.skipped, f"{road}: point equal to the one before": repeated}
        drawn = replace(drawn, road_m=road_m, skipped=skipped)
    drawn = replace(drawn, heads=numbered(drawn.heads))
    if drawn.heads and all(it.z_m == 0.0 for it in drawn.heads):
        note = (
            f"{heads}: all radio heads are at height 0 m, as in a plan without heights; write the "
            "heights of their antennas above the ground into position_m"
        )
        drawn = replace(drawn, notes=[*drawn.notes, note])
    notes = _shared_cells(drawn.heads, str(heads or road))
    drawn = replace(drawn, notes=[*drawn.notes, *notes])
    return checked(drawn, str(road), str(heads or road), str(walls))


def _shared_cells(heads: Sequence[Head], file: str) -> Iterator[str]:
    """Notes on physical cell identities that several radio heads have."""
    names: dict[int, list[str]] = {}
    for index, head in enumerate(heads):
        if head.pci is not None:
            names.setdefault(head.pci, []).append(repr(head.name or f"head {index + 1}"))
    for pci, sharing in names.items():
        if len(sharing) > 1:
            listed = ", ".join(sharing[:4]) + (", ..." if len(sharing) > 4 else "")
            yield (
                f"{file}: {len(sharing)} radio heads have PCI {pci}: {listed}; correct the PCI, "
                "or, if they belong to one cell, write the ssb_index of each of them"
            )


class _Files:
    """Files of a plant; maps are read once and have a common origin."""

    def __init__(self, options: Options) -> None:
        self.options = options
        self.origin = options.origin
        self.maps: dict[Path, geojson.Map] = {}

    def check_frames(self, paths: list[Path]) -> None:
        """Rejects files in metres next to files in geographic coordinates without an origin."""
        for path in dict.fromkeys(paths):
            if _ending(path) == "geojson":
                self.maps[path] = geojson.Map.load(path)
        geographic = [it for it in paths if it in self.maps and not self.maps[it].is_in_metres]
        in_metres = [it for it in paths if it not in geographic]
        if geographic and in_metres and self.options.origin is None:
            raise InputError(
                f"{geographic[0]}: in geographic coordinates, and {in_metres[0]} in metres: add "
                "the origin of the metres, --origin LATITUDE,LONGITUDE"
            )
        for each in self.maps.values():
            self.origin = each.place(self.origin, given=self.options.origin is not None) or (
                self.origin
            )

    def add(self, drawn: Drawn, path: Path, what: str) -> Drawn:
        """Adds the road, the radio heads or the walls of a file."""
        found = self._read(path, what)
        return replace(
            drawn,
            **{name: getattr(found, name) for name in PARTS[what]},
            skipped={**drawn.skipped, **found.skipped},
            notes=[*drawn.notes, *(it for it in found.notes if it not in drawn.notes)],
        )

    def _read(self, path: Path, what: str) -> Drawn:
        ending, options = _ending(path), self.options
        if ending == "geojson":
            return Drawn(**{PARTS[what][0]: getattr(self.maps[path], what)()})
        if ending == "csv" and what != "walls":
            return csv_file.read_road(path) if what == "road" else csv_file.read_heads(path)
        if ending == "dxf":
            return dxf.read(path, what, getattr(options, f"{what}_layer"), options.scale_m)
        csv = "" if what == "walls" else ".csv, "
        raise InputError(f"{path}: its name must end in {csv}.geojson, .json or .dxf")


def _ending(path: Path) -> str:
    ending = path.suffix.lower().lstrip(".")
    return "geojson" if ending == "json" else ending


def of_site(site: _core.Site) -> Drawn:
    """Returns a site's road as points, its radio heads and walls.

    Examples
    --------
    >>> drawn = of_site(_core.Site.load("yard"))
    >>> len(drawn.heads), len(drawn.road_m) > 100
    (4, True)
    """
    settings = as_dict(site)
    heads = [
        Head(one["name"], x_m, y_m, z_m, one["pci"])
        for one in settings["radio_heads"]
        for x_m, y_m, z_m in [one["position_m"]]
    ]
    walls = [[(x_m, y_m) for x_m, y_m in it["polyline_m"]] for it in settings.get("walls", ())]
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
