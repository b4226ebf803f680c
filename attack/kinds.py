"""Kinds of cases: each is a function of a random generator and a case, and returns a command."""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

from attack import arguments, drives, files, plug_ins, tables
from attack.case import Case

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# Weight of each kind among the inputs; the number of drives is a separate option.
KINDS: dict[str, tuple[Callable[[Random, Case], list[str]], int]] = {
    "settings-text": (files.settings_text, 15),
    "settings-table": (files.settings_table, 26),
    "scenario": (files.scenario, 15),
    "limits": (files.at_the_limits, 10),
    "plug-in": (plug_ins.plug_in, 10),
    "recording": (files.recording, 5),
    "odometry": (files.odometry, 3),
    "angles": (files.angles, 3),
    "truth": (files.truth, 2),
    "road-file": (files.road_file, 2),
    "results": (tables.results, 2),
    "tables": (tables.given, 2),
    "figures": (tables.figures, 2),
    "arguments": (arguments.arguments, 3),
    "drive": (drives.drive, 0),
}


def inputs(seed: int, count: int) -> list[tuple[str, int]]:
    """Returns kind and case number of each input, in random order."""
    random = Random(seed)
    weights = [weight for _, weight in KINDS.values()]
    return [(kind, n) for n, kind in enumerate(random.choices(list(KINDS), weights, k=count))]


def make(seed: int, kind: str, number: int, folder: Path) -> list[str]:
    """Writes the files of a case into a folder; returns its command."""
    return KINDS[kind][0](Random(f"{seed}:{kind}:{number}"), Case(folder))
