"""Error by position along the road, and the worst positions with their causes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.run.error_bound import VISIBLE_SNR_DB, along_route
from access_av.run.pairs import LOST_M
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from access_av.run.runs import Runs

# Half-width (m) of the section whose errors determine the percentile at a position.
WINDOW_M = 5.0
# Minimum distance between reported worst positions, in metres.
APART_M = 40.0
MOST_PLACES = 3
# Distance from the start within which the given start dominates the position (m).
STARTING_M = 20.0
# Distance over which the odometer retains errors (m), and minimum reported ratio.
CARRIED_M = 60.0
MORE_THAN_USUAL = 1.25
# Below this SNR noise is a large part of an angle's error.
WEAK_SNR_DB = 5.0


@dataclass(frozen=True)
class WorstPlace:
    """A position with a large error, and its cause."""

    along_m: float
    x_m: float
    y_m: float
    error_m: float
    why: str


def by_place(driven: Runs, percent: float, error_m: float) -> pl.DataFrame:
    """Returns error, bound, geometry and signal at every metre of the road.

    Returns
    -------
    polars.DataFrame
        One row per metre; columns ``places`` of :mod:`access_av.columns`. The dilution along the
        road is ``1 / sqrt(Σ (n·t)² / r²)`` over the visible radio heads, with their distance r, the
        normal n of their line of sight and the direction t of the road. It is the error along the
        road per unit of angle error. The map limits the error across the road.
    """
    route = along_route(driven.scenario)
    time_s, along_m, x_m, y_m = (
        route[name].to_numpy() for name in ("time_s", "along_m", "x_m", "y_m")
    )
    at = np.interp(driven.time_s, time_s, along_m)
    centres = np.arange(0.5, max(1.0, math.floor(along_m[-1])), 1.0)
    low = np.searchsorted(at, centres - WINDOW_M)
    high = np.maximum(np.searchsorted(at, centres + WINDOW_M, side="right"), low + 1)
    low = np.minimum(low, len(at) - 1)
    rows = []
    for first, last in zip(low, high, strict=True):
        near = driven.errors_m[:, first:last].ravel()
        median, upper = np.quantile(near, [0.5, 0.01 * percent], method="inverted_cdf")
        levels_m = driven.levels_m[:, first:last].ravel()
        levels_m = levels_m[~np.isnan(levels_m)]
        level = np.quantile(levels_m, 0.5, method="inverted_cdf") if len(levels_m) else math.nan
        within = float((near <= error_m).mean())
        rows.append((median, upper, within, level, len(levels_m) / len(near)))
    median_m, percentile_m, within_share, level_m, reliable_share = np.array(rows).T
    here_x, here_y = (np.interp(centres, *_rising(along_m, it)) for it in (x_m, y_m))
    bound_m = np.interp(centres, *_rising(along_m, route["bound_m"].to_numpy()))
    snr_db = np.asarray(_core.Bound(driven.scenario).snr_db(here_x, here_y))
    visible = snr_db >= VISIBLE_SNR_DB
    return pl.DataFrame(
        {
            "along_m": centres,
            "x_m": here_x,
            "y_m": here_y,
            "median_error_m": median_m,
            "target_error_m": percentile_m,
            "within_share": within_share,
            "passes": percentile_m <= error_m,
            "level_m": level_m,
            "reliable_share": reliable_share,
            "bound_m": bound_m,
            "along_road_error_per_degree_m": _dilution(driven.scenario, here_x, here_y, visible),
            "heads_visible": visible.sum(axis=0),
            "best_snr_db": snr_db.max(axis=0),
        }
    ).with_columns(
        pl.col("along_road_error_per_degree_m", "level_m").fill_nan(None),
        pl.col("best_snr_db").replace(-math.inf, None),  # every radio head is behind walls
    )


def _rising(along_m: NDArray[Any], values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Returns increasing distances and their values, without repetitions at stops."""
    moved = np.concatenate([[True], np.diff(along_m) > 1e-6])
    return along_m[moved], values[moved]


