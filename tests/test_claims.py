from __future__ import annotations

import json
from dataclasses import replace

import polars as pl
import pytest

import synthetic
from access_av.paper.claims import FINDINGS, as_records, check_claims, judge
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
        ("exactly", [2, 3, 6], [2, 3, 6], True),
        ("exactly", [2, 3, 6], [2, 3, 6, 7], False),
    ],
)
def test_rules(rule: str, stated: object, obtained: object, met: bool) -> None:
    assert judge(rule, stated, obtained, tolerance=0.25) is met


def test_there_is_a_finding_for_every_claim_of_the_paper() -> None:
    assert list(FINDINGS) == list(stated_claims())
    assert len(FINDINGS) == 17


def test_records_have_the_promised_fields() -> None:
    records = json.loads(json.dumps(as_records(check_claims(synthetic.evaluation()))))
    for record in records:
        assert set(record) >= {
            "id", "stated", "obtained", "unit", "verdict", "fitted", "note",
        }  # fmt: skip
        assert record["verdict"] in ("reproduced", "not reproduced")
        assert isinstance(record["fitted"], bool)


def test_what_was_not_fitted_says_so() -> None:
    fitted = {claim.id: claim.fitted for claim in check_claims(synthetic.evaluation())}
    free = [claim_id for claim_id, was_fitted in fitted.items() if not was_fitted]
    assert free == [
        "e2_mode0_executions",
        "e3_mode67_executions",
        "c1_sensor_cost_ratio_above",
        "c2_four_rsu_usd",
    ]


def test_a_worse_adaptive_drive_turns_its_claims() -> None:
    good = synthetic.evaluation()
    worse = replace(
        good,
        points=good.points.with_columns(
            worst_error_y_m=pl.when("adaptive").then(0.4).otherwise("worst_error_y_m")
        ),
    )
    verdicts = {claim.id: claim for claim in check_claims(worse)}
    assert not verdicts["a1_adaptive_worst_m"].reproduced
    assert not verdicts["a6_modes_1_2_3_adaptive_worst_m"].reproduced
    assert "wake up least often" in verdicts["a6_modes_1_2_3_adaptive_worst_m"].note
