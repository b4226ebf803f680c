"""The ACCESS-AV paper: figures, evaluation, and comparison of its claims with the results.

No module outside of this package depends on it.

Examples
--------
>>> from access_av import paper
>>> paper.paper_numbers()["trip"]["length_m"]
300.0
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.lazy import attach

if TYPE_CHECKING:
    from access_av.paper import claims, energy_fit, evaluation, interpretations, study
    from access_av.paper.claims import Claim, check_claims
    from access_av.paper.energy_fit import fit_energy
    from access_av.paper.evaluation import Evaluation, evaluate
    from access_av.paper.interpretations import Interpretation
    from access_av.paper.statements import paper_numbers

__all__ = [
    "Claim",
    "Evaluation",
    "Interpretation",
    "check_claims",
    "claims",
    "energy_fit",
    "evaluate",
    "evaluation",
    "fit_energy",
    "interpretations",
    "paper_numbers",
    "study",
]

if not TYPE_CHECKING:
    __getattr__, __dir__ = attach(__name__)
