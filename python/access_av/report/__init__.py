"""The report: one HTML file that works offline, on a phone and in print."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from typing import TYPE_CHECKING

import polars as pl

from access_av import carbon, cost, facts
from access_av.claims import saving, savings_percent
from access_av.explore import Query, answer
from access_av.methods import METHODS, label
from access_av.report import charts
from access_av.report.page import fill
from access_av.report.parts import badge, figure, number, source, table, tile, value_text

if TYPE_CHECKING:
    from access_av.claims import Claim
    from access_av.evaluate import Evaluation
    from access_av.report.charts import Spec

UNITS_NOT_BUILT = 4
QUERIES = (
    Query(max_energy_j=210.0),
    Query(max_energy_j=260.0, max_rms_m=0.15),
    Query(max_worst_m=0.3),
)


def render(evaluation: Evaluation, claims: list[Claim]) -> str:
    """The whole report as HTML.

    Parameters
    ----------
    evaluation
        Results of :func:`access_av.evaluate.evaluate`.
    claims
        Results of :func:`access_av.claims.check_claims`.

    Returns
    -------
    str
        An HTML page that loads nothing.
    """
    specs: dict[str, Spec] = {}
    reproduced = sum(claim.reproduced for claim in claims)
    return fill(
        "page.html",
        specs,
        scenario_name=escape(evaluation.scenario.name),
        headline=f"{reproduced} of {len(claims)} claims of the paper reproduced",
        lead=_lead(evaluation),
        tiles=_tiles(evaluation),
        meta=_meta(evaluation),
        runs=evaluation.runs,
        claims=_claims(claims),
        signal=_signal(evaluation, specs),
        accuracy=_accuracy(evaluation, specs),
        accuracy_table=_accuracy_table(evaluation),
        energy_text=_energy_text(evaluation),
        energy=_energy(evaluation, specs),
        energy_table=_energy_table(evaluation),
        design=_design(evaluation, specs),
        queries=_queries(evaluation),
        cost_text=_cost_text(evaluation),
        cost=_cost(specs),
        carbon=_carbon(evaluation, specs),
        provenance=_provenance(evaluation),
    )


def _lead(evaluation: Evaluation) -> str:
    adaptive, fixed = evaluation.campaign("R"), evaluation.campaign("Q")
    worst = adaptive.select(pl.max_horizontal("worst_error_x_m", "worst_error_y_m").max()).item()
    grown = fixed.select(pl.col("worst_error_y_m").max()).item()
    return (
        f"Adaptive wake-up keeps the error within {worst:.2f} m in X and Y in every power mode; "
        f"fixed intervals let it grow to {grown:.2f} m. "
        "Simulated with the paper's track, radio and controller."
    )


def _tiles(evaluation: Evaluation) -> str:
    adaptive, fixed = evaluation.campaign("R"), evaluation.campaign("Q")
    worst = adaptive.select(pl.max_horizontal("worst_error_x_m", "worst_error_y_m").max()).item()
    modes = adaptive["mode"].to_list()
    savings = [value for mode in modes for value in savings_percent(evaluation, mode).values()]
    first = modes[0]
    instead = fixed.filter(mode=first, method="music")["executions"].item()
    return "".join(
        (
            tile(f"{worst:.2f} m", "worst adaptive error, any mode (paper: within 0.3 m)"),
            tile(
                f"{sum(savings) / len(savings):.1f} %", "energy saved on average (paper: 43.09 %)"
            ),
            tile(
                f"{adaptive['executions'][0]:.0f}",
                f"executions in mode {first}, adaptive, instead of {instead:.0f}",
            ),
            tile(f"{cost.sensor_cost_ratio():.0f} ×", "cheaper than a LiDAR (paper: over 130 ×)"),
        )
    )


def _meta(evaluation: Evaluation) -> str:
    return escape(
        f"Scenario “{evaluation.scenario.name}”, platform “{evaluation.platform.name}”, "
        f"{evaluation.runs} runs per setting, seed {evaluation.seed}, "
        f"version {version('access-av')}."
    )


def _claims(claims: list[Claim]) -> str:
    rows = []
    for claim in claims:
        verdict = badge(claim.verdict, "yes" if claim.reproduced else "no")
        fitted = " " + badge("fitted", "fit") if claim.fitted else ""
        rows.append(
            (
                f"<b>{escape(claim.says)}</b><small>{escape(claim.where)} · "
                f"<code>{escape(claim.id)}</code></small><small>{escape(claim.note)}</small>",
                escape(value_text(claim.stated)),
                escape(value_text(claim.obtained)),
                escape(claim.unit),
                verdict + fitted,
            )
        )
    return table(("Claim", "Paper", "Obtained", "Unit", "Verdict"), rows)


def _signal(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    specs["snr"] = charts.snr(evaluation)
    highest = evaluation.snr.sort("snr_db").row(-1, named=True)
    return figure("snr", f"Highest {highest['snr_db']:.1f} dB at {highest['time_s']:.1f} s.")


def _accuracy(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    every_ssb = evaluation.campaign("P")
    panels = [("Every SSB (20 ms), what the radio would allow", every_ssb)]
    reference = every_ssb.filter(pl.col("method") == "music")
    by_mode = pl.concat([evaluation.campaign("Q"), evaluation.campaign("R")])
    groups: dict[tuple[float, ...], list[int]] = {}
    for mode in evaluation.campaign("R")["mode"]:
        times = tuple(by_mode.filter(pl.col("mode") == mode)["wake_up_ms"])
        groups.setdefault(times, []).append(mode)
    for times, modes in groups.items():
        name = "Mode" if len(modes) == 1 else "Modes"
        intervals = " / ".join(f"{time:g}" for time in times[: len(METHODS)])
        rows = pl.concat([by_mode.filter(pl.col("mode") == modes[0]), reference])
        panels.append((f"{name} {', '.join(map(str, modes))}: {intervals} ms", rows))
    parts = []
    for index, (title, rows) in enumerate(panels):
        for axis in ("x", "y"):
            chart_id = f"error-{axis}-{index}"
            specs[chart_id] = charts.errors(evaluation, rows, axis)
            parts.append(figure(chart_id, title=f"{title}, error in {axis.upper()}"))
    return f'<div class="charts">{"".join(parts)}</div>'


def _accuracy_table(evaluation: Evaluation) -> str:
    rows = []
    for point in evaluation.points.unique(
        ["campaign", "method", "adaptive", "wake_up_ms"], maintain_order=True
    ).iter_rows(named=True):
        modes = evaluation.points.filter(
            *(pl.col(key) == point[key] for key in ("campaign", "method", "adaptive", "wake_up_ms"))
        )["mode"]
        rows.append(
            (
                escape(label(point["method"], adaptive=point["adaptive"])),
                "every SSB" if point["campaign"] == "P" else ", ".join(map(str, modes)),
                f"{point['wake_up_ms']:g}",
                number(point["worst_error_x_m"]),
                number(point["worst_error_y_m"]),
                number(point["rms_error_m"]),
            )
        )
    head = ("Method", "Modes", "Wake-up / ms", "Worst X / m", "Worst Y / m", "RMS / m")
    worst = table(head, rows, numbers=(2, 3, 4, 5))
    return f"<details><summary>Worst and RMS errors as a table</summary>{worst}</details>"


def _energy_text(evaluation: Evaluation) -> str:
    return escape(
        "Energy of a trip is the number of executions times the energy of one execution. "
        f"Boundary: {evaluation.platform.energy_boundary}. Bars are ours; diamonds are the "
        "values the paper states. Energies per execution were fitted to those and to the paper’s "
        "statements about the rest (access-av fit), so agreement here is a check of the "
        "executions, not of the power."
    )


def _energy(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    specs["energy-bars"] = charts.energy(evaluation)
    specs["executions"] = charts.executions(evaluation)
    bars = figure("energy-bars", title="Energy of a trip")
    return f'<div class="charts">{bars}{figure("executions", title="Executions in a trip")}</div>'


def _energy_table(evaluation: Evaluation) -> str:
    paper = facts.load("paper")["energy_j"]
    rows = []
    for mode in evaluation.platform.modes:
        fixed = evaluation.campaign("Q").filter(pl.col("mode") == mode.number)
        adaptive = evaluation.campaign("R").filter(pl.col("mode") == mode.number)
        stated = paper.get(f"adaptive_mode_{mode.number}")
        savings = savings_percent(evaluation, mode.number)
        rows.append(
            (
                f"{mode.number} {escape(mode.name)}",
                *(number(value, 1) for value in fixed["energy_j"]),
                number(adaptive["energy_j"].item(), 1) + (f" (paper {stated})" if stated else ""),
                number(sum(savings.values()) / len(savings), 1),
                number(adaptive["executions"].item(), 0),
            )
        )
    head = (
        "Mode",
        *(f"{label(m)} / J" for m in METHODS),
        "Adaptive / J",
        "Saved / %",
        "Executions",
    )
    return table(head, rows, numbers=range(1, 7))


def _design(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    specs["design-space"] = charts.design_space(evaluation)
    return figure("design-space")


def _queries(evaluation: Evaluation) -> str:
    rows = []
    for query in QUERIES:
        found = answer(evaluation.campaign("R"), query)
        modes = ", ".join(map(str, found["mode"])) or "none"
        best = "–"
        if not found.is_empty():
            first = found.row(0, named=True)
            best = (
                f"mode {first['mode']}: {first['energy_j']:.1f} J, RMS {first['rms_error_m']:.3f} m"
            )
        rows.append((escape(str(query)), modes, best))
    return table(("Query (adaptive)", "Modes that meet it", "Least energy"), rows)


def _cost_text(evaluation: Evaluation) -> str:
    units = cost.roadside_units(UNITS_NOT_BUILT)
    mode = evaluation.platform.modes[0].number
    saved = saving(evaluation, mode)
    return escape(
        f"{units.units} roadside units would cost {units.capital_low_usd:,.0f} to "
        f"{units.capital_high_usd:,.0f} USD and {units.yearly_usd:,.0f} USD a year "
        f"({units.source}). In mode {mode} one vehicle saves {saved.per_day_kj:.1f} kJ a day "
        f"(paper: 398.84), a fleet of 100 saves {saved.fleet_per_day_mj(100):.2f} MJ "
        "(paper: 39.884)."
    )


def _cost(specs: dict[str, Spec]) -> str:
    specs["rsu-cost"] = charts.roadside_unit_cost(UNITS_NOT_BUILT, years=10)
    specs["sensor-cost"] = charts.sensor_cost()
    return figure("rsu-cost", title=f"{UNITS_NOT_BUILT} roadside units over the years") + figure(
        "sensor-cost", facts.load("cost")["sensor"][0]["source"], title="One sensor"
    )


def _carbon(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    avoided = {
        grid: carbon.footprint("roadside_unit", UNITS_NOT_BUILT, grid) for grid in carbon.grids()
    }
    onboard = {grid: carbon.footprint("onboard_box", 1, grid) for grid in carbon.grids()}
    specs["carbon-chart"] = charts.carbon(avoided)
    mode = evaluation.platform.modes[0].number
    saved_j = saving(evaluation, mode).per_trip_j

    def span(values: carbon.Range) -> str:
        return f"{values.central:,.0f} ({values.low:,.0f}–{values.high:,.0f})"

    rows = [
        (
            charts.grid_name(grid),
            number(intensity, 0),
            span(avoided[grid].use_kg),
            span(onboard[grid].use_kg),
            number(carbon.use_kg_per_year(saved_j, 100, grid), 0),
        )
        for grid, intensity in carbon.grids().items()
    ]
    rows.append(
        (
            "Embodied",
            "–",
            span(next(iter(avoided.values())).embodied_kg),
            span(next(iter(onboard.values())).embodied_kg),
            "–",
        )
    )
    sources = (
        ("Roadside units", next(iter(avoided.values())).source),
        ("Onboard computer", next(iter(onboard.values())).source),
        ("Grid", facts.load("carbon")["grid"]["source"] + "."),
    )
    head = (
        "Grid",
        "gCO2e/kWh",
        f"{UNITS_NOT_BUILT} roadside units, use / kg",
        "Onboard computer, use / kg",
        f"Saved by 100 vehicles in a year, mode {mode} / kg",
    )
    return (
        figure("carbon-chart", title=f"{UNITS_NOT_BUILT} roadside units, not built")
        + table(head, rows, numbers=range(1, 5))
        + "".join(f'<p class="note">{name}. {escape(text)}</p>' for name, text in sources)
    )


def _provenance(evaluation: Evaluation) -> str:
    rows = []
    for mode in evaluation.platform.modes:
        for method in METHODS:
            energy = mode.energy_per_execution_j[method]
            rows.append(
                (
                    f"{mode.number} {escape(mode.name)}",
                    escape(label(method)),
                    number(energy.value, 4),
                    badge(energy.provenance, "fit"),
                    escape(energy.source),
                )
            )
    head = ("Mode", "Method", "J per execution", "Provenance", "Source")
    return (
        "<p>Errors, executions and SNR are simulated by this version from the scenario below "
        "and the seed above. Prices and carbon factors carry their sources where they stand.</p>"
        "<details><summary>Energy per execution, with its sources</summary>"
        + table(head, rows, numbers=(2,))
        + "</details>"
        + source("Scenario, all defaults written out", evaluation.scenario.to_toml())
        + source("Platform", evaluation.platform.to_toml())
    )
