"""Example files: short, commented, with realistic values and units."""

from __future__ import annotations

import json
from importlib import resources
from string import Template
from typing import TYPE_CHECKING

from access_av.site_files.drawn import Drawn, Head, Segment

if TYPE_CHECKING:
    from access_av.site_files.picture import Placed

KINDS = ("plant", "site", "vehicle", "scenario", "node")
# Default values of an imported radio head.
HEAD = "position_std_m = 0.1\n{cell}eirp_dbm = 10.0 # to be looked up\neirp_std_db = 2.0\n"
SSB_INDICES = 8  # SSB indices of a burst at most carriers below 6 GHz (TS 38.213, 4.1)
FIRST_PCI = 21
EXAMPLE_STOP_M = 320.0
TRIPS = "trips_per_day = 40 # of one vehicle"
# Placeholder of missing parts while the rest of a file is checked.
STRAIGHT = Drawn(segments=[Segment(100.0)], heads=[Head("", 50.0, 10.0, 8.0)])
WALL_POINTS = 100  # maximum number of points of a wall (settings/walls.rs)


def new(
    kind: str,
    name: str,
    file: str,
    drawn: Drawn | None = None,
    placed: Placed | None = None,
    *,
    filled: bool = False,
) -> str:
    """Returns the text of a new file.

    A site or plant with imported parts contains no road, radio head, stop or trip of the example:
    comments contain these, and :func:`missing` names them.

    Parameters
    ----------
    kind
        One of :data:`KINDS`.
    name
        Short name.
    file
        Name of the file, for the commands in its comments.
    drawn
        Imported road, radio heads and walls, of a plant or a site.
    placed
        Background image of the maps.
    filled
        Whether missing keys are filled with placeholders, so that the others can be checked.
    """
    prefix = "site." if kind == "plant" else ""
    example = Template(_read("example_site.toml")).substitute(prefix=prefix)
    road, heads = example.split("\n# Different SSB", 1)
    heads, example_walls = f"# Different SSB{heads}".split("\n# Walls in", 1)
    walls = f"\n# Walls in{example_walls}"
    stops = f"stops = [{{ at_m = {EXAMPLE_STOP_M:.1f}, dwell_s = 15.0 }}]"
    trips = TRIPS
    if drawn is not None:
        made_road = _road(drawn, prefix) if drawn.length_m else None
        made_heads = _heads(drawn, prefix) if drawn.heads else None
        if filled:
            road, heads = _road(STRAIGHT, prefix), _heads(STRAIGHT, prefix)
        road = made_road or (road if filled else _commented(road))
        heads = made_heads or (heads if filled else _commented(heads))
        walls = _walls(drawn, prefix)
        stops = "stops = [] # for example [{ at_m = 120.0, dwell_s = 15.0 }]"
        trips = "trips_per_day = 1" if filled else f"# {TRIPS}"
    picture = "" if placed is None else _picture(placed, prefix)
    site = f"{road.rstrip()}\n\n{heads.rstrip()}\n{walls}{picture}"
    return Template(_read(f"{kind}.toml")).substitute(
        name=name, file=file, site=site, stops=stops, trips=trips
    )


def missing(kind: str, drawn: Drawn | None) -> list[str]:
    """Returns the required keys of a new file that the imported files do not contain."""
    if drawn is None or kind not in ("plant", "site"):
        return []
    prefix = "site." if kind == "plant" else ""
    return [
        *([f"[{prefix}road]"] if kind == "plant" and not drawn.length_m else []),
        *([] if drawn.heads else [f"[[{prefix}radio_heads]]"]),
        *(["fleet.trips_per_day"] if kind == "plant" else []),
    ]


def _commented(text: str) -> str:
    lines = (
        f"# {line}" if line and not line.startswith("#") else line for line in text.splitlines()
    )
    return "\n".join(lines)


def _road(drawn: Drawn, prefix: str) -> str:
    lines = [f"[{prefix}road]", "width_m = 5.0"]
    if drawn.segments:
        x_m, y_m, heading_rad = drawn.start
        lines += [
            f"start = {{ x_m = {x_m:.4f}, y_m = {y_m:.4f}, heading_rad = {heading_rad:.12f} }}",
            "segments = [",
            *(
                f"    {{ length_m = {it.length_m:.6f}, turn_rad = {it.turn_rad:.12f} }},"
                for it in drawn.segments
            ),
            "]",
        ]
    else:
        lines += [
            "polyline_m = [",
            *(f"    [{x_m:.4f}, {y_m:.4f}]," for x_m, y_m in drawn.road_m),
            "]",
        ]
    return "\n".join(lines)


def _walls(drawn: Drawn, prefix: str) -> str:
    """Returns the tables of walls; walls with too many corners are split."""
    made = ""
    for wall in drawn.walls_m:
        for first in range(0, len(wall) - 1, WALL_POINTS - 1):
            corners = wall[first : first + WALL_POINTS]
            points = ", ".join(f"[{x_m:.4f}, {y_m:.4f}]" for x_m, y_m in corners)
            made += f"\n[[{prefix}walls]] # loss_db: that of concrete\npolyline_m = [{points}]\n"
    return made


def _picture(placed: Placed, prefix: str) -> str:
    x_px, y_px = placed.zero_px
    return (
        "\n# Background image of the maps; no result depends on it.\n"
        f"[{prefix}underlay]\n"
        f"file = {json.dumps(placed.file, ensure_ascii=False)}\n"
        f"metres_per_pixel = {placed.metres_per_pixel:.9g}\n"
        f"zero_px = [{x_px:.3f}, {y_px:.3f}] # map origin, from the upper left corner\n"
    )


def _heads(drawn: Drawn, prefix: str) -> str:
    taken = {head.pci for head in drawn.heads}
    free = (pci for pci in range(FIRST_PCI, 1008) if pci not in taken)
    made = ["# Different SSB indices, because simultaneous SSBs interfere."]
    for index, head in enumerate(drawn.heads):
        pci = next(free) if head.pci is None else head.pci
        cell = f"pci = {pci}{' # to be looked up' if head.pci is None else ''}\n"
        cell += f"ssb_index = {index % SSB_INDICES} # to be looked up\n"
        made.append(
            f"[[{prefix}radio_heads]]\n"
            f"name = {json.dumps(head.name or f'head {index + 1}', ensure_ascii=False)}\n"
            f"position_m = [{head.x_m:.4f}, {head.y_m:.4f}, {head.z_m:.4f}]\n"
            + HEAD.format(cell=cell)
        )
    return "\n".join(made)


def _read(name: str) -> str:
    home = resources.files("access_av").joinpath("site_files", "templates", name)
    return home.read_text(encoding="utf-8")
