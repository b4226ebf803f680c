"""Faults of the messages in one drive, for `day.py --faults`."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

Message = dict[str, Any]
# Begin and duration of a fault in its drive (s).
BEGIN_S, LASTS_S = 60.0, 6.0


class Fault(NamedTuple):
    """Fault type. `change` gets a message and the first odometry message of the fault."""

    name: str
    change: Callable[[Message, Message], list[Message | str]]
    # Number of messages that the node must reject, and how many of them are no JSON object.
    rejected: int = 0
    invalid: int = 0


def _is_odometry(message: Message) -> bool:
    return bool(message["type"] == "odometry")


def _frozen(message: Message, first: Message) -> list[Message | str]:
    if not _is_odometry(message):
        return [message]
    return [{**message, "distance_m": first["distance_m"], "speed_mps": 0.0}]


def _frozen_distance(message: Message, first: Message) -> list[Message | str]:
    if not _is_odometry(message):
        return [message]
    return [{**message, "distance_m": first["distance_m"]}]


def _with_first(*added: Message | str) -> Callable[[Message, Message], list[Message | str]]:
    """Sends further messages after the first one: lines of text, or its copies with changes."""

    def change(message: Message, first: Message) -> list[Message | str]:
        if message is not first:
            return [message]
        return [message, *({**first, **it} if isinstance(it, dict) else it for it in added)]

    return change


FAULTS = (
    Fault("odometry frozen at zero", _frozen),
    Fault("odometry at 1e300 s", _with_first({"time_s": 1e300}), rejected=1),
    Fault("no JSON", _with_first("no JSON"), rejected=1, invalid=1),
    Fault("no angles", lambda it, _: [it] if _is_odometry(it) else []),
    Fault("no odometry", lambda it, _: [] if _is_odometry(it) else [it]),
    Fault("odometry repeated 10 times", _with_first(*[{}] * 10), rejected=10),
    Fault("distance frozen", _frozen_distance),
    Fault("odometry without a speed", _with_first({"speed_mps": None, "distance_m": None}), 1, 1),
)


def with_fault(lap: list[Message], fault: Fault) -> list[Message | str]:
    """Returns the messages of a drive with a fault."""
    sent: list[Message | str] = []
    first: Message | None = None
    for message in lap:
        if not BEGIN_S <= message["time_s"] < BEGIN_S + LASTS_S:
            sent.append(message)
            continue
        if first is None and _is_odometry(message):
            first = message
        sent += fault.change(message, first) if first else [message]
    return sent


def line_of(message: Message | str, begins_s: float) -> str:
    """Returns a message as a line of JSON; ``begins_s`` is the start time of the drive (s)."""
    if isinstance(message, str):
        return message + "\n"
    return json.dumps({**message, "time_s": round(begins_s + message["time_s"], 9)}) + "\n"
