"""Sensitivity of the claims: Sobol indices of their margins over the unspecified parameters.

Interpretations are drawn from ranges (:mod:`access_av.paper.open_choices`); the SNR threshold is
one of the parameters. A polynomial chaos expansion is fitted to the margin of each claim by least
squares, with Legendre polynomials, which are orthogonal for uniform ranges. Its squared
coefficients are shares of the variance and give first-order and total Sobol indices (Sudret,
Reliability Engineering & System Safety 93, 2008). Only significant polynomials are kept; the
unexplained share is stated with the indices. Intervals are computed by a bootstrap over whole
environments with these polynomials ("fast bPCE": Marelli and Sudret, Structural Safety 75, 2018).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.paper.statements import stated_claims

if TYPE_CHECKING:
    from collections.abc import Mapping

    from access_av.paper.outcome import Numbers
    from access_av.paper.sampled_interpretations import Sample

# Total indices below this value are irrelevant.
MATTERS = 0.1
# Degrees of a single dimension, and of two together.
SINGLE, PAIR = 4, 2
RESAMPLES = 200
# Minimum ratio of a polynomial's coefficient to its standard deviation.
STANDS_OUT = 3.0


@dataclass(frozen=True)
class Index:
    """Sensitivity of a claim's margin to a parameter, as fractions of the margin's variance.

    Columns ``sensitivity`` of :mod:`access_av.columns`.
    """

    claim: str
    dimension: str
    first: float
    total: float
    first_low: float
    first_high: float
    total_low: float
    total_high: float

    @property
    def half_width(self) -> float:
        """Half of the width of the 95 % interval of the total index."""
        return 0.5 * (self.total_high - self.total_low)


@dataclass(frozen=True)
class Unknowns:
    """Sobol indices of all claims, and the share of the parameter space in which each claim holds.

    Attributes
    ----------
    holds, holds_interval
        Share of the parameter space by claim, with its 95 % interval.
    explained
        Share of the margin's variance that the expansion explains, by claim.
    sample
        The drawn interpretations and their margins, from which all other values follow.
    """

    indices: list[Index]
    holds: Mapping[str, float]
    holds_interval: Mapping[str, tuple[float, float]]
    explained: Mapping[str, float]
    interpretations: int
    runs: int
    sample: Sample

    @property
    def matter(self) -> list[Index]:
        """Returns total indices of at least :data:`MATTERS`, for claims with evidence.

        Claims by construction and by arithmetic are excluded.
        """
        stated = stated_claims()
        return [
            each
            for each in self.indices
            if each.total >= MATTERS and "evidence" not in stated[each.claim]
        ]

    def tables(self) -> dict[str, pl.DataFrame]:
        """Indices, shares and sample; columns of :mod:`access_av.columns` by these names."""
        sample = self.sample
        points = [sample.values(index) for index in range(self.interpretations)]
        rows = [
            {
                "interpretation_index": index,
                "environment_index": int(sample.world[index]),
                "dimension": dimension.key,
                "coordinate": float(sample.coordinates[index, d]),
                "num_choices": len(dimension.choices),
                "drawn_value": str(points[index][dimension.key]),
            }
            for index in range(self.interpretations)
            for d, dimension in enumerate(sample.dimensions)
        ]
        margins = [
            {"interpretation_index": index, "claim": claim, "margin": float(margin)}
            for claim, of_claim in sample.margins.items()
            for index, margin in enumerate(of_claim)
        ]
        shares = [
            {
                "claim": claim,
                "share_met": share,
                "share_met_low": self.holds_interval[claim][0],
                "share_met_high": self.holds_interval[claim][1],
                "explained_variance": self.explained.get(claim),
            }
            for claim, share in self.holds.items()
        ]
        return {
            "sensitivity": pl.DataFrame([asdict(each) for each in self.indices]),
            "sensitivity_claims": pl.DataFrame(
                shares, schema_overrides={"explained_variance": pl.Float64}
            ),
            "sensitivity_sample": pl.DataFrame(rows),
            "sensitivity_margins": pl.DataFrame(margins),
        }


def sobol(sample: Sample, runs: int, *, seed: int = 0, count: int = RESAMPLES) -> Unknowns:
    """Returns the Sobol indices of a sample; claims with a constant margin have none.

    A margin m is replaced by m / (1 + |m|), so that extreme margins do not dominate the variance.
    """
    names = [name for name, margin in sample.margins.items() if np.ptp(margin) > 1e-9]
    margins = [sample.margins[name] / (1.0 + np.abs(sample.margins[name])) for name in names]
    levels = [len(dimension.choices) for dimension in sample.dimensions]
    terms, basis = expansion(sample.coordinates, levels)
    fits = [Fit.of(terms, basis, margin) for margin in margins]
    claims = [(fit, basis[:, fit.columns], it) for fit, it in zip(fits, margins, strict=True)]
    rng = np.random.default_rng(seed)
    drawn = []
    shares = []
    worlds = np.unique(sample.world)
    rows_of = [np.flatnonzero(sample.world == world) for world in worlds]
    held = np.stack([sample.margins[name] >= 0.0 for name in sample.margins], 1)
    for _ in range(count):
        rows = np.concatenate([rows_of[i] for i in rng.integers(0, len(worlds), len(worlds))])
        drawn.append([fit.indices(values[rows], margin[rows]) for fit, values, margin in claims])
        shares.append(held[rows].mean(axis=0))
    of_claim = [fit.indices(values, margin) for fit, values, margin in claims]
    low, high = np.quantile(drawn, (0.025, 0.975), axis=0)
    least, most = np.quantile(shares, (0.025, 0.975), axis=0)
    indices = [
        Index(
            claim,
            dimension.key,
            *(float(of_claim[c][which, d]) for which in (0, 1)),
            *(float(end[c, which, d]) for which in (0, 1) for end in (low, high)),
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
        explained={name: fit.explained for name, fit in zip(names, fits, strict=True)},
        interpretations=len(sample.coordinates),
        runs=runs,
        sample=sample,
    )


def expansion(coordinates: Numbers, levels: list[int]) -> tuple[list[tuple[int, ...]], Numbers]:
    """Returns the terms of the expansion (their dimensions), and their values at the points.

    Parameters
    ----------
    coordinates
        Points from 0 to 1, one row each.
    levels
        Number of choices of each dimension; 0 for a number. A choice is represented by its
        index, with one polynomial less than choices.
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


