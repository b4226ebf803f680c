"""Resources of a node during a simulated drive: processor time, memory, latencies.

    python examples/live/measure.py [--node PROGRAM] [--duration-s 60] [--every-ssb]
        [--stream-off | --radio | --times 8 [--speed 0.25]] [--core 1] [--first] [--tabs 2]

Sources of samples:

- ZeroMQ, by default;
- `--stream-off`: a recording played in real time (61 MB a second on disk). Parts that the node does
  not need are not read, as if the radio was off;
- `--radio`: a SoapySDR module that plays the recording, for a node built with the feature `soapy`;
- `--times N`: one TCP stream of integers at N × 3.84 Msps.

The program prints the processor time of the node as a share of one core, per second of the drive:
overall, while tracking, and for each thread. It also prints the memory and the latency from the
arrival of an SSB's last sample to the pose that uses its angle.

Measure on an otherwise idle computer. `--first` gives transmitter and node real-time priority
(SCHED_FIFO, requires root). A `--speed` below 1 suits a computer that is too slow for real time.
`--tabs N` opens the page in N browser connections.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path
from typing import Any

from live import ROOT, recorded
from transmitter import (
    Drive,
    RawTransmitter,
    Transmitter,
    Wheels,
    node_toml,
    odometry_of,
    settings_of,
    stream_toml,
)

import access_av
from radio import Radio

# Time at which the SSBs and the pose are found (s).
TRACKS_S = 8.0
ANY_PORT = "127.0.0.1:0"


def resident_mib(process: int) -> float:
    """Returns the resident memory of a process (MiB)."""
    pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def busy_s(process: int) -> dict[str, float]:
    """Returns the processor time (s) of each thread of a process, by thread name."""
    used: dict[str, float] = {}
    for thread in Path(f"/proc/{process}/task").iterdir():
        stat = (thread / "stat").read_text(encoding="ascii")
        name = stat[stat.index("(") + 1 : stat.rindex(")")]
        fields = stat.rpartition(")")[2].split()
        took_s = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        used[name] = used.get(name, 0.0) + took_s
    return used


class Node:
    """A running node and its page."""

    def __init__(
        self,
        program: str,
        arguments: list[str],
        core: int | None = None,
        stdin: int | None = None,
    ) -> None:
        pinned = [] if core is None else ["taskset", "-c", str(core)]
        self.process = subprocess.Popen(
            [*pinned, program, *arguments], stdin=stdin, stderr=subprocess.PIPE, text=True
        )
        assert self.process.stderr is not None
        found = re.search(r"http://\S+", self.process.stderr.readline())
        assert found, self.process.stderr.read()
        self.page = found.group()

    def look(self) -> None:
        """Reads the page's events until the node ends."""
        with contextlib.suppress(OSError), urllib.request.urlopen(f"{self.page}events") as events:
            for _ in events:
                pass

    def state(self) -> dict[str, Any]:
        """Returns the state of the node."""
        with urllib.request.urlopen(f"{self.page}state.json") as answer:
            return dict(json.load(answer))

    def end(self) -> None:
        """Stops the node."""
        self.process.terminate()
        self.process.communicate()


