"""An MQTT broker that prints what is published to a topic: `mqtt_broker.py PORT TOPIC`."""

from __future__ import annotations

import asyncio
import logging
import sys

from amqtt.broker import Broker
from amqtt.client import MQTTClient


async def main(port: int, topic: str) -> None:
    logging.disable(logging.CRITICAL)
    listeners = {"default": {"type": "tcp", "bind": f"127.0.0.1:{port}"}}
    plugins: dict[str, dict[str, str]] = {"amqtt.plugins.authentication.AnonymousAuthPlugin": {}}
    broker = Broker({"listeners": listeners, "plugins": plugins})
    await broker.start()
    client = MQTTClient()
    await client.connect(f"mqtt://127.0.0.1:{port}/")
    await client.subscribe([(topic, 0)])
    print("ready", flush=True)
    while True:
        message = await client.deliver_message()
        if message is not None and message.data is not None:
            print(bytes(message.data).decode(), flush=True)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), sys.argv[2]))
