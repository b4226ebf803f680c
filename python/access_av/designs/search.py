"""Number of runs of each design: all runs, or successive halving."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from access_av.designs.driven import drive, in_worst, joined
from access_av.designs.front import aims, not_beaten
from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from access_av.designs.driven import Design, Driven, Part
    from access_av.run.campaign import Campaign

# Successive halving: factor of fewer designs and more runs per round.
KEEP_ONE_IN = 3
FIRST_RUNS = 2


@dataclass(frozen=True)
class Found:
    """Designs with all runs, and the number of simulated runs.

    Attributes
    ----------
    driven
        Designs with all runs.
    drives
        Total number of runs, counted per design.
    """

    driven: list[Driven]
    drives: int


def rounds(runs: int, *, halving: bool) -> list[int]:
    """Returns the numbers of runs after which the designs are compared.

    Examples
    --------
    >>> rounds(20, halving=True), rounds(20, halving=False)
    ([2, 6, 20], [20])
    """
    counts, upto = [], FIRST_RUNS
    while halving and 2 * upto <= runs:
        counts.append(upto)
        upto *= KEEP_ONE_IN
    return [*counts, runs]


def search(
    campaign: Campaign,
    designs: Sequence[Sequence[Design]],
    *,
    runs: int,
    seed: int,
    halving: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Found:
    """Simulates the designs.

    Parameters
    ----------
    designs
        Designs in every environment; each is rated in its worst one.
    runs
        Number of runs of each remaining design in each environment.
    halving
        Whether inferior designs are dropped early; all designs use the same runs.
    """
    if not designs:
        raise InputError("no designs to drive")
    nothing: list[Part] = []
    left = [(worlds, [list(nothing) for _ in worlds]) for worlds in designs]
    done = drives = 0
    driven: list[Driven] = []
    stages = rounds(runs, halving=halving)
    for stage, upto in enumerate(stages):
        every = [one for worlds, _ in left for one in worlds]
        made = drive(
            campaign, every, first_run=done, runs=upto - done, seed=seed, progress=progress
        )
        kept = [parts for _, of_worlds in left for parts in of_worlds]
        for parts, part in zip(kept, made, strict=True):
            parts.append(part)
        drives += len(every) * (upto - done)
        done = upto
        driven = [
            in_worst([joined(*pair) for pair in zip(worlds, parts, strict=True)])
            for worlds, parts in left
        ]
        if stage + 1 < len(stages):
            keep = max(len(left) // KEEP_ONE_IN, 1)
            left = [left[place] for place in sorted(ranking(driven)[:keep])]
    return Found(driven, drives)


def ranking(driven: Sequence[Driven]) -> list[int]:
    """Returns the designs in order of Pareto rank."""
    energy_j, square_m2 = aims(driven)
    left = np.arange(len(driven))
    found: list[int] = []
    while left.size:
        on_front = left[not_beaten(energy_j[left], square_m2[left])]
        if on_front.size == 0:
            on_front = left[np.argsort(energy_j[left], kind="stable")]
        found += on_front.tolist()
        left = np.setdiff1d(left, on_front)
    return found
