"""Studies of plants: time on two cores, soundness of the recommended point, agreement of seeds.

    python benches/shipped_plants.py                               # all shipped plants, seed 1
    python benches/shipped_plants.py bends mine.toml --seeds 5     # seeds 1 to 5
    python benches/shipped_plants.py bends --out results/studies   # for study_conclusions.py

A sound point is available, is equivalent to the best point of the front, and was driven with a
protection level, like all other points. Each study uses one thread of one of as many processes as
cores. The time is half of the processor time (s): the duration on two idle cores. With several
seeds, the recommended points are identical, or a study reports the other one as equivalent, or they
differ. Measures and page are computed for seed 1 only: the time is that of seed 1. The last lines
are the table of docs/measured.md.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

import access_av
from access_av.study.study_result import recommended_toml
from access_av.tables.results_directory import json_text

MOST_S = 90.0


@dataclass
class Found:
    """One study: its recommendation, and whether it is sound."""

    plant: str
    seed: int
    both_s: float
    is_sound: bool
    verdict: str
    name: str
    ok: str
    page_mb: float
    operations: int
    equivalent: set[str] = field(default_factory=set)

    @property
    def line(self) -> str:
        """One line of the output."""
        return (
            f"{self.plant:<8} seed {self.seed}  {self.both_s:5.1f} s  sound {self.is_sound}  "
            f"{self.page_mb:.2f} MB  {self.verdict}  {self.ok}  "
            f"{len(self.equivalent)} equivalent  {self.name}"
        )


def main() -> None:
    """Prints a row for each study and a table; exit code 1 if a result is not as required."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plants", nargs="*", default=access_av.Plant.names())
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds, from 1")
    parser.add_argument("--runs", type=int, help="runs with the nominal channel")
    parser.add_argument("--out", type=Path, help="folder for the results of seed 1, by plant")
    asked = parser.parse_args()
    tasks = list(itertools.product(asked.plants, range(1, asked.seeds + 1)))
    began_s, found = time.monotonic(), list[Found]()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        running = [pool.submit(study, name, seed, asked.runs, asked.out) for name, seed in tasks]
        for done, it in enumerate(as_completed(running), start=1):
            found.append(it.result())
            passed_s = time.monotonic() - began_s
            left_s = passed_s * (len(tasks) - done) / done
            print(f"[{done}/{len(tasks)}, about {left_s:.0f} s left]", end=" ", file=sys.stderr)
            print(found[-1].line, flush=True)
    by_plant = {
        Path(name).stem: sorted(
            (it for it in found if it.plant == Path(name).stem), key=lambda it: it.seed
        )
        for name in asked.plants
    }
    print("\n| plant | time (s) | recommended points (seeds) | equivalent, of all | agreement |")
    print("|---|---|---|---|---|")
    for plant, studies in by_plant.items():
        print(row(plant, studies))
    short = any(not it.is_sound or it.both_s > MOST_S for it in found)
    raise SystemExit(short or any(agreement(it) == "differ" for it in by_plant.values()))


def study(name: str, seed: int, runs: int | None, out: Path | None) -> Found:
    """Returns the result of a study; writes that of seed 1 to a folder of ``out``."""
    from access_av.report.study import render_study
    from access_av.study import answer
    from access_av.study.operate import Rival
    from access_av.study.remedies import remedies

    # The recommendation does not depend on measures.
    answer.remedies = remedies if seed == 1 else lambda *_: []
    before = os.times()
    found = access_av.study_plant(name, seed=seed, runs=runs, threads=1)
    page = render_study(found) if seed == 1 else ""
    after = os.times()
    if seed == 1 and out is not None:
        write(found, page, out / Path(name).stem)
    driven = [it.driven for it in [*found.remedies, *found.points]]
    protected = all(
        it.scenario.vehicle.alert_limit_m is not None
        for it in [found.nominal, found.poor_los, *driven]
    )
    chosen, recommendation = found.point, found.recommendation
    is_sound = (
        protected
        and chosen is not None
        and chosen.is_available
        and recommendation.best in found.front
        and Rival.of(
            found.plant,
            found.targets,
            chosen,
            found.points[recommendation.best],
            recommendation.comparisons,
        ).is_equivalent
    )
    shares = (
        [] if chosen is None else [chosen.driven.ok_share, chosen.ok_delta and chosen.ok_delta[0]]
    )
    return Found(
        plant=Path(name).stem,
        seed=seed,
        both_s=0.5 * (after.user - before.user + after.system - before.system),
        is_sound=is_sound,
        verdict=found.judged(found.nominal).words,
        name="" if chosen is None else chosen.name,
        ok="ok " + " ".join("–" if it is None else f"{100.0 * it:+.1f}" for it in shares),
        page_mb=len(page.encode()) / 1e6,
        operations=len(recommendation.rivals),
        equivalent={it.point.name for it in recommendation.rivals if it.is_equivalent},
    )


def write(found: access_av.Study, page: str, folder: Path) -> None:
    """Writes the files that benches/study_conclusions.py reads, and the page."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.json").write_text(json_text(found.summary()), "utf-8")
    (folder / "plant.toml").write_text(found.plant.to_toml(), "utf-8")
    (folder / "recommended.toml").write_text(recommended_toml(found) or "", "utf-8")
    (folder / "report.html").write_text(page, "utf-8")
    found.tables()["targets"].write_parquet(folder / "targets.parquet")


def agreement(studies: list[Found]) -> str:
    """Whether seeds recommend one point, or points that a study reports as equivalent."""
    if len({it.name for it in studies}) == 1:
        return "identical"
    same = all(
        one.name == other.name or one.name in other.equivalent or other.name in one.equivalent
        for one, other in itertools.combinations(studies, 2)
    )
    return "equivalent" if same else "differ"


def row(plant: str, studies: list[Found]) -> str:
    """Row of the table: duration of seed 1, recommended and equivalent points, agreement."""
    names: dict[str, list[str]] = {}
    for it in studies:
        names.setdefault(it.name, []).append(str(it.seed))
    points = "; ".join(f"{name} ({', '.join(seeds)})" for name, seeds in names.items())
    counts = [len(it.equivalent) for it in studies]
    equivalent = f"{min(counts)} to {max(counts)} of {studies[0].operations}"
    return (
        f"| `{plant}` | {studies[0].both_s:.0f} | {points} | {equivalent} | {agreement(studies)} |"
    )


if __name__ == "__main__":
    main()
