"""Live demonstration: a simulated yard drives in real time into `access-av-node` by ZeroMQ.

    python examples/live/live.py [--node PROGRAM] [--duration-s 60] [--no-browser]

The page of the node opens in a browser. The drive is recorded once, in `results/live/`, and
repeated until Ctrl-C.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import webbrowser
from pathlib import Path

from transmitter import Drive, Transmitter, node_toml

import access_av

ROOT = Path(__file__).parents[2]
SCENARIO = "yard"
# Duration of the drive at 15 km/h (s); the vehicle is slower in a longer drive.
LASTS_S = 420.0
PORTS = {"port": 2000, "odometry_port": 2100}
PAGE = "127.0.0.1:8400"


def recorded(folder: Path, duration_s: float, *, continuous: bool = False) -> Path:
    """Returns the folder of the drive, and records it if absent: all samples, or only the SSBs."""
    if not (folder / "iq.sigmf-meta").exists():
        print(f"recording {duration_s:g} s of the scenario `{SCENARIO}` in {folder} …", flush=True)
        slower = {"vehicle.top_speed_kmh": 15.0 * min(LASTS_S / duration_s, 1.0) ** 1.5}
        scenario = access_av.Scenario.load(SCENARIO).with_overrides(slower)
        access_av.synthesize(scenario, folder, duration_s=duration_s, continuous=continuous)
    return folder


def main() -> int:
    """Repeats the drive until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--node", default=str(ROOT / "target/release/access-av-node"))
    parser.add_argument("--duration-s", type=float, default=60.0)
    parser.add_argument("--no-browser", action="store_true")
    parser.add_argument("--once", action="store_true")
    arguments = parser.parse_args()
    folder = ROOT / f"results/live/{arguments.duration_s:g}s"
    drive = Drive(recorded(folder, arguments.duration_s))
    site, vehicle = folder / "site.toml", folder / "vehicle.toml"
    with tempfile.TemporaryDirectory() as scratch:
        transmitter = Transmitter(drive, **PORTS)
        settings = Path(scratch) / "node.toml"
        settings.write_text(node_toml(transmitter, PAGE), encoding="utf-8")
        command = [arguments.node, "--site", str(site), "--vehicle", str(vehicle), str(settings)]
        node = subprocess.Popen(command)
        try:
            if not arguments.no_browser:
                webbrowser.open(f"http://{PAGE}/")
            while node.poll() is None:
                transmitter.run()
                transmitter.close()
                if arguments.once:
                    break
                transmitter = Transmitter(drive, **PORTS)
        except KeyboardInterrupt:
            pass
        finally:
            transmitter.close()
            node.terminate()
            node.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