@dataclass(frozen=True)
class Fit:
    """Polynomials of a claim's margin.

    Attributes
    ----------
    explained
        Explained share of the margin's variance.
    """

    terms: list[tuple[int, ...]]
    columns: Numbers
    dimensions: int
    explained: float

    @classmethod
    def of(cls, terms: list[tuple[int, ...]], basis: Numbers, margin: Numbers) -> Fit:
        """Returns the polynomials with significant coefficients.

        Orthogonal matching pursuit: the polynomial with the largest coefficient is added, and the
        next one is selected from the residual, until no coefficient is significant. The variance of
        a noise coefficient is that of the residual divided by the number of points.
        """
        centred = margin - margin.mean()
        columns: list[int] = []
        rest = centred
        while len(columns) < len(margin) // 4:
            correlation = np.abs(basis.T @ rest) / len(rest)
            correlation[columns] = 0.0
            best = int(np.argmax(correlation))
            free = len(rest) - len(columns) - 1
            if correlation[best] < STANDS_OUT * np.sqrt((rest @ rest) / free / len(rest)):
                break
            columns.append(best)
            rest = centred - _fitted(basis[:, columns], centred)
        free = max(len(rest) - len(columns) - 1, 1)
        left = (rest @ rest) / free / max(centred @ centred / len(centred), 1e-12)
        return cls(
            [terms[column] for column in columns],
            np.asarray(columns, dtype=np.intp),
            1 + max(max(term) for term in terms),
            float(max(1.0 - left, 0.0)),
        )

    def indices(self, values: Numbers, margin: Numbers) -> Numbers:
        """Returns first-order and total indices, shape (2, dimensions).

        ``values`` are the polynomials at the points of the sample.
        """
        found = np.zeros((2, self.dimensions))
        if not self.terms:
            return found
        centred = margin - margin.mean()
        design = values - values.mean(axis=0)
        coefficients, *_ = np.linalg.lstsq(design.T @ design, design.T @ centred, rcond=None)
        rest = centred - design @ coefficients
        # Subtract the share of the noise that least squares explains from each squared coefficient.
        unexplained = (rest @ rest) / max(len(rest) - design.shape[1] - 1, 1)
        squares = np.maximum(coefficients**2 - unexplained / len(rest), 0.0)
        # Variance over the whole range, independent of the drawn points.
        variance = max(squares.sum() + unexplained, 1e-12)
        for term, share in zip(self.terms, squares / variance, strict=True):
            found[1, list(term)] += share
            if len(term) == 1:
                found[0, term] += share
        return found


def _fitted(columns: Numbers, margin: Numbers) -> Numbers:
    design = columns - columns.mean(axis=0)
    normal = design.T @ design
    return np.asarray(design @ np.linalg.lstsq(normal, design.T @ margin, rcond=None)[0])