def main() -> None:
    """Measures one drive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--node", default=str(ROOT / "target/release/access-av-node"))
    parser.add_argument("--duration-s", type=float, default=60.0)
    parser.add_argument("--every-ssb", action="store_true")
    parser.add_argument("--interval-s", type=float, help="time between two received bursts")
    parser.add_argument("--stream-off", action="store_true")
    parser.add_argument("--radio", action="store_true")
    parser.add_argument("--times", type=int)
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--core", type=int)
    parser.add_argument("--tabs", type=int, default=0)
    parser.add_argument("--first", action="store_true")
    arguments = parser.parse_args()
    if arguments.first:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    folder = ROOT / f"results/live/{arguments.duration_s:g}s"
    with tempfile.TemporaryDirectory() as scratch:
        settings = Path(scratch) / "node.toml"
        sender: Transmitter | RawTransmitter | Wheels | Radio
        if arguments.stream_off or arguments.radio:
            whole = folder.with_name(folder.name + "-whole")
            folder = recorded(whole, arguments.duration_s, continuous=True)
        if arguments.radio:
            sender = Radio(folder, Path(scratch))
            text = settings_of(sender.samples, sender.odometry, ANY_PORT)
            settings.write_text(text, encoding="utf-8")
            send = sender.run
        elif arguments.stream_off:
            sender = Wheels(odometry_of(folder))
            samples = f'source = "sigmf"\nrecording = "{folder}/iq"\n'
            settings.write_text(settings_of(samples, sender.address, ANY_PORT), encoding="utf-8")
            send = sender.run
        elif arguments.times:
            drive = Drive(recorded(folder, arguments.duration_s))
            sender = RawTransmitter(drive, arguments.times)
            samples = f'source = "raw"\nformat = "ci16_le"\naddress = "{sender.address}"\n'
            samples += stream_toml(drive, arguments.times)
            text = settings_of(samples, sender.wheels.address, ANY_PORT)
            settings.write_text(text, encoding="utf-8")
            send = sender.run
        else:
            sender = Transmitter(Drive(recorded(folder, arguments.duration_s)))
            settings.write_text(node_toml(sender, ANY_PORT), encoding="utf-8")
            send = sender.run
        vehicle = access_av.Vehicle.load(str(folder / "vehicle.toml"))
        interval_s = 0.02 if arguments.every_ssb else arguments.interval_s
        if interval_s:
            fixed = {"wake_up.policy": "fixed", "wake_up.interval_ms": 1e3 * interval_s}
            vehicle = vehicle.with_overrides(fixed)
        nominal = Path(scratch) / "vehicle.toml"
        nominal.write_text(vehicle.to_toml(), encoding="utf-8")
        site = str(folder / "site.toml")
        options = ["--site", site, "--vehicle", str(nominal), str(settings)]
        node = Node(arguments.node, options, arguments.core)
        process = node.process.pid
        in_time = arguments.stream_off or arguments.radio
        for _ in range(arguments.tabs):
            threading.Thread(target=node.look, daemon=True).start()
        speed = {} if in_time else {"speed": arguments.speed}
        sending = threading.Thread(target=send, kwargs=speed)
        began = time.monotonic()
        sending.start()
        memory_mib, tracking, used = [], None, {}
        while sending.is_alive():
            sending.join(1.0)
            memory_mib.append(resident_mib(process))
            # The processor time of a thread that has ended is not available.
            used |= busy_s(process)
            if tracking is None and time.monotonic() - began >= TRACKS_S / arguments.speed:
                tracking = (time.monotonic(), used.copy())
        ended, state = time.monotonic(), node.state()
        used |= busy_s(process)
        node.end()
        sender.close()
        on_s = [ended - began for began, ended in sender.on()] if isinstance(sender, Radio) else []
    drive_s = arguments.speed * (ended - began)
    load = os.getloadavg()[0]
    print(f"{drive_s:.0f} s of the drive in {ended - began:.0f} s, at a load of {load:.1f}")
    print(f"processor: {100 * sum(used.values()) / drive_s:.1f} % of a core")
    if tracking is not None:
        since_s = arguments.speed * (ended - tracking[0])
        shares = {name: 100 * (used[name] - tracking[1].get(name, 0.0)) / since_s for name in used}
        parts = ", ".join(f"{name} {share:.1f} %" for name, share in shares.items())
        print(f"from {TRACKS_S:g} s on: {sum(shares.values()):.1f} % ({parts})")
    half = memory_mib[len(memory_mib) // 2 :]
    at = f"{half[0]:.0f} at half, {half[-1]:.0f} at the end"
    print(f"memory: {max(memory_mib):.0f} MiB at most, {at}")
    if on_s:
        print(f"radio on: {100 * sum(on_s) / drive_s:.1f} % of the time, {len(on_s)} times")
    print(
        f"samples received: {100 * state['duty']:.1f} %, angles: {state['energy']['aoa_estimates']}"
    )
    print(f"state: {state['pose']['state']}, {state['pose']['tracked']} SSBs tracked")
    print(f"SSBs found by a search: {state['found_by_search']}, all others where expected")
    print(f"dropped: {state['dropped']}")
    for name, figures in state["latency"].items():
        print(f"{name}: {figures}")


if __name__ == "__main__":
    main()
