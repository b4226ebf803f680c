"""``python -m attack``: runs many cases, counts the findings, and keeps the cases that fail."""

from __future__ import annotations

import argparse
import json
import os
import queue
import secrets
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from attack import kinds

LONGEST_S = 20.0
# Maximum start time of a worker (s): it prepares the files that all cases share.
STARTING_S = 300.0


class Worker:
    """A worker process; it is replaced if it ends."""

    def __init__(self, seed: int, place: Path):
        self.command = [sys.executable, "-m", "attack.worker", str(seed), str(place)]
        self.process: subprocess.Popen[bytes] | None = None

    def ask(self, kind: str, number: int) -> dict[str, object]:
        """Returns the findings of a case, including an abort or a hang of the worker."""
        process = self.process or self._start()
        assert process.stdin is not None
        process.stdin.write(f"{kind} {number}\n".encode())
        process.stdin.flush()
        # The time limit is proportional to the load of the computer.
        busy = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
        line = self._line(process, LONGEST_S * busy)
        if line:
            return dict(json.loads(line))
        try:  # a process closes its output shortly before it ends
            what = f"abort: the process ended with {process.wait(1.0)}"
        except subprocess.TimeoutExpired:
            what = f"hang: more than {LONGEST_S:.0f} s"
        self.stop()
        self.process = None
        return {"findings": [what], "ok": 0, "beyond": 0}

    def _start(self) -> subprocess.Popen[bytes]:
        environment = {**os.environ, "POLARS_MAX_THREADS": "1", "RUST_BACKTRACE": "0"}
        self.process = subprocess.Popen(
            self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
        )
        if not self._line(self.process, STARTING_S):
            raise RuntimeError("a worker does not start")
        return self.process

    @staticmethod
    def _line(process: subprocess.Popen[bytes], timeout_s: float) -> bytes:
        assert process.stdout is not None
        ready, _, _ = select.select([process.stdout], [], [], timeout_s)
        return process.stdout.readline() if ready else b""

    def stop(self) -> None:
        """Ends the process."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()


def attack(
    seed: int, cases: list[tuple[str, int]], workers: int, kept: Path
) -> tuple[Counter[str], int, int]:
    """Counts kinds of findings, ``ok`` epochs, and ``ok`` epochs above their protection level."""
    waiting: queue.SimpleQueue[tuple[str, int]] = queue.SimpleQueue()
    for case in cases:
        waiting.put(case)
    counts: Counter[str] = Counter()
    epochs = [0, 0]
    place = Path(tempfile.mkdtemp(prefix="attack-"))

    def work() -> None:
        worker = Worker(seed, place)
        try:
            while True:
                kind, number = waiting.get_nowait()
                found = worker.ask(kind, number)
                epochs[0] += found["ok"]  # type: ignore[operator]
                epochs[1] += found["beyond"]  # type: ignore[operator]
                folder = place / f"{kind}-{number}"
                for finding in found["findings"]:  # type: ignore[attr-defined]
                    counts[finding.split(":")[0]] += 1
                    print(f"  {folder.name}: {finding}", flush=True)
                if found["findings"]:
                    shutil.move(folder, kept / folder.name)
                else:
                    shutil.rmtree(folder, ignore_errors=True)
        except queue.Empty:
            pass
        finally:
            worker.stop()

    with ThreadPoolExecutor(workers) as pool:
        for done in [pool.submit(work) for _ in range(workers)]:
            done.result()  # raises the exception of the thread
    shutil.rmtree(place, ignore_errors=True)
    return counts, epochs[0], epochs[1]


def main() -> None:
    """Runs the campaign; exit code 1 if there are findings."""
    options = argparse.ArgumentParser(prog="python -m attack", description=__doc__)
    options.add_argument("--seed", type=int, help="seed of the attack [default: a new one]")
    options.add_argument("--inputs", type=int, default=20_000, help="number of random inputs")
    options.add_argument("--drives", type=int, default=2_000, help="number of random drives")
    options.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options.add_argument("--only", metavar="KIND-NUMBER", help="run only this case of the seed")
    options.add_argument(
        "--keep", type=Path, help="folder for failing cases [default: results/attack-SEED]"
    )
    chosen = options.parse_args()
    seed = secrets.randbits(32) if chosen.seed is None else chosen.seed
    print(f"seed {seed}", flush=True)
    cases = [*kinds.inputs(seed, chosen.inputs), *(("drive", n) for n in range(chosen.drives))]
    if chosen.only:
        kind, _, number = chosen.only.rpartition("-")
        cases = [(kind, int(number))]
    kept = (chosen.keep or Path("results") / f"attack-{seed}").resolve()
    kept.mkdir(parents=True, exist_ok=True)
    began_s = time.monotonic()
    counts, ok, beyond = attack(seed, cases, chosen.workers, kept)
    print(f"{len(cases)} cases in {time.monotonic() - began_s:.0f} s")
    if ok:
        print(f"{beyond} of {ok} epochs beyond their protection level while ok: {beyond / ok:.1e}")
    if counts:
        print(f"findings: {dict(counts)}")
        print(f"each in a folder of its own, to be run there by `sh command.sh`: {kept}")
        sys.exit(1)
    with suppress(OSError):  # the folder may contain cases of an earlier campaign
        kept.rmdir()
    print("no findings")


if __name__ == "__main__":
    if sys.argv[1:3] == ["node", "gaps"]:
        from attack.node import gaps

        sys.exit(gaps.main(sys.argv[3:]))
    if sys.argv[1:2] == ["node"]:
        from attack.node import campaign

        sys.exit(campaign.main(sys.argv[2:]))
    main()
