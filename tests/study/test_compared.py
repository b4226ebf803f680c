"""Comparison of variants, and the verdicts on the differences."""

from __future__ import annotations

import re

import numpy as np
import pytest

from access_av.cli.side_by_side import show_compared
from access_av.report.parts import compared_section
from access_av.run.pairs import ErrorSamples
from access_av.statistics.paired import paired_difference
from access_av.study.compare import beside_first
from access_av.study.compare import table as compared_table
from access_av.tables.columns import TABLES
from access_av.verdicts import Effect, Judgement


def errors_of(name: str, errors_m: np.ndarray) -> ErrorSamples:
    """Returns the errors of ten drives of 100 s."""
    return ErrorSamples(name=name, errors_m=errors_m, duration_s=100.0)


def test_a_lost_drive_is_stated_first_in_its_row(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    random = np.random.default_rng(5)
    baseline = np.abs(random.normal(0.0, 0.1, (10, 1000)))
    one_lost, late, short = baseline.copy(), baseline.copy(), baseline.copy()
    one_lost[3, 600:] = 40.0
    late[:, :300] = np.inf  # the search for the first position
    short[:, 500:540] = 40.0  # 4 s
    never = baseline.copy()
    never[0] = np.inf
    unknown = baseline.copy()
    unknown[5:7, 100:] = np.inf
    held = {
        "baseline": baseline, "lost": one_lost, "late": late, "short": short, "never": never,
        "unknown": unknown, "same": baseline.copy(),
    }  # fmt: skip
    found = beside_first([errors_of(*it) for it in held.items()], [50.0])
    rows = {it.driven.name: (it.lost_in_words(), it.difference_in_words()) for it in found}
    assert [it.driven.lost_runs for it in found] == [0, 1, 0, 0, 1, 2, 0]
    assert rows["baseline"] == ("0 of 10", "baseline")
    assert rows["same"] == ("0 of 10", "identical to the baseline")
    assert [rows[it][0] for it in ("lost", "unknown")] == ["LOST in 1 of 10", "LOST in 2 of 10"]
    # It stands before all figures, in the terminal and in reports.
    show_compared(found)
    [printed] = [it for it in capsys.readouterr().out.splitlines() if it.split()[:1] == ["lost"]]
    assert printed.split()[:6] == ["lost", "LOST", "in", "1", "of", "10"]
    page = compared_section(found)
    cells = [re.findall(r"<td[^>]*>(.*?)</td>", it, re.DOTALL) for it in page.split("<tr>")]
    [second] = [it[1] for it in cells if it[:1] == ["lost"]]
    assert "LOST in 1 of 10" in second
    table = compared_table(found)
    assert table["lost_runs"].to_list() == [0, 1, 0, 0, 1, 2, 0]
    assert tuple(table.columns) == TABLES["compared"].columns


@pytest.mark.parametrize(
    ("factor", "words"),
    [(0.5, "better: -0.0"), (2.0, "worse: +0.0"), (1.001, "no significant")],
)
def test_a_difference_is_that_of_variant_and_baseline(factor: float, words: str) -> None:
    random = np.random.default_rng(6)
    baseline = np.abs(random.normal(0.0, 0.1, (10, 1000)))
    other = factor * baseline if factor != 1.001 else np.abs(random.normal(0.0, 0.1, (10, 1000)))
    _, found = beside_first([errors_of("a", baseline), errors_of("b", other)], [50.0])
    assert found.delta_m is not None
    expected = np.median(other) - np.median(baseline)
    assert found.delta_m[0][0] == pytest.approx(expected, abs=1e-3)
    assert found.difference_in_words().startswith(words)


@pytest.mark.parametrize(
    ("delta_m", "effect"),
    [
        ((-0.2, -0.3, -0.1), Effect.HELPS),
        ((-0.2, -0.3, 0.1), Effect.UNCERTAIN),
        ((0.2, 0.1, 0.3), Effect.HARMS),
    ],
)
def test_verdicts_are_enums_with_separate_wording(
    delta_m: tuple[float, float, float], effect: Effect
) -> None:
    assert Effect.of(delta_m) is effect
    for each in (*Effect, *Judgement):
        assert each.words != each.name
        assert each.badge in ("yes", "fit", "no")


def test_paired_intervals_have_their_coverage() -> None:
    """The runs differ more than the variants."""
    rng = np.random.default_rng(5)
    held = 0
    trials = 100
    for _ in range(trials):
        scale = np.exp(0.4 * rng.standard_normal((20, 1)))
        first = scale * np.abs(rng.standard_normal((20, 60)))
        second = 0.8 * scale * np.abs(rng.standard_normal((20, 60)))
        _, low, high = paired_difference(second, first, 50.0)
        # The median of a mixture scales by the same factor, so that the difference is a fifth of
        # the first median.
        held += low <= -0.2 * MEDIAN <= high
    # 95 of 100, minus three standard deviations of the count, minus 5 for the small number of runs.
    assert held >= 83


def _median() -> float:
    rng = np.random.default_rng(6)
    scale = np.exp(0.4 * rng.standard_normal(1_000_000))
    return float(np.median(scale * np.abs(rng.standard_normal(1_000_000))))


MEDIAN = _median()
