"""Changes to values, tables, texts and bytes: extreme values, and values close to the original."""

from __future__ import annotations

import copy
import json
import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from random import Random

NUMBERS = (
    0, -0.0, 1, -1, 0.5, 2, 3, 7, 100, 1e3, 1e4, 1e5, 1e6, 1e9, 1e15, 1e19, 1e300, 1e308, -1e308,
    1e-3, 1e-6, 1e-12, 1e-300, 5e-324, math.pi, -math.pi, math.inf, -math.inf, math.nan, 2**31,
    2**32, 2**40, 2**53 + 1, 2**63 - 1, -(2**63), 255, 256, 65535, 65536, 1007, 1008,
)  # fmt: skip
TEXTS = (
    "", " ", ".", "..", "../../../x", "/dev/zero", "/dev/full", "/", "a/b", "CON", "nul", "-",
    "--help", "[/]", "[red]x[/red]", "\x1b[2J\x1b]0;x\x07", "<!--<script>", "</script><b>",
    "&lt;", "%s%n", "{0}", "${x}", "x" * 300, "x" * 100_000, "\u202egnp.exe", "\u0000", "\ufeffx",
    "naïve", "日本", "🚗", "\n\n", "a,b;c\td", '"', "'''", "\\", "nan", "1e999", "true", "paper",
    "yard", "carrier", "default",
)  # fmt: skip


def number(random: Random, old: float = 1.0) -> float:
    """Returns another number: an extreme, or one that differs slightly or by many powers of ten."""
    choice = random.random()
    if choice < 0.4:
        return random.choice(NUMBERS)
    if choice < 0.7:
        return old * 10.0 ** random.uniform(-12, 12)
    if choice < 0.9:
        return old * random.uniform(-2, 2)
    return random.choice((old + 1, old - 1, -old, int(old) if math.isfinite(old) else 0))


def value(random: Random, old: Any) -> Any:
    """Returns a random replacement of a value, usually of the same type."""
    if random.random() < 0.1:
        return random.choice((True, 3, 2.5, "word", [], {}, [1, "a"], {"a": 1}, [[[]]]))
    if isinstance(old, bool):
        return not old
    if isinstance(old, int | float):
        return number(random, old)
    if isinstance(old, str):
        return random.choice(TEXTS)
    if isinstance(old, list):
        return _list(random, old)
    return {} if isinstance(old, dict) else random.choice(TEXTS)


def _list(random: Random, old: list[Any]) -> list[Any]:
    many = old * random.choice((2, 3, 1100)) if old else [random.choice(NUMBERS)]
    return random.choice(
        ([], old[:-1], old[::-1], many, [*old, value(random, old[0] if old else 0)])
    )


def places(table: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Returns the paths of all items of a table of tables, lists and values."""
    found = [path] if path else []
    items = table.items() if isinstance(table, dict) else ()
    items = enumerate(table) if isinstance(table, list) else items
    for key, item in items:
        found += places(item, (*path, key))
    return found


def table(random: Random, original: Any, *, changes: int | None = None) -> Any:
    """Returns a table in which one to three items are changed, removed, repeated or added."""
    made = copy.deepcopy(original)
    for _ in range(changes or random.choice((1, 1, 1, 2, 3))):
        known = places(made)
        if not known:
            return made
        *path, key = random.choice(known)
        holder = made
        for step in path:
            holder = holder[step]
        choice = random.random()
        if choice < 0.8:
            holder[key] = value(random, holder[key])
        elif choice < 0.9 or isinstance(holder, list):
            del holder[key]
        else:
            holder[random.choice(TEXTS[:20])] = holder[key]
    return made


def data(random: Random, original: bytes) -> bytes:
    """Returns bytes of which some are changed, removed, repeated or inserted."""
    made = bytearray(original)
    for _ in range(random.choice((1, 1, 2, 5, 20))):
        place, length = random.randrange(len(made) + 1), random.choice((1, 1, 4, 8, 100))
        choice = random.random()
        if choice < 0.5:
            made[place : place + length] = random.randbytes(min(length, len(made) - place))
        elif choice < 0.65:
            made[place:place] = random.choice(
                (
                    b"\xff\xfe",
                    b"\xef\xbb\xbf",
                    b"\0",
                    b"\n",
                    b"[[",
                    b"a" * 10_000,
                    b"\x1b[2J",
                    b"nan",
                )
            )
        elif choice < 0.8:
            del made[place : place + length]
        elif choice < 0.9:
            del made[place:]
        else:
            made[place:place] = made[max(0, place - 100) : place]
    return bytes(made)


def lines(random: Random, original: str) -> str:
    """Returns a text table with changed cells and lines."""
    rows = original.splitlines()
    separator = "," if "," in rows[0] else " "
    for _ in range(random.choice((1, 1, 3, 10))):
        at = random.randrange(len(rows)) if rows else 0
        choice = random.random()
        if not rows:
            break
        if choice < 0.6:
            cells = rows[at].split(separator)
            cells[random.randrange(len(cells))] = str(
                number(random) if random.random() < 0.8 else random.choice(TEXTS)
            )
            rows[at] = separator.join(cells)
        elif choice < 0.75:
            del rows[at]
        elif choice < 0.9:
            rows.insert(random.randrange(len(rows)), rows[at])
        else:
            del rows[at:]
    return "\n".join(rows) + "\n"


def text(random: Random, original: str) -> bytes:
    """Returns a text file with changed cells and lines, sometimes with changed bytes."""
    if random.random() < 0.7:
        return lines(random, original).encode("utf-8", "surrogatepass")
    return data(random, original.encode())


def toml(settings: dict[str, Any]) -> str:
    """Returns a table as TOML, with one line for each key."""
    return "".join(f"{_key(key)} = {_inline(item)}\n" for key, item in settings.items())


def _key(key: str) -> str:
    return json.dumps(key).replace("\x7f", "\\u007f")


def _inline(item: Any) -> str:
    if isinstance(item, dict):
        return "{" + ", ".join(f"{_key(key)} = {_inline(it)}" for key, it in item.items()) + "}"
    if isinstance(item, list):
        return "[" + ", ".join(map(_inline, item)) + "]"
    if isinstance(item, bool):
        return str(item).lower()
    if isinstance(item, float | int):
        return str(item)
    return _key(item)
