from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

import synthetic
from access_av.errors import InputError
from access_av.paper import summary
from access_av.paper.claims import (
    EVIDENCE,
    NO_EVIDENCE,
    NOT_JUDGED,
    NOT_TESTABLE,
    VERDICTS,
    check_claims,
    evidence,
    margin,
    with_seeds,
)
from access_av.paper.findings import FINDINGS
from access_av.paper.statements import stated_claims
from conftest import ROOT


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
def test_rules_of_claims_accept_values_within_their_tolerance(
    rule: str, stated: object, obtained: object, met: bool
) -> None:
    found = margin({"rule": rule, "stated": stated, "tolerance": 0.25}, obtained)
    assert (found >= 0.0) == met


@pytest.mark.parametrize(
    ("energies_j", "met"),
    [
        ((250.0, 250.0, 250.0, 270.0), True),
        ((250.0, 250.0, 250.0, 206.5), True),  # mode 7 may qualify as well
        ((250.0, 250.0, 270.0, 206.5), False),
    ],
)
def test_claim_d2_requires_exactly_the_published_modes(
    energies_j: tuple[float, ...], met: bool
) -> None:
    modes = {
        mode: {"energy_j": np.array([energy]), "rms_m": np.array([0.14])}
        for mode, energy in zip((2, 3, 6, 7), energies_j, strict=True)
    }
    entry = stated_claims()["d2_budget_260_j_rms_015_m"]
    assert (margin(entry, modes) >= 0.0).all() == met


def test_an_unknown_rule_is_named() -> None:
    with pytest.raises(InputError, match=r"unknown rule 'almost'; allowed are: at_most, above"):
        margin({"rule": "almost", "stated": 1.0}, 1.0)


def test_every_claim_of_the_paper_has_a_finding_or_a_reason() -> None:
    stated = stated_claims()
    testable = [name for name, entry in stated.items() if entry["rule"] != NOT_TESTABLE]
    assert list(FINDINGS) == testable
    for name, entry in stated.items():
        assert (name in testable) != ("why" in entry), name


# Figures in sections VI and VII of the paper, and their claims.
FIGURES = {
    "x1": "four antennas with 20 snapshots",
    "x2": "clocks and base wake-up times of eight modes",
    "x3": "theoretical baseline of 20 ms",
    "x4": "4.17 m/s, 1 m in 240 ms, 2 m in 480 ms",
    "x5": "upper limit of 240 ms",
    "x6": "gains and weights",
    "x7": "100 times",
    "x8": "the 32 GB board",
    "a1": "0.3 m",
    "a3": "0.8 m at 20 ms",
    "a4": "over 1 m",
    "a5": "0.8 m",
    "a6": "0.2 m in modes 1 to 3",
    "a9": "Root-MUSIC unable to keep 0.3 m",
    "e1": "627.22, 679.77 and 648.70 J",
    "e2": "over 1000, 1235 and 1147 angle estimates",
    "e3": "above 52 %; over 800, 1147 and 1071 angle estimates",
    "e4": "43.09 %",
    "e5": "398.84 kJ",
    "e6": "39.884 MJ",
    "e9": "2265.6 MHz, 80, 65 and 70 ms",
    "e10": "two refrigerators",
    "d1": "210 J, 206.5 J, 0.2 m",
    "d2": "260 J, 0.15 m",
    "c1": "130 times",
    "c2": "52,000 to 60,000 USD, 9,600 a year",
    "c3": "0.3 m while saving 43.09 %",
    "c4": "13,000 to 15,000, 2,400, 4,000 and 30.71 USD",
}


def test_every_figure_of_the_papers_sections_is_a_row() -> None:
    claims = check_claims(synthetic.evaluation().outcome)
    rows = {claim.id.split("_")[0]: claim for claim in claims}
    assert rows.keys() >= FIGURES.keys()
    for name in FIGURES:
        assert rows[name].verdict in VERDICTS
        assert rows[name].verdict != NOT_TESTABLE or rows[name].note


