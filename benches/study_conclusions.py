"""Conclusions of a study, compared with new runs in other environments.

    access-av study yard --out results/yard
    python benches/study_conclusions.py results/yard
    python benches/study_conclusions.py results/yard --runs 50 --pairs 0

Verdicts (``--runs``): each target is judged again by new runs. Recommendation (``--pairs``): error
and energy of ``recommended.toml`` are compared with the ends that the study states. Measures
(``--pairs``): the difference that the study states is compared with new pairs of runs. "Inside":
it is in their 95 % interval. It has errors of its own, because a study has fewer pairs. Therefore
the number that is expected inside follows from both intervals, and a contradiction is a difference
between both that exceeds the root of the sum of their squared half widths. All runs use all cores.
The last lines are tables of docs/measured.md.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import polars as pl

import access_av
from access_av.run.runs import drive
from access_av.study.targets import Targets
from access_av.verdicts import Judgement

if TYPE_CHECKING:
    from access_av.run.runs import Runs

# Offset of the seed of the new runs; those of a study are below 10 000.
SEED_OFFSET = 500_000
# Quantile of the normal distribution for 95 % intervals.
Z95 = NormalDist().inv_cdf(0.975)


@dataclass
class Work:
    """Runs that are completed, and rows of the tables."""

    total: int
    began_s: float = field(default_factory=time.monotonic)
    done: int = 0
    agreed: list[bool] = field(default_factory=list)
    verdicts: list[str] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    measures: list[str] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)
    expected: float = 0.0

    def drive(self, name: str, scenario: access_av.Scenario, runs: int, seed: int) -> Runs:
        """Simulates runs and shows the progress."""
        found = drive(name, scenario, runs, seed)
        self.done += runs
        passed_s = time.monotonic() - self.began_s
        left_s = passed_s * (self.total - self.done) / self.done
        print(f"[{self.done} of {self.total} runs, about {left_s:.0f} s left]", file=sys.stderr)
        return found


def main() -> None:
    """Prints a row for each conclusion; exit code 1 if the new runs contradict one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=Path, help="directories of `access-av study`")
    parser.add_argument("--runs", type=int, default=200, help="new runs of the plant")
    parser.add_argument(
        "--pairs", type=int, default=60, help="new runs of the recommendation and of each measure"
    )
    asked = parser.parse_args()
    stated = {it: json.loads((it / "study.json").read_text("utf-8")) for it in asked.results}
    base = max(asked.runs, asked.pairs)
    each = sum(len(it["remedies"]) + (it["recommended"] is not None) for it in stated.values())
    work = Work(base * len(stated) + asked.pairs * each)
    for folder, said in stated.items():
        compare(work, folder, said, base, asked.pairs)
    for head, rows in (
        (
            "| plant | target | study: within, verdict | new runs: within (95 %), verdict |",
            work.verdicts,
        ),
        ("| plant | recommended point | study: error (m), energy (J) | new runs |", work.points),
        (
            "| plant | measure | study: difference (m) | new pairs: difference (m) | |",
            work.measures,
        ),
    ):
        if rows:
            print("", head, "|---" * (head.count("|") - 1) + "|", *rows, sep="\n")
    if work.inside:
        print(
            f"\n{sum(work.inside)} of {len(work.inside)} stated differences are in the interval of "
            f"the new pairs; {work.expected:.1f} are expected from both intervals"
        )
    print(f"{sum(work.agreed)} of {len(work.agreed)} conclusions do not contradict the new runs")
    raise SystemExit(not all(work.agreed))


def compare(work: Work, folder: Path, said: dict[str, Any], runs: int, pairs: int) -> None:
    """Compares the conclusions of one study."""
    plant = access_av.Plant.load(str(folder / "plant.toml"))
    seed, percent = said["seed"] + SEED_OFFSET, said["target"]["percent"]
    base = work.drive("unchanged", plant.scenario(), runs, seed)
    targets(work, folder, plant, base)
    if pairs:
        if said["recommended"] is not None:
            recommended(work, folder, said, pairs, seed)
        for it in said["remedies"]:
            measure(work, plant, it, base.first(pairs), percent, seed)


