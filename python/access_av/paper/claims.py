"""Verdicts on the paper's claims, with their weight of evidence and the rules of ``paper.toml``.

The margin of a claim is relative to the paper's value, unless this is 0. It is positive if the
claim is met. It is continuous, so that it has an interval and a sensitivity. Obtained values may be
arrays over variants.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.errors import InputError
from access_av.paper import energy_fit
from access_av.paper.findings import FINDINGS, Finding, MissingFigureError
from access_av.paper.outcome import Numbers, Outcome, interval
from access_av.paper.statements import stated_claims

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping


REPRODUCED = "reproduced"
NOT_REPRODUCED = "not reproduced"
NOT_JUDGED = "not judged"
NOT_TESTABLE = "not testable"
# Verdicts of claims that are no evidence: they follow by arithmetic or by construction.
AGREES = "agrees"
DIFFERS = "differs"
VERDICTS = (REPRODUCED, NOT_REPRODUCED, AGREES, DIFFERS, NOT_JUDGED, NOT_TESTABLE)

INDEPENDENT = "independent"
CALIBRATED = "calibrated"
BY_CONSTRUCTION = "by construction"
ARITHMETIC = "arithmetic"
# Kinds of evidence, the strongest first.
EVIDENCE = (INDEPENDENT, CALIBRATED, BY_CONSTRUCTION, ARITHMETIC)
# Kinds whose claims are not counted as reproduced: no simulation can contradict them.
NO_EVIDENCE = (BY_CONSTRUCTION, ARITHMETIC)

# Minimum margin of a seed-independent verdict, in standard deviations of the difference between two
# seeds: 99 % of other seeds give the same verdict.
SAFE_DEVIATIONS = 2.58


# Maximum relative difference of equal settings.
ROUNDED = 1e-3


@dataclass(frozen=True)
class Claim:
    """One statement of the paper, and the simulated result under one interpretation.

    Columns ``claims`` of :mod:`access_av.columns`. ``verdict`` is one of :data:`VERDICTS`, and
    ``evidence`` one of :data:`EVIDENCE`; it is empty for a claim that is not testable.
    """

    interpretation: str
    id: str
    statement: str
    paper_section: str
    stated: Any
    obtained: Any
    interval: Any
    unit: str
    verdict: str
    seed_sensitive: bool
    evidence: str
    note: str
    spread: Mapping[str, float] = field(default_factory=dict)
    met_by_seed: Mapping[int, bool] = field(default_factory=dict)
    deviation: float | None = None
    tolerance: float | None = None

    @property
    def reproduced(self) -> bool:
        """Whether the claim is met by evidence other than arithmetic or construction."""
        return self.verdict == REPRODUCED

    @property
    def met(self) -> bool:
        """Whether the claim is met, with any kind of evidence."""
        return self.verdict in (REPRODUCED, AGREES)

    @property
    def is_judged(self) -> bool:
        """Whether the claim is met or not met."""
        return self.verdict in (REPRODUCED, NOT_REPRODUCED, AGREES, DIFFERS)

    @property
    def seeds_met(self) -> str:
        """Text with the number of seeds that meet the claim; empty if all seeds agree."""
        met = self.met_by_seed.values()
        return f"{sum(met)}/{len(met)}" if 0 < sum(met) < len(met) else ""


def evidence(
    entry: Mapping[str, Any],
    chosen: Collection[str],
    freedoms: Collection[str] = energy_fit.SHIPPED,
) -> str:
    """Returns the kind of evidence of a met claim.

    ``chosen`` are parameters that were selected with the claims known. ``freedoms`` are the fit
    parameters of the energies: a claim that determines one of them is met by construction.

    Examples
    --------
    >>> evidence({"rests_on": ["radio"]}, chosen=["controller"])
    'independent'
    """
    if "evidence" in entry:
        return str(entry["evidence"])
    if entry.get("solved_by") in freedoms:
        return BY_CONSTRUCTION
    # Energies are fitted to the paper's figures under every interpretation.
    return CALIBRATED if {*entry["rests_on"]} & {*chosen, "energy"} else INDEPENDENT


def check_claims(
    outcome: Outcome,
    *,
    interpretation: str = "",
    chosen: Collection[str] = ("radio", "controller"),
    freedoms: Collection[str] = energy_fit.SHIPPED,
    stated: Mapping[str, Any] | None = None,
) -> list[Claim]:
    """Evaluates every claim of the paper, in the paper's order.

    Parameters
    ----------
    outcome
        Campaigns of one interpretation; variants after the first are resamples of its runs.
    interpretation
        Name of the interpretation.
    chosen
        Parameters of the interpretation that were chosen with the claims known.
    freedoms
        Degrees of freedom of the fitted energies per estimate.
    stated
        Claims in the format of ``paper.toml``. Default: this file. The note of a claim that cannot
        be evaluated contains the reason.
    """
    return [
        _judge(claim_id, entry, outcome, interpretation, evidence(entry, chosen, freedoms))
        for claim_id, entry in (stated_claims() if stated is None else stated).items()
    ]


def margins(outcome: Outcome) -> dict[str, Numbers]:
    """Returns the margins of the claims in every variant; omits claims without a value."""
    found = {}
    for claim_id, entry in stated_claims().items():
        if entry["rule"] == NOT_TESTABLE:
            continue
        try:
            found[claim_id] = margin(entry, FINDINGS[claim_id](outcome).value)
        except MissingFigureError:
            continue
    return found


def with_seeds(claims: Mapping[int, list[Claim]]) -> list[Claim]:
    """Returns the claims of the first seed with the verdicts of the other seeds."""
    first, *_ = claims.values()
    made = []
    for index, claim in enumerate(first):
        met = {seed: each[index].met for seed, each in claims.items()}
        turns = claim.seed_sensitive or len({*met.values()}) > 1
        made.append(replace(claim, met_by_seed=met, seed_sensitive=turns))
    return made


def _judge(
    claim_id: str, entry: Mapping[str, Any], outcome: Outcome, interpretation: str, kind: str
) -> Claim:
    finding: Finding | None = None
    turns = False
    if entry["rule"] == NOT_TESTABLE:
        verdict, kind, note = NOT_TESTABLE, "", str(entry["why"])
    else:
        try:
            if claim_id not in FINDINGS:
                raise InputError(f"unknown claim; allowed are: {', '.join(FINDINGS)}")
            finding = FINDINGS[claim_id](outcome)
            by = np.atleast_1d(margin(entry, finding.value))
            met = bool(by[0] >= 0.0)
            held, missed = (
                (AGREES, DIFFERS) if kind in NO_EVIDENCE else (REPRODUCED, NOT_REPRODUCED)
            )
            verdict = held if met else missed
            turns = _turns(by)
            note = " ".join(filter(None, (finding.note, "" if met else finding.conflict)))
        except (MissingFigureError, InputError) as error:
            finding, verdict, note = None, NOT_JUDGED, f"Not judged: {error}"
    deviation = tolerance = None
    if finding is not None and entry["rule"] == "about":
        deviation = round(abs(_first(margin({**entry, "tolerance": 0.0}, finding.value))), 4)
        tolerance = float(entry.get("tolerance", 0.0))
    return Claim(
        interpretation=interpretation,
        id=claim_id,
        statement=entry["statement"],
        paper_section=entry["paper_section"],
        stated=entry["stated"],
        obtained=None if finding is None else _obtained(entry, finding.value),
        interval=None if finding is None else _interval(finding.value),
        unit=entry["unit"],
        verdict=verdict,
        seed_sensitive=turns,
        evidence=kind,
        note=note,
        spread={} if finding is None else dict(finding.spread),
        deviation=deviation,
        tolerance=tolerance,
    )


def _turns(margins: Numbers) -> bool:
    spread = float(np.std(margins[1:])) if len(margins) > 2 else 0.0
    return bool(abs(margins[0]) < SAFE_DEVIATIONS * np.sqrt(2.0) * spread)


def _obtained(entry: Mapping[str, Any], value: Any) -> Any:
    """Returns the value of the original sample, in the shape of the paper's value."""
    if entry["rule"] == "equal":
        return value
    if entry["rule"] == "modes":
        query = entry["query"]
        return sorted(
            mode
            for mode, each in value.items()
            if _first(each["energy_j"]) <= query["max_energy_j"]
            and _first(each["rms_m"]) <= query["max_rms_m"]
        )
    if entry["rule"] == "query":
        budget_j = entry["query"]["max_energy_j"]
        energies_j = {mode: _first(each["energy_j"]) for mode, each in value.items()}
        within = {mode: energy for mode, energy in energies_j.items() if energy <= budget_j}
        if not within:
            return None
        best = min(within, key=lambda mode: within[mode])
        return {
            "best_mode": best,
            "energy_j": round(within[best], 4),
            "rms_m": round(_first(value[best]["rms_m"]), 4),
        }
    if isinstance(value, dict):
        return {key: round(_first(item), 4) for key, item in value.items()}
    return round(_first(value), 4)


def _first(value: Numbers) -> float:
    return float(np.atleast_1d(value)[0])


def _interval(value: Any) -> Any:
    if isinstance(value, list):
        return None
    if isinstance(value, dict):
        if any(isinstance(item, dict) for item in value.values()):
            return None
        each = {key: _interval(item) for key, item in value.items()}
        return each if any(each.values()) else None
    values = np.atleast_1d(value)
    if len(values) < 3 or np.ptp(values[1:]) == 0.0:
        return None
    return [round(end, 4) for end in interval(values)]


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
