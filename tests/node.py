"""The node that tests run, its drives, and its MQTT broker."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from amqtt.client import MQTTClient
from attack.node.node import free_port

import access_av
from conftest import ROOT

SCHEMAS = Path(os.environ.get("ACCESS_AV_DATA", ROOT / "../shared/data")) / "vda5050"
NODE = Path(os.environ.get("ACCESS_AV_NODE", ROOT / "target/debug/access-av-node"))


def command(drive: Path, settings: Path, *options: str) -> list[str]:
    """Returns the node's command for a drive that `access-av record synth` wrote."""
    nominal = ["--site", str(drive / "site.toml"), "--vehicle", str(drive / "vehicle.toml")]
    return [str(NODE), *nominal, *options, str(settings)]


def wake_up_every(drive: Path, interval_s: float) -> None:
    """Sets a fixed wake-up interval of the drive's vehicle."""
    file = drive / "vehicle.toml"
    fixed = {"wake_up.policy": "fixed", "wake_up.interval_ms": 1e3 * interval_s}
    vehicle = access_av.Vehicle.load(str(file)).with_overrides(fixed)
    file.write_text(vehicle.to_toml(), encoding="utf-8")


class Broker:
    """An MQTT broker, and the messages to its topic `fleet/position`."""

    def __init__(self, port: int | None = None) -> None:
        self.port = free_port() if port is None else port
        self.process = subprocess.Popen(
            [sys.executable, str(ROOT / "tests/mqtt_broker.py"), str(self.port), "fleet/position"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline().strip() == "ready"

    def received(self) -> list[dict[str, Any]]:
        """Stops the broker and returns the received messages."""
        self.process.terminate()
        received, _ = self.process.communicate(timeout=10.0)
        return [json.loads(line) for line in received.splitlines() if line.startswith("{")]

    def kill(self) -> None:
        """Ends the broker without notice to its clients."""
        self.process.kill()
        self.process.communicate(timeout=10.0)

    def retained(self) -> dict[str, Any] | None:
        """Returns the message that a new subscriber receives at once."""

        async def subscribe() -> dict[str, Any] | None:
            client = MQTTClient()
            await client.connect(f"mqtt://127.0.0.1:{self.port}/")
            await client.subscribe([("fleet/position", 0)])
            try:
                message = await client.deliver_message(timeout_duration=2.0)
            except TimeoutError:
                return None
            finally:
                await client.disconnect()
            data = None if message is None else message.data
            return None if data is None else json.loads(bytes(data))

        return asyncio.run(subscribe())
