"""Faults of the messages: each changes the list of messages that a run sends."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from attack.node import transmitter
from attack.node.environment import HEADS
from attack.node.message import Message

if TYPE_CHECKING:
    from collections.abc import Callable

    from attack.node.fault import Change, Context

# A radio head that is not part of the site: PCI, x, y, z (m).
STRANGER = (99, 10.0, -40.0, 6.0)
# A radio head that repeats the PCI of the second head of the site, 50 m away from it.
DUPLICATE = (HEADS[1][0], 75.0, -35.0, 6.0)
# Error of the angles of a disturbed head (rad).
ANGLE_ERROR_RAD = 0.5
# Interval of the difference quotient of the heading (s).
YAW_STEP_S = 0.02
# Delay of a second odometry source, and difference of its distance counter (s, m).
SECOND_SOURCE_S = 0.01
SECOND_COUNTER_M = 1000.0
# Bytes of an oversize message.
OVERSIZE = 1 << 20


def _odometry(messages: list[Message]) -> list[Message]:
    return [it for it in messages if it.is_of("odometry")]


def _value(message: Message, key: str) -> Any:
    assert isinstance(message.content, dict)
    return message.content[key]


def odometry_values(change: Callable[[dict[str, Any]], dict[str, Any]]) -> Change:
    """Changes the fields of all odometry messages of the window."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        return [
            Message(it.send_s, change(dict(it.content)))
            if isinstance(it.content, dict) and it.is_of("odometry") and it.send_s in context.window
            else it
            for it in messages
        ]

    return apply


def odometry_steps(speed: float | None, step: float | None) -> Change:
    """Multiplies speed and distance step of the window; `None` freezes the last speed.

    Distances after the window continue from the changed ones, as those of a counter do.
    """

    def apply(messages: list[Message], context: Context) -> list[Message]:
        changed: list[Message] = []
        lost_m, frozen = 0.0, None
        samples = _odometry(messages)
        steps = {
            after.send_s: _value(after, "distance_m") - _value(before, "distance_m")
            for before, after in pairwise(samples)
        }
        period_s = samples[1].send_s - samples[0].send_s
        for it in messages:
            if not it.is_of("odometry"):
                changed.append(it)
                continue
            speed_mps = _value(it, "speed_mps")
            if it.send_s in context.window:
                if frozen is None:
                    frozen = speed_mps
                true_m = steps.get(it.send_s, 0.0)
                speed_mps = frozen if speed is None else speed * speed_mps
                lost_m += (frozen * period_s if step is None else step * true_m) - true_m
            distance_m = _value(it, "distance_m") + lost_m
            changed.append(it.with_values(speed_mps=speed_mps, distance_m=distance_m))
        return changed

    return apply


def shifted_clock(step_s: float) -> Change:
    """Shifts the time stamps of the odometry."""
    return odometry_values(lambda it: {**it, "time_s": it["time_s"] + step_s})


def absent(kind: str | None) -> Change:
    """Removes all messages of a type, or of every type, from the window."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        return [
            it
            for it in messages
            if it.send_s not in context.window or not (kind is None or it.is_of(kind))
        ]

    return apply


def one(kind: str, **values: object) -> Change:
    """Adds one message at the begin of the window: the next of a type, with changed values.

    A value that is a function is applied to the original value.
    """

    def apply(messages: list[Message], context: Context) -> list[Message]:
        begin_s = context.window.begin_s
        original = next(it for it in messages if it.is_of(kind) and it.send_s >= begin_s)
        new = {
            key: value(_value(original, key)) if callable(value) else value
            for key, value in values.items()
        }
        return [*messages, original.with_values(**new)]

    return apply


def raw(content: bytes, period_s: float) -> Change:
    """Inserts the given bytes into the message stream periodically."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        begin_s, end_s = context.window
        count = max(1, int((end_s - begin_s) / period_s))
        return [*messages, *(Message(begin_s + k * period_s, content) for k in range(count))]

    return apply


def nan_fields(messages: list[Message], context: Context) -> list[Message]:
    """Writes NaN, null and an infinite number into the fields of odometry messages."""
    values = (float("nan"), None, float("inf"))
    changed = []
    for number, it in enumerate(messages):
        if it.is_of("odometry") and it.send_s in context.window and number % 2:
            it = it.with_values(speed_mps=values[number % 3])
        changed.append(it)
    return changed


def repeated(messages: list[Message], context: Context) -> list[Message]:
    """Repeats one odometry message five times a second, between the current ones."""
    begin_s, end_s = context.window
    original = next(it for it in messages if it.is_of("odometry") and it.send_s >= begin_s)
    count = int((end_s - begin_s) / 0.2)
    again = [Message(begin_s + 0.2 * k, original.content) for k in range(1, count)]
    return [*messages, *again]


