"""What a file of a plant holds: a road, radio heads, walls; and what of it cannot be."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

# Farther from the road no radio head is of any use; its file is of another place or unit.
FARTHEST_HEAD_M = 3000.0
# No plant is larger; roads of more are in another unit.
LONGEST_ROAD_M = 50_000.0
SHORTEST_ROAD_M = 2.0


@dataclass(frozen=True)
class Head:
    """A radio head.

    Attributes
    ----------
    name
        Name for people; empty where the file has none.
    x_m, y_m, z_m
        Place.
    pci
        Physical cell identity; ``None`` where the file has none.
    """

    name: str
    x_m: float
    y_m: float
    z_m: float
    pci: int | None = None


@dataclass(frozen=True)
class Segment:
    """A line or an arc of a road; ``turn_rad`` is positive to the left."""

    length_m: float
    turn_rad: float = 0.0


@dataclass(frozen=True)
class Drawn:
    """What was found in files of a plant, in metres.

    Attributes
    ----------
    road_m
        Points of the road, in driving order; empty where its shape is given by segments.
    start
        Where segments begin: x and y in metres, heading in radians.
    segments
        Lines and arcs that join without a kink.
    heads
        Radio heads.
    walls_m
        Corners of each wall.
    """

    road_m: Sequence[tuple[float, float]] = ()
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    segments: Sequence[Segment] = ()
    heads: Sequence[Head] = ()
    walls_m: Sequence[Sequence[tuple[float, float]]] = ()


def checked(drawn: Drawn, road_file: str, heads_file: str, walls_file: str) -> Drawn:
    """Refuse what is no plant, and name the file.

    Raises
    ------
    InputError
        For a road too short or too long, and radio heads or walls kilometres from it.
    """
    points = list(drawn.road_m)
    length_m = math.fsum(it.length_m for it in drawn.segments) or math.fsum(
        math.dist(a, b) for a, b in itertools.pairwise(points)
    )
    if not SHORTEST_ROAD_M <= length_m <= LONGEST_ROAD_M and (points or drawn.segments):
        raise InputError(
            f"{road_file}: its road is {length_m:,.3g} m long; from {SHORTEST_ROAD_M:g} to "
            f"{LONGEST_ROAD_M:,.0f} m are allowed: is it in another unit?"
        )
    near = points or [drawn.start[:2]]
    reach_m = FARTHEST_HEAD_M + (length_m if drawn.segments else 0.0)
    heads = ((f"radio head {it.name or '(no name)'!r}", (it.x_m, it.y_m)) for it in drawn.heads)
    walls = (("a wall", wall[0]) for wall in drawn.walls_m)
    placed = itertools.chain(
        zip(itertools.repeat(heads_file), heads, strict=False),
        zip(itertools.repeat(walls_file), walls, strict=False),
    )
    for file, (what, at) in placed:
        away_m = min(math.dist(at, point) for point in near)
        if (points or drawn.segments) and away_m > reach_m:
            raise InputError(
                f"{file}: {what} at ({at[0]:.0f}, {at[1]:.0f}) m is "
                f"{away_m / 1000.0:,.0f} km from the road; at most "
                f"{FARTHEST_HEAD_M / 1000.0:g} km are allowed: both files must be of one place, in "
                "one system and unit"
            )
    return drawn
