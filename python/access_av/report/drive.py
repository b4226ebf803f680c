"""The page of ``access-av run``: error and executions against time, integrity."""

from __future__ import annotations

import json
from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

from access_av.assumptions import energy_boundary, flattering, in_words
from access_av.errors import InputError
from access_av.report import drive_charts as charts
from access_av.report.page import sheet
from access_av.report.parts import figure, section, service_levels, source, tile, value_text

if TYPE_CHECKING:
    from access_av._core import Scenario
    from access_av.report.chart import Spec
    from access_av.simulation import Simulation
    from access_av.statistics.integrity import Integrity


def render_drive(scenario: Scenario, result: Simulation, seed: int) -> str:
    """The drives of one scenario as an HTML page that loads nothing.

    Parameters
    ----------
    scenario
        The scenario that was driven.
    result
        What :func:`access_av.simulate` returned, trajectories kept.
    seed
        Its seed.
    """
    if result.trajectories is None or result.executions is None:
        raise InputError("the page of a drive needs its trajectories: keep_trajectories=True")
    runs, duration_s = result.runs.height, float(result.steps["time_s"][-1])
    specs: dict[str, Spec] = {"error": charts.error_against_time(result.steps)}
    sections = [
        section(
            "Error",
            "Distance between estimate and truth at each SSB, over the runs.",
            figure("error"),
        )
    ]
    if not result.executions.is_empty():
        specs["executions"] = charts.executions_against_time(result.executions, runs, duration_s)
        sections.append(
            section(
                "Executions",
                "Angle estimates per second, mean over the runs.",
                figure("executions"),
            )
        )
    integrity = result.integrity
    if integrity is not None:
        vehicle = json.loads(scenario.resolved().vehicle.to_json())
        alert_limit_m = vehicle["integrity"]["alert_limit_m"]
        specs["stanford"] = charts.stanford(result.trajectories, alert_limit_m)
        sections.append(
            section("Integrity", _integrity_text(integrity, alert_limit_m), figure("stanford"))
        )
    if levels := result.service_levels:
        sections.append(
            section(
                "Service levels",
                "Horizontal accuracy and availability of TS 22.261, 7.3.2.2, and the industrial "
                "target of TR 38.857, over all runs. Reached is what the low end of the 95 % "
                "interval reaches.",
                service_levels(levels),
            )
        )
    sections.append(
        section(
            "Provenance",
            "Simulated by this version from the scenario below and the seed above.",
            source("Scenario, all defaults written out", scenario.to_toml()),
        )
    )
    quantiles_m = result.error_quantiles_m
    tiles = [
        tile(f"{quantiles_m[0.5]:.3f} m", "horizontal error, median"),
        tile(f"{quantiles_m[0.9]:.3f} m", "90th percentile"),
        tile(f"{quantiles_m[0.99]:.3f} m", "99th percentile"),
        tile(f"{result.runs['executions'].sum() / runs:,.0f}", "executions in a run"),
    ]
    if (boundary := energy_boundary(scenario)) is not None:
        energy_j = value_text(result.runs["energy_j"].mean())
        tiles.append(tile(f"{energy_j} J", f"energy of a run: {boundary}"))
    if integrity is not None:
        tiles.append(tile(f"{integrity.exceedances}", "errors beyond the protection level"))
    return sheet(
        specs,
        title=f"ACCESS-AV drive: {escape(scenario.name)}",
        kicker="ACCESS-AV drive",
        headline=f"{quantiles_m[0.9]:.2f} m or less in nine of ten epochs",
        lead=escape(f"{scenario.description} {in_words(flattering(scenario))}".strip()),
        tiles="".join(tiles),
        meta=escape(
            f"Scenario “{scenario.name}”, {runs} runs of {duration_s:.1f} s, seed {seed}, "
            f"version {version('access-av')}."
        ),
        sections="".join(sections),
    )


def _integrity_text(integrity: Integrity, alert_limit_m: float) -> str:
    shares = ", ".join(f"{state} {share:.2%}" for state, share in integrity.state_shares.items())
    return (
        "Stanford diagram: how often an error met with a protection level. Right of the diagonal "
        "the level did not hold; the dashed lines are the alert limit, "
        f"{alert_limit_m:g} m. {integrity.epochs:,} epochs: {shares}. While ok, the error lay "
        f"beyond the protection level {integrity.exceedances} times; the level is "
        f"{integrity.median_level_over_error:.1f} times the error in the median."
    )
