"""Placement of additional radio heads: candidate masts, ranked by the error bound."""

from __future__ import annotations

import math
import os
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.run import service_levels
from access_av.run.error_bound import along_route, p90_m
from access_av.settings import as_dict
from access_av.tables import validation
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

MOST_MASTS = 1000
# Physical cell identities (TS 38.211, 7.4.2.1); each new head gets the lowest free one.
CELLS = 1008
# SSB indices of a burst at every carrier (TS 38.213, 4.1). Each new head gets the least used one,
# because cells that transmit simultaneously interfere.
SSB_INDICES = range(4)
# Default candidates: distances from the weakest position of the route (m), number of directions.
BESIDE_M = (15.0, 40.0)
DIRECTIONS = 8


@dataclass(frozen=True, eq=False)
class Plan(Result):
    """Selected masts.

    Attributes
    ----------
    scenario
        The scenario with the new radio heads.
    before_m, after_m
        90th percentile of the error bound along the route, without and with the new radio heads.
    chosen
        Names of the masts, the best one first.
    ranking
        One row per mast, added alone; columns ``radio_heads`` of :mod:`access_av.columns`.
    verdicts
        Service levels that the bound permits with the new radio heads.
    """

    scenario: _core.Scenario
    before_m: float
    after_m: float
    chosen: list[str]
    ranking: pl.DataFrame
    verdicts: list[service_levels.Verdict]


def plan(
    scenario: _core.Scenario | str,
    masts: pl.DataFrame | str | Path | None = None,
    *,
    add: int = 1,
    eirp_dbm: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Plan:
    """Selects masts for radio heads by the 90th percentile of the error bound along the route.

    The first mast is the best of all candidates. Each further mast is the best addition to the
    previous ones. Then masts are exchanged as long as the percentile improves.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    masts
        Candidates: a table or a CSV file with the columns ``name, x_m, y_m, z_m``. Default:
        positions next to the road around the largest bound.
    add
        Number of radio heads to add.
    eirp_dbm
        EIRP of the new radio heads. Default: that of the site's first radio head.
    progress
        Called as ``progress(done, total)`` with the number of computed bounds.

    Raises
    ------
    InputError
        Missing column or number, or fewer candidates than ``add``.
    SettingsError
        Mast at an invalid position.

    Examples
    --------
    >>> masts = pl.DataFrame(
    ...     {"name": ["near", "far"], "x_m": [60.0, 60.0], "y_m": [40.0, 400.0], "z_m": [0.0, 0.0]}
    ... )
    >>> found = plan("paper-real-odometry-2", masts)
    >>> found.chosen, found.after_m < found.before_m
    (['near'], True)
    """
    if not isinstance(scenario, _core.Scenario):
        scenario = _core.Scenario.load(scenario)
    site = as_dict(scenario.site)
    heads = site["radio_heads"]
    candidates = _next_to_route(scenario, site) if masts is None else _candidates(masts)
    if not 1 <= add <= len(candidates):
        raise InputError(f"--add {add}: only {len(candidates)} candidate masts exist")
    eirp_dbm = heads[0]["eirp_dbm"] if eirp_dbm is None else eirp_dbm
    taken = {head["pci"] for head in heads}
    free = [pci for pci in range(CELLS) if pci not in taken]
    used = Counter(head["ssb_index"] for head in heads)
    quiet = []
    for _ in range(add):
        quiet.append(min(SSB_INDICES, key=used.__getitem__))
        used[quiet[-1]] += 1

    def equipped(chosen: Sequence[int]) -> _core.Scenario:
        new = [
            {
                "name": candidates[number]["name"],
                "position_m": [candidates[number][axis] for axis in ("x_m", "y_m", "z_m")],
                "pci": pci,
                "ssb_index": ssb_index,
                "eirp_dbm": eirp_dbm,
            }
            for number, pci, ssb_index in zip(chosen, free, quiet, strict=False)
        ]
        return scenario.with_overrides({"site.radio_heads": [*heads, *new]}) if new else scenario

    def with_masts_m(chosen: Sequence[int]) -> float:
        return p90_m(equipped(chosen))

    everyone = range(len(candidates))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        before_m = with_masts_m([])
        alone_m = []
        for value_m in pool.map(with_masts_m, ([number] for number in everyone)):
            alone_m.append(value_m)
            if progress is not None:
                progress(len(alone_m), len(candidates))
        chosen = [min(everyone, key=alone_m.__getitem__)]
        after_m = alone_m[chosen[0]]

        def better(kept: list[int]) -> tuple[float, int]:
            others = [number for number in everyone if number not in kept]
            of_others_m = pool.map(with_masts_m, ([*kept, it] for it in others))
            return min(zip(of_others_m, others, strict=True))

        while len(chosen) < add:
            after_m, number = better(chosen)
            chosen.append(number)
        exchanged = add > 1
        while exchanged:
            exchanged = False
            for place in range(add):
                kept = chosen[:place] + chosen[place + 1 :]
                value_m, number = better(kept)
                if value_m < after_m - 1e-9:
                    after_m, chosen, exchanged = value_m, [*kept, number], True
    ranking = pl.DataFrame(candidates).with_columns(p90_bound_m=pl.Series(alone_m))
    final = equipped(chosen)
    route = along_route(final)
    return Plan(
        scenario=final,
        before_m=before_m,
        after_m=after_m,
        chosen=[candidates[number]["name"] for number in chosen],
        ranking=ranking.sort("p90_bound_m", maintain_order=True),
        verdicts=service_levels.of_bound(route["along_std_m"], route["across_std_m"]),
    )


def _next_to_route(scenario: _core.Scenario, site: dict[str, Any]) -> list[dict[str, Any]]:
    """Returns positions around the largest bound, at the height of the site's first radio head."""
    route = along_route(scenario)
    weakest = route.row(int(route["bound_m"].arg_max() or 0), named=True)
    # Keep the masts off the road, including the part before the start of the trip.
    whole = along_route(scenario.with_overrides({"motion.start_at_m": 0.0}))
    width_m = (site.get("road") or {}).get("width_m", 0.0)
    z_m = site["radio_heads"][0]["position_m"][2]
    made = []
    for away_m in BESIDE_M:
        for direction in range(DIRECTIONS):
            angle_rad = 2.0 * math.pi * direction / DIRECTIONS
            x_m = round(weakest["x_m"] + away_m * math.cos(angle_rad))
            y_m = round(weakest["y_m"] + away_m * math.sin(angle_rad))
            nearest_m = (((pl.col("x_m") - x_m) ** 2 + (pl.col("y_m") - y_m) ** 2) ** 0.5).min()
            if whole.select(nearest_m).item() > max(width_m, 0.5 * BESIDE_M[0]):
                name = f"({x_m}, {y_m}) m"
                made.append({"name": name, "x_m": float(x_m), "y_m": float(y_m), "z_m": z_m})
    return made


def _candidates(masts: pl.DataFrame | str | Path) -> list[dict[str, Any]]:
    where = "masts" if isinstance(masts, pl.DataFrame) else str(masts)
    if not isinstance(masts, pl.DataFrame):
        masts = validation.read(Path(masts), "table of masts", {"name": pl.String})
    place = ("x_m", "y_m", "z_m")
    validation.check(masts, where, numbers=place, other=["name"])
    if not 0 < masts.height <= MOST_MASTS:
        raise InputError(f"{where}: {masts.height} masts; from 1 to {MOST_MASTS} are allowed")
    return masts.select("name", pl.col(place).cast(pl.Float64)).to_dicts()
