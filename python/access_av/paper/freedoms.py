"""Claims that are met with each degree of freedom of the energy fit.

All use equal runs; only the energies per estimate are fitted again. A claim that a degree of
freedom solves for is met by construction, so that fewer degrees of freedom give more evidence.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from access_av.paper.claims import ARITHMETIC, BY_CONSTRUCTION, Claim, check_claims
from access_av.paper.energy_fit import FREEDOMS, NONE, SHIPPED, numbers
from access_av.paper.statements import claim_group, stated_claims

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.paper.evaluation import Evaluation

# Sets of degrees of freedom, each with one more than the previous set.
LADDER = tuple(tuple(FREEDOMS)[:count] for count in range(len(FREEDOMS) + 1))


@dataclass(frozen=True)
class FitOption:
    """Claims under a fit with a set of degrees of freedom: table ``fit_degrees_of_freedom``.

    Attributes
    ----------
    freedom
        Description of the last degree of freedom.
    free_numbers, solved_numbers
        Number of fit parameters, and number of solved ones.
    claims_reproduced, agree_by_construction, agree_by_arithmetic
        Number of claims under the shown interpretation that are reproduced, and of those that agree
        by construction or by arithmetic, which are not counted as reproduced.
    average_saving_percent
        Result of claim e4 under the shown interpretation.
    keep_energy, keep_both
        Interpretations that meet the energy claims, and those that meet both claim groups.
    """

    freedoms: tuple[str, ...] = field(repr=False)
    freedom: str
    free_numbers: int
    solved_numbers: int
    claims_reproduced: int
    agree_by_construction: int
    agree_by_arithmetic: int
    average_saving_percent: float | None
    keep_energy: str
    keep_both: str

    @property
    def is_shipped(self) -> bool:
        """Whether this fit determines the verdicts."""
        return self.freedoms == SHIPPED


def met_halves(claims: Sequence[Claim]) -> tuple[bool, bool]:
    """Returns whether an interpretation meets the accuracy claims, and the energy claims."""
    met = {claim.id for claim in claims if claim.met}
    return met.issuperset(claim_group("accuracy")), met.issuperset(claim_group("energy"))


def judged(evaluation: Evaluation, stated: Mapping[str, Any] | None = None) -> list[Claim]:
    """Returns the claims under the interpretation of an evaluation.

    ``stated`` are claims in the format of ``paper.toml``. Default: this file.
    """
    interpretation = evaluation.interpretation
    return check_claims(
        evaluation.outcome,
        interpretation=interpretation.name,
        chosen=interpretation.chosen,
        freedoms=evaluation.freedoms,
        stated=stated,
    )


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
    unchanged = [claim for claim in claims if claim.id not in with_energy]
    if not any(each.refitted for each in evaluations):
        return []
    return [_bought(freedoms, evaluations, unchanged, shown, with_energy) for freedoms in LADDER]


def _bought(
    freedoms: tuple[str, ...],
    evaluations: Sequence[Evaluation],
    unchanged: Sequence[Claim],
    shown: str,
    with_energy: Mapping[str, Any],
) -> FitOption:
    free, solved = numbers(freedoms)
    found = {
        name: [it for it in unchanged if it.interpretation == name]
        + judged(each.refit(freedoms), with_energy)
        for each in evaluations
        for name in (each.interpretation.name,)
    }
    met = {name: met_halves(claims) for name, claims in found.items()}
    counted = found.get(shown, [])
    saving = [it.obtained for it in counted if it.id == "e4_average_saving_percent"]
    return FitOption(
        freedoms=freedoms,
        freedom=(FREEDOMS[freedoms[-1]] if freedoms else NONE).says,
        free_numbers=free,
        solved_numbers=solved,
        claims_reproduced=sum(it.reproduced for it in counted),
        agree_by_construction=sum(it.met and it.evidence == BY_CONSTRUCTION for it in counted),
        agree_by_arithmetic=sum(it.met and it.evidence == ARITHMETIC for it in counted),
        average_saving_percent=saving[0] if saving else None,
        keep_energy=", ".join(name for name, (_, energy) in met.items() if energy),
        keep_both=", ".join(name for name, halves in met.items() if all(halves)),
    )
