"""Terminal output of the evaluation and of the paper's claims."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.cli.terminal import console, show_rows, table
from access_av.paper import summary
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from access_av.paper.chosen import Effect
    from access_av.paper.sampled_interpretations import Confirmed, Sample
    from access_av.paper.study import Study


def show_study(study: Study) -> None:
    """Prints the verdict, the main figures, and the interpretations that were not evaluated.

    The report and the tables contain everything else.
    """
    console.print(f"{summary.headline(study)}.", style="bold")
    title = f"Adaptive MUSIC, interpretation “{study.shown.interpretation.title}”"
    made = table(["figure", "paper", "obtained", "verdict"], title=title, text=1)
    for cells in summary.main_figures(study):
        made.add_row(*cells)
    console.print(made)
    if seeds := summary.seeds_text(study):
        console.print(seeds)
    for name, why in study.unusable.items():
        console.print(f"Not evaluated: {name}: {why}")


def show_chosen(effects: Sequence[Effect], runs: int) -> None:
    """Prints the open choices of the paper, the chosen values, and the effect of alternatives."""
    columns: list[tuple[str, Callable[[Effect], str]]] = [
        ("choice", lambda it: it.what if it.is_shipped else ""),
        ("value", lambda it: it.value if it.is_shipped else f"instead {it.value}"),
        ("angle estimates", lambda it: f"{it.aoa_estimates:.0f}"),
        ("maximum m", lambda it: f"{it.worst_error_m:.2f}"),
        ("RMS m", lambda it: f"{it.rms_error_m:.3f} ± {it.rms_std_m:.3f}"),
        ("80 ms: RMS", lambda it: f"{it.fixed_rms_m:.3f}"),
        ("every SSB: RMS", lambda it: f"{it.every_ssb_rms_m:.3f}"),
    ]
    title = f"Single changes, mode 0 of the shipped interpretation, {runs} runs"
    show_rows(columns, effects, title=title, text=2)


def show_search(found: Sample, checked: Sequence[Confirmed]) -> None:
    """Prints the best interpretations of a search, and their confirmation by more runs."""
    held = found.held()
    made = table(
        ["claims met", "angle estimates", "maximum m", "drawn values"],
        title=f"Best of {len(held)} interpretations ({len(found.margins)} claims)",
    )
    for index in found.best()[:8]:
        drawn = ", ".join(f"{name} {value_text(it)}" for name, it in found.values(index).items())
        made.add_row(
            f"{held[index]:.0f}",
            f"{found.aoa_estimates[index]:.0f}",
            f"{found.worst_error_m[index]:.2f}",
            drawn,
        )
    console.print(made)
    if checked:
        again = table(["interpretation", "claims met", "not met"], title="Confirmation", text=1)
        for each in checked:
            again.add_row(each.label, str(each.held), ", ".join(each.missed))
        console.print(again)
