"""Lower bound of the localization error of a scenario."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.run import service_levels
from access_av.settings import as_dict
from access_av.tables.columns import TABLES
from access_av.tables.result import Result

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Minimum Es/Iot of a detectable SSB in dB (TS 38.133, side condition of intra-frequency
# measurements).
VISIBLE_SNR_DB = -6.0
# Driven distance with reception for the map (m), with one independent angle per half wavelength.
MAP_TRAVEL_M = 1.0
ANGLES_PER_WAVELENGTH = 2.0
MARGIN_M = 20.0
MAP_CELLS = 3000
MOST_MAP_CELLS = 40_000
SPEED_OF_LIGHT_MPS = 299_792_458.0


@dataclass(frozen=True, eq=False)
class ErrorBound(Result):
    """The posterior Cramér–Rao bound of a scenario.

    Attributes
    ----------
    scenario
        The scenario.
    route
        One row per SSB of the drive; columns ``positions`` of :mod:`access_av.columns`.
    heads
        One row per radio head; columns ``radio_heads``.
    site
        The bound over the site, one row per square of ``map_step_m``; columns ``positions``. It
        is valid for a vehicle that has measured ``map_num_angles`` independent angles, with a
        heading σ of ``map_heading_std_rad`` and an unknown position.
    """

    scenario: _core.Scenario
    route: pl.DataFrame
    heads: pl.DataFrame
    site: pl.DataFrame
    map_step_m: float
    map_num_angles: float
    map_heading_std_rad: float

    def __repr__(self) -> str:
        median_m = float(self.route.select(pl.col("bound_m").median()).item())
        return f"ErrorBound({self.scenario.name}, median {median_m:.3f} m)"

    def plot(self) -> Any:
        """Draws the bound and its parts against the distance along the road, with Altair."""
        from access_av.plots.of_results import lines

        columns = ("bound_m", "along_std_m", "across_std_m")
        titles = ("distance along the road / m", "bound of the RMS error / m")
        return lines(self.route, "along_m", columns, titles=titles)

    def summary(self) -> dict[str, Any]:
        """Returns the main figures of a placement of radio heads."""
        bound_m = self.route["bound_m"]
        return {
            "scenario": self.scenario.name,
            "median_m": bound_m.median(),
            "p90_m": bound_m.quantile(0.9, "linear"),
            "max_m": bound_m.max(),
            "duration_s": self.route["time_s"].max(),
            "length_m": self.route["along_m"].max(),
            "heads": self.heads.to_dicts(),
            "service_levels": [verdict.as_record() for verdict in self.verdicts],
        }

    @cached_property
    def verdicts(self) -> list[service_levels.Verdict]:
        """Returns the service levels by the bound, which no localizer exceeds."""
        return service_levels.of_bound(self.route["along_std_m"], self.route["across_std_m"])


def bound(scenario: _core.Scenario | str, *, map_step_m: float | None = None) -> ErrorBound:
    """Computes the lower bound of the error along a scenario's route and over its site.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    map_step_m
        Side of the map's squares in metres. Default: a round length with about :data:`MAP_CELLS`
        squares.

    Raises
    ------
    SettingsError
        Unusable scenario.
    InputError
        Map with more than :data:`MOST_MAP_CELLS` squares.

    Examples
    --------
    >>> found = bound("paper-real-odometry-4", map_step_m=50.0)
    >>> bool(found.route["bound_m"].max() < 0.3)
    True
    """
    if not isinstance(scenario, _core.Scenario):
        scenario = _core.Scenario.load(scenario)
    settings = as_dict(scenario.site)
    core, route = _core.Bound(scenario), along_route(scenario)
    heads = _heads(core, settings["radio_heads"], route)
    places = np.vstack([table.select("x_m", "y_m").to_numpy() for table in (route, heads)])
    low, high = places.min(axis=0) - MARGIN_M, places.max(axis=0) + MARGIN_M
    step_m = _round_step(low, high) if map_step_m is None else map_step_m
    if not (math.isfinite(step_m) and step_m > 0.0):
        raise InputError(f"--map-step-m {step_m}: it must be above 0")
    extent_m = float((high - low).max())
    if step_m > extent_m:
        raise InputError(
            f"--map-step-m {step_m:g}: it exceeds the size of the site, {extent_m:.0f} m"
        )
    cells = math.prod(np.maximum(1.0, np.ceil((high - low) / step_m)).tolist())
    if cells > MOST_MAP_CELLS:
        least_m = 1.1 * math.sqrt(float(np.prod(high - low)) / MOST_MAP_CELLS)
        raise InputError(
            f"--map-step-m {step_m:g}: it gives {cells:.3g} squares; at most {MOST_MAP_CELLS} "
            f"are allowed: write at least {least_m:.2g} m"
        )
    wavelength_m = SPEED_OF_LIGHT_MPS / (settings["carrier_mhz"] * 1e6)
    looks = max(1.0, MAP_TRAVEL_M * ANGLES_PER_WAVELENGTH / wavelength_m)
    heading_std_rad = float(route.select(pl.col("heading_std_rad").median()).item())
    x_m, y_m = (
        grid.ravel()
        for grid in np.meshgrid(
            *(
                np.arange(a + 0.5 * step_m, b + 0.5 * step_m, step_m)
                for a, b in zip(low, high, strict=True)
            )
        )
    )
    bound_m = core.at(x_m, y_m, looks, heading_std_rad)
    return ErrorBound(
        scenario=scenario,
        route=route,
        heads=heads,
        site=TABLES["positions"].frame({"x_m": x_m, "y_m": y_m, "bound_m": bound_m}),
        map_step_m=step_m,
        map_num_angles=looks,
        map_heading_std_rad=heading_std_rad,
    )


def along_route(scenario: _core.Scenario) -> pl.DataFrame:
    """Returns the bound at every SSB of the drive; columns ``positions``."""
    return pl.DataFrame(_core.Bound(scenario).along_route())


def p90_m(scenario: _core.Scenario) -> float:
    """Returns the 90th percentile of the bound along the route, in metres."""
    return float(along_route(scenario)["bound_m"].quantile(0.9, "linear") or 0.0)


def _heads(core: _core.Bound, settings: list[dict[str, Any]], route: pl.DataFrame) -> pl.DataFrame:
    x_m, y_m = route["x_m"].to_numpy(), route["y_m"].to_numpy()
    snrs_db = core.snr_db(x_m, y_m)
    rows = []
    for number, (head, snr_db) in enumerate(zip(settings, snrs_db, strict=True), start=1):
        head_x_m, head_y_m, _ = head["position_m"]
        distance_m = np.hypot(x_m - head_x_m, y_m - head_y_m)
        in_sight_db = snr_db[np.isfinite(snr_db)]
        rows.append(
            {
                "name": head["name"] or f"head {number}",
                "pci": head["pci"],
                "ssb_index": head["ssb_index"],
                "x_m": float(head_x_m),
                "y_m": float(head_y_m),
                "nearest_m": float(distance_m.min()),
                "farthest_m": float(distance_m.max()),
                "least_expected_snr_db": float(in_sight_db.min()) if in_sight_db.size else None,
                "most_expected_snr_db": float(in_sight_db.max()) if in_sight_db.size else None,
                "visible_share": float((snr_db >= VISIBLE_SNR_DB).mean()),
            }
        )
    return pl.DataFrame(rows)


def _round_step(low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Returns the smallest round step (1, 2, 5 times 10ⁿ) with at most ``MAP_CELLS`` squares."""
    least_m = math.sqrt(float(np.prod(high - low)) / MAP_CELLS)
    power = 10.0 ** math.floor(math.log10(least_m))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= least_m)
