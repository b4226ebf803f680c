"""Report of ``access-av run``: error and angle estimates against time, integrity."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.errors import InputError
from access_av.report import drive_charts as charts
from access_av.report.page import VERSION, sheet
from access_av.report.parts import figure, section, shown, source, table, warnings
from access_av.report.played import CAPTION as PLAYED
from access_av.report.shown import service_levels
from access_av.run.assumptions import energy_boundary, in_words, optimistic_assumptions
from access_av.settings import as_dict
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from access_av._core import Scenario
    from access_av.report.chart import Spec
    from access_av.run.simulation import Simulation
    from access_av.statistics.integrity import Integrity


# Percentiles at the top of the report.
SHOWN_PERCENTS = (50.0, 90.0, 99.0)


def render_drive(scenario: Scenario, result: Simulation, seed: int, appendix: str = "") -> str:
    """Returns the runs of one scenario as a self-contained HTML page.

    Parameters
    ----------
    scenario
        Simulated scenario.
    result
        Result of :func:`access_av.simulate` with ``keep_trajectories=True``.
    seed
        Seed of the simulation.
    appendix
        HTML section with the comparison of variants.
    """
    if result.trajectories is None or result.aoa_estimates is None:
        raise InputError("the report needs trajectories: set keep_trajectories=True")
    operation = result.operation
    runs, duration_s = result.runs.height, float(result.steps["time_s"][-1])
    specs: dict[str, Spec] = {
        "map": charts.drive_on_map(scenario, result),
        "error": charts.error_against_time(result.steps),
    }
    sections = [
        section(
            "Operation",
            "" if operation is None else f"{operation.in_words()} {operation.what_helps()}".strip(),
            _errors(result),
        ),
        section("Map", f"The first run. {PLAYED}", figure("map")),
        section(
            "Error over the drive",
            "Horizontal distance of estimate and truth at each SSB, quantiles over the runs.",
            figure("error"),
        ),
    ]
    if not result.aoa_estimates.is_empty():
        specs["aoa_estimates"] = charts.aoa_estimates_against_time(
            result.aoa_estimates, runs, duration_s
        )
        text = "Angle estimates per second, mean over the runs."
        sections.append(section("Angle estimates", text, figure("aoa_estimates")))
    integrity = result.integrity
    if integrity is not None:
        vehicle = as_dict(scenario.resolved().vehicle)
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
                "target of TR 38.857, over all runs. A level is reached if the lower end of the "
                "95 % interval reaches it.",
                shown(service_levels(levels)),
            )
        )
    written = source("Scenario with all default values", scenario.to_toml())
    text = "Simulated by this version with the scenario below and the seed above."
    sections += [appendix, section("Provenance", text, written)]
    tiles = [
        (f"{each.value:.3f} m", f"{each.percent:g}th percentile of the horizontal error")
        for each in result.percentiles or ()
        if each.percent in SHOWN_PERCENTS
    ]
    if (boundary := energy_boundary(scenario)) is not None:
        energy_j = value_text(result.runs["energy_j"].mean())
        tiles.append((f"{energy_j} J", f"energy of a run: {boundary}"))
    tiles.append((f"{result.runs['aoa_estimates'].sum() / runs:,.0f}", "angles estimated per run"))
    if operation is not None and integrity is not None:
        tiles.append((f"{operation.reliable:.1%}", "availability (state ok)"))
        beyond = f"of {operation.epochs:,} errors above the protection level in state ok"
        tiles.append((f"{integrity.exceedances:,}", beyond))
    return sheet(
        specs,
        "drive",
        scenario.name,
        headline=f"90 % of the errors are below {result.error_quantiles_m[0.9]:.2f} m",
        lead=f"{scenario.description} {in_words(optimistic_assumptions(scenario))}".strip(),
        tiles=tiles,
        meta=f"Scenario “{scenario.name}”, {runs} run{'s' * (runs > 1)} of {duration_s:.1f} s, "
        f"seed {seed}, {VERSION}.",
        sections=[warnings(scenario.warnings()), *sections],
    )


def _errors(result: Simulation) -> str:
    """Returns the table of error percentiles, their intervals, and the means."""
    rows = [
        (
            f"{each.percent:g}th percentile",
            f"{each.value:.3f} m",
            each.interval if each.low is None else f"{each.interval} m",
        )
        for each in result.percentiles or ()
    ]
    if result.mean_error_m is not None:
        rows.append(("mean", f"{result.mean_error_m:.3f} m", "–"))
    rows.append(("root mean square", f"{result.rms_error_m:.3f} m", "–"))
    return table(("Horizontal error", "value", "95 % interval"), rows, numbers=(1, 2))


def _integrity_text(integrity: Integrity, alert_limit_m: float) -> str:
    shares = ", ".join(f"{state} {share:.2%}" for state, share in integrity.state_shares.items())
    return (
        "The protection level is the vehicle's bound of its error for the target integrity risk. "
        "A position with a level above the alert limit is not available. The Stanford diagram "
        "counts pairs of error and level. Right of the diagonal, the error exceeds the level. "
        f"Dashed lines: alert limit, {alert_limit_m:g} m. {integrity.epochs:,} "
        f"positions: {shares}. Median ratio of level and error: "
        f"{integrity.median_level_over_error:.1f}."
    )
