"""The headline of the evaluation agrees with its verdicts, and these with the energy fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from access_av.device.platform import Platform
from access_av.paper import summary
from access_av.paper.driver import Driver
from access_av.paper.energy_fit import FREEDOMS, SHIPPED
from access_av.paper.evaluation import Evaluation, evaluate_with
from access_av.paper.freedoms import LADDER, judged, ladder, met_halves
from access_av.paper.interpretations import load_all
from access_av.paper.study import Study

if TYPE_CHECKING:
    from collections.abc import Sequence

BOTH = "Accuracy and saving hold together only if estimates wait for a better SSB"
NONE = "The paper's accuracy and its saving do not hold together under this interpretation"


@pytest.fixture(scope="module")
def evaluations() -> list[Evaluation]:
    driver = Driver(Platform.load("jetson-agx-xavier"), runs=12, seed=1)
    return [
        evaluate_with(driver, interpretation) for interpretation in load_all(["gate", "every-ssb"])
    ]


def study(evaluations: Sequence[Evaluation], freedoms: Sequence[str]) -> Study:
    fitted = [each.refit(freedoms) for each in evaluations]
    claims = [claim for each in fitted for claim in judged(each)]
    return Study(
        evaluations=fitted,
        claims=claims,
        ablations=[],
        front=[],
        proposed_vs_paper=[],
        sensitivity=None,
        unusable={},
        duration_s=0.0,
        fit_options=ladder(fitted, claims, "gate"),
    )


@pytest.mark.parametrize("taken", [None, *FREEDOMS])
def test_the_summary_changes_if_a_removed_fit_parameter_changes_verdicts(
    taken: str | None, evaluations: list[Evaluation]
) -> None:
    made = study(evaluations[:1], [name for name in FREEDOMS if name != taken])
    [group] = summary.claim_groups(made)
    assert group.accuracy, "no energy is in it"
    assert group.energy == (taken not in ("ratio", "factor"))
    assert summary.headline(made) == (BOTH if group.energy else NONE)


def test_the_effect_of_a_fit_parameter_equals_an_evaluation_with_it(
    evaluations: list[Evaluation],
) -> None:
    made = study(evaluations, SHIPPED)
    assert [each.freedoms for each in made.fit_options] == list(LADDER)
    for each in made.fit_options:
        there = study(evaluations, each.freedoms)
        claims = there.of("gate")
        assert each.claims_reproduced == sum(claim.reproduced for claim in claims)
        both = [it for it in ("gate", "every-ssb") if all(met_halves(there.of(it)))]
        assert each.keep_both == ", ".join(both)
    [shipped] = [each for each in made.fit_options if each.is_shipped]
    assert not shipped.keep_both
    assert summary.headline(made) == (
        "The paper's accuracy and its saving hold together under none of 2 interpretations"
    )
    added = "one factor of the power ratios in modes 1 to 5"
    assert f"one more parameter of the energy fit: {added}" in summary.lead(made)


def test_a_subset_of_interpretations_has_its_own_headline(evaluations: list[Evaluation]) -> None:
    for each in evaluations:
        alone = study([each], SHIPPED)
        assert summary.headline(alone) == NONE
        assert each.interpretation.title in summary.lead(
            alone
        ) or "no interpretation" in summary.lead(alone)
