"""``python -m attack node gaps``: samples absent ten times; exit code 1: late reception.

Two processes load the computer, one for each of two cores. The samples are absent for 6 s, ten
times in one run, with both clocks of the node, and with and without sleep between bursts.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from attack.node import sample_run, samples

if TYPE_CHECKING:
    from multiprocessing.synchronize import Event

# Number of gaps, their duration, and the time between them (s).
GAPS, GAP_S, BETWEEN_S = 10, 6.0, 3.0
# Drive time before the first gap (s).
BEFORE_S = 5.0
# Maximum time from the first sample after a gap to the first SSB (s), with a tolerance.
RECEPTION_S, TOLERANCE_S = 1.0, 0.15
# Number of processes that load the computer.
LOADS = 2


class Condition(NamedTuple):
    """Settings of the node."""

    counts_samples: bool
    sleeps: bool

    def __str__(self) -> str:
        """Text for the table."""
        clock = "start-time-s" if self.counts_samples else "default"
        return f"clock {clock}, sleep {'on' if self.sleeps else 'off'}"


def _burn(stopped: Event) -> None:
    value = 1.0
    while not stopped.is_set():
        for _ in range(100_000):
            value = value * 1.000001 % 7.0


def ends_s() -> list[float]:
    """Ends of the gaps in drive time (s)."""
    return [BEFORE_S + k * (GAP_S + BETWEEN_S) + GAP_S for k in range(GAPS)]


def run(condition: Condition, folder: Path, recorded: Path) -> tuple[list[float | None], float]:
    """Time to the first SSB after each gap (s), `None` if absent, and the sending delay (s)."""
    ends = ends_s()

    def is_withheld(now_s: float) -> bool:
        return any(end_s - GAP_S <= now_s < end_s for end_s in ends)

    sent = sample_run.transmit(
        folder,
        recorded,
        is_withheld,
        BEFORE_S,
        f"sleep = {str(condition.sleeps).lower()}",
        counts_samples=condition.counts_samples,
    )
    received_s = [
        it.at_s - sent.epoch_s for it in sent.arrivals if it.content.get("type") == "verdict"
    ]
    return [
        next((it - end_s for it in received_s if it > end_s), None) for end_s in ends
    ], sent.lateness_s


def main(arguments: list[str]) -> int:
    """Exit code 1 if an SSB is received late."""
    options = argparse.ArgumentParser(prog="python -m attack node gaps", description=__doc__)
    options.add_argument(
        "--without-load", action="store_true", help="start no processes that load the computer"
    )
    chosen = options.parse_args(arguments)
    context = multiprocessing.get_context("spawn")
    stopped = context.Event()
    loads = [context.Process(target=_burn, args=(stopped,), daemon=True) for _ in range(LOADS)]
    is_late = False
    with tempfile.TemporaryDirectory() as scratch:
        recorded = samples.record(Path(scratch) / "drive", ends_s()[-1] + BETWEEN_S)
        for load in () if chosen.without_load else loads:
            load.start()
        print("| condition | gaps | first SSB after: median, maximum | messages sent late by |")
        print("|---|---|---|---|")
        for number, flags in enumerate(itertools.product((False, True), repeat=2)):
            condition = Condition(*flags)
            times_s, late_s = run(condition, Path(scratch) / str(number), recorded)
            known = sorted(it for it in times_s if it is not None)
            missing = len(times_s) - len(known)
            is_late |= missing > 0 or known[-1] > RECEPTION_S + TOLERANCE_S
            figures = f"{known[len(known) // 2]:.2f} s, {known[-1]:.2f} s" if known else "–"
            figures += f" ({missing} without)" if missing else ""
            print(f"| {condition} | {len(times_s)} | {figures} | {late_s:.2f} s |", flush=True)
        stopped.set()
    return 1 if is_late else 0
