"""Time and memory of the whole evaluation, and how time grows with the number of runs."""

from __future__ import annotations

import os
import resource
import time

from rich.console import Console
from rich.table import Table

from access_av import evaluate, simulate


def main() -> None:
    console = Console()
    table = Table("runs", "seconds", "ms per run", title="Adaptive MUSIC, paper's scenario")
    for runs in (25, 50, 100, 200, 400):
        seconds = min(_timed(runs) for _ in range(3))
        table.add_row(str(runs), f"{seconds:.3f}", f"{1e3 * seconds / runs:.2f}")
    console.print(table)

    evaluation = evaluate(runs=100, seed=1)
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    console.print(
        f"Whole evaluation, 100 runs, {os.cpu_count()} cores: {evaluation.duration_s:.1f} s, "
        f"peak memory {peak_mib:.0f} MiB"
    )


def _timed(runs: int) -> float:
    started = time.perf_counter()
    simulate("paper", runs=runs, seed=1)
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
