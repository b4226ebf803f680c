"""Changes that bring a site and a vehicle to the next 3GPP positioning service level."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av import _core
from access_av.run import service_levels
from access_av.run.error_bound import along_route
from access_av.settings import as_dict

if TYPE_CHECKING:
    import numpy as np
    import polars as pl
    from numpy.typing import NDArray

    from access_av.radio.placement import Plan

SHORTEST_PERIOD_MS = 5.0  # TS 38.331, ssb-periodicityServingCell
MOST_ANTENNAS = 8  # maximum number of antennas of the bound


@dataclass(frozen=True)
class Change:
    """Effect of one change.

    Attributes
    ----------
    what
        Description of the change.
    share
        Share of positions within the level's accuracy by the bound, after the change.
    reaches
        Whether this share reaches the level.
    """

    what: str
    share: float
    reaches: bool


@dataclass(frozen=True)
class NextLevel:
    """The lowest service level that the bound excludes, and the effect of changes.

    Attributes
    ----------
    level
        The level.
    share
        Share of positions within its accuracy by the bound.
    short_share
        Share of the route where this share is below the required availability.
    weakest_along_m, weakest_x_m, weakest_y_m
        Weakest position: distance along the route, and coordinates.
    changes
        Effect of each single change, ordered from cell settings to new equipment.
    """

    level: service_levels.Level
    share: float
    short_share: float
    weakest_along_m: float
    weakest_x_m: float
    weakest_y_m: float
    changes: list[Change]

    @property
    def cheapest(self) -> Change | None:
        """Returns the first change that reaches the level alone."""
        return next((change for change in self.changes if change.reaches), None)

    def in_words(self) -> str:
        """Returns the shortfall and the cheapest change as text."""
        cheapest = self.cheapest.what if self.cheapest else "no single change"
        return (
            f"The site fails level {self.level.name} on {self.short_share:.1%} of the route. "
            f"Weakest position: {self.weakest_along_m:.0f} m along the route, at "
            f"({self.weakest_x_m:.0f}, {self.weakest_y_m:.0f}) m. Cheapest change that reaches "
            f"the level: {cheapest}."
        )

    def as_record(self) -> dict[str, Any]:
        """Returns the values for JSON."""
        return {
            "level": self.level.name,
            "share": self.share,
            "short_share": self.short_share,
            "weakest_along_m": self.weakest_along_m,
            "weakest_m": [self.weakest_x_m, self.weakest_y_m],
            "changes": [vars(change) for change in self.changes],
            "cheapest": self.cheapest.what if self.cheapest else None,
        }


def next_level(scenario: _core.Scenario | str, planned: Plan | None = None) -> NextLevel | None:
    """Evaluates changes that bring a scenario to the next service level.

    Each change is evaluated alone: SSBs twice as often, an odometer with half the errors, twice the
    number of antennas, and the radio heads of a plan, if any. They are ordered by their usual cost,
    which is an assumption.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    planned
        Radio heads to add.

    Returns
    -------
    NextLevel or None
        ``None`` if the bound permits every level.

    Examples
    --------
    >>> from access_av.radio.placement import plan
    >>> found = next_level("yard", plan("yard"))
    >>> found.level.name, found.cheapest.what
    ('5', '8 antennas')
    """
    if not isinstance(scenario, _core.Scenario):
        scenario = _core.Scenario.load(scenario)
    route = along_route(scenario)
    verdicts = service_levels.of_bound(route["along_std_m"], route["across_std_m"])
    missed = next((verdict for verdict in verdicts if not verdict.reached), None)
    if missed is None:
        return None
    level = missed.level
    tried = {
        what: scenario.with_overrides(settings) for what, settings in _settings(scenario).items()
    }

    def share(one: _core.Scenario) -> float:
        return float(_within(along_route(one), level).mean())

    with ThreadPoolExecutor() as pool:
        shares = dict(zip(tried, pool.map(share, tried.values()), strict=True))
    if planned is not None:
        heads = f"a radio head at {planned.chosen[0]}"
        if len(planned.chosen) > 1:
            heads = f"radio heads at {' and '.join(planned.chosen)}"
        with_heads = (verdict.share for verdict in planned.verdicts if verdict.level == level)
        shares[heads] = next(with_heads)
    near = _within(route, level)
    weakest = route.row(int(near.argmin()), named=True)
    return NextLevel(
        level=level,
        share=missed.share,
        short_share=float((near < level.availability).mean()),
        weakest_along_m=weakest["along_m"],
        weakest_x_m=weakest["x_m"],
        weakest_y_m=weakest["y_m"],
        changes=[
            Change(what, share, share >= level.availability) for what, share in shares.items()
        ],
    )


def _settings(scenario: _core.Scenario) -> dict[str, dict[str, Any]]:
    """Returns descriptions of the changes and their settings."""
    site, vehicle = (as_dict(part) for part in (scenario.site, scenario.vehicle))
    made = {}
    period_ms = site["ssb"]["period_ms"] / 2.0
    if period_ms >= SHORTEST_PERIOD_MS:
        made[f"SSBs every {period_ms:g} ms"] = {"site.ssb.period_ms": period_ms}
    made["half the odometer's errors"] = {
        f"vehicle.odometer.{key}": 0.5 * vehicle["odometer"][key]
        for key in ("scale_std", "noise_m_per_sqrt_m", "noise_m_per_sqrt_s")
    }
    antennas = 2 * vehicle["array"]["elements"]
    if antennas <= MOST_ANTENNAS and "shape" not in vehicle["array"]:
        made[f"{antennas} antennas"] = {"vehicle.array.elements": antennas}
    return made


def _within(route: pl.DataFrame, level: service_levels.Level) -> NDArray[np.float64]:
    return service_levels.within(route["along_std_m"], route["across_std_m"], level.accuracy_m)
