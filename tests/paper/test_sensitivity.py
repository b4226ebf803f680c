"""Indices, shares and page of ``evaluate --sensitivity``, computed again from the drawn sample.

This file uses NumPy and polars alone: none of the project's statistics or rules.
"""

from __future__ import annotations

import itertools
import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import layout
from access_av.paper import study
from access_av.report.paper import results as paper_results
from access_av.run.campaign import Campaign, ResultCache
from access_av.tables.toml import tomllib
from browser import Browser
from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

# Environments, controllers in each, runs per setting.
SIZE = (20, 2, 1)
RESAMPLES = 200
CLAIMS = tomllib.loads((ROOT / "python/access_av/paper/paper.toml").read_text("utf-8"))["claims"]


@dataclass
class Tables:
    """The tables of one analysis, as arrays."""

    dimensions: list[str]
    coordinates: Numbers
    choices: list[int]
    environment: NDArray[np.int64]
    margins: dict[str, Numbers]
    indices: pl.DataFrame
    shares: pl.DataFrame
    charts: dict[str, Any]
    page: str
    file: Path

    @classmethod
    def read(cls, path: Path) -> Tables:
        sample, margins, indices, shares = (
            pl.read_parquet(path / f"sensitivity{name}.parquet")
            for name in ("_sample", "_margins", "", "_claims")
        )
        first = sample.filter(interpretation_index=0)
        wide = sample.pivot("dimension", index="interpretation_index", values="coordinate")
        one = sample.filter(dimension=first["dimension"][0]).sort("interpretation_index")
        page = (path / "report.html").read_text("utf-8")
        charts = re.search(r"const charts = (.*?);\n", page)
        assert charts is not None
        return cls(
            dimensions=first["dimension"].to_list(),
            coordinates=wide.sort("interpretation_index").drop("interpretation_index").to_numpy(),
            choices=first["num_choices"].to_list(),
            environment=one["environment_index"].to_numpy(),
            margins={
                name: margins.filter(claim=name).sort("interpretation_index")["margin"].to_numpy()
                for name in margins["claim"].unique(maintain_order=True)
            },
            indices=indices,
            shares=shares,
            charts=json.loads(charts.group(1)),
            page=page,
            file=path / "report.html",
        )

    def resamples(self) -> list[NDArray[np.int64]]:
        """Rows of each bootstrap resample: whole environments, seed 0."""
        rng = np.random.default_rng(0)
        count = len(np.unique(self.environment))
        rows = [np.flatnonzero(self.environment == it) for it in range(count)]
        drawn = (rng.integers(0, count, count) for _ in range(RESAMPLES))
        return [np.concatenate([rows[it] for it in one]) for one in drawn]


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Tables:
    folder = tmp_path_factory.mktemp("sensitivity")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("access_av.tables.results_directory.RESULTS", folder)
        patch.setattr(study, "UNKNOWNS", SIZE)
        # The effects of other assumptions take a third of the time and are another section.
        patch.setattr(study.chosen_otherwise, "effects", lambda *_, **__: [])
        paper_results.run(
            ["gate"],
            runs=1,
            seed=3,
            out=folder / "out",
            unknowns=Campaign(ResultCache(folder / "parts")),
        )
    return Tables.read(folder / "out")


def legendre(x: Numbers, degree: int) -> Numbers:
    """Columns P1 to Pdegree, by the recurrence of Bonnet."""
    found = [np.ones_like(x), x]
    for n in range(1, degree):
        found.append(((2 * n + 1) * x * found[n] - n * found[n - 1]) / (n + 1))
    return np.stack(found[1 : degree + 1], axis=1)


def expansion(tables: Tables) -> tuple[list[set[int]], Numbers]:
    """Dimensions and values of all terms: degree 4 of one dimension, 2 x 2 of two."""
    points = len(tables.coordinates)
    single = []
    for d, count in enumerate(tables.choices):
        u = tables.coordinates[:, d]
        x = 2.0 * u - 1.0 if not count else (2.0 * np.floor(u * count) + 1.0) / count - 1.0
        values = legendre(x, count - 1 if count else 4)
        # Orthonormal in the sample: the Gram-Schmidt process is a QR decomposition.
        single.append(np.linalg.qr(values - values.mean(axis=0))[0] * np.sqrt(points))
    terms = [{d} for d, values in enumerate(single) for _ in values.T]
    columns = [column for values in single for column in values.T]
    for a, b in itertools.combinations(range(len(single)), 2):
        for one, other in itertools.product(single[a].T[:2], single[b].T[:2]):
            terms.append({a, b})
            columns.append(one * other)
    return terms, np.stack(columns, axis=1)


def residual(columns: Numbers, margin: Numbers) -> tuple[Numbers, Numbers]:
    """Residual and coefficients of the least squares with an intercept."""
    design = np.column_stack([np.ones(len(margin)), columns])
    found = np.linalg.lstsq(design, margin, rcond=None)[0]
    return margin - design @ found, found[1:]


def significant(basis: Numbers, margin: Numbers) -> list[int]:
    """Terms by orthogonal matching pursuit, while a correlation exceeds three deviations."""
    points, kept = len(margin), list[int]()
    left = margin - margin.mean()
    while len(kept) < points // 4:
        correlation = np.abs(basis.T @ left) / points
        correlation[kept] = 0.0
        best = int(correlation.argmax())
        deviation = np.sqrt((left**2).sum() / (points - len(kept) - 1) / points)
        if correlation[best] < 3.0 * deviation:
            break
        kept.append(best)
        left, _ = residual(basis[:, kept], margin)
    return kept


