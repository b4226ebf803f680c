"""On what the claims hang: Sobol indices of their margins over what the paper leaves open.

Readings are drawn from stated ranges (:mod:`access_av.paper.space`), a gate being one of the things
drawn. A polynomial chaos expansion is fitted to each claim's margin (Legendre polynomials, which
are orthogonal over uniform ranges, by least squares); its squared coefficients are shares of
variance, and so first-order and total Sobol indices (Sudret, Reliability Engineering & System
Safety 93, 2008).
What it does not explain is told beside them. Intervals are by the bootstrap over whole worlds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.paper.outcome import Numbers
    from access_av.paper.search import Sample

# Degrees of a single dimension, and of two together.
SINGLE, PAIR = 4, 2
RESAMPLES = 200
# Margins end here: a claim missed a hundredfold is missed no less than one missed threefold.
FARTHEST = 2.0


@dataclass(frozen=True)
class Index:
    """How much of a claim's margin hangs on a dimension: shares of its variance.

    Attributes
    ----------
    first, total
        By itself, and together with others.
    first_low, first_high, total_low, total_high
        Ends of their 95 % intervals.
    """

    claim: str
    dimension: str
    first: float
    total: float
    first_low: float
    first_high: float
    total_low: float
    total_high: float


@dataclass(frozen=True)
class Unknowns:
    """Indices of all claims, and the share of the space in which each holds.

    Attributes
    ----------
    holds, holds_interval
        Share by claim, with its 95 % interval.
    explained
        Share of the margin's variance that the expansion explains, by claim.
    """

    indices: list[Index]
    holds: Mapping[str, float]
    holds_interval: Mapping[str, tuple[float, float]]
    explained: Mapping[str, float]
    readings: int
    runs: int


def sobol(sample: Sample, runs: int, *, seed: int = 0, count: int = RESAMPLES) -> Unknowns:
    """Sobol indices of a sample of readings; claims whose margin never changes have none."""
    names = [name for name, margin in sample.margins.items() if np.ptp(margin) > 1e-9]
    margins = np.stack([np.clip(sample.margins[name], -FARTHEST, FARTHEST) for name in names], 1)
    levels = [len(dimension.choices) for dimension in sample.dimensions]
    terms, basis = expansion(sample.coordinates, levels)
    rng = np.random.default_rng(seed)
    first, total, left = _indices(basis, terms, margins)
    drawn = []
    shares = []
    worlds = np.unique(sample.world)
    rows_of = [np.flatnonzero(sample.world == world) for world in worlds]
    held = np.stack([sample.margins[name] >= 0.0 for name in sample.margins], 1)
    for _ in range(count):
        rows = np.concatenate([rows_of[i] for i in rng.integers(0, len(worlds), len(worlds))])
        drawn.append(np.stack(_indices(basis[rows], terms, margins[rows])[:2]))
        shares.append(held[rows].mean(axis=0))
    low, high = np.quantile(drawn, (0.025, 0.975), axis=0)
    least, most = np.quantile(shares, (0.025, 0.975), axis=0)
    indices = [
        Index(
            claim,
            dimension.name,
            float(first[d, c]),
            float(total[d, c]),
            float(low[0, d, c]),
            float(high[0, d, c]),
            float(low[1, d, c]),
            float(high[1, d, c]),
        )
        for c, claim in enumerate(names)
        for d, dimension in enumerate(sample.dimensions)
    ]
    return Unknowns(
        indices=indices,
        holds={name: float(held[:, i].mean()) for i, name in enumerate(sample.margins)},
        holds_interval={
            name: (float(least[i]), float(most[i])) for i, name in enumerate(sample.margins)
        },
        explained={name: float(1.0 - left[c]) for c, name in enumerate(names)},
        readings=len(sample.coordinates),
        runs=runs,
    )


def expansion(coordinates: Numbers, levels: list[int]) -> tuple[list[tuple[int, ...]], Numbers]:
    """Terms of the expansion, each the dimensions that it is of, and their values at the points.

    Parameters
    ----------
    coordinates
        Points from 0 to 1, one row each.
    levels
        How many choices each dimension has; 0 for a number. A choice is told by its number, with as
        many polynomials less one, which is all that can be said of it.
    """
    points, dimensions = coordinates.shape
    single: list[list[Numbers]] = []
    for d in range(dimensions):
        x = 2.0 * coordinates[:, d] - 1.0
        degree = SINGLE
        if levels[d]:
            x = 2.0 * (np.floor(coordinates[:, d] * levels[d]) + 0.5) / levels[d] - 1.0
            degree = levels[d] - 1
        powers = np.polynomial.legendre.legvander(x, degree)[:, 1:]
        # Orthonormal over the range, or over the choices.
        columns: list[Numbers] = []
        for k in range(degree):
            column = powers[:, k] - powers[:, k].mean()
            for before in columns:
                column = column - before * (column @ before) / points
            columns.append(column / max(np.sqrt(np.mean(column**2)), 1e-9))
        single.append(columns)
    terms: list[tuple[int, ...]] = []
    values: list[Numbers] = []
    for d, columns in enumerate(single):
        terms += [(d,)] * len(columns)
        values += columns
    for a, b in combinations(range(dimensions), 2):
        for one in single[a][:PAIR]:
            for other in single[b][:PAIR]:
                terms.append((a, b))
                values.append(one * other)
    return terms, np.stack(values, axis=1)


def _indices(
    basis: Numbers, terms: list[tuple[int, ...]], margins: Numbers
) -> tuple[Numbers, Numbers, Numbers]:
    """First-order and total indices (dimensions by claims), and the share that is not explained."""
    centred = margins - margins.mean(axis=0)
    design = basis - basis.mean(axis=0)
    # A little ridge: what is drawn again in a resample must not blow up.
    ridge = 1e-2 * len(design) * np.eye(design.shape[1])
    coefficients = np.linalg.solve(design.T @ design + ridge, design.T @ centred)
    variance = np.maximum((centred**2).mean(axis=0), 1e-12)
    # Least squares explains some of any noise; that much is taken off each term's square.
    rest = centred - design @ coefficients
    free = max(len(design) - design.shape[1], 1)
    noise = (rest**2).sum(axis=0) / free / len(design)
    shares = np.maximum(coefficients**2 - noise, 0.0) / variance
    dimensions = 1 + max(max(term) for term in terms)
    first, total = np.zeros((2, dimensions, margins.shape[1]))
    for term, share in zip(terms, shares, strict=True):
        for d in term:
            total[d] += share
            if len(term) == 1:
                first[d] += share
    left = np.minimum((rest**2).sum(axis=0) / free / variance, 1.0)
    return first, total, left
