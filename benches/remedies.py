"""Remedies of a plant: compares their order in a study with that in many paired drives.

    python benches/remedies.py                       # bends, 200 drives each
    python benches/remedies.py yard --drives 50

The study uses its default number of drives. Here, each remedy and the unchanged plant are driven
with the same seeds, which differ from those of the study. One of two remedies is better with 95 %
confidence if the 95 % interval of their paired difference excludes 0. The pair agrees if the study
has the same order.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time

import access_av
from access_av.run.runs import drive
from access_av.study.remedies import remedies

STUDY_SEED, SEED = 1, 1001


def main() -> None:
    """Prints the paired differences, and the pairs that agree."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plant", nargs="?", default="bends", help="shipped name, or a file")
    parser.add_argument("--drives", type=int, default=200)
    asked = parser.parse_args()
    plant = access_av.Plant.load(asked.plant)
    scenario, (_, percent) = plant.scenario(), plant.target
    began_s = time.monotonic()
    studied = access_av.study_plant(plant, seed=STUDY_SEED, force_remedies=True)
    single = studied.measured.single
    place = {it.name: number for number, it in enumerate(single, start=1)}
    runs = studied.measured.before.runs
    print(f"{plant.name}: study of {runs} pairs, {time.monotonic() - began_s:.0f} s")

    began_s = time.monotonic()
    base = drive("unchanged", scenario, asked.drives, SEED)
    vehicles = json.loads(plant.to_json())["fleet"]["vehicles"]
    driven = {
        it.name: drive(it.name, scenario.with_overrides(dict(it.settings)), asked.drives, SEED)
        for it in remedies(scenario, vehicles)
    }
    print(f"{asked.drives} drives each, {time.monotonic() - began_s:.0f} s")
    print(f"unchanged: {percent:g} % within {base.percentile(percent).value:.3f} m")
    less = {name: it.delta_m(base, percent) for name, it in driven.items()}
    for number, name in enumerate(sorted(less, key=lambda it: less[it][0]), start=1):
        found, low, high = less[name]
        print(
            f"{number} (study {place[name]})  {name:<32} {found:+.3f} ({low:+.3f} to {high:+.3f}) m"
        )

    agree = sure = 0
    for one, other in itertools.combinations(driven, 2):
        _, low, high = driven[one].delta_m(driven[other], percent)
        if low <= 0.0 <= high:
            continue
        sure += 1
        agrees = (high < 0.0) == (place[one] < place[other])
        agree += agrees
        if not agrees:
            better, worse = (one, other) if high < 0.0 else (other, one)
            print(f"the study disagrees: it states that “{better}” is better than “{worse}”")
    pairs = len(driven) * (len(driven) - 1) // 2
    print(f"{sure} of {pairs} pairs are sure; the study agrees in {agree} of them")


if __name__ == "__main__":
    main()
