"""Studies of plants: time on two cores, soundness of the recommended point, agreement of seeds.

    python benches/shipped_plants.py                 # all shipped plants
    python benches/shipped_plants.py bends mine.toml --seeds 5 --runs 8

A sound point is on the front and was driven with a protection level, like all other points. The
time is half of the processor time (s): the duration on two idle cores. The code of the pages is
built once in a process, and its time is part of the first plant. With several seeds, the
recommended points are identical, or each study reports the other points as equivalent, or they
differ.
"""

from __future__ import annotations

import argparse
import itertools
import os

import access_av
from access_av.report.study import render_study

MOST_S = 90.0
# Name of the recommended point, and names of the points that are equivalent to it.
Recommended = tuple[str, set[str]]


def main() -> None:
    """Prints a row for each plant; exit code 1 if a plant has no valid recommendation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plants", nargs="*", default=access_av.Plant.names())
    parser.add_argument("--seeds", type=int, default=1, help="number of seeds, from 1")
    parser.add_argument("--runs", type=int, help="runs with the nominal channel")
    asked = parser.parse_args()
    short = False
    for name in asked.plants:
        studies = []
        for seed in range(1, asked.seeds + 1):
            found, is_sound = _study(name, seed, asked.runs)
            short |= not is_sound
            studies.append(found)
        if asked.seeds > 1:
            agreement = _agreement(studies)
            short |= agreement == "differ"
            print(f"{name:<8} {asked.seeds} seeds: {agreement}", flush=True)
    raise SystemExit(short)


def _study(name: str, seed: int, runs: int | None) -> tuple[Recommended, bool]:
    """Prints the row of a study; returns its recommendation, and whether it is sound."""
    before = os.times()
    found = access_av.study_plant(name, seed=seed, runs=runs)
    page = render_study(found)
    after = os.times()
    both_s = 0.5 * (after.user - before.user + after.system - before.system)
    protected = all(
        it.scenario.vehicle.alert_limit_m is not None
        for it in [
            *(found.nominal, found.poor_los),
            *(one.driven for one in [*found.remedies, *found.points]),
        ]
    )
    on_front = found.recommended in found.front
    recommendation = found.recommendation
    chosen = recommendation.point
    print(
        f"{name:<8} seed {seed}  {both_s:5.1f} s  front {on_front}  protected {protected}  "
        f"{len(page.encode()) / 1e6:.2f} MB  {found.judged(found.nominal).words}  "
        f"{recommendation.agreement.value}  {chosen and chosen.name}",
        flush=True,
    )
    equivalent = {it.point.name for it in recommendation.rivals if it.is_equivalent}
    sound = both_s <= MOST_S and protected and on_front
    return ("" if chosen is None else chosen.name, equivalent), sound


def _agreement(studies: list[Recommended]) -> str:
    """Whether seeds recommend one point, or points that a study reports as equivalent."""
    names = {name for name, _ in studies}
    if len(names) == 1:
        return "identical"
    pairs = itertools.combinations(studies, 2)
    same = all(
        one[0] == other[0] or one[0] in other[1] or other[0] in one[1] for one, other in pairs
    )
    return "equivalent" if same else "differ"


if __name__ == "__main__":
    main()
