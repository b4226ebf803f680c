"""What a node takes while a simulated drive comes through sockets: processor, memory, latencies.

    python examples/live/measure.py [--node PROGRAM] [--duration-s 60] [--every-ssb]

Prints the share of one core by the node's own processor time, per second of the drive, its memory,
and from the arrival of an SSB's last sample to the pose with its angle. Measure on a computer that
does nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

from live import ROOT, recorded
from transmitter import Transmitter, node_toml

import access_av

PAGE = "127.0.0.1:8401"


def resident_mib(process: int) -> float:
    """Memory of a process."""
    pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def busy_s(process: int) -> float:
    """Processor time of a process."""
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def state() -> dict[str, object]:
    """How the node stands."""
    with urllib.request.urlopen(f"http://{PAGE}/state.json") as answer:
        return dict(json.load(answer))


def main() -> None:
    """Measures one drive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--node", default=str(ROOT / "target/release/access-av-node"))
    parser.add_argument("--duration-s", type=float, default=60.0)
    parser.add_argument("--every-ssb", action="store_true")
    arguments = parser.parse_args()
    folder = ROOT / f"results/live/{arguments.duration_s:g}s"
    drive = recorded(folder, arguments.duration_s)
    vehicle = access_av.Vehicle.load(str(folder / "vehicle.toml"))
    if arguments.every_ssb:
        every = {"wake_up.policy": "fixed", "wake_up.interval_ms": 20.0}
        vehicle = vehicle.with_overrides(every)
    transmitter = Transmitter(drive)
    with tempfile.TemporaryDirectory() as scratch:
        settings = Path(scratch) / "node.toml"
        settings.write_text(node_toml(transmitter, PAGE), encoding="utf-8")
        believed = Path(scratch) / "vehicle.toml"
        believed.write_text(vehicle.to_toml(), encoding="utf-8")
        site = str(folder / "site.toml")
        command = [arguments.node, "--site", site, "--vehicle", str(believed), str(settings)]
        node = subprocess.Popen(command)
        began = time.monotonic()
        sending = threading.Thread(target=transmitter.run)
        sending.start()
        memory_mib = []
        while sending.is_alive():
            sending.join(1.0)
            memory_mib.append(resident_mib(node.pid))
        took_s = time.monotonic() - began
        used_s = busy_s(node.pid)
        told = state()
        node.terminate()
        node.wait()
        transmitter.close()
    drive_s = drive.length / drive.rate_hz
    half = memory_mib[len(memory_mib) // 2 :]
    print(f"{drive_s:.0f} s of the drive in {took_s:.0f} s")
    print(f"processor: {100 * used_s / drive_s:.1f} % of a core")
    at = f"{half[0]:.0f} at half, {half[-1]:.0f} at the end"
    print(f"memory: {max(memory_mib):.0f} MiB at most, {at}")
    print(f"samples looked at: {100 * told['duty']:.1f} %")
    print(f"dropped: {told['dropped']}")
    for name, figures in told["latency"].items():
        print(f"{name}: {figures}")


if __name__ == "__main__":
    main()
