"""A day of driving at maximum speed: tests for memory leaks and consistent counters.

    python examples/live/day.py [--node PROGRAM] [--hours 24]

A drive of the scenario `yard` is repeated as newline JSON on standard input, with angles and
odometry. Each repetition starts without a pose. The program prints the memory over the hours, the
numbers of received and dropped messages, and the size of the MCAP files. Each MCAP file is read and
must be complete.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from live import ROOT, SCENARIO
from mcap.reader import make_reader
from measure import Node, resident_mib
from transmitter import odometry_of

from access_av.drives.recorded import log_angles

if TYPE_CHECKING:
    from collections.abc import Iterator


def messages_of(folder: Path) -> list[tuple[float, str]]:
    """Angles and odometry in order of time: the time, and the rest of the line."""
    told: list[tuple[float, dict[str, Any]]] = []
    for odometry in odometry_of(folder):
        told.append((odometry.pop("time_s"), {"type": "odometry", **odometry}))
    with (folder / "angles.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            angle: dict[str, Any] = {"type": "angle", "pci": int(row["pci"])}
            angle["ssb_index"] = int(row["ssb_index"])
            angle["resolved"] = row["resolved"] == "1"
            for key in ("phase_rad", "phase_sigma_rad", "snr_db"):
                angle[key] = float(row[key])
            told.append((float(row["time_s"]), angle))
    told.sort(key=lambda it: it[0])
    return [(time_s, json.dumps(message)[1:]) for time_s, message in told]


def hours_of(lap: list[tuple[float, str]], hours: float) -> Iterator[tuple[str, int]]:
    """Yields the text and the number of messages of each repetition, for the given hours."""
    begins_s = 0.0
    while begins_s < 3600.0 * hours:
        lines = [f'{{"time_s":{begins_s + time_s:.9f},{rest}\n' for time_s, rest in lap]
        # The search for a pose requires odometry of a driven distance.
        lines.insert(0, '{"type":"reset"}\n')
        yield "".join(lines), len(lines)
        begins_s += lap[-1][0] + 0.02


def main() -> int:
    """Runs the day of driving."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--node", default=str(ROOT / "target/release/access-av-node"))
    parser.add_argument("--hours", type=float, default=24.0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder, files = Path(scratch), Path(scratch) / "mcap"
        log_angles(SCENARIO, folder)
        lap = messages_of(folder)
        settings = folder / "node.toml"
        settings.write_text(
            'name = "day"\npace = "fast"\nmessages = ["-"]\n'
            f'[output.mcap]\nfolder = "{files}"\n[page]\nlisten = "127.0.0.1:0"\n',
            encoding="utf-8",
        )
        nominal = ["--site", str(folder / "site.toml"), "--vehicle", str(folder / "vehicle.toml")]
        options = [*nominal, str(settings)]
        node = Node(arguments.node, options, stdin=subprocess.PIPE)
        assert node.process.stdin is not None
        sent, memory_mib, began = 0, [], time.monotonic()
        for text, count in hours_of(lap, arguments.hours):
            node.process.stdin.write(text)
            sent += count
            memory_mib.append(resident_mib(node.process.pid))
        node.process.stdin.flush()
        while (told := node.state())["sources"][0]["items"] < sent:
            time.sleep(0.2)
        time.sleep(1.0)
        told = node.state()
        memory_mib.append(resident_mib(node.process.pid))
        node.process.stdin.close()
        node.process.wait()
        drive_s, took_s = told["now_s"], time.monotonic() - began
        size, read = 0, {}
        for file in sorted(files.iterdir()):
            size += file.stat().st_size
            with file.open("rb") as stream:
                for _, channel, _ in make_reader(stream, validate_crcs=True).iter_messages():
                    read[channel.topic] = read.get(channel.topic, 0) + 1
        number = len(list(files.iterdir()))
    quarter = max(1, len(memory_mib) // 4)
    print(f"{drive_s / 3600:.2f} h of driving, {len(memory_mib) - 1} drives, in {took_s:.0f} s")
    print(f"messages: {sent} sent, {told['sources'][0]['items']} taken, {told['dropped']} dropped")
    print(
        f"memory: {memory_mib[quarter - 1]:.1f} MiB after a quarter, {memory_mib[-1]:.1f} at the "
        f"end, {max(memory_mib):.1f} at most"
    )
    print(f"MCAP: {number} files, {size / 1e6:.1f} MB, {size / drive_s * 0.0864:.0f} MB a day")
    print(f"read of them: {read}")
    lost = sum(told["dropped"].values()) + sent - told["sources"][0]["items"]
    # One status message per second of the drive.
    whole = abs(read["/diagnostics"] - drive_s) <= 2 + 2 * len(memory_mib)
    return 0 if lost == 0 and whole else 1


if __name__ == "__main__":
    sys.exit(main())