def _dilution(
    scenario: _core.Scenario, x_m: NDArray[Any], y_m: NDArray[Any], visible: NDArray[Any]
) -> NDArray[np.float64]:
    heads = np.array([head["position_m"][:2] for head in radio_heads(scenario)])
    dx, dy = heads[:, 0, None] - x_m, heads[:, 1, None] - y_m
    heading = np.arctan2(np.gradient(y_m), np.gradient(x_m)) if len(x_m) > 1 else np.zeros(1)
    # Component of the line-of-sight normal along the road.
    across = (np.cos(heading) * dy - np.sin(heading) * dx) / (dx**2 + dy**2)
    known = (np.where(visible, across, 0.0) ** 2).sum(axis=0)
    with np.errstate(divide="ignore"):
        return np.where(known > 1e-12, np.radians(1.0) / np.sqrt(known), np.nan)


def radio_heads(scenario: _core.Scenario) -> list[Mapping[str, Any]]:
    """Returns the radio heads of a scenario's site."""
    heads: list[Mapping[str, Any]] = as_dict(scenario.site)["radio_heads"]
    return heads


def worst_places(places: pl.DataFrame, plant: _core.Plant) -> list[WorstPlace]:
    """Returns the positions with the largest errors, at least :data:`APART_M` apart."""
    written = as_dict(plant)
    left = places.sort("target_error_m", descending=True, maintain_order=True)
    found: list[WorstPlace] = []
    for row in left.iter_rows(named=True):
        if all(abs(row["along_m"] - place.along_m) >= APART_M for place in found):
            why, error_m = _why(row, places, written), row["target_error_m"]
            if error_m > LOST_M:
                lost = f"lost drives determine the percentile here (error above {LOST_M:g} m)"
                why = f"{lost}; {why}"
            found.append(WorstPlace(row["along_m"], row["x_m"], row["y_m"], error_m, why))
        if len(found) == MOST_PLACES:
            break
    return found


def _why(row: Mapping[str, Any], places: pl.DataFrame, plant: Mapping[str, Any]) -> str:
    """Returns the cause of a large error at a position as text."""
    along_m = row["along_m"]
    if along_m < places["along_m"][0] + STARTING_M:
        return "the vehicle has just started, and its position is mostly the configured start"
    if not row["heads_visible"]:
        return f"no radio head is in reach and in sight{hiding(row, plant)}: only the odometer"
    if row["along_road_error_per_degree_m"] is None:
        return "every radio head in reach lies straight ahead or behind"
    if carried := _carried_over(row, places, plant):
        return carried
    here, usual = _carried(places, along_m), _usual(places)
    if here > MORE_THAN_USUAL * usual:
        return (
            f"on the {CARRIED_M:g} m before, radio heads lie ahead, behind or far away"
            f"{hiding(row, plant)}: an angle error of one degree is {here:.1f} m along the road, "
            f"{usual:.1f} m at the median of the road"
        )
    if row["heads_visible"] == 1:
        return f"only one radio head is in reach and in sight{hiding(row, plant)}"
    if row["best_snr_db"] < WEAK_SNR_DB:
        return f"the strongest radio head is weak here ({row['best_snr_db']:.0f} dB)"
    for stop in plant["motion"]["stops"]:
        if 0.0 <= along_m - stop["at_m"] < 2.0 * WINDOW_M:
            name = f" “{stop['name']}”" if stop.get("name") else ""
            return f"at the stop{name}: the error on arrival remains while the vehicle stands"
    bound = places["bound_m"].median()
    if isinstance(bound, float) and row["bound_m"] <= bound:
        return "by chance in these drives: the Cramér–Rao bound is not larger than elsewhere"
    return (
        "not the geometry: the specified errors of odometer, array and radio-head positions "
        "determine the error here"
    )


def _is_poor(row: Mapping[str, Any], usual_m: float) -> bool:
    dilution_m = row["along_road_error_per_degree_m"]
    return dilution_m is None or dilution_m > MORE_THAN_USUAL * usual_m


