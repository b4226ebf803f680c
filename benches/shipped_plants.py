"""Studies of all shipped plants: time on two cores, and soundness of the recommended point.

    python benches/shipped_plants.py                 # all of them
    python benches/shipped_plants.py bends yard

A sound point is on the front and was driven with a protection level, like all other points. The
time is half of the processor time (s): the duration on two idle cores. The code of the pages is
built once in a process, and its time is part of the first plant.
"""

from __future__ import annotations

import argparse
import os

import access_av
from access_av.report.study import render_study

MOST_S = 90.0


def main() -> None:
    """Prints a row for each plant; exit code 1 if one has no sound point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("plants", nargs="*", default=access_av.Plant.names())
    asked = parser.parse_args()
    short = False
    for name in asked.plants:
        before = os.times()
        found = access_av.study_plant(name)
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
        short |= both_s > MOST_S or not (protected and on_front)
        print(
            f"{name:<8} {both_s:5.1f} s  front {on_front}  protected {protected}  "
            f"{len(page.encode()) / 1e6:.2f} MB  {found.point and found.point.name}",
            flush=True,
        )
    raise SystemExit(short)


if __name__ == "__main__":
    main()
