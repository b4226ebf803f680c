"""Claims that are met with each degree of freedom of the energy fit.

All use equal runs; only the energies per estimate are fitted again. A claim that a degree of
freedom solves for is met by construction, so that fewer degrees of freedom give more evidence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.paper.claims import ARITHMETIC, BY_CONSTRUCTION, Claim, check_claims
from access_av.paper.energy_fit import FREEDOMS, NONE, SHIPPED, numbers
from access_av.paper.statements import claim_group, stated_claims

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from access_av.paper.evaluation import Evaluation

# Sets of degrees of freedom, each with one more than the previous set.
LADDER = tuple(tuple(FREEDOMS)[:count] for count in range(len(FREEDOMS) + 1))


@dataclass(frozen=True)
class FitOption:
    """Claims under a fit with a set of degrees of freedom.

    Attributes
    ----------
    free, solved
        Number of fit parameters, and number of solved ones.
    reproduced, by_construction, by_arithmetic
        Number of claims under the shown interpretation that are reproduced, and of those that agree
        by construction or by arithmetic, which are not counted as reproduced.
    average_saving_percent
        Result of claim e4 under the shown interpretation.
    energy, both
        Interpretations that meet the energy claims, and those that meet both claim groups.
    """

    freedoms: tuple[str, ...]
    says: str
    free: int
    solved: int
    reproduced: int
    by_construction: int
    by_arithmetic: int
    average_saving_percent: float | None
    energy: tuple[str, ...]
    both: tuple[str, ...]

    def as_row(self) -> dict[str, Any]:
        """Returns a row of the table ``fit_degrees_of_freedom``."""
        return {
            "freedom": self.says,
            "free_numbers": self.free,
            "solved_numbers": self.solved,
            "claims_reproduced": self.reproduced,
            "agree_by_construction": self.by_construction,
            "agree_by_arithmetic": self.by_arithmetic,
            "average_saving_percent": self.average_saving_percent,
            "keep_energy": ", ".join(self.energy),
            "keep_both": ", ".join(self.both),
        }

    @property
    def is_shipped(self) -> bool:
        """Whether this fit determines the verdicts."""
        return self.freedoms == SHIPPED


def met_halves(claims: Sequence[Claim]) -> tuple[bool, bool]:
    """Returns whether an interpretation meets the accuracy claims, and the energy claims."""
    met = {claim.id for claim in claims if claim.met}
    return met.issuperset(claim_group("accuracy")), met.issuperset(claim_group("energy"))


def ladder(
    evaluations: Sequence[Evaluation],
    claims: Sequence[Claim],
    shown: str,
    stated: Mapping[str, Any] | None = None,
) -> list[FitOption]:
    """Returns the claims for each set of degrees of freedom; empty without fitted energies.

    Parameters
    ----------
    claims
        Claims of all interpretations under the shipped fit.
    shown
        Name of the interpretation whose claims are counted.
    stated
        Claims in the format of ``paper.toml``. Default: this file.
    """
    stated = stated_claims() if stated is None else stated
    # Verdicts without energies are unchanged.
    with_energy = {
        name: entry for name, entry in stated.items() if "energy" in entry.get("rests_on", ())
    }
    if not any(each.refitted for each in evaluations):
        return []
    return [_bought(freedoms, evaluations, claims, shown, with_energy) for freedoms in LADDER]


def _bought(
    freedoms: tuple[str, ...],
    evaluations: Sequence[Evaluation],
    claims: Sequence[Claim],
    shown: str,
    with_energy: Mapping[str, Any],
) -> FitOption:
    free, solved = numbers(freedoms)
    energy, both = [], []
    counted: list[Claim] = []
    for each in evaluations:
        name = each.interpretation.name
        judged = rejudged(each, claims, freedoms, with_energy)
        keeps_accuracy, keeps_energy = met_halves(judged)
        energy += [name] if keeps_energy else []
        both += [name] if keeps_energy and keeps_accuracy else []
        counted = judged if name == shown else counted
    saving = [it.obtained for it in counted if it.id == "e4_average_saving_percent"]
    return FitOption(
        freedoms=freedoms,
        says=(FREEDOMS[freedoms[-1]] if freedoms else NONE).says,
        free=free,
        solved=solved,
        reproduced=sum(it.reproduced for it in counted),
        by_construction=sum(it.met and it.evidence == BY_CONSTRUCTION for it in counted),
        by_arithmetic=sum(it.met and it.evidence == ARITHMETIC for it in counted),
        average_saving_percent=saving[0] if saving else None,
        energy=tuple(energy),
        both=tuple(both),
    )


def rejudged(
    evaluation: Evaluation,
    claims: Sequence[Claim],
    freedoms: Collection[str],
    with_energy: Mapping[str, Any],
) -> list[Claim]:
    """Returns the claims of an interpretation, with energies fitted with these free parameters."""
    interpretation = evaluation.interpretation
    again = check_claims(
        evaluation.refit(tuple(freedoms)).outcome,
        interpretation=interpretation.name,
        chosen=interpretation.chosen,
        freedoms=freedoms,
        stated=with_energy,
    )
    kept = [
        it for it in claims if it.interpretation == interpretation.name and it.id not in with_energy
    ]
    return kept + again
