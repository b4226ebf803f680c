"""A day of driving at maximum speed: tests for memory leaks and consistent counters.

    python examples/live/day.py [--node PROGRAM] [--hours 24] [--nodes 2] [--faults]

A drive of the scenario `yard` is repeated as newline JSON on standard input, with angles and
odometry. Each repetition starts without a pose. With `--faults`, one drive per hour has a fault
(`day_faults.py`). The program prints the memory over the hours, the numbers of received, rejected
and dropped messages, and the size of the MCAP files. Each MCAP file is read and must be complete.
A node uses one core: `--nodes` divides the hours between several nodes that run at once.
"""

from __future__ import annotations

import argparse
import csv
import math
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from day_faults import FAULTS, line_of, with_fault
from live import ROOT, SCENARIO
from mcap.reader import make_reader
from measure import Node, resident_mib
from transmitter import odometry_of

from access_av.drives.recorded import log_angles

if TYPE_CHECKING:
    from collections.abc import Iterator


def messages_of(folder: Path) -> list[dict[str, Any]]:
    """Returns the angle and odometry messages of a drive, in order of time."""
    messages: list[dict[str, Any]] = [{"type": "odometry", **it} for it in odometry_of(folder)]
    with (folder / "angles.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            angle: dict[str, Any] = {"type": "angle", "pci": int(row["pci"])}
            angle["ssb_index"] = int(row["ssb_index"])
            angle["resolved"] = row["resolved"] == "1"
            for key in ("time_s", "phase_rad", "phase_sigma_rad", "snr_db"):
                angle[key] = float(row[key])
            messages.append(angle)
    messages.sort(key=lambda it: float(it["time_s"]))
    return messages


class Text(NamedTuple):
    """Text of a drive, its number of messages, and the number that must be rejected."""

    text: str
    messages: int
    rejected: int


def hours_of(lap: list[dict[str, Any]], hours: float, first_fault: int | None) -> Iterator[Text]:
    """Yields the repetitions of a drive for the given hours; faults begin with this number."""
    begins_s, faults = 0.0, 0
    while begins_s < 3600.0 * hours:
        sent, invalid, rejected = list[dict[str, Any] | str](lap), 0, 0
        if first_fault is not None and begins_s >= 3600.0 * faults:
            fault = FAULTS[(first_fault + faults) % len(FAULTS)]
            sent, invalid, rejected = with_fault(lap, fault), fault.invalid, fault.rejected
            faults += 1
        # The search for a pose requires odometry of a driven distance.
        lines = ['{"type":"reset"}\n', *(line_of(it, begins_s) for it in sent)]
        yield Text("".join(lines), len(lines) - invalid, rejected)
        begins_s += lap[-1]["time_s"] + 0.02


class Day(NamedTuple):
    """Hours of one node: report, and whether counters and files are consistent."""

    report: str
    is_consistent: bool


def run_node(
    program: str,
    folder: Path,
    lap: list[dict[str, Any]],
    number: int,
    hours: float,
    first_fault: int | None,
) -> Day:
    """Runs the hours of one node. `folder` contains site and vehicle."""
    files, settings = folder / f"mcap{number}", folder / f"node{number}.toml"
    settings.write_text(
        'name = "day"\npace = "fast"\nmessages = ["-"]\n'
        f'[output.mcap]\nfolder = "{files}"\n[page]\nlisten = "127.0.0.1:0"\n',
        encoding="utf-8",
    )
    nominal = ["--site", str(folder / "site.toml"), "--vehicle", str(folder / "vehicle.toml")]
    node = Node(program, [*nominal, str(settings)], stdin=subprocess.PIPE)
    assert node.process.stdin is not None
    sent, rejected, memory_mib, began = 0, 0, [], time.monotonic()
    for drive in hours_of(lap, hours, first_fault):
        node.process.stdin.write(drive.text)
        sent += drive.messages
        rejected += drive.rejected
        memory_mib.append(resident_mib(node.process.pid))
    node.process.stdin.flush()
    while (status := node.state())["sources"][0]["items"] < sent:
        time.sleep(0.2)
    time.sleep(1.0)
    status = node.state()
    memory_mib.append(resident_mib(node.process.pid))
    node.process.stdin.close()
    node.process.wait()
    drive_s, took_s = status["now_s"], time.monotonic() - began
    size, read = 0, {}
    for file in sorted(files.iterdir()):
        size += file.stat().st_size
        with file.open("rb") as stream:
            for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages():
                read[channel.topic] = read.get(channel.topic, 0) + 1
    quarter = max(1, len(memory_mib) // 4)
    source, dropped = status["sources"][0], status["dropped"]
    report = "\n".join(
        (
            f"{drive_s / 3600:.2f} h of driving, {len(memory_mib) - 1} drives, in {took_s:.0f} s",
            f"messages: {sent} sent, {source['items']} taken, {dropped} dropped",
            f"rejected: {source['defects']}, expected: {rejected}",
            f"memory: {memory_mib[quarter - 1]:.1f} MiB after a quarter, {memory_mib[-1]:.1f} at "
            f"the end, {max(memory_mib):.1f} at most",
            f"MCAP: {len(list(files.iterdir()))} files, {size / 1e6:.1f} MB, "
            f"{size / drive_s * 0.0864:.0f} MB a day",
            f"read of them: {read}",
        )
    )
    lost = sum(dropped.values()) + sent - source["items"]
    # One status message per second of the drive.
    whole = abs(read["/diagnostics"] - drive_s) <= 2 + 2 * len(memory_mib)
    return Day(report, lost == 0 and whole and source["defects"] == rejected)


def main() -> int:
    """Runs the day of driving."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--node", default=str(ROOT / "target/release/access-av-node"))
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--nodes", type=int, default=1, help="nodes at once [1]")
    parser.add_argument("--faults", action="store_true", help="one drive per hour has a fault")
    arguments = parser.parse_args()
    if not Path(arguments.node).is_file():
        command = "cargo build --release --bin access-av-node"
        parser.error(f"--node: {arguments.node} does not exist; build it with `{command}`")
    hours = arguments.hours / arguments.nodes
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(arguments.nodes) as pool:
        folder = Path(scratch)
        log_angles(SCENARIO, folder)
        lap = messages_of(folder)
        days = [
            pool.submit(
                run_node,
                arguments.node,
                folder,
                lap,
                number,
                hours,
                math.ceil(number * hours) if arguments.faults else None,
            )
            for number in range(arguments.nodes)
        ]
        results = [it.result() for it in days]
    print("\n\n".join(it.report for it in results))
    return 0 if all(it.is_consistent for it in results) else 1


if __name__ == "__main__":
    sys.exit(main())