def stuck(messages: list[Message], context: Context) -> list[Message]:
    """Replaces all odometry of the window by its first message."""
    begin_s = context.window.begin_s
    original = next(it for it in messages if it.is_of("odometry") and it.send_s >= begin_s)
    return [
        Message(it.send_s, original.content)
        if it.is_of("odometry") and it.send_s in context.window
        else it
        for it in messages
    ]


def milliseconds(messages: list[Message], context: Context) -> list[Message]:
    """Writes the times of the odometry in milliseconds."""
    return [
        it.in_milliseconds() if it.is_of("odometry") and it.send_s in context.window else it
        for it in messages
    ]


def extra_head(head: tuple[int, float, float, float], index: int) -> Change:
    """Adds the angles of one more radio head."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        made = transmitter.messages(
            context.motion, context.duration_s, context.random, (head,), index
        )
        return [*messages, *(it for it in made if it.send_s in context.window)]

    return apply


def biased_head(messages: list[Message], context: Context) -> list[Message]:
    """Adds a constant to the angles of the third head, as a reflection does."""
    return [
        it.with_values(phase_rad=_value(it, "phase_rad") + ANGLE_ERROR_RAD)
        if it.is_of("angle") and it.send_s in context.window and _value(it, "ssb_index") == 2
        else it
        for it in messages
    ]


def yaw_rate(change: Callable[[float], float]) -> Change:
    """Adds the true yaw rate to all odometry messages, and changes it within the window (rad/s)."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        changed = []
        for it in messages:
            if it.is_of("odometry"):
                time_s = _value(it, "time_s")
                before, after = (
                    context.motion.pose(time_s + step_s).heading_rad
                    for step_s in (-0.5 * YAW_STEP_S, 0.5 * YAW_STEP_S)
                )
                rate_radps = math.remainder(after - before, math.tau) / YAW_STEP_S
                if it.send_s in context.window:
                    rate_radps = change(rate_radps)
                it = it.with_values(yaw_rate_radps=rate_radps)
            changed.append(it)
        return changed

    return apply


def second_source(messages: list[Message], context: Context) -> list[Message]:
    """Adds a second odometry source with another distance counter, between the current messages."""
    return [
        *messages,
        *(
            Message(
                it.send_s + SECOND_SOURCE_S,
                {
                    **it.content,
                    "time_s": it.content["time_s"] + SECOND_SOURCE_S,
                    "distance_m": it.content["distance_m"] + SECOND_COUNTER_M,
                },
            )
            for it in messages
            if isinstance(it.content, dict) and it.is_of("odometry") and it.send_s in context.window
        ),
    ]


def stuck_angles(messages: list[Message], context: Context) -> list[Message]:
    """Repeats the first angle of each head in the window, with current time stamps."""
    held: dict[int, float] = {}
    changed = []
    for it in messages:
        if it.is_of("angle") and it.send_s in context.window:
            phase_rad = held.setdefault(_value(it, "pci"), _value(it, "phase_rad"))
            it = it.with_values(phase_rad=phase_rad)
        changed.append(it)
    return changed


def angle_values(change: Callable[[dict[str, Any]], dict[str, Any]], every: int = 1) -> Change:
    """Changes the fields of every `every`-th angle message of the window."""

    def apply(messages: list[Message], context: Context) -> list[Message]:
        changed, number = [], 0
        for it in messages:
            if isinstance(it.content, dict) and it.is_of("angle") and it.send_s in context.window:
                number += 1
                if number % every == 0:
                    it = Message(it.send_s, change(dict(it.content)))
            changed.append(it)
        return changed

    return apply


def heads_off(count: int) -> Change:
    """Removes the angles of the first `count` radio heads."""
    pcis = {head[0] for head in HEADS[:count]}

    def apply(messages: list[Message], context: Context) -> list[Message]:
        return [
            it
            for it in messages
            if not (it.is_of("angle") and it.send_s in context.window and _value(it, "pci") in pcis)
        ]

    return apply


def garbage(messages: list[Message], context: Context) -> list[Message]:
    """Adds 2 kB of random bytes, five times a second."""
    begin_s, end_s = context.window
    count = int((end_s - begin_s) / 0.2)
    blocks = [context.random.bytes(2048) + b"\n" for _ in range(count)]
    return [*messages, *(Message(begin_s + 0.2 * k, block) for k, block in enumerate(blocks))]


def truncated(messages: list[Message], context: Context) -> list[Message]:
    """Cuts every fifth message of the window in the middle; its line is completed by the next."""
    changed = []
    for number, it in enumerate(messages):
        if isinstance(it.content, dict) and it.send_s in context.window and number % 5 == 0:
            text = json.dumps({**it.content, "time_s": 0.0}).encode()
            it = Message(it.send_s, text[: len(text) // 2])
        changed.append(it)
    return changed
