"""The report of the evaluation: one HTML file that works offline, on a phone and in print."""

from __future__ import annotations

from html import escape
from importlib import resources
from typing import TYPE_CHECKING

from access_av.paper import summary
from access_av.paper.claims import ARITHMETIC, BY_CONSTRUCTION, NO_EVIDENCE
from access_av.paper.statements import METHODS
from access_av.report.page import VERSION, fill
from access_av.report.paper import (
    accuracy,
    controller,
    design_space,
    energy,
    equipment,
    interpretations,
    unknowns,
)
from access_av.report.parts import badge, folded, records, source, tile
from access_av.signal.methods import label
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation
    from access_av.paper.study import Study
    from access_av.report.chart import Spec

# Display names of the kinds of evidence that do not count.
TILES = {BY_CONSTRUCTION: "by construction", ARITHMETIC: "by arithmetic"}
NO_FIGURES = (
    "The source of the paper contains no figures: each \\includegraphics has an empty file name. "
    "Claims are compared with the paper's text and tables only."
)
TEMPLATE = resources.files(__package__).joinpath("evaluation.html")


def render(study: Study, specs: dict[str, Spec] | None = None) -> str:
    """Returns the report as HTML.

    Parameters
    ----------
    study
        Evaluation of several interpretations; the charts are those of the shown one.
    specs
        Dictionary to which the charts are added, by name.
    """
    specs = {} if specs is None else specs
    evaluation = study.shown
    return fill(
        TEMPLATE.read_text(encoding="utf-8"),
        specs,
        shown=escape(evaluation.interpretation.title),
        headline=escape(summary.headline(study)),
        promise=escape(summary.PROMISE),
        overview=interpretations.overview(study, specs),
        chosen=interpretations.chosen(study),
        freedoms=energy.freedoms(study),
        fair=controller.fair(study),
        lead=escape(summary.lead(study)),
        tiles=_tiles(study),
        meta=escape(
            f"{len(study.evaluations)} interpretations, platform “{evaluation.platform.name}”, "
            f"{evaluation.runs} runs per setting, seed {evaluation.seed}, {VERSION}."
        ),
        runs=evaluation.runs,
        interpretations=interpretations.interpretations(study),
        matrix=interpretations.matrix(study),
        seeds=escape(summary.seeds_text(study)),
        claims=interpretations.claims(study),
        tolerances=escape(interpretations.tolerances()),
        power_modes=interpretations.power_modes(evaluation),
        contribution=controller.contribution(study, specs),
        unknowns=unknowns.unknowns(study, specs),
        ours=controller.ours(study),
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


def _tiles(study: Study) -> str:
    """Returns the tiles with the met claims of the shown interpretation, by kind of evidence."""
    name = study.shown.interpretation.title
    met = summary.counts(study.of(study.shown.interpretation.name))
    made = [
        tile(
            f"{held} of {judged}",
            f"claims agree {TILES[kind]}, not counted as reproduced"
            if kind in NO_EVIDENCE
            else f"{kind} claims reproduced under “{name}”",
        )
        for kind, (held, judged) in met.items()
        if judged
    ]
    without_map = [each for each in study.proposed_vs_paper if not each.map]
    better = sum(each.is_better for each in without_map)
    text = "modes with less error and energy of the proposed method, both without a road map"
    return "".join([*made, tile(f"{better} of {len(without_map)}", text)])


def _provenance(evaluation: Evaluation) -> str:
    rows = []
    for mode in evaluation.platform.modes:
        for method in METHODS:
            figure = mode.energy_per_execution_j.get(method)
            used_j = evaluation.outcome.energy_per_execution_j[mode.number].get(method)
            rows.append(
                {
                    "Mode": f"{mode.number} {mode.name}",
                    "Method": label(method),
                    "J per estimate": number(None if used_j is None else float(used_j.flat[0]), 4),
                    "Provenance": badge(
                        "fitted" if evaluation.refitted else figure.provenance, "fit"
                    )
                    if figure
                    else "the platform has none",
                    "Source": figure.source if figure else "",
                }
            )
    return (
        f"<p>{escape(NO_FIGURES)}</p>"
        "<p>Errors, angle estimates and SNR are simulated by this version from the scenario below "
        "and the seed above. Prices and carbon factors are listed with their sources.</p>"
        + folded("Energy per estimate, with its sources", records(rows, numbers=(2,)))
        + source("Scenario, all defaults written out", evaluation.scenario.to_toml())
        + source("Platform", evaluation.platform.to_toml())
    )
