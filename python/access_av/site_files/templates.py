"""New files for people to fill in: short, commented, with realistic values and their units."""

from __future__ import annotations

import itertools
import json
import math
from importlib import resources
from string import Template
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from access_av.site_files.drawn import Drawn
    from access_av.site_files.picture import Placed

KINDS = ("plant", "site", "vehicle", "scenario", "node")
# What a new radio head is taken to be where its file does not say.
HEAD = "position_std_m = 0.1\n{cell}eirp_dbm = 10.0 # to be looked up\neirp_std_db = 2.0\n"
SSB_INDICES = 8  # of a burst at most carriers below 6 GHz (TS 38.213, 4.1)
FIRST_PCI = 21
EXAMPLE_STOP_M = 320.0
WALL_POINTS = 100  # of a table (settings/walls.rs)


def new(
    kind: str, name: str, file: str, drawn: Drawn | None = None, placed: Placed | None = None
) -> str:
    """The text of a new file.

    Parameters
    ----------
    kind
        One of :data:`KINDS`.
    name
        Its short name.
    file
        What the file is called, for the commands that its comments name.
    drawn
        Road, radio heads and walls in place of the example's, of a plant or a site.
    placed
        A picture under its maps.
    """
    prefix = "site." if kind == "plant" else ""
    example = Template(_read("example_site.toml")).substitute(prefix=prefix)
    road, heads = example.split("\n# Each sends", 1)
    heads = f"# Each sends{heads}"
    stop_m = EXAMPLE_STOP_M
    if drawn is not None and (drawn.road_m or drawn.segments):
        road = _road(drawn, prefix)
        stop_m = round(0.5 * _length_m(drawn), 1)
    if drawn is not None and drawn.heads:
        heads = _heads(drawn, prefix)
    walls = "" if drawn is None else _walls(drawn, prefix)
    picture = "" if placed is None else _picture(placed, prefix)
    site = f"{road.rstrip()}\n\n{heads.rstrip()}\n{walls}{picture}"
    return Template(_read(f"{kind}.toml")).substitute(
        name=name, file=file, site=site, stop_m=f"{stop_m:.1f}"
    )


def _length_m(drawn: Drawn) -> float:
    points = list(drawn.road_m)
    if drawn.segments:
        return math.fsum(it.length_m for it in drawn.segments)
    return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))


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
    """Tables of walls; long ones in pieces of as many corners as a table may have."""
    made = ""
    for wall in drawn.walls_m:
        for first in range(0, len(wall) - 1, WALL_POINTS - 1):
            corners = wall[first : first + WALL_POINTS]
            points = ", ".join(f"[{x_m:.4f}, {y_m:.4f}]" for x_m, y_m in corners)
            made += f"\n[[{prefix}walls]] # loss_db: that of concrete\npoints_m = [{points}]\n"
    return made


def _picture(placed: Placed, prefix: str) -> str:
    x_px, y_px = placed.zero_px
    return (
        "\n# A picture that lies under its maps; nothing is computed from it.\n"
        f"[{prefix}underlay]\n"
        f"file = {json.dumps(placed.file, ensure_ascii=False)}\n"
        f"metres_per_pixel = {placed.metres_per_pixel:.9g}\n"
        f"zero_px = [{x_px:.3f}, {y_px:.3f}] # the map's zero, from the upper left corner\n"
    )


def _heads(drawn: Drawn, prefix: str) -> str:
    taken = {head.pci for head in drawn.heads}
    free = (pci for pci in range(FIRST_PCI, 1008) if pci not in taken)
    made = ["# Each sends its SSB at an index of its own: the strongest would drown the others."]
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