def _carried_over(
    row: Mapping[str, Any], places: pl.DataFrame, plant: Mapping[str, Any]
) -> str | None:
    """Returns the explanation of an error from an earlier section; ``None`` if it arose here."""
    usual_m = _usual(places)
    if _is_poor(row, usual_m):
        return None
    before = pl.col("along_m").is_between(row["along_m"] - CARRIED_M, row["along_m"])
    poor = [it for it in places.filter(before).iter_rows(named=True) if _is_poor(it, usual_m)]
    if not poor:
        return None
    first, last = poor[0], poor[-1]
    middle = poor[len(poor) // 2]
    cause = (
        "no radio head is in sight"
        if not middle["heads_visible"]
        else "radio heads lie ahead, behind or far away"
    )
    return (
        f"carried over from the stretch {first['along_m']:.0f} to {last['along_m']:.0f} m, where "
        f"{cause}{hiding(middle, plant)}; the geometry is good here, and the odometer retains the "
        "error"
    )


def hiding(row: Mapping[str, Any], plant: Mapping[str, Any]) -> str:
    """Returns the named walls between a position and radio heads, in parentheses."""
    found = []
    for number, head in enumerate(plant["site"]["radio_heads"], start=1):
        ends = (row["x_m"], row["y_m"]), tuple(head["position_m"][:2])
        walls = dict.fromkeys(
            wall.get("name") or f"wall {index}"
            for index, wall in enumerate(plant["site"].get("walls", []), start=1)
            if any(
                _cross(ends, corners)
                for corners in zip(wall["polyline_m"][:-1], wall["polyline_m"][1:], strict=True)
            )
        )
        if walls:
            names = " and ".join(f"“{wall}”" for wall in walls)
            found.append(f"{names} hides “{head['name'] or f'head {number}'}”")
    return f" ({', '.join(found)})" if found else ""


def _cross(one: Sequence[Sequence[float]], other: Sequence[Sequence[float]]) -> bool:
    """Returns whether two line segments cross."""

    def side(ends: Sequence[Sequence[float]], point: Sequence[float]) -> float:
        (ax, ay), (bx, by) = ends
        return (bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)

    parted = side(one, other[0]) * side(one, other[1]) < 0.0
    return parted and side(other, one[0]) * side(other, one[1]) < 0.0


def _carried(places: pl.DataFrame, along_m: float) -> float:
    """Returns the root mean square of the dilution on the section before a position."""
    before = pl.col("along_m").is_between(along_m - CARRIED_M, along_m)
    square = (pl.col("along_road_error_per_degree_m").filter(before) ** 2).mean().sqrt()
    found = places.select(square).item()
    return math.inf if found is None else float(found)


def _usual(places: pl.DataFrame) -> float:
    """Returns the median of :func:`_carried` over the road."""
    every = range(0, places.height, 10)
    return float(np.median([_carried(places, places["along_m"][place]) for place in every]))


def radio_head_sides(scenario: _core.Scenario) -> pl.DataFrame:
    """Returns side and distance of each radio head from the road, at the nearest point of the trip.

    Returns
    -------
    polars.DataFrame
        Columns ``name, along_m, side, distance_m``; ``side`` is ``left`` or ``right`` in the
        direction of driving.
    """
    route = along_route(scenario)
    x_m, y_m, along_m = (route[name].to_numpy() for name in ("x_m", "y_m", "along_m"))
    _, x_m = _rising(along_m, x_m)
    along_m, y_m = _rising(along_m, y_m)
    rows = []
    for number, head in enumerate(radio_heads(scenario), start=1):
        dx, dy = head["position_m"][0] - x_m, head["position_m"][1] - y_m
        nearest = int(np.hypot(dx, dy).argmin())
        before, after = max(0, nearest - 1), min(len(x_m) - 1, nearest + 1)
        turn = (x_m[after] - x_m[before]) * dy[nearest] - (y_m[after] - y_m[before]) * dx[nearest]
        rows.append(
            {
                "name": head["name"] or f"head {number}",
                "along_m": float(along_m[nearest]),
                "side": "left" if turn > 0.0 else "right",
                "distance_m": float(np.hypot(dx[nearest], dy[nearest])),
            }
        )
    return pl.DataFrame(rows)
