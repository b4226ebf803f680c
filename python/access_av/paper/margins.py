"""Margins of the claims: the rules of ``paper.toml``.

A margin is relative to the stated value, unless this is 0. It is positive if the claim is met. It
is continuous, so that it has an interval and a sensitivity. Obtained values may be arrays over
variants.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from access_av.paper.outcome import Numbers


# Maximum relative difference of equal settings.
ROUNDED = 1e-3


def margin(entry: Mapping[str, Any], obtained: Any) -> Numbers:
    """Returns the margin of an obtained value under a claim; negative if the claim is not met.

    Raises
    ------
    InputError
        If the rule of the claim is not in :data:`RULES`.

    Examples
    --------
    >>> entry = {"rule": "about", "stated": 0.8, "tolerance": 0.25}
    >>> bool(margin(entry, 0.7) >= 0), bool(margin(entry, 1.1) >= 0)
    (True, False)
    """
    rule = entry["rule"]
    if rule not in RULES:
        raise InputError(f"unknown rule {rule!r}; allowed are: {', '.join(RULES)}")
    return np.asarray(RULES[rule](entry, obtained), dtype=np.float64)


def _least(margins: list[Numbers]) -> Numbers:
    return np.asarray(np.min(np.broadcast_arrays(*margins), axis=0), dtype=np.float64)


def _each(compare: Callable[[float, Any, float], Numbers]) -> Callable[..., Numbers]:
    """Returns a rule that compares numbers.

    If a claim states several named numbers, the rule returns the smallest of their margins.
    """

    def rule(entry: Mapping[str, Any], obtained: Any) -> Numbers:
        stated, tolerance = entry["stated"], float(entry.get("tolerance", 0.0))
        if isinstance(stated, dict):
            return _least([compare(stated[key], obtained[key], tolerance) for key in stated])
        return compare(stated, obtained, tolerance)

    return rule


def _at_most(stated: float, obtained: Any, _: float) -> Numbers:
    return np.asarray((stated - obtained) / stated)


def _above(stated: float, obtained: Any, _: float) -> Numbers:
    # Use the next smaller number, because a value equal to the bound is not above it.
    return np.asarray((obtained - np.nextafter(stated, np.inf)) / (stated or 1.0))


def _about(stated: float, obtained: Any, tolerance: float) -> Numbers:
    return np.asarray((tolerance * stated - np.abs(obtained - stated)) / stated)


def _query(entry: Mapping[str, Any], modes: Mapping[int, Mapping[str, Numbers]]) -> Numbers:
    stated, budget_j = entry["stated"], float(entry["query"]["max_energy_j"])
    best = modes[stated["best_mode"]]
    others = [each for number, each in modes.items() if number != stated["best_mode"]]
    return _least(
        [
            _at_most(budget_j, best["energy_j"], 0.0),
            *((other["energy_j"] - best["energy_j"]) / best["energy_j"] for other in others),
            _about(stated["energy_j"], best["energy_j"], float(entry["tolerance"])),
            -_above(stated["rms_below_m"], best["rms_m"], 0.0),
        ]
    )


def _modes(entry: Mapping[str, Any], modes: Mapping[int, Mapping[str, Numbers]]) -> Numbers:
    query = entry["query"]
    return _least(
        [
            bound(query[key], modes[number][name], 0.0)
            for number in entry["stated"]
            for bound, key, name in (
                (_at_most, "max_energy_j", "energy_j"),
                (_at_most, "max_rms_m", "rms_m"),
            )
        ]
    )


def _both(entry: Mapping[str, Any], obtained: Mapping[str, Numbers]) -> Numbers:
    stated, tolerance = entry["stated"], float(entry["tolerance"])
    return _least(
        [
            _at_most(stated["worst_m"], obtained["worst_m"], 0.0),
            _about(stated["saving_percent"], obtained["saving_percent"], tolerance),
        ]
    )


def _equal(entry: Mapping[str, Any], obtained: Any) -> Numbers:
    stated = np.asarray(entry["stated"], dtype=np.float64)
    found = np.asarray(obtained, dtype=np.float64)
    # The paper rounds clock frequencies.
    alike = found.shape == stated.shape and np.allclose(found, stated, rtol=ROUNDED, atol=0.0)
    return np.asarray(0.0 if alike else -1.0)


RULES: dict[str, Callable[..., Numbers]] = {
    "at_most": _each(_at_most),
    "above": _each(_above),
    "about": _each(_about),
    "query": _query,
    "modes": _modes,
    "both": _both,
    "equal": _equal,
}