def sobol(
    terms: list[set[int]], columns: Numbers, margin: Numbers, count: int
) -> tuple[Numbers, float]:
    """First-order and total index of each dimension, and the explained share of the variance."""
    found = np.zeros((2, count))
    left, coefficients = residual(columns, margin)
    noise = (left**2).sum() / max(len(margin) - len(terms) - 1, 1)
    squares = np.clip(coefficients**2 - noise / len(margin), 0.0, None)
    shares = squares / (squares.sum() + noise)
    for term, share in zip(terms, shares, strict=True):
        for d in term:
            found[1, d] += share
            found[0, d] += share if len(term) == 1 else 0.0
    return found, max(0.0, 1.0 - noise / np.var(margin))


def test_indices_follow_from_the_sample(tables: Tables) -> None:
    terms, basis = expansion(tables)
    names = [name for name, margin in tables.margins.items() if np.ptp(margin) > 1e-9]
    assert tables.indices["claim"].unique(maintain_order=True).to_list() == names
    resamples, fitted = tables.resamples(), 0
    for name in names:
        margin = tables.margins[name] / (1.0 + np.abs(tables.margins[name]))
        kept = significant(basis, margin)
        fitted += len(kept)
        mine, columns, count = [terms[it] for it in kept], basis[:, kept], len(tables.dimensions)
        found, explained = sobol(mine, columns, margin, count)
        drawn = [sobol(mine, columns[it], margin[it], count)[0] for it in resamples]
        ends = np.quantile(drawn, [0.025, 0.975], axis=0)
        rows = tables.indices.filter(claim=name)
        assert rows["dimension"].to_list() == tables.dimensions
        for which, column in enumerate(("first", "total")):
            close(rows[column], found[which])
            close(rows[f"{column}_low"], ends[0, which])
            close(rows[f"{column}_high"], ends[1, which])
        [share] = tables.shares.filter(claim=name)["explained_variance"]
        assert share == pytest.approx(explained, abs=1e-9)
    assert fitted > len(names), "the test compares indices that are not zero"


def close(found: pl.Series, expected: Numbers) -> None:
    assert np.allclose(found.to_numpy(), expected, rtol=0.0, atol=1e-6), (found, expected)


def test_shares_are_those_of_margins_of_at_least_zero(tables: Tables) -> None:
    assert tables.shares["claim"].to_list() == [*tables.margins]
    resamples = tables.resamples()
    met = {name: margin >= 0.0 for name, margin in tables.margins.items()}
    assert any(0.0 < it.mean() < 1.0 for it in met.values())
    for row in tables.shares.iter_rows(named=True):
        mine = met[row["claim"]]
        drawn = [mine[it].mean() for it in resamples]
        expected = [mine.mean(), *np.quantile(drawn, [0.025, 0.975])]
        assert [row[f"share_met{it}"] for it in ("", "_low", "_high")] == pytest.approx(expected)


def test_the_sensitivity_report_shows_the_values_of_its_tables(tables: Tables) -> None:
    def rows(chart: str) -> list[dict[str, Any]]:
        [found] = tables.charts[chart]["datasets"].values()
        return list(found)

    def short(claim: str) -> str:
        return " ".join(claim.split("_")[:3])

    expected = {
        (short(row["claim"]), round(row["total"], 3))
        for row in tables.indices.iter_rows(named=True)
        if round(row["total"], 3) >= 0.05
    } | {
        (short(row["claim"]), round(1.0 - row["explained_variance"], 3))
        for row in tables.shares.drop_nulls().iter_rows(named=True)
        if round(1.0 - row["explained_variance"], 3) >= 0.05
    }
    assert {(it["claim"], it["total"]) for it in rows("sobol")} == expected
    bars = {it["claim"]: (it["share"], it["low"], it["high"]) for it in rows("share")}
    for row in tables.shares.iter_rows(named=True):
        figures = [row[f"share_met{it}"] for it in ("", "_low", "_high")]
        assert bars[short(row["claim"])] == pytest.approx(figures, abs=5.1e-5)
    # The sentence on the indices that matter: claims that a simulation can contradict.
    open_claims = [name for name in tables.margins if "evidence" not in CLAIMS[name]]
    matter = tables.indices.filter(pl.col("claim").is_in(open_claims), pl.col("total") >= 0.1)
    widest = (0.5 * (matter["total_high"] - matter["total_low"])).max()
    assert f"{matter.height} total indices" in tables.page
    assert f"{widest:.3f}" in tables.page
    assert f"{SIZE[0] * SIZE[1]} interpretations" in tables.page


def test_no_numbers_of_the_charts_overlap(tables: Tables) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    with Browser(program, tables.file.as_uri()) as browser:
        for width in (1300, 400):
            found = layout.measure(browser, width, "light")["found"]
            # Axes of other charts are wide here: one run has errors of kilometres.
            assert [it for it in found if it.startswith("one over the other")] == []


def test_coordinates_are_a_latin_hypercube_of_the_stated_ranges(tables: Tables) -> None:
    """Environments and controllers cover each range evenly, and environments are shared."""
    environments = len(np.unique(tables.environment))
    assert environments == SIZE[0]
    for d, name in enumerate(tables.dimensions):
        u = tables.coordinates[:, d]
        by_environment = [u[tables.environment == it] for it in range(environments)]
        shared = all(np.ptp(it) == 0.0 for it in by_environment)
        drawn = np.array([it[0] for it in by_environment]) if shared else u
        strata = np.sort(np.floor(drawn * len(drawn)))
        assert strata.tolist() == [*range(len(drawn))], name
