"""Statements of the paper as data: ``paper.toml``."""

from __future__ import annotations

from typing import Any

from access_av.signal.methods import label
from access_av.tables.toml import shipped

# The angle-of-arrival methods that the paper compares.
METHODS = ("music", "esprit", "root_music")
ADAPTIVE_LABEL = label("music", adaptive=True)


def paper_numbers() -> dict[str, Any]:
    """Returns the content of ``paper.toml``: settings, energies, one entry per claim.

    Examples
    --------
    >>> paper_numbers()["trip"]["duration_s"]
    80.33
    """
    return shipped("paper", "paper.toml")


def stated_claims() -> dict[str, Any]:
    """Returns the entries of the claims by their ids, in the paper's order."""
    return dict(paper_numbers()["claims"])


def of_claim(claim_id: str, key: str = "stated") -> Any:
    """Returns the value of a claim, or another field of the claim's entry.

    Examples
    --------
    >>> of_claim("e4_average_saving_percent")
    43.09
    """
    return stated_claims()[claim_id][key]


def claim_group(name: str) -> tuple[str, ...]:
    """Returns the ids of a claim group: ``accuracy`` or ``energy``.

    Examples
    --------
    >>> claim_group("accuracy")
    ('a1_adaptive_worst_m', 'a2_adaptive_beats_fixed')
    """
    return tuple(key for key, entry in stated_claims().items() if entry.get("claim_group") == name)