def test_two_refrigerators_would_take_eleven_kilowatt_hours() -> None:
    claims = {claim.id: claim for claim in check_claims(synthetic.evaluation().outcome)}
    claim = claims["e10_two_refrigerators"]
    assert claim.obtained == pytest.approx(39.884 / 3.6 / 1.4, abs=1e-3)
    assert not claim.met
    assert claim.verdict == "differs"
    assert "5.5 kWh" in claim.note


def test_claims_by_arithmetic_or_construction_do_not_count_as_reproduced() -> None:
    claims = check_claims(synthetic.evaluation().outcome)
    given = [claim for claim in claims if claim.evidence in NO_EVIDENCE and claim.is_judged]
    assert {claim.verdict for claim in given} == {"agrees", "differs"}
    assert not any(claim.reproduced for claim in given)
    met = sum(claim.reproduced for claim in claims)
    assert f"reproduced: {met} of " in summary.counts_text(claims)
    assert "not counted as reproduced" in summary.counts_text(claims)


def test_the_deviation_is_the_tolerance_of_a_changed_verdict() -> None:
    outcome = synthetic.evaluation().outcome
    judged = [claim for claim in check_claims(outcome) if claim.deviation]
    assert judged
    for claim in judged:
        for factor, met in ((0.99, False), (1.01, True)):
            entry = {**stated_claims()[claim.id], "tolerance": factor * claim.deviation}
            [again] = check_claims(outcome, stated={claim.id: entry})
            assert again.met == met, claim.id


def test_the_spread_of_single_trips_is_reported_with_the_mean() -> None:
    outcome = synthetic.evaluation().outcome
    worst_m = np.linspace(0.1, 0.5, 101)
    adaptive = {
        mode: replace(drives, worst_of_runs_m=worst_m) for mode, drives in outcome.adaptive.items()
    }
    [claim, *_] = [
        it for it in check_claims(replace(outcome, adaptive=adaptive)) if it.id.startswith("a1")
    ]
    assert claim.spread["share_of_trips_within_bound"] == pytest.approx(0.5, abs=0.01)
    assert claim.spread["worst_error_of_a_trip_p99_m"] == pytest.approx(0.496, abs=1e-3)


def test_claims_without_a_value_are_reported_and_the_others_are_evaluated() -> None:
    stated = dict(stated_claims())
    stated["a1_adaptive_worst_m"] = {**stated["a1_adaptive_worst_m"], "rule": "almost"}
    stated["b1_not_ours"] = stated["e2_mode0_executions"]
    found = {
        claim.id: claim for claim in check_claims(synthetic.evaluation().outcome, stated=stated)
    }
    for name, said in (("a1_adaptive_worst_m", "almost"), ("b1_not_ours", "unknown claim")):
        assert found[name].verdict == NOT_JUDGED
        assert found[name].obtained is None
        assert said in found[name].note
    # The claims about settings are not judged either, because a synthetic evaluation has no
    # settings.
    unjudged = {name for name, claim in found.items() if claim.verdict == NOT_JUDGED}
    assert {name for name in unjudged if not name.startswith("x")} == {
        "a1_adaptive_worst_m",
        "b1_not_ours",
    }


def test_a_platform_without_a_figure_is_reported_and_the_others_are_evaluated() -> None:
    outcome = synthetic.evaluation().outcome
    energies_j = {
        mode: {method: value for method, value in each.items() if (mode, method) != (4, "esprit")}
        for mode, each in outcome.energy_per_execution_j.items()
    }
    found = check_claims(replace(outcome, energy_per_execution_j=energies_j))
    lacking = [
        claim for claim in found if claim.verdict == NOT_JUDGED and not claim.id.startswith("x")
    ]
    assert [claim.id for claim in lacking] == [
        "e4_average_saving_percent",
        "e7_saves_in_every_mode",
        "e8_most_in_mode_0",
        "c3_accurate_and_saving",
    ]
    assert "no energy per estimate of ESPRIT in mode 4" in lacking[0].note


def test_a_platform_without_a_mode_is_reported() -> None:
    outcome = synthetic.evaluation().outcome
    adaptive = {mode: drives for mode, drives in outcome.adaptive.items() if mode != 1}
    found = {claim.id: claim for claim in check_claims(replace(outcome, adaptive=adaptive))}
    claim = found["a6_modes_1_2_3_adaptive_worst_m"]
    assert claim.verdict == NOT_JUDGED
    assert "no mode 1" in claim.note
    assert found["a3_theoretical_20ms_worst_m"].verdict != NOT_JUDGED


