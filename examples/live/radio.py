"""Simulated radio for SoapySDR (`replay_radio.cpp`), with the odometry of the same drive."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

from transmitter import Wheels, odometry_of

OPENED_WITHIN_S = 10.0
SOURCE = Path(__file__).with_name("replay_radio.cpp")


class Radio:
    """Plays a drive of `access-av record synth --continuous` to a program that uses SoapySDR."""

    def __init__(self, recording: Path, scratch: Path) -> None:
        module = scratch / "libreplay.so"
        compiler = os.environ.get("CXX", "c++")
        options = ["-O2", "-shared", "-fPIC", "-o", str(module), str(SOURCE), "-lSoapySDR"]
        subprocess.run([compiler, *options], check=True)
        os.environ["SOAPY_SDR_PLUGIN_PATH"] = str(scratch)
        self.log = scratch / "radio.log"
        self.device = (
            f"driver=replay,path={recording / 'iq.sigmf-data'},log={self.log},"
            "rate=3840000,channels=4"
        )
        self.wheels = Wheels(odometry_of(recording))
        self.odometry = self.wheels.address

    @property
    def samples(self) -> str:
        """`[samples]` settings of node.toml."""
        return f"""
source = "soapy"
device = "{self.device}"
[samples.stream]
rate_msps = 3.84
centre_mhz = 3500.0
antennas = [0, 1, 2, 3]
"""

    def run(self) -> None:
        """Sends the odometry synchronously with the radio, by this computer's clock."""
        until = time.monotonic() + OPENED_WITHIN_S
        while not (self.log.exists() and self.log.read_text(encoding="ascii").endswith("\n")):
            if time.monotonic() > until:
                raise TimeoutError(f"no program has opened {self.device}")
            time.sleep(0.01)
        zero_s = float(self.log.read_text(encoding="ascii").splitlines()[0])
        wheels = self.wheels
        wheels.odometry = [{**it, "time_s": zero_s + it["time_s"]} for it in wheels.odometry]
        wheels.run(began_s=0.0)

    def on(self) -> list[tuple[float, float]]:
        """Intervals in which the radio was on (s since it was opened)."""
        rows = [line.split() for line in self.log.read_text(encoding="ascii").splitlines()[1:]]
        return [(float(began), float(ended)) for began, ended in rows]

    def stop(self) -> None:
        """Ends `run`, from another thread."""
        self.wheels.stop()

    def close(self) -> None:
        """Closes the socket."""
        self.wheels.close()
