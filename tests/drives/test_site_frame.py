"""Posterior probability that a surveyed site plan is displaced against the map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av.drives.site_frame import (
    LEAST_PROBABILITY,
    MOST_PROBABILITY,
    OFFSET_STD_M,
    displacement_probability,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

PRIOR = 0.01
HEADS = 4
BY_DRIVES_STD_M = 0.02


def posterior(std_m: float, moved_m: Numbers) -> tuple[Numbers, Numbers]:
    """Returns estimate and covariance of positions that the drives measure with 0.02 m."""
    information = std_m**-2.0 + BY_DRIVES_STD_M**-2.0
    found = moved_m * BY_DRIVES_STD_M**-2.0 / information
    return found, np.eye(2 * HEADS) / information


def probability(std_m: float, moved_m: Numbers, prior: float = PRIOR) -> float:
    found, covariance = posterior(std_m, moved_m)
    stds = np.full(2 * HEADS, std_m)
    written_stds = np.sqrt(np.diag(covariance))
    before = np.zeros(2 * HEADS)
    return displacement_probability(prior, before, stds, found, covariance, found, written_stds)


def test_a_consistent_plan_is_practically_not_displaced() -> None:
    assert probability(0.1, np.zeros(2 * HEADS)) == LEAST_PROBABILITY


def test_a_displacement_beyond_the_given_deviations_is_probable() -> None:
    # The deviations of 0.1 m pull the estimates back by 4 % of 2 m, more than the written 0.02 m.
    assert probability(0.1, np.tile([2.0, 0.0], HEADS)) == MOST_PROBABILITY


def test_a_displacement_that_the_survey_corrects_is_no_fault() -> None:
    assert probability(2.0, np.tile([2.0, 0.0], HEADS)) == LEAST_PROBABILITY


def test_radio_heads_that_are_off_in_different_directions_are_no_displaced_plan() -> None:
    assert probability(0.1, np.array([0.1, 0.0, -0.1, 0.0, 0.0, 0.1, 0.0, -0.1])) < 1e-4


def test_an_exact_plan_stays_exact() -> None:
    assert probability(0.1, np.tile([2.0, 0.0], HEADS), prior=0.0) == 0.0


def test_drives_without_information_keep_the_prior_probability() -> None:
    stds, before = np.full(2 * HEADS, 0.1), np.zeros(2 * HEADS)
    covariance = np.diag(stds**2) * (1.0 - 1e-9)
    found = displacement_probability(PRIOR, before, stds, before, covariance, before, stds)
    # Almost every offset with a deviation of 1.5 m exceeds 0.15 m, three deviations of the mean.
    assert 0.98 * PRIOR < found <= PRIOR * (1.0 + 1e-6)


def test_the_posterior_follows_from_the_densities_of_the_measured_positions() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(2 * HEADS, 2 * HEADS))
    of_drives = 0.05**2 * (root @ root.T + np.eye(2 * HEADS))
    stds = rng.uniform(0.1, 0.4, 2 * HEADS)
    measured = np.tile([0.3, -0.2], HEADS) + 0.1 * rng.normal(size=2 * HEADS)
    information = np.linalg.inv(of_drives)
    covariance = np.linalg.inv(information + np.diag(stds**-2.0))
    found = covariance @ information @ measured
    before = np.zeros(2 * HEADS)
    # The given positions with small deviations are written: any offset is beyond them.
    written_stds = np.full(2 * HEADS, 1e-6)
    by_survey = displacement_probability(
        PRIOR, before, stds, found, covariance, before, written_stds
    )
    within = of_drives + np.diag(stds**2)
    shift = np.tile(np.eye(2), (HEADS, 1))

    def log_density(covariance: Numbers) -> float:
        _, log_det = np.linalg.slogdet(covariance)
        return -0.5 * float(log_det + measured @ np.linalg.solve(covariance, measured))

    displaced = within + OFFSET_STD_M**2 * shift @ shift.T
    odds = PRIOR / (1.0 - PRIOR) * np.exp(log_density(displaced) - log_density(within))
    assert by_survey == pytest.approx(odds / (1.0 + odds), rel=1e-6)
