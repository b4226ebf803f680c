"""Instructions per estimate on aarch64: NEON and portable code, counted under emulation.

Four antennas, 20 snapshots, batches of 64. The emulator logs one line for each executed
instruction; the difference between two runs of different length counts only the batches. Requires
the tools of ``make test-aarch64``::

    make count-aarch64
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TARGET = "aarch64-unknown-linux-gnu"
ITEMS = 64
BATCHES = [
    f"{what}{kind}"
    for what in ("ml", "covariance", "music", "root-music", "esprit")
    for kind in ("", "-f32")
]


def build(cargo: str, *features: str) -> Path:
    """Builds the program that runs batches, with the given features."""
    target = Path("target") / ("count-" + "-".join(features or ("neon",)))
    command = [cargo, "build", "--quiet", "--release", "--target", TARGET, "--target-dir", target]
    command += ["-p", "aoa-array", "--example", "batches"]
    if features:
        command += ["--features", ",".join(features)]
    subprocess.run(command, check=True)
    return target / TARGET / "release/examples/batches"


def executed(program: Path, what: str, times: int) -> int:
    """Returns the number of executed instructions of a program for a number of batches."""
    command = ["qemu-aarch64", "-L", "/", "-singlestep", "-d", "exec,nochain", program, what, times]
    with subprocess.Popen([str(it) for it in command], stderr=subprocess.PIPE) as run:
        assert run.stderr is not None
        lines = sum(
            chunk.count(b"\nTrace") for chunk in iter(lambda: run.stderr.read(1 << 20), b"")
        )
    if run.returncode:
        raise SystemExit(f"{what}: the emulator ended with {run.returncode}")
    return lines


def per_item(program: Path, what: str) -> float:
    """Returns the number of instructions per estimate."""
    return (executed(program, what, 3) - executed(program, what, 1)) / (2 * ITEMS)


def main() -> None:
    """Counts and prints."""
    cargo = sys.argv[1] if len(sys.argv) > 1 else "cargo"
    neon, portable = build(cargo), build(cargo, "portable")
    print(f"{'':16}{'portable':>10}{'NEON':>10}{'ratio':>8}")
    for what in BATCHES:
        before, after = per_item(portable, what), per_item(neon, what)
        print(f"{what:16}{before:10.0f}{after:10.0f}{before / after:8.1f}")


if __name__ == "__main__":
    main()
