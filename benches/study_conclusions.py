"""Conclusions of a study, compared with new runs in other environments.

    access-av study yard --out results/yard
    python benches/study_conclusions.py results/yard
    python benches/study_conclusions.py results/yard --runs 50 --pairs 0

Verdicts (``--runs``): each target is judged again by new runs. Recommendation (``--pairs``): error
and energy of ``recommended.toml`` are compared with the ends that the study states. Measures
(``--pairs``): the difference that the study states is compared with the 95 % interval of new pairs
of runs.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
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


def main() -> None:
    """Prints a row for each conclusion; exit code 1 if the new runs contradict one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=Path, help="directories of `access-av study`")
    parser.add_argument("--runs", type=int, default=200, help="new runs of the plant")
    parser.add_argument(
        "--pairs", type=int, default=60, help="new runs of the recommendation and of each measure"
    )
    asked = parser.parse_args()
    agreed = [
        each for folder in asked.results for each in _compared(folder, asked.runs, asked.pairs)
    ]
    print(f"{sum(agreed)} of {len(agreed)} conclusions agree with the new runs")
    raise SystemExit(not all(agreed))


def _compared(folder: Path, runs: int, pairs: int) -> list[bool]:
    said = json.loads((folder / "study.json").read_text("utf-8"))
    plant = access_av.Plant.load(str(folder / "plant.toml"))
    seed, percent = said["seed"] + SEED_OFFSET, said["target"]["percent"]
    print(f"{plant.name}: {runs} new runs, {pairs} new pairs of each measure, seed {seed}")
    base = drive("unchanged", plant.scenario(), max(runs, pairs), seed)
    agreed = _targets(folder, plant, base)
    if pairs:
        if said["recommended"] is not None:
            agreed += _recommended(folder, said["recommended"], percent, pairs, seed)
        before = base.first(pairs)
        agreed += [_measure(plant, it, before, percent, seed) for it in said["remedies"]]
    return agreed


def _targets(folder: Path, plant: Any, base: Runs) -> list[bool]:
    """Whether the verdicts do not contradict each other: both of them 95 % certain."""
    stated = pl.read_parquet(folder / "targets.parquet").filter(variant="unchanged")
    certain = {Judgement.MET, Judgement.MISSED}
    agreed = []
    for row, it in zip(stated.iter_rows(named=True), Targets.of(plant).results(base), strict=True):
        verdict = Judgement(row["judgement"])
        both = {verdict, it.judgement}
        agreed.append(both != certain)
        print(
            f"  target {row['target']}: {row['within_share']:.2%} within, {verdict.words}; new: "
            f"{it.share[0]:.2%} ({it.share[1]:.2%} to {it.share[2]:.2%}), {it.judgement.words}"
            f"{'' if agreed[-1] else '  CONTRADICTION'}"
        )
    return agreed


def _recommended(
    folder: Path, stated: dict[str, Any], percent: float, runs: int, seed: int
) -> list[bool]:
    """Whether error and energy are between the stated ends."""
    scenario = access_av.Scenario.load(str(folder / "recommended.toml"))
    driven = drive("recommended", scenario, runs, seed)
    found, energy_j = driven.percentile(percent), driven.energy_j
    low_m, high_m = stated["target_error_low_m"], stated["target_error_high_m"]
    low_j, high_j = stated["trip_j"]["low"], stated["trip_j"]["high"]
    error_agrees = low_m <= found.value <= (math.inf if high_m is None else high_m)
    energy_agrees = energy_j is not None and low_j <= energy_j <= high_j
    ends = "no upper end" if high_m is None else f"{high_m:.3f} m"
    print(
        f"  {stated['name']}: stated {stated['target_error_m']:.3f} m ({low_m:.3f} m to {ends}), "
        f"{low_j:.3g} to {high_j:.3g} J; new: {found.value:.3f} m ({found.interval} m), "
        f"{energy_j:.3g} J{'' if error_agrees and energy_agrees else '  CONTRADICTION'}"
    )
    return [error_agrees, energy_agrees]


def _measure(plant: Any, stated: dict[str, Any], before: Runs, percent: float, seed: int) -> bool:
    """Whether the stated difference is in the 95 % interval of the new pairs."""
    changed = plant.scenario()
    # A further radio head replaces the list of radio heads: keys of single ones come after it.
    for settings in sorted(stated["settings"], key=lambda it: "site.radio_heads" not in it):
        changed = changed.with_overrides(settings)
    driven = drive(stated["name"], changed, before.runs, seed)
    delta, low, high = driven.delta_m(before, percent)
    agrees = low <= stated["delta_m"] <= high
    print(
        f"  {stated['name']}: stated {stated['delta_m']:+.3f} m ({stated['delta_low_m']:+.3f} to "
        f"{stated['delta_high_m']:+.3f} m), new {delta:+.3f} m ({low:+.3f} to {high:+.3f} m)"
        f"{'' if agrees else '  OUTSIDE'}",
        flush=True,
    )
    return agrees


if __name__ == "__main__":
    main()
