"""Report section on energy and angle estimates."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import altair as alt
import polars as pl

from access_av.paper.energy_fit import numbers
from access_av.paper.findings import MissingFigureError, savings_percent
from access_av.paper.statements import ADAPTIVE_LABEL, METHODS, paper_numbers
from access_av.report.chart import Spec, finish, tips
from access_av.report.paper.lines import NAMES, by_mode, coloured
from access_av.report.parts import Html, figure, records
from access_av.signal.methods import LABELS, label
from access_av.tables.numbers import number

if TYPE_CHECKING:
    from access_av.paper.evaluation import Evaluation
    from access_av.paper.study import Study


def energy_text(evaluation: Evaluation) -> str:
    """Returns a paragraph on the energies and their sources."""
    free, solved = numbers(evaluation.freedoms)
    return escape(
        "Energy of a trip is the number of angle estimates times the energy of one estimate. "
        f"Boundary: {evaluation.platform.energy_boundary}. Bars: this simulation; diamonds: "
        "values in the paper. "
        + (
            "The energies per estimate were fitted to these values and to the paper’s other "
            f"statements, for each interpretation separately: {free} numbers are free, {solved} "
            "of them solved from figures of the paper. Agreement is therefore a check of the "
            "angle estimates, not of the power."
            if evaluation.refitted
            else "The energies per estimate are those of the platform file."
        )
        + _missing(evaluation)
    )


def _missing(evaluation: Evaluation) -> str:
    """Returns the energies for which the platform has no figure."""
    missing = [
        f"{label(method)} in mode {mode.number}"
        for mode in evaluation.platform.modes
        for method in METHODS
        if method not in mode.energy_per_execution_j
    ]
    return f" The platform has no figure for {', '.join(missing)}." if missing else ""


def _savings(evaluation: Evaluation, mode: int) -> float | None:
    try:
        savings = savings_percent(evaluation.outcome, mode)
    except MissingFigureError:
        return None
    return sum(float(value[0]) for value in savings.values()) / len(savings)


def energy(evaluation: Evaluation, specs: dict[str, Spec]) -> str:
    """Returns the section on energy and angle estimates of a trip in each mode."""
    specs["energy-bars"] = _energy_chart(evaluation)
    specs["aoa_estimates"] = finish(
        _grouped_bars(evaluation, "aoa_estimates", "angle estimates in a trip", ".0f"),
        height=230,
        description="Angle estimates in one trip per power mode and method",
    )
    bars = figure("energy-bars", title="Energy of a trip")
    return f'<div class="charts">{bars}{figure("aoa_estimates", title="Estimates in a trip")}</div>'


def freedoms(study: Study) -> str:
    """Returns the table of claims met with each degree of freedom of the energy fit."""
    if not study.fit_options:
        return "<p>The energies are those of the platform file; none was fitted.</p>"
    titles = {each.interpretation.name: each.interpretation.title for each in study.evaluations}

    def named(interpretations: str) -> str:
        return "; ".join(titles[name] for name in interpretations.split(", ") if name) or "none"

    title = study.shown.interpretation.title
    counted = f"“{title}”: reproduced / agree by construction / by arithmetic"
    rows = [
        {
            "Degree of freedom": Html(
                ("" if index == 0 else "and ")
                + escape(each.freedom)
                + (" <b>(used for the verdicts)</b>" if each.is_shipped else "")
            ),
            "Parameters: free / solved": f"{each.free_numbers} / {each.solved_numbers}",
            counted: f"{each.claims_reproduced} / {each.agree_by_construction} / "
            f"{each.agree_by_arithmetic}",
            "Average saving / %": number(each.average_saving_percent, 1),
            "Energy claims met by": named(each.keep_energy),
            "Both claim groups met by": named(each.keep_both),
        }
        for index, each in enumerate(study.fit_options)
    ]
    return records(rows)


def energy_table(evaluation: Evaluation) -> str:
    """Returns the table of energies, savings and angle estimates of each mode."""
    paper = paper_numbers()["energy_j"]
    rows = []
    for mode in evaluation.platform.modes:
        fixed = evaluation.campaign("Q").filter(pl.col("mode") == mode.number)
        adaptive = evaluation.campaign("R").filter(pl.col("mode") == mode.number)
        stated = paper.get(f"adaptive_mode_{mode.number}")
        energies = [number(value, 1) for value in fixed["energy_j"]]
        rows.append(
            {
                "Mode": f"{mode.number} {mode.name}",
                **{f"{label(m)} / J": it for m, it in zip(METHODS, energies, strict=True)},
                "Adaptive / J": number(adaptive["energy_j"].item(), 1)
                + (f" (paper {stated})" if stated else ""),
                "Saved / %": number(_savings(evaluation, mode.number), 1),
                "Angle estimates": number(adaptive["aoa_estimates"].item(), 0),
            }
        )
    return records(rows, numbers=range(1, 7))


def _energy_chart(evaluation: Evaluation) -> Spec:
    """Returns the chart of the energy per mode; diamonds are the stated values of the paper."""
    paper = paper_numbers()["energy_j"]
    stated = [
        {"mode": 0, "line": LABELS[method], "energy_j": value}
        for method, value in paper["fixed_mode_0"].items()
    ]
    stated += [
        {"mode": mode, "line": ADAPTIVE_LABEL, "energy_j": paper[f"adaptive_mode_{mode}"]}
        for mode in (0, 7)
    ]
    marks = (
        alt.Chart(pl.DataFrame(stated))
        .mark_point(
            shape="diamond", size=90, filled=True, color="#f5c518", stroke="#222", strokeWidth=1
        )
        .encode(
            x="mode:O",
            xOffset=alt.XOffset("line:N", sort=NAMES),
            y="energy_j:Q",
            tooltip=tips(("line:N", "the paper, method"), ("energy_j:Q", "energy / J")),
        )
    )
    bars = _grouped_bars(evaluation, "energy_j", "energy of a trip / J", ".1f")
    return finish(
        bars + marks, height=260, description="Energy of one trip per power mode and method"
    )


def _grouped_bars(evaluation: Evaluation, column: str, title: str, digits: str) -> alt.Chart:
    table = by_mode(evaluation).select(
        "mode", "line", pl.col(column).round(4), "base_wake_up_ms", "energy_provenance"
    )
    bars: alt.Chart = (
        alt.Chart(table)
        .mark_bar(cornerRadiusTopLeft=2, cornerRadiusTopRight=2)
        .encode(
            x=alt.X("mode:O", title="power mode", axis=alt.Axis(labelAngle=0)),
            xOffset=alt.XOffset("line:N", sort=NAMES),
            y=alt.Y(f"{column}:Q", title=title),
            color=coloured(NAMES),
            tooltip=tips(
                ("mode:O", "power mode"),
                ("line:N", "method"),
                (f"{column}:Q", title, digits),
                ("base_wake_up_ms:Q", "base wake-up time / ms"),
                ("energy_provenance:N", "energy per estimate"),
            ),
        )
    )
    return bars
