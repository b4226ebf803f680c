"""The evaluation and the paper's claims on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.methods import label
from access_av.paper.methods import METHODS
from access_av.report.parts import value_text
from access_av.terminal import console, is_narrow, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.paper.claims import Claim
    from access_av.paper.evaluation import Evaluation


def show_evaluation(evaluation: Evaluation) -> None:
    """Accuracy and energy per mode, fixed methods beside the adaptive one."""
    energy = table(["mode", *map(label, METHODS), "adaptive"], title="Energy of a trip in J")
    error = table(["mode", *map(label, METHODS), "adaptive"], title="Worst error in Y in m")
    for mode in evaluation.platform.modes:
        rows = [
            *evaluation.campaign("Q").filter(mode=mode.number).iter_rows(named=True),
            *evaluation.campaign("R").filter(mode=mode.number).iter_rows(named=True),
        ]
        name = str(mode.number) if is_narrow() else f"{mode.number} {mode.name}"
        energy.add_row(name, *(f"{row['energy_j']:.1f}" for row in rows))
        error.add_row(name, *(f"{row['worst_error_y_m']:.3f}" for row in rows))
    console.print(error)
    console.print(energy)


def show_claims(claims: Sequence[Claim]) -> None:
    """The paper's claims with their verdicts."""
    made = table(["claim", "paper", "obtained", ""], title="Claims of the paper", text=4)
    for claim in claims:
        name = claim.id.split("_")[0] if is_narrow() else claim.id
        fitted = " (fitted)" if claim.fitted and not is_narrow() else ""
        made.add_row(
            name,
            value_text(claim.stated),
            value_text(claim.obtained),
            f"[green]✓[/]{fitted}" if claim.reproduced else "[red]✗ not reproduced[/]",
        )
    console.print(made)
    reproduced = sum(claim.reproduced for claim in claims)
    console.print(f"[bold]{reproduced} of {len(claims)} claims reproduced.[/]")
    for claim in claims:
        if not claim.reproduced:
            console.print(f"  {claim.id}: {claim.note}")
