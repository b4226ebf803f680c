"""Verdicts on the paper's claims, with their weight of evidence."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.errors import InputError
from access_av.paper import energy_fit
from access_av.paper.findings import FINDINGS, Finding, MissingFigureError
from access_av.paper.margins import margin
from access_av.paper.outcome import Numbers, Outcome, interval
from access_av.paper.statements import stated_claims

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping


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


@dataclass(frozen=True)
class Claim:
    """One statement of the paper, and the simulated result under one interpretation.

    Attributes
    ----------
    interval
        95 % interval of ``obtained`` over the runs; ``None`` for results that are not random, and
        for sets of modes.
    seed_sensitive
        Whether other runs may give another verdict: by the standard deviation of the margin, or
        because another seed gave one.
    verdict
        One of :data:`VERDICTS`.
    evidence
        One of :data:`EVIDENCE`: the kind of evidence; empty for a claim that is not testable.
    deviation
        Maximum relative deviation of ``obtained`` from ``stated``, for claims with a tolerance.
    tolerance
        Maximum allowed deviation; ``None`` without one.
    spread
        Deviation of single trips from the mean, if the claim is about a mean over the runs.
    met_by_seed
        Whether the claim is met with each seed, if several seeds were simulated.
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
