"""The report of the evaluation: one HTML file that works offline, on a phone and in print."""

from __future__ import annotations

from html import escape
from importlib import resources
from importlib.metadata import version
from typing import TYPE_CHECKING

import polars as pl

from access_av.cost import sensor_cost_ratio
from access_av.methods import label
from access_av.paper.claims import savings_percent
from access_av.paper.methods import METHODS
from access_av.paper.report import accuracy, design_space, energy, equipment
from access_av.paper.statements import of_claim
from access_av.report.page import fill
from access_av.report.parts import badge, number, source, table, tile, value_text

if TYPE_CHECKING:
    from access_av.paper.claims import Claim
    from access_av.paper.evaluation import Evaluation
    from access_av.report.chart import Spec

TEMPLATE = resources.files(__package__).joinpath("page.html")


def render(evaluation: Evaluation, claims: list[Claim]) -> str:
    """The whole report as HTML.

    Parameters
    ----------
    evaluation
        Results of :func:`access_av.evaluate`.
    claims
        Results of :func:`access_av.paper.check_claims`.

    Returns
    -------
    str
        An HTML page that loads nothing.
    """
    specs: dict[str, Spec] = {}
    reproduced = sum(claim.reproduced for claim in claims)
    return fill(
        TEMPLATE.read_text(encoding="utf-8"),
        specs,
        scenario_name=escape(evaluation.scenario.name),
        headline=f"{reproduced} of {len(claims)} claims of the paper reproduced",
        lead=_lead(evaluation),
        tiles=_tiles(evaluation),
        meta=_meta(evaluation),
        runs=evaluation.runs,
        claims=_claims(claims),
        signal=accuracy.signal(evaluation, specs),
        accuracy=accuracy.accuracy(evaluation, specs),
        accuracy_table=accuracy.accuracy_table(evaluation),
        energy_text=energy.energy_text(evaluation),
        energy=energy.energy(evaluation, specs),
        energy_table=energy.energy_table(evaluation),
        design=design_space.design(evaluation, specs),
        queries=design_space.queries(evaluation),
        cost_text=equipment.cost_text(evaluation),
        cost=equipment.cost_section(specs),
        carbon=equipment.carbon_section(evaluation, specs),
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
            tile(
                f"{worst:.2f} m",
                "worst adaptive error, any mode "
                f"(paper: within {of_claim('a1_adaptive_worst_m')} m)",
            ),
            tile(
                f"{sum(savings) / len(savings):.1f} %",
                f"energy saved on average (paper: {of_claim('e4_average_saving_percent')} %)",
            ),
            tile(
                f"{adaptive['executions'][0]:.0f}",
                f"executions in mode {first}, adaptive, instead of {instead:.0f}",
            ),
            tile(
                f"{sensor_cost_ratio():.0f} ×",
                f"cheaper than a LiDAR (paper: over {of_claim('c1_sensor_cost_ratio_above'):g} ×)",
            ),
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
