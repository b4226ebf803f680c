"""Road, radio heads and walls of a plant, and the checks that reject implausible ones."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

# Maximum distance of a radio head from the road (m); beyond it, place or unit of a file is wrong.
FARTHEST_HEAD_M = 3000.0
# Maximum length of a road (m); a longer one has another unit.
LONGEST_ROAD_M = 50_000.0
SHORTEST_ROAD_M = 2.0
# Smallest turn that counts as a bend, in radians: 5 degrees.
BEND_RAD = math.radians(5.0)
# Turns between two edges below this are rounding, in radians.
STRAIGHT_RAD = 1e-5
# Edges of a polyline above this length separate two bends, in metres.
STRAIGHT_M = 10.0


@dataclass(frozen=True)
class Head:
    """A radio head.

    Attributes
    ----------
    name
        Display name; empty if the file has none.
    x_m, y_m, z_m
        Position.
    pci
        Physical cell identity; ``None`` if the file has none.
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
    """Road, radio heads and walls from files of a plant, in metres.

    Attributes
    ----------
    road_m
        Points of the road, in driving order; empty if segments give its shape.
    start
        Start pose of the segments: x and y in metres, heading in radians.
    segments
        Lines and arcs that join without a kink.
    heads
        Radio heads.
    walls_m
        Corners of each wall.
    skipped
        Entities of the selected layers or of the map that were not imported, by file and type.
    notes
        Facts about the import that need the user's attention.
    """

    road_m: Sequence[tuple[float, float]] = ()
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    segments: Sequence[Segment] = ()
    heads: Sequence[Head] = ()
    walls_m: Sequence[Sequence[tuple[float, float]]] = ()
    skipped: Mapping[str, int] = field(default_factory=dict)
    notes: Sequence[str] = ()

    @property
    def length_m(self) -> float:
        """Length of the road in metres."""
        if self.segments:
            return math.fsum(it.length_m for it in self.segments)
        points = list(self.road_m)
        return math.fsum(math.dist(a, b) for a, b in itertools.pairwise(points))

    @property
    def bends(self) -> int:
        """Returns the number of sections with a heading change of at least :data:`BEND_RAD`."""
        turns = [it.turn_rad for it in self.segments] or _turns(self.road_m)
        directions = itertools.groupby(
            turns, key=lambda turn: 0.0 if abs(turn) < STRAIGHT_RAD else math.copysign(1.0, turn)
        )
        stretches = (math.fsum(turns) for _, turns in directions)
        return sum(abs(turn) >= BEND_RAD for turn in stretches)


def _turns(points: Sequence[tuple[float, float]]) -> Iterator[float]:
    """Turns between the edges of a polyline in radians; 0 for each long edge."""
    edges = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(points) if a != b]
    for (ax, ay), (bx, by) in itertools.pairwise(edges):
        yield math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        if math.hypot(bx, by) > STRAIGHT_M:
            yield 0.0


def numbered(heads: Sequence[Head]) -> list[Head]:
    """Appends a number to names that occur several times, as those of one DXF block.

    Examples
    --------
    >>> [it.name for it in numbered([Head("mast", 0, 0, 6), Head("mast", 9, 0, 6)])]
    ['mast 1', 'mast 2']
    """
    count = Counter(it.name for it in heads)
    taken, made = Counter(count), []
    seen: Counter[str] = Counter()
    for head in heads:
        name = head.name
        if name and count[head.name] > 1:
            while True:
                seen[head.name] += 1
                name = f"{head.name} {seen[head.name]}"
                if name not in taken:
                    break
            taken[name] += 1
        made.append(replace(head, name=name))
    return made


def checked(drawn: Drawn, road_file: str, heads_file: str, walls_file: str) -> Drawn:
    """Rejects an implausible plant and names the file.

    Raises
    ------
    InputError
        Road too short or too long, or radio heads or walls kilometres from the road.
    """
    points = list(drawn.road_m)
    length_m = drawn.length_m
    if not SHORTEST_ROAD_M <= length_m <= LONGEST_ROAD_M and (points or drawn.segments):
        raise InputError(
            f"{road_file}: its road is {length_m:,.3g} m long; allowed are {SHORTEST_ROAD_M:g} "
            f"to {LONGEST_ROAD_M:,.0f} m; check its unit"
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
                f"{FARTHEST_HEAD_M / 1000.0:g} km are allowed: both files must describe one "
                f"plant in one reference system and unit"
            )
    return drawn
