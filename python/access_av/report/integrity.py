"""The page of ``access-av integrity``: a table, and a Stanford diagram of each case."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from access_av.report import drive_charts as charts
from access_av.report.page import sheet
from access_av.report.parts import figure, source, table, tile, warnings
from access_av.run.pairs import AS_IT_IS
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.run.integrity_campaign import Case

HEAD = (
    "World", "Channel", "Radio heads", "Available", "Beyond while ok", "95 %, up to",
    "Runs with it", "Time to alert / s", "Level / error", "90 % of errors / m",
    "Risk per hour: asked", "Obtained", "95 %, up to",
)  # fmt: skip


def _world(case: dict[str, Any]) -> str:
    """How the world of a case departs from what is believed, and by which variant."""
    world = "all as stated" if case["mismatch"] == "none" else str(case["mismatch"])
    return world if case["variant"] == AS_IT_IS else f"{world}; {case['variant']}"


def render_integrity(
    cases: Sequence[Case],
    records: Sequence[dict[str, Any]],
    runs: int,
    seed: int,
    beside: str = "",
) -> str:
    """The campaign, its rows in the table, and a section on variants, as a page by itself."""
    rows = [
        (
            escape(_world(one)),
            escape(one["channel"]),
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
        title=f"ACCESS-AV integrity: {escape(first.name)}",
        kicker="ACCESS-AV integrity",
        headline="What the protection level is worth where the world is otherwise",
        lead=escape(first.description),
        tiles=tile(
            f"{worst['exceedance_share']:.1e}",
            f"of the errors beyond the protection level while ok, worst case: {_world(worst)}",
        )
        + tile(f"{least['availability']:.1%}", f"of the time ok, worst case: {_world(least)}"),
        meta=escape(f"{runs} drives of each case, seed {seed}, version {version('access-av')}."),
        sections=warnings(first.warnings())
        + f"<section><h2>Cases</h2>{table(HEAD, rows, numbers=range(2, 13))}</section>"
        + beside
        + f"<section><h2>Stanford diagrams</h2>{diagrams}</section><section><h2>Provenance</h2>"
        f"{source('Scenario of the first case', first.to_toml())}</section>",
    )
