"""Terminal output of the evaluation and of the paper's claims."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.cli.terminal import console, is_narrow, table
from access_av.paper import summary
from access_av.paper.claims import NOT_JUDGED
from access_av.paper.statements import METHODS
from access_av.paper.summary import SIGNS
from access_av.signal.methods import label
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.paper.chosen import Effect
    from access_av.paper.claims import Claim
    from access_av.paper.evaluation import Evaluation
    from access_av.paper.sampled_readings import Confirmed, Sample
    from access_av.paper.study import Study
    from access_av.paper.unknowns import Unknowns


def mark(claim: Claim) -> str:
    """Returns the sign of a verdict, and the sign of one that changes with the seed.

    ✓ reproduced, ✗ not reproduced, = agrees and ≠ differs by arithmetic or construction.
    """
    sign = SIGNS.get(claim.verdict, "–")
    return sign + ((claim.seeds_met or "?") if claim.turns_with_seed else "")


def show_study(study: Study) -> None:
    """Prints claims by interpretation, the modes of the shown one, and the summary."""
    show_evaluation(study.shown)
    _show_claims(study)
    _show_freedoms(study)
    console.print(f"{summary.headline(study)}.", style="bold")
    console.print(summary.lead(study))
    shown = study.of(study.shown.reading.name)
    console.print(f"Claims under “{study.shown.reading.title}”: {summary.counts_text(shown)}.")
    console.print(summary.fair_text(study))
    console.print(summary.ours_text(study))
    if seeds := summary.seeds_text(study):
        console.print(seeds)
    if study.unknowns is not None:
        _show_unknowns(study.unknowns)
    for reading, why in study.unusable.items():
        console.print(f"Not evaluated: {reading}: {why}", markup=False)
    for note in sorted({it.id + ": " + it.note for it in study.claims if it.verdict == NOT_JUDGED}):
        console.print(note, markup=False)


def show_evaluation(evaluation: Evaluation) -> None:
    """Prints accuracy and energy per mode for fixed and adaptive methods."""
    energy = table(["mode", *map(label, METHODS), "adaptive"], title="Energy of a trip in J")
    error = table(["mode", *map(label, METHODS), "adaptive"], title="Maximum mean error in Y in m")
    for mode in evaluation.platform.modes:
        rows = [
            *evaluation.campaign("Q").filter(mode=mode.number).iter_rows(named=True),
            *evaluation.campaign("R").filter(mode=mode.number).iter_rows(named=True),
        ]
        name = str(mode.number) if is_narrow() else f"{mode.number} {mode.name}"
        energies = (row["energy_j"] for row in rows)
        energy.add_row(name, *("–" if it is None else f"{it:.1f}" for it in energies))
        error.add_row(name, *(f"{row['worst_error_y_m']:.3f}" for row in rows))
    console.print(error)
    console.print(energy)


def _show_claims(study: Study) -> None:
    shown = study.of(study.shown.reading.name)
    wide = not is_narrow()
    head = ["claim", "paper", "obtained", "evidence"] if wide else ["claim", "paper", "obtained"]
    made = table(head, title="Claims of the paper", text=4)
    for claim in shown:
        row = [
            claim.id if wide else claim.id.split("_")[0],
            summary.shown_value(claim.stated),
            f"{summary.shown_value(claim.obtained)} {mark(claim)}",
            claim.evidence,
        ]
        made.add_row(*row[: len(head)])
    console.print(made)
    columns = [each.reading.name for each in study.evaluations]
    matrix = table(
        ["claim", *(map(str, range(1, len(columns) + 1)))],
        title="Claims by interpretation (✓ reproduced, ✗ not; = agrees, ≠ differs by arithmetic or "
        "construction; ? or 3/5: changes with the seed)",
    )
    by_reading = [study.of(name) for name in columns]
    for claims in zip(*by_reading, strict=True):
        name = claims[0].id if wide else claims[0].id.split("_")[0]
        matrix.add_row(name, *map(mark, claims))
    console.print(matrix)
    console.print(", ".join(f"{i} {name}" for i, name in enumerate(columns, start=1)))


def _show_freedoms(study: Study) -> None:
    """Prints the effect of each free parameter of the energy fit."""
    if not study.bought:
        return
    made = table(
        [
            "free in the energy fit",
            "numbers / solved",
            "reproduced / by construction / by arithmetic",
            "saving %",
            "both claim groups",
        ],
        title=f"Effect of each free parameter, claims under {study.shown.reading.name}",
        text=1,
    )
    for index, each in enumerate(study.bought):
        saving = each.average_saving_percent
        made.add_row(
            ("and " if index else "") + each.says + (" *" if each.is_shipped else ""),
            f"{each.free} / {each.solved}",
            f"{each.reproduced} / {each.by_construction} / {each.by_arithmetic}",
            "–" if saving is None else f"{saving:.1f}",
            ", ".join(each.both) or "none",
        )
    console.print(made)
    console.print("* fit that judges the claims")


def show_chosen(effects: Sequence[Effect], runs: int) -> None:
    """Prints the open choices of the paper, the chosen values, and the effect of alternatives."""
    made = table(
        ["choice", "value", "executions", "maximum m", "RMS m", "80 ms: RMS", "every SSB: RMS"],
        title=f"Single changes, mode 0 of the shipped interpretation, {runs} runs",
        text=2,
    )
    for each in effects:
        made.add_row(
            each.what if each.is_shipped else "",
            each.value if each.is_shipped else f"instead {each.value}",
            f"{each.executions:.0f}",
            f"{each.worst_error_m:.2f}",
            f"{each.rms_error_m:.3f} ± {each.rms_std_m:.3f}",
            f"{each.fixed_rms_m:.3f}",
            f"{each.every_ssb_rms_m:.3f}",
        )
    console.print(made)


def _show_unknowns(found: Unknowns) -> None:
    """Prints the sensitivity of each claim to the open choices."""
    made = table(
        [
            "claim",
            "holds in",
            "significant total Sobol indices, ± half of the 95 % interval",
            "rest",
        ],
        title=f"Sensitivity of the claims: {found.readings} interpretations with {found.runs} runs",
        text=3,
    )
    matter = found.matter
    for claim in dict.fromkeys(each.claim for each in matter):
        mine = sorted((it for it in matter if it.claim == claim), key=lambda it: -it.total)
        made.add_row(
            claim if not is_narrow() else claim.split("_")[0],
            f"{found.holds[claim]:.0%}",
            ", ".join(f"{it.dimension} {it.total:.2f} ± {it.half_width:.2f}" for it in mine),
            f"{1.0 - found.explained[claim]:.2f}",
        )
    console.print(made)
    widest = max(matter, key=lambda it: it.half_width, default=None)
    if widest is not None:
        console.print(
            f"Widest of these {len(matter)} intervals: ± {widest.half_width:.3f} "
            f"({widest.claim}, {widest.dimension})."
        )


def show_search(found: Sample, checked: Sequence[Confirmed]) -> None:
    """Prints the best interpretations of a search, and their confirmation by more runs."""
    held = found.held()
    made = table(
        ["claims met", "executions", "maximum m", "drawn values"],
        title=f"Best of {len(held)} interpretations ({len(found.margins)} claims)",
    )
    for index in found.best()[:8]:
        drawn = ", ".join(f"{name} {value_text(it)}" for name, it in found.values(index).items())
        made.add_row(
            f"{held[index]:.0f}",
            f"{found.executions[index]:.0f}",
            f"{found.worst_error_m[index]:.2f}",
            drawn,
        )
    console.print(made)
    if checked:
        again = table(["interpretation", "claims met", "not met"], title="Confirmation", text=1)
        for each in checked:
            again.add_row(each.label, str(each.held), ", ".join(each.missed))
        console.print(again)