def targets(work: Work, folder: Path, plant: Any, base: Runs) -> None:
    """Verdicts contradict each other if both are 95 % certain and differ."""
    stated = pl.read_parquet(folder / "targets.parquet").filter(variant="unchanged")
    certain = {Judgement.MET, Judgement.MISSED}
    for row, it in zip(stated.iter_rows(named=True), Targets.of(plant).results(base), strict=True):
        verdict = Judgement(row["judgement"])
        agrees = {verdict, it.judgement} != certain
        work.agreed.append(agrees)
        work.verdicts.append(
            f"| `{plant.name}` | {row['target']}, {it.target.words} "
            f"| {row['within_share']:.1%}, {verdict.words} "
            f"| {it.share[0]:.1%} ({it.share[1]:.1%} to {it.share[2]:.1%}), {it.judgement.words}"
            f"{'' if agrees else ' CONTRADICTION'} |"
        )


def recommended(work: Work, folder: Path, said: dict[str, Any], runs: int, seed: int) -> None:
    """Error and energy of the new runs have to be between the stated ends."""
    stated, percent = said["recommended"], said["target"]["percent"]
    scenario = access_av.Scenario.load(str(folder / "recommended.toml"))
    driven = work.drive("recommended", scenario, runs, seed)
    found, energy_j = driven.percentile(percent), driven.energy_j
    low_m, high_m = stated["target_error_low_m"], stated["target_error_high_m"]
    low_j, high_j = stated["trip_j"]["low"], stated["trip_j"]["high"]
    error_agrees = low_m <= found.value <= (math.inf if high_m is None else high_m)
    energy_agrees = energy_j is not None and low_j <= energy_j <= high_j
    work.agreed += [error_agrees, energy_agrees]
    ends = "no upper end" if high_m is None else f"{high_m:.3f}"
    work.points.append(
        f"| `{said['plant']}` | {stated['name']} | {stated['target_error_m']:.3f} "
        f"({low_m:.3f} to {ends}), {low_j:.3g} to {high_j:.3g} | {found.value:.3f} "
        f"({found.interval}), {energy_j:.3g}"
        f"{'' if error_agrees and energy_agrees else ' CONTRADICTION'} |"
    )


def measure(
    work: Work, plant: Any, stated: dict[str, Any], before: Runs, percent: float, seed: int
) -> None:
    """Compares the difference of a measure with that of the new pairs."""
    changed = plant.scenario()
    # A further radio head replaces the list of radio heads: keys of single ones come after it.
    for settings in sorted(stated["settings"], key=lambda it: "site.radio_heads" not in it):
        changed = changed.with_overrides(settings)
    driven = work.drive(stated["name"], changed, before.runs, seed)
    delta, low, high = driven.delta_m(before, percent)
    was, was_low, was_high = (stated[f"delta{end}_m"] for end in ("", "_low", "_high"))
    half, was_half = 0.5 * (high - low), 0.5 * (was_high - was_low)
    both = math.hypot(half, was_half)
    inside, agrees = low <= was <= high, abs(was - delta) <= both
    work.inside.append(inside)
    work.agreed.append(agrees)
    # Standard deviation of the difference of both: that of normal errors with these intervals.
    work.expected += 2.0 * NormalDist().cdf(Z95 * half / both) - 1.0 if both > 0.0 else 1.0
    result = "inside" if inside else "outside" if agrees else "CONTRADICTION"
    work.measures.append(
        f"| `{plant.name}` | {stated['name']} | {was:+.3f} ({was_low:+.3f} to {was_high:+.3f}) "
        f"| {delta:+.3f} ({low:+.3f} to {high:+.3f}) | {result} |"
    )


if __name__ == "__main__":
    main()
