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

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av.paper.statements import stated_claims

if TYPE_CHECKING:
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
class Unknowns:
    """Sobol indices of all claims, and the share of the parameter space in which each claim holds.

    Attributes
    ----------
    indices
        Shares of the variance of each claim's margin, one row per claim and parameter; columns
        ``sensitivity`` of :mod:`access_av.columns`.
    claims
        Share of the parameter space that meets each claim; columns ``sensitivity_claims``.
    sample
        The drawn interpretations and their margins, from which all other values follow.
    """

    indices: pl.DataFrame
    claims: pl.DataFrame
    runs: int
    sample: Sample

    @property
    def matter(self) -> pl.DataFrame:
        """Returns total indices of at least :data:`MATTERS`, for claims with evidence.

        Claims by construction and by arithmetic are excluded.
        """
        open_claims = [name for name, entry in stated_claims().items() if "evidence" not in entry]
        return self.indices.filter(pl.col("total") >= MATTERS, pl.col("claim").is_in(open_claims))

    def tables(self) -> dict[str, pl.DataFrame]:
        """Indices, shares and sample; columns of :mod:`access_av.columns` by these names."""
        sample = self.sample
        count, dimensions = sample.coordinates.shape
        points = [sample.values(index) for index in range(count)]
        each = sample.dimensions * count
        drawn = {
            "interpretation_index": np.repeat(np.arange(count), dimensions),
            "environment_index": np.repeat(sample.world, dimensions),
            "dimension": [it.key for it in each],
            "coordinate": sample.coordinates.ravel(),
            "num_choices": [len(it.choices) for it in each],
            "drawn_value": [str(point[it.key]) for point in points for it in sample.dimensions],
        }
        margins = {
            "interpretation_index": np.tile(np.arange(count), len(sample.margins)),
            "claim": np.repeat(list(sample.margins), count),
            "margin": np.concatenate(list(sample.margins.values())),
        }
        return {
            "sensitivity": self.indices,
            "sensitivity_claims": self.claims,
            "sensitivity_sample": pl.DataFrame(drawn),
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
    # Shape (claims, first and total, dimensions).
    shape = (len(names), 2, len(levels))
    middle = np.reshape([fit.indices(values, margin) for fit, values, margin in claims], shape)
    ends = np.quantile(np.reshape(drawn, (count, *shape)), (0.025, 0.975), axis=0)
    low, high = np.quantile(shares, (0.025, 0.975), axis=0)
    of_kind = dict(enumerate(("first", "total")))
    explained = {name: fit.explained for name, fit in zip(names, fits, strict=True)}
    return Unknowns(
        indices=pl.DataFrame(
            {
                "claim": np.repeat(np.array(names, dtype=np.str_), len(levels)),
                "dimension": [dimension.key for dimension in sample.dimensions] * len(names),
                **{name: middle[:, kind].ravel() for kind, name in of_kind.items()},
                **{
                    f"{name}_{end}": values[:, kind].ravel()
                    for kind, name in of_kind.items()
                    for end, values in zip(("low", "high"), ends, strict=True)
                },
            }
        ),
        claims=pl.DataFrame(
            {
                "claim": list(sample.margins),
                "share_met": held.mean(axis=0),
                "share_met_low": low,
                "share_met_high": high,
                "explained_variance": [explained.get(name) for name in sample.margins],
            },
            schema_overrides={"explained_variance": pl.Float64},
        ),
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
