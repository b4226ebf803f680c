"""Progress of the evaluation: one total, from the first report to the last."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from access_av._core import SettingsError
from access_av.device.platform import Platform
from access_av.paper import own_design
from access_av.paper.driver import Driver
from access_av.paper.evaluation import evaluate_with
from access_av.paper.interpretations import load
from access_av.paper.study import Stages
from access_av.report.paper import results

if TYPE_CHECKING:
    from pathlib import Path


def test_the_total_is_known_before_the_first_run(tmp_path: Path) -> None:
    reported: list[tuple[int, int]] = []
    results.run(
        ["every-ssb", "gate"],
        runs=1,
        seed=1,
        seeds=2,
        out=tmp_path / "out",
        progress=lambda *it: reported.append(it),
    )
    done = [it for it, _ in reported]
    assert {total for _, total in reported} == {done[-1]}
    assert done == sorted(done)
    assert done[0] < 0.01 * done[-1], "the first of more than 100 simulations"
    # The report is part of the work: it begins before the total is reached.
    assert done[-1] - results.REPORT_COST in done


def test_a_stage_is_complete_even_if_it_fails() -> None:
    reported: list[tuple[int, int]] = []
    work = Stages([6, 4], lambda *it: reported.append(it))

    def fail() -> None:
        with work.stage() as tick:
            tick(1, 3)
            raise SettingsError("no such key")

    with pytest.raises(SettingsError, match="no such key"):
        fail()
    with work.stage() as tick:
        tick(1, 2)
    assert reported == [(2, 10), (6, 10), (8, 10), (10, 10)]


def test_the_number_of_tracker_settings_is_that_of_the_simulated_ones() -> None:
    driver = Driver(Platform.load("jetson-agx-xavier"), runs=1, seed=1, count=2)
    evaluation = evaluate_with(driver, load("gate"))
    before = len(driver.known)
    own_design.compare(driver, evaluation, lambda _, __: None)
    # The other driver of :func:`own_design.fair` simulates the settings with a real odometer.
    real = sum(real and who != "bound" for real, _, who in own_design.EQUAL)
    own_design.fair(driver, evaluation)
    assert len(driver.known) - before + real == own_design.simulations(driver.platform)