def test_claim_records_have_the_documented_fields() -> None:
    records = json.loads(
        json.dumps(list(map(asdict, check_claims(synthetic.evaluation().outcome))))
    )
    for record in records:
        assert record["verdict"] in VERDICTS
        assert record["evidence"] in EVIDENCE or record["verdict"] == NOT_TESTABLE
        assert isinstance(record["seed_sensitive"], bool)


def test_evidence_depends_on_the_selected_parameters() -> None:
    entries = stated_claims()
    kinds = {name: evidence(entry, chosen=["controller"]) for name, entry in entries.items()}
    of_kind = {
        kind: [name.split("_")[0] for name, each in kinds.items() if each == kind]
        for kind in EVIDENCE
    }
    assert of_kind["independent"] == ["a3", "a4", "a5", "a7", "a8", "a9"]
    assert "e4" in of_kind["calibrated"]
    assert [name for name in of_kind["by construction"] if name[0] != "x"] == ["e1", "d1"]
    free = evidence(entries["e4_average_saving_percent"], [], freedoms=("ratio", "factor"))
    assert free == "by construction", "it is solved for by the factor"


def test_a_worse_adaptive_drive_changes_the_verdicts() -> None:
    worse = synthetic.evaluation(adaptive_worst_m=0.4)
    verdicts = {claim.id: claim for claim in check_claims(worse.outcome)}
    assert not verdicts["a1_adaptive_worst_m"].reproduced
    assert not verdicts["a6_modes_1_2_3_adaptive_worst_m"].reproduced
    assert "wake up least often" in verdicts["a6_modes_1_2_3_adaptive_worst_m"].note


@pytest.mark.parametrize(("worst_m", "turns"), [(0.1, False), (0.198, True), (0.3, False)])
def test_a_verdict_near_its_bound_depends_on_the_seed(worst_m: float, turns: bool) -> None:
    found = synthetic.evaluation(adaptive_worst_m=worst_m, spread=0.02)
    claims = {claim.id: claim for claim in check_claims(found.outcome)}
    claim = claims["a6_modes_1_2_3_adaptive_worst_m"]
    assert claim.seed_sensitive == turns
    assert claim.interval[0] < claim.obtained < claim.interval[1]


def test_a_verdict_that_differs_between_seeds_is_seed_sensitive() -> None:
    good, bad = (
        check_claims(synthetic.evaluation(adaptive_worst_m=worst_m).outcome)
        for worst_m in (0.1, 0.4)
    )
    assert not any(claim.seed_sensitive for claim in good)
    claims = {claim.id: claim for claim in with_seeds({1: good, 2: bad, 3: good})}
    a1, e2 = claims["a1_adaptive_worst_m"], claims["e2_mode0_executions"]
    assert a1.reproduced
    assert a1.seed_sensitive
    assert a1.seeds_met == "2/3"
    assert a1.met_by_seed == {1: True, 2: False, 3: True}
    assert not e2.seed_sensitive
    assert e2.seeds_met == ""


def test_the_daily_saving_follows_from_trip_duration_and_duty() -> None:
    short = check_claims(synthetic.evaluation(trip_s=80.33).outcome)
    long = check_claims(replace(synthetic.evaluation(trip_s=178.6).outcome, duty=0.25))
    ids = ("e5_mode0_saved_per_day_kj", "e6_fleet_of_100_saved_per_day_mj")
    for name in ids:
        [once], [other] = (
            [it.obtained for it in found if it.id == name] for found in (short, long)
        )
        assert other == pytest.approx(once * 80.33 / 178.6 * 0.25, rel=1e-4)


def test_the_documentation_lists_every_claim() -> None:
    page = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    section = page.partition("## Verdict on each claim")[2].partition("\n## ")[0]
    rows = [row.split(" | ")[:2] for row in section.splitlines() if row.startswith("| ")][1:]
    expected = [
        (f"| {name.partition('_')[0]}", entry["statement"])
        for name, entry in stated_claims().items()
    ]
    assert [(claim, statement) for claim, statement in rows] == expected
