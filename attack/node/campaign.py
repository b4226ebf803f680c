"""``python -m attack node``: run the fault campaign and print its table; exit code 1: violation."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from attack.node import sample_run, samples
from attack.node.faults import FAULTS
from attack.node.node import has_small_disk
from attack.node.run import Run
from attack.node.verdict import Verdict, judge

if TYPE_CHECKING:
    from attack.node.fault import Fault


# Repetitions of a run whose messages were sent late because the computer was busy.
ATTEMPTS = 3
# Drive time before a fault (s): the start is confirmed by then.
BEFORE_S = 8.0
# Folder of the recorded drive.
RECORDED = "drive"
# Nice value of the campaign with `--first`.
FIRST_NICE = -10
# Nodes at once that process samples, for each core: one uses up to 0.6 of a core.
SAMPLE_NODES_PER_CORE = 1.5


def run_one(name: str, seed: int, repetition: int, scratch: Path, before_s: float) -> Verdict:
    """Runs and judges one repetition; repeats it if the computer was too busy."""
    fault = next(it for it in FAULTS if it.name == name)
    for attempt in range(ATTEMPTS):
        folder = scratch / f"{FAULTS.index(fault)}-{repetition}-{attempt}"
        if fault.uses_samples:
            recorded = sample_run.execute(fault, seed, repetition, folder, scratch / RECORDED)
        else:
            recorded = Run(fault, seed, repetition, folder, before_s).execute()
        verdict = judge(recorded)
        if not verdict.was_busy:
            break
    return verdict


def run_all(
    faults: list[Fault],
    seed: int,
    repetitions: int,
    at_once: int,
    scratch: Path,
    before_s: float = BEFORE_S,
) -> list[Verdict]:
    """Runs all repetitions of all faults, several nodes at once.

    The cores limit the number of nodes that process samples; other nodes run next to them.
    """
    if any(it.uses_samples for it in faults):
        samples.record(scratch / RECORDED)
    heavy = {it.name for it in faults if it.uses_samples}
    most_heavy = max(1, int(SAMPLE_NODES_PER_CORE * (os.cpu_count() or 1)))
    # A process of its own for each run, because one interpreter is too slow to keep all times.
    with ProcessPoolExecutor(at_once, get_context("spawn")) as pool:
        cases = [
            (it.name, seed, number)
            for it in faults
            for number in range(it.repetitions * repetitions)
        ]
        # Long runs first, because the last ones decide when the campaign ends.
        cases.sort(key=lambda it: -next(f.lasts_s for f in faults if f.name == it[0]))
        running: dict[Future[Verdict], str] = {}
        verdicts: list[Verdict] = []
        while cases or running:
            number_heavy = sum(name in heavy for name in running.values())
            startable = (it for it in cases if it[0] not in heavy or number_heavy < most_heavy)
            case = next(startable, None) if len(running) < at_once else None
            if case is not None:
                cases.remove(case)
                running[pool.submit(run_one, *case, scratch, before_s)] = case[0]
                continue
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                del running[done]
                verdicts.append(done.result())
    order = [it.name for it in faults]
    return sorted(verdicts, key=lambda it: order.index(it.fault))


def _worst(values: list[float | None]) -> str:
    known = [it for it in values if it is not None]
    if not known:
        return "–"
    missing = len(values) - len(known)
    text = f"{statistics.median(known):.2f} / {max(known):.2f}"
    return text + (f" ({missing} none)" if missing else "")


def table(verdicts: list[Verdict]) -> Table:
    """Table with one line for each fault: median and maximum of each figure."""
    made = Table(title="Fault campaign of access-av-node: median / maximum, seconds")
    for column in ("fault", "runs", "reported", "ok beyond level", "recovery", "localized above"):
        made.add_column(column, justify="left" if column == "fault" else "right")
    made.add_column("violations")
    for name in dict.fromkeys(it.fault for it in verdicts):
        own = [it for it in verdicts if it.fault == name]
        failed = [it for it in own if it.violations]
        kinds = list(dict.fromkeys(text for it in failed for text in it.violations))
        text = f"{len(failed)}: " + "; ".join(kinds[:3]) if failed else "none"
        made.add_row(
            name,
            str(len(own)),
            _worst([it.report_s for it in own]),
            _worst([it.wrong_ok_s for it in own]),
            _worst([it.recovery_s for it in own]),
            _worst([it.localized_above_limit_s for it in own]),
            text,
            style="red" if failed else "",
        )
    return made


def markdown(verdicts: list[Verdict]) -> str:
    """Table for the documentation: maxima in seconds."""

    def largest(values: list[float | None]) -> str:
        known = [it for it in values if it is not None]
        return f"{max(known):.1f}" if known else "–"

    lines = [
        "| fault | runs | reported after | `ok` beyond level | recovery | runs with a violation |",
        "|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(it.fault for it in verdicts):
        own = [it for it in verdicts if it.fault == name]
        failed = [it for it in own if it.violations]
        kinds = list(dict.fromkeys(text for it in failed for text in it.violations))
        cells = (
            name,
            str(len(own)),
            largest([it.report_s for it in own]),
            largest([it.wrong_ok_s for it in own]),
            largest([it.recovery_s for it in own]),
            f"{len(failed)}: {kinds[0]}" if failed else "0",
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main(arguments: list[str]) -> int:
    """Exit code 1 if a bound is exceeded."""
    options = argparse.ArgumentParser(prog="python -m attack node", description=__doc__)
    options.add_argument("--seed", type=int, default=1, help="seed of the runs [1]")
    options.add_argument("--repetitions", type=int, default=10, help="runs of each fault [10]")
    options.add_argument(
        "--at-once", type=int, default=4, help="number of nodes that run at once [4]"
    )
    options.add_argument(
        "--first",
        action="store_true",
        help="real-time priority for node and transmitter (needs root)",
    )
    options.add_argument("--only", metavar="TEXT", help="run only faults whose name contains TEXT")
    options.add_argument("--out", type=Path, help="JSON file to write with all verdicts")
    options.add_argument(
        "--markdown", type=Path, help="Markdown file to write with the table of the documentation"
    )
    options.add_argument(
        "--keep", type=Path, help="folder for the files of each run [default: they are removed]"
    )
    chosen = options.parse_args(arguments)
    faults = [it for it in FAULTS if chosen.only is None or chosen.only in it.name]
    if not faults:
        options.error(f"--only {chosen.only}: no fault has this text in its name")
    if chosen.first:
        os.nice(FIRST_NICE)
    skipped = [] if has_small_disk() else [it for it in faults if "disk" in it.outputs]
    for fault in skipped:
        print(f"not run: {fault.name}: no tmpfs can be mounted (unshare -rm)")
    faults = [it for it in faults if it not in skipped]
    with tempfile.TemporaryDirectory() as scratch:
        folder = chosen.keep or Path(scratch)
        began_s = time.monotonic()
        verdicts = run_all(faults, chosen.seed, chosen.repetitions, chosen.at_once, folder)
        took_s = time.monotonic() - began_s
    Console(width=None if sys.stdout.isatty() else 180).print(table(verdicts))
    print(f"{len(verdicts)} runs of {len(faults)} faults in {took_s:.0f} s")
    if chosen.out:
        made = {"seed": chosen.seed, "runs": [it.to_json() for it in verdicts]}
        chosen.out.write_text(json.dumps(made, indent=1), encoding="utf-8")
    if chosen.markdown:
        chosen.markdown.write_text(markdown(verdicts), encoding="utf-8")
    return 1 if any(it.violations for it in verdicts) else 0
