"""Summary of the evaluation in sentences."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from access_av.paper.claims import (
    AGREES,
    DIFFERS,
    EVIDENCE,
    NO_EVIDENCE,
    NOT_REPRODUCED,
    REPRODUCED,
    Claim,
)
from access_av.paper.freedoms import met_halves
from access_av.paper.statements import of_claim
from access_av.tables.numbers import value_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from access_av.paper.interpretations import Interpretation
    from access_av.paper.study import Study


@dataclass(frozen=True)
class ClaimGroups:
    """Claim groups that hold under an interpretation, with their conditions.

    Attributes
    ----------
    keeps_t_max
        Whether the maximum time between two estimates is at most t_max in the simulation.
    controller
        Numbers of power modes in which the controller helps, has no effect, and harms.
    """

    interpretation: Interpretation
    accuracy: bool
    energy: bool
    keeps_t_max: bool
    longest_gap_s: float
    controller: tuple[int, int, int]


def claim_groups(study: Study) -> list[ClaimGroups]:
    """Returns the claim groups that hold under each interpretation."""
    found = []
    for each in study.evaluations:
        accuracy, energy = met_halves(study.of(each.interpretation.name))
        effects = Counter(
            it.matters for it in study.ablations if it.interpretation == each.interpretation.name
        )
        found.append(
            ClaimGroups(
                interpretation=each.interpretation,
                accuracy=accuracy,
                energy=energy,
                keeps_t_max=each.interpretation.keeps(each.longest_gap_s),
                longest_gap_s=each.longest_gap_s,
                controller=(effects[1], effects[0], effects[-1]),
            )
        )
    return found


def controller_text(counts: tuple[int, int, int]) -> str:
    """Returns the counts as text.

    Examples
    --------
    >>> controller_text((0, 4, 0))
    'makes no difference'
    """
    helps, same, harms = counts
    if not helps and not harms:
        return "makes no difference"
    modes = helps + same + harms
    parts = [
        f"{word} in {count} of {modes} modes"
        for word, count in (("helps", helps), ("makes no difference", same), ("harms", harms))
        if count
    ]
    return parts[0].split(" in ")[0] if len(parts) == 1 else ", ".join(parts)


WORST, SAVING = "a1_adaptive_worst_m", "e4_average_saving_percent"
# Signs of verdicts in tables.
SIGNS = {REPRODUCED: "✓", NOT_REPRODUCED: "✗", AGREES: "=", DIFFERS: "≠"}
PROMISE = (
    "The paper claims that adaptive MUSIC stays within 0.3 m and is more accurate than every fixed "
    "interval over most of the track (accuracy claims a1 and a2). It also claims savings of more "
    "than 52 % of the energy in modes 6 and 7 and of 43 % on average (energy claims e3 and e4). "
    "Parameters that determine both are not in the paper. Each interpretation sets them to other "
    "values; it is simulated, and every claim is evaluated."
)


def main_figures(study: Study) -> list[tuple[str, str, str, str]]:
    """Returns maximum error, mean saving and number of reproduced claims, as text.

    Each row has name, stated and obtained value, and the verdict on the claim. Claims that agree by
    construction or by arithmetic are not counted.
    """
    claims = study.of(study.shown.interpretation.name)
    found = []
    for id_, name, sign in (
        (WORST, "maximum mean error / m", "≤ "),
        (SAVING, "mean energy saving / %", ""),
    ):
        for claim in claims:
            if claim.id == id_:
                stated, obtained = (shown_value(it) for it in (claim.stated, claim.obtained))
                found.append((name, sign + stated, obtained, claim.verdict))
    evident = [it for it in claims if it.evidence not in NO_EVIDENCE and it.is_judged]
    met = sum(it.met for it in evident)
    return [*found, ("reproduced claims", str(len(evident)), str(met), "")]


def headline(study: Study) -> str:
    """Returns a headline: the claim groups that hold under one interpretation."""
    found = claim_groups(study)
    both = [group for group in found if group.accuracy and group.energy]
    if any(not group.interpretation.is_gated and group.keeps_t_max for group in both):
        return "The paper's accuracy and its saving hold together under the published Algorithm 1"
    if both and all(group.interpretation.is_gated for group in both):
        return "Accuracy and saving hold together only if estimates wait for a better SSB"
    if both:
        return "Accuracy and saving hold together, but t_max is not kept"
    if len(found) == 1:
        return "The paper's accuracy and its saving do not hold together under this interpretation"
    return (
        "The paper's accuracy and its saving hold together under none of "
        f"{len(found)} interpretations"
    )


def bought_text(study: Study) -> str:
    """Returns the further fit parameter with which both claim groups hold, if there is one."""
    found = claim_groups(study)
    if not study.fit_options or any(group.accuracy and group.energy for group in found):
        return ""
    titles = {group.interpretation.name: group.interpretation.title for group in found}
    for each in study.fit_options:
        if each.keep_both:
            named = ", ".join(f"“{titles[name]}”" for name in each.keep_both.split(", "))
            return (
                f"Under {named} both hold with one more parameter of the energy fit: "
                f"{each.freedom}. The only reason for this parameter is the figure that it "
                "reproduces."
            )
    return "Both hold with no set of parameters of the energy fit."


def lead(study: Study) -> str:
    """Returns a paragraph about the claim groups that hold under each interpretation."""
    found = claim_groups(study)

    def titles(chosen: list[ClaimGroups]) -> str:
        named = [f"“{group.interpretation.title}”" for group in chosen]
        return ", ".join(named) if named else "no interpretation"

    both = [group for group in found if group.accuracy and group.energy]
    accurate = [group for group in found if group.accuracy and not group.energy]
    saving = [group for group in found if group.energy and not group.accuracy]
    sentences = [
        f"Accuracy claims (a1, a2) without the energy claims hold under {titles(accurate)}. "
        f"Energy claims (e3, e4) without the accuracy claims hold under {titles(saving)}. "
        f"Both hold under {titles(both)}."
    ]
    saving_percent = {it.interpretation: it.obtained for it in study.claims if it.id == SAVING}
    saved = [
        f"“{group.interpretation.title}” saves {percent:.1f} %"
        for group in found
        if group.accuracy and (percent := saving_percent.get(group.interpretation.name)) is not None
    ]
    if saved and not both:
        sentences.append(
            f"Mean saving of the interpretations that meet the accuracy claims: "
            f"{', '.join(saved)}. A saving within 10 % of the "
            f"stated {of_claim(SAVING)} % counts as reproduced."
        )
    for group in both:
        t_max = (
            "t_max is kept"
            if group.keeps_t_max
            else f"t_max is exceeded (longest gap {group.longest_gap_s:.2f} s)"
        )
        if group.interpretation.is_gated:
            sentences.append(
                f"Under “{group.interpretation.title}” estimates wait for a better SSB, which "
                "Algorithm 1 "
                f"does not contain; {t_max}. Compared with a constant, Algorithm 1 "
                f"{controller_text(group.controller)}."
            )
        else:
            sentences.append(
                f"Under “{group.interpretation.title}” {t_max}, and Algorithm 1 "
                f"{controller_text(group.controller)} compared with an equal number of fixed "
                f"wake-ups."
            )
    return " ".join(filter(None, [*sentences, bought_text(study)]))


def seeds_text(study: Study) -> str:
    """Number of verdicts that are equal with all seeds; empty for a single seed."""
    several = [claim for claim in study.claims if len(claim.met_by_seed) > 1]
    if not several:
        return ""
    differ = [claim for claim in several if claim.seeds_met]
    seeds = list(several[0].met_by_seed)
    return (
        f"Seeds {seeds[0]} to {seeds[-1]}: {len(several) - len(differ)} of {len(several)} verdicts "
        f"are equal with all seeds, {len(differ)} change."
    )


def shown_value(value: Any) -> str:
    """Returns a stated or obtained value as text; a table of settings row by row.

    Examples
    --------
    >>> shown_value([[0, 2265.6, 80], [1, 1200, 150]])
    '0 2265.6 80; 1 1200 150'
    """
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "; ".join(" ".join(f"{each:g}" for each in row) for row in value)
    return value_text(value)


def counts(claims: Sequence[Claim]) -> dict[str, tuple[int, int]]:
    """Returns the numbers of claims met and of claims judged, by kind of evidence."""
    found = {}
    for kind in EVIDENCE:
        judged = [it for it in claims if it.evidence == kind and it.is_judged]
        found[kind] = (sum(it.met for it in judged), len(judged))
    return found


def counts_text(claims: Sequence[Claim]) -> str:
    """Returns the numbers of reproduced claims and, separately, of claims without evidence.

    Claims that agree by construction or by arithmetic are not counted as reproduced.
    """

    def listed(kinds: Sequence[str]) -> str:
        return ", ".join(f"{found[kind][0]} of {found[kind][1]} {kind}" for kind in kinds)

    found = {kind: each for kind, each in counts(claims).items() if each[1]}
    evident = [kind for kind in found if kind not in NO_EVIDENCE]
    given = [kind for kind in found if kind in NO_EVIDENCE]
    parts = [f"reproduced: {listed(evident)}"] if evident else []
    parts += [f"agree, not counted as reproduced: {listed(given)}"] if given else []
    return "; ".join(parts)


def ours_text(study: Study) -> str:
    """Returns a text that compares the proposed method with the paper's adaptive point."""
    sentences = []
    for knows_road, who in (
        (False, "The tracker with uncertainty-driven wake-up and without a road map"),
        (True, "With a road map, which the paper's method does not have, the tracker"),
    ):
        rows = [each for each in study.proposed_vs_paper if each.map == knows_road]
        if not rows:
            continue
        better = sum(each.is_better for each in rows)
        ours, papers = (
            [getattr(each, name) for each in rows]
            for name in ("aoa_estimates", "papers_aoa_estimates")
        )
        worst_m, papers_m = (
            max(getattr(each, name) for each in rows) for name in ("rms_error_m", "papers_rms_m")
        )
        sentences.append(
            f"{who} has a smaller error and less energy in {better} of {len(rows)} power modes "
            f"(paired, 95 %): {_range(ours)} estimates, the paper's method {_range(papers)}; "
            f"maximum RMS error {worst_m:.2f} m, the paper's method {papers_m:.2f} m."
        )
    return " ".join(sentences)


