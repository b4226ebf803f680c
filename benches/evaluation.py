"""Time and memory of the whole evaluation, and growth of the time with the number of runs."""

from __future__ import annotations

import os
import resource
import time

from rich.console import Console
from rich.table import Table

from access_av import simulate
from access_av.device.platform import Platform
from access_av.paper.interpretations import load_all
from access_av.paper.study import study


def main() -> None:
    console = Console()
    table = Table("runs", "seconds", "ms per run", title="Adaptive MUSIC, paper's scenario")
    for runs in (25, 50, 100, 200, 400):
        seconds = min(_timed(runs) for _ in range(3))
        table.add_row(str(runs), f"{seconds:.3f}", f"{1e3 * seconds / runs:.2f}")
    console.print(table)

    started = time.process_time()
    made = study(load_all(), Platform.load("jetson-agx-xavier"), runs=100, seed=1)
    computing_s = time.process_time() - started
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    console.print(
        f"Every reading, 100 runs, {os.cpu_count()} cores: {made.duration_s:.1f} s, of which "
        f"{computing_s / (os.cpu_count() or 1):.1f} s of computing on each; "
        f"peak memory {peak_mib:.0f} MiB"
    )


def _timed(runs: int) -> float:
    started = time.perf_counter()
    simulate("paper", runs=runs, seed=1)
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
