"""Report of ``access-av design integrity``: table, and Stanford diagram of each case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from access_av.report import drive_charts as charts
from access_av.report.page import VERSION, sheet
from access_av.report.parts import figure, section, source, table, warnings
from access_av.run.pairs import UNCHANGED
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.run.integrity_campaign import Case

HEAD = (
    "Truth", "Channel", "Radio heads", "Availability", "Error above level in ok", "95 %, up to",
    "Runs with error above level", "Time to alert / s", "Level / error", "Error, p90 / m",
    "Target risk per hour", "Risk per hour", "95 %, up to",
)  # fmt: skip


def _world(case: dict[str, Any]) -> str:
    """Returns the difference of truth and nominal model of a case, and its variant."""
    world = "nominal" if case["mismatch"] == "none" else str(case["mismatch"])
    return world if case["variant"] == UNCHANGED else f"{world}; {case['variant']}"


def render_integrity(
    cases: Sequence[Case],
    records: Sequence[dict[str, Any]],
    runs: int,
    seed: int,
    comparison: str = "",
) -> str:
    """Returns the campaign as a self-contained HTML page."""
    rows = [
        (
            _world(one),
            one["channel"],
            str(one["heads"]),
            f"{one['availability']:.1%}",
            f"{one['exceedance_share']:.1e}",
            f"{one['exceedance_share_high']:.1e}",
            f"{one['runs_with_exceedances']} of {one['runs']}",
            number(one["time_to_alert_s"], 2),
            number(one["level_over_error"], 1),
            number(one["p90_error_m"]),
            *(
                "–" if one[name] is None else f"{one[name]:.1e}"
                for name in ("asked_risk_per_hour", "risk_per_hour", "risk_per_hour_high")
            ),
        )
        for one in records
    ]
    specs = {
        f"case{index}": charts.stanford(case.trajectories, case.alert_limit_m)
        for index, case in enumerate(cases)
    }
    titles = [f"{_world(vars(case))}; {case.channel}; {case.heads} radio heads" for case in cases]
    diagrams = "".join(figure(f"case{index}", title=title) for index, title in enumerate(titles))
    worst = max(records, key=lambda one: one["exceedance_share"])
    least = min(records, key=lambda one: one["availability"])
    first = cases[0].scenario
    return sheet(
        specs,
        "integrity",
        first.name,
        headline="Protection level under faults and wrong settings",
        lead=first.description,
        tiles=[
            (
                f"{worst['exceedance_share']:.1e}",
                "of the errors in state ok above the protection level, worst case: "
                f"{_world(worst)}",
            ),
            (f"{least['availability']:.1%}", f"availability, worst case: {_world(least)}"),
        ],
        meta=f"{runs} runs of each case, seed {seed}, {VERSION}.",
        sections=[
            warnings(first.warnings()),
            section("Cases", "", table(HEAD, rows, numbers=range(2, 13))),
            comparison,
            section("Stanford diagrams", "", diagrams),
            section("Provenance", "", source("Scenario of the first case", first.to_toml())),
        ],
    )
