"""A message to the node, and lists of messages in order of sending."""

from __future__ import annotations

import json
from typing import Any, NamedTuple


class Message(NamedTuple):
    """Content and time of sending: drive time, in seconds since the start of the run."""

    send_s: float
    # A JSON object whose `time_s` is drive time, or bytes that are sent unchanged.
    content: dict[str, Any] | bytes
    # Factor of the time stamp: 1000 for milliseconds.
    time_scale: float = 1.0

    def is_of(self, kind: str) -> bool:
        """Whether this is a JSON message of a type."""
        return isinstance(self.content, dict) and self.content["type"] == kind

    def with_values(self, **values: object) -> Message:
        """Copy with changed values."""
        assert isinstance(self.content, dict)
        return Message(self.send_s, {**self.content, **values})

    def in_milliseconds(self) -> Message:
        """Returns a copy with the time stamp in milliseconds."""
        return self._replace(time_scale=1e3)

    def encode(self, epoch_s: float) -> bytes:
        """Bytes on the socket; drive time 0 is at `epoch_s` (Unix time in s)."""
        if isinstance(self.content, bytes):
            return self.content
        content = self.content
        time_s = content.get("time_s")
        if isinstance(time_s, float):
            content = {**content, "time_s": self.time_scale * (epoch_s + time_s)}
        return json.dumps(content).encode() + b"\n"


def merged(*lists: list[Message]) -> list[Message]:
    """All messages, in order of sending."""
    return sorted((it for one in lists for it in one), key=lambda it: it.send_s)
