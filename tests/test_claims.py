from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import synthetic
from access_av.errors import InputError
from access_av.paper.claims import (
    EVIDENCE,
    NOT_JUDGED,
    as_records,
    check_claims,
    evidence,
    with_seeds,
)
from access_av.paper.findings import FINDINGS
from access_av.paper.margins import margin
from access_av.paper.statements import stated_claims


@pytest.mark.parametrize(
    ("rule", "stated", "obtained", "met"),
    [
        ("at_most", 0.3, 0.3, True),
        ("at_most", 0.3, 0.3001, False),
        ("above", 52.0, 52.0, False),
        ("above", {"music": 1000, "esprit": 1235}, {"music": 1005, "esprit": 1235}, False),
        ("about", 0.8, 1.0, True),
        ("about", 0.8, 1.01, False),
    ],
)
def test_rules(rule: str, stated: object, obtained: object, met: bool) -> None:
    found = margin({"rule": rule, "stated": stated, "tolerance": 0.25}, obtained)
    assert (found >= 0.0) == met


@pytest.mark.parametrize(
    ("energies_j", "met"),
    [((250.0, 250.0, 250.0, 270.0), True), ((250.0, 250.0, 250.0, 206.5), False)],
)
def test_exactly_the_stated_modes(energies_j: tuple[float, ...], met: bool) -> None:
    modes = {
        mode: {"energy_j": np.array([energy]), "rms_m": np.array([0.14])}
        for mode, energy in zip((2, 3, 6, 7), energies_j, strict=True)
    }
    entry = stated_claims()["d2_budget_260_j_rms_015_m"]
    assert (margin(entry, modes) >= 0.0).all() == met


def test_an_unknown_rule_is_named() -> None:
    with pytest.raises(InputError, match=r"unknown rule 'almost'; there are: at_most, above"):
        margin({"rule": "almost", "stated": 1.0}, 1.0)


def test_there_is_a_finding_for_every_claim_of_the_paper() -> None:
    assert list(FINDINGS) == list(stated_claims())
    assert len(FINDINGS) == 17


def test_what_cannot_be_judged_is_named_and_the_others_are_judged() -> None:
    stated = dict(stated_claims())
    stated["a1_adaptive_worst_m"] = {**stated["a1_adaptive_worst_m"], "rule": "almost"}
    stated["b1_not_ours"] = stated["e2_mode0_executions"]
    found = {
        claim.id: claim for claim in check_claims(synthetic.evaluation().outcome, stated=stated)
    }
    for name, said in (("a1_adaptive_worst_m", "almost"), ("b1_not_ours", "nothing is obtained")):
        assert found[name].verdict == NOT_JUDGED
        assert found[name].obtained is None
        assert said in found[name].note
    assert sum(claim.verdict == NOT_JUDGED for claim in found.values()) == 2


def test_a_platform_without_a_figure_is_named_and_the_others_are_judged() -> None:
    outcome = synthetic.evaluation().outcome
    energies_j = {
        mode: {method: value for method, value in each.items() if (mode, method) != (4, "esprit")}
        for mode, each in outcome.energy_per_execution_j.items()
    }
    found = check_claims(replace(outcome, energy_per_execution_j=energies_j))
    lacking = [claim for claim in found if claim.verdict == NOT_JUDGED]
    assert [claim.id for claim in lacking] == ["e4_average_saving_percent"]
    assert "no energy per execution of ESPRIT in mode 4" in lacking[0].note


def test_a_platform_without_a_mode_is_named() -> None:
    outcome = synthetic.evaluation().outcome
    adaptive = {mode: drives for mode, drives in outcome.adaptive.items() if mode != 1}
    found = {claim.id: claim for claim in check_claims(replace(outcome, adaptive=adaptive))}
    claim = found["a6_modes_1_2_3_adaptive_worst_m"]
    assert claim.verdict == NOT_JUDGED
    assert "no mode 1" in claim.note
    assert found["a3_theoretical_20ms_worst_m"].verdict != NOT_JUDGED


def test_records_have_the_promised_fields() -> None:
    records = json.loads(json.dumps(as_records(check_claims(synthetic.evaluation().outcome))))
    for record in records:
        assert record["verdict"] in ("reproduced", "not reproduced")
        assert record["evidence"] in EVIDENCE
        assert isinstance(record["turns_with_seed"], bool)


def test_evidence_follows_from_what_was_chosen() -> None:
    entries = stated_claims()
    kinds = {name: evidence(entry, chosen=["controller"]) for name, entry in entries.items()}
    assert [name for name, kind in kinds.items() if kind == "independent"] == [
        "a3_theoretical_20ms_worst_m",
        "a4_esprit_worst_y_m",
        "a5_root_music_worst_y_m",
    ]
    assert [name for name, kind in kinds.items() if kind == "arithmetic"] == [
        "e2_mode0_executions",
        "e3_mode67_executions",
        "e6_fleet_of_100_saved_per_day_mj",
        "c1_sensor_cost_ratio_above",
        "c2_four_rsu_usd",
    ]
    assert [name for name, kind in kinds.items() if kind == "by construction"] == [
        "e1_mode0_fixed_j",
        "e4_average_saving_percent",
        "d1_budget_210_j",
    ]


def test_a_worse_adaptive_drive_turns_its_claims() -> None:
    worse = synthetic.evaluation(adaptive_worst_m=0.4)
    verdicts = {claim.id: claim for claim in check_claims(worse.outcome)}
    assert not verdicts["a1_adaptive_worst_m"].reproduced
    assert not verdicts["a6_modes_1_2_3_adaptive_worst_m"].reproduced
    assert "wake up least often" in verdicts["a6_modes_1_2_3_adaptive_worst_m"].note


@pytest.mark.parametrize(("worst_m", "turns"), [(0.1, False), (0.198, True), (0.3, False)])
def test_a_verdict_near_its_bound_turns_with_the_seed(worst_m: float, turns: bool) -> None:
    found = synthetic.evaluation(adaptive_worst_m=worst_m, spread=0.02)
    claims = {claim.id: claim for claim in check_claims(found.outcome)}
    claim = claims["a6_modes_1_2_3_adaptive_worst_m"]
    assert claim.turns_with_seed == turns
    assert claim.interval[0] < claim.obtained < claim.interval[1]


def test_a_verdict_that_another_seed_does_not_share_turns() -> None:
    good, bad = (
        check_claims(synthetic.evaluation(adaptive_worst_m=worst_m).outcome)
        for worst_m in (0.1, 0.4)
    )
    assert not any(claim.turns_with_seed for claim in good)
    claims = {claim.id: claim for claim in with_seeds({1: good, 2: bad, 3: good})}
    a1, e2 = claims["a1_adaptive_worst_m"], claims["e2_mode0_executions"]
    assert a1.reproduced
    assert a1.turns_with_seed
    assert a1.seeds_met == "2/3"
    assert a1.met_by_seed == {1: True, 2: False, 3: True}
    assert not e2.turns_with_seed
    assert e2.seeds_met == ""


def test_the_saving_of_a_day_is_of_the_trip_that_was_driven_and_of_its_duty() -> None:
    short = check_claims(synthetic.evaluation(trip_s=80.33).outcome)
    long = check_claims(replace(synthetic.evaluation(trip_s=178.6).outcome, duty=0.25))
    ids = ("e5_mode0_saved_per_day_kj", "e6_fleet_of_100_saved_per_day_mj")
    for name in ids:
        [once], [other] = (
            [it.obtained for it in found if it.id == name] for found in (short, long)
        )
        assert other == pytest.approx(once * 80.33 / 178.6 * 0.25, rel=1e-4)