def fair_text(study: Study) -> str:
    """Returns a text that compares both methods with equal information."""
    if not study.equal_information:
        return ""
    found = {(it.real_odometer, it.map, it.who): it for it in study.equal_information}
    rms_m = {key: each.rms_error_m for key, each in found.items()}
    count = {key: each.aoa_estimates for key, each in found.items()}
    sentences = []
    for real, where in (
        (False, "With the paper's exact odometer and start"),
        (True, "With a real odometer and start"),
    ):
        sentences.append(
            f"{where}, in mode 0, without road maps: the paper's method has an RMS error of "
            f"{rms_m[real, False, 'paper']:.2f} m with {count[real, False, 'paper']:.0f} "
            f"estimates, the tracker {rms_m[real, False, 'ours']:.2f} m with "
            f"{count[real, False, 'ours']:.0f}. With a road map, angles only correct the distance "
            f"driven: one angle at the start gives {_metres(rms_m[real, True, 'one angle'])}, the "
            f"tracker with {count[real, True, 'ours']:.0f} estimates "
            f"{_metres(rms_m[real, True, 'ours'])}."
        )
    return " ".join(sentences)


def _metres(value_m: float) -> str:
    return f"{value_m:.2f} m" if value_m >= 0.01 else f"{1e3 * value_m:.1f} mm"


def _range(values: Sequence[float]) -> str:
    low, high = round(min(values)), round(max(values))
    return f"{low}" if low == high else f"{low} to {high}"
