"""Studies of all shipped plants: seconds of two cores, and whether each recommends a sound point.

    python benches/shipped_plants.py                 # all of them
    python benches/shipped_plants.py bends yard

Sound is a point of the front, driven with a protection level as everything beside it. Seconds are
those of computing, over two: what two cores take that do nothing else. The pages' code, which is
made once in a process, is counted with the first.
"""

from __future__ import annotations

import argparse
import os

import access_av
from access_av.report.study import render_study

MOST_S = 90.0


def main() -> None:
    """Print a row for each plant; exit code 1 where one of them falls short."""
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
        guarded = all(
            it.scenario.vehicle.alert_limit_m is not None
            for it in [
                *(found.believed, found.poor),
                *(one.driven for one in [*found.mended, *found.points]),
            ]
        )
        on_front = found.recommended in found.front
        short |= both_s > MOST_S or not (guarded and on_front)
        print(
            f"{name:<8} {both_s:5.1f} s  front {on_front}  guarded {guarded}  "
            f"{len(page.encode()) / 1e6:.2f} MB  {found.point and found.point.name}",
            flush=True,
        )
    raise SystemExit(short)


if __name__ == "__main__":
    main()
