"""Posterior probability that a surveyed site plan is displaced against the map.

Hypotheses of the site before the survey: every parameter is within its standard deviation (H), or
all radio heads have one common offset ``d ~ N(0, τ² I)`` in addition (D). With the estimate θ̂ and
its covariance C under H, the prior mean θ₀ and information Λ₀, and U, which adds an offset to every
position, the likelihood ratio for a given offset is exact for Gaussian parameters:

    log p(data | d) / p(data | 0) = bᵀ d − ½ dᵀ A d,
    b = Uᵀ Λ₀ (θ̂ − θ₀),  A = Uᵀ Λ₀ U − Uᵀ Λ₀ C Λ₀ U

Its mean over d is the Bayes factor of D (Bar-Shalom, Li and Kirubarajan 2001, 11.6).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

# Standard deviation of the offset in x and y, in metres, as in the integrity monitor's hypothesis.
OFFSET_STD_M = 1.5
# Remaining offset that the written standard deviations do not cover, as a multiple of the
# standard deviation of the radio heads' mean position.
NOT_COVERED = 3.0
# Minimum probability: the plan or the map may be replaced after the survey. It is the default
# probability of an array fault, and below the integrity risk per epoch.
LEAST_PROBABILITY = 1e-5
# Maximum probability that the settings permit.
MOST_PROBABILITY = 0.5


def displacement_probability(
    prior: float,
    before: Numbers,
    stds_before: Numbers,
    found: Numbers,
    covariance: Numbers,
    written: Numbers,
    written_stds: Numbers,
) -> float:
    """Returns the probability that the surveyed positions have a common offset beyond their σ.

    Parameters
    ----------
    prior
        Probability of an offset before the survey; 0 for an exact plan, which stays exact.
    before, stds_before
        Given positions (x and y of each radio head, in turn) and their standard deviations, in
        metres, shape (2n,).
    found, covariance
        Estimates from the drives, shape (2n,), and their covariance, shape (2n, 2n).
    written, written_stds
        Positions and standard deviations of the surveyed site file, shape (2n,).
    """
    if prior == 0.0:
        return 0.0
    known = np.diag(stds_before**-2.0)
    shift = np.tile(np.eye(2), (len(before) // 2, 1))
    towards = shift.T @ known @ (found - before)
    information = shift.T @ known @ shift - shift.T @ known @ covariance @ known @ shift
    of_offset = np.linalg.inv(information + np.eye(2) / OFFSET_STD_M**2)
    # Bayes factor, limited so that its exponential is finite.
    exponent = min(0.5 * float(towards @ of_offset @ towards), 300.0)
    growth = float(np.linalg.det(np.eye(2) + OFFSET_STD_M**2 * information))
    odds = prior / (1.0 - prior) * math.exp(exponent) / math.sqrt(growth)
    # Offset of the written positions given D, averaged over the radio heads.
    gain = shift.T @ covariance @ known @ shift / (len(before) / 2)
    mean_m = shift.T @ (found - written) / (len(before) / 2) + gain @ of_offset @ towards
    stds_m = np.sqrt(np.diag(gain @ of_offset @ gain.T))
    limit_m = NOT_COVERED * float(np.sqrt(np.mean(written_stds**2) / (len(before) / 2)))
    remains = sum(_beyond(limit_m, *map(float, axis)) for axis in zip(mean_m, stds_m, strict=True))
    probability = odds / (1.0 + odds) * min(remains, 1.0)
    return min(max(probability, min(LEAST_PROBABILITY, prior)), MOST_PROBABILITY)


def _beyond(limit: float, mean: float, std: float) -> float:
    """Returns the probability that the magnitude of a Gaussian variable exceeds a limit."""
    scale = max(std, 1e-12) * math.sqrt(2.0)
    return 0.5 * (math.erfc((limit - mean) / scale) + math.erfc((limit + mean) / scale))
