"""Names that were replaced: an old name is rejected with the new one.

``renamed.toml`` contains the names. The loader of settings files reads its table ``keys``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.tables import toml

if TYPE_CHECKING:
    from collections.abc import Iterable

VERSION = "0.2.0"


def names(kind: str) -> dict[str, str]:
    """Returns the new names of a ``kind`` by their old names.

    Examples
    --------
    >>> names("columns")["listened"]
    'bursts_received'
    """
    found: dict[str, str] = toml.shipped("tables", "renamed.toml")[kind]
    return found


def column_hint(missing: str, there: Iterable[str]) -> str:
    """Returns a hint if a table has the missing column under its old name; otherwise ``""``.

    Examples
    --------
    >>> column_hint("bursts_received", ["run", "listened"])
    '; `listened` was renamed in version 0.2.0: write `bursts_received`'
    """
    old = [it for it in there if names("columns").get(it) == missing]
    return f"; `{old[0]}` was renamed in version {VERSION}: write `{missing}`" if old else ""


def option_message(option: str, command: str) -> str | None:
    """Returns the message for an old ``option`` of a ``command``; ``None`` for another option.

    Examples
    --------
    >>> option_message("--vary", "access-av run")
    'No such option: --vary. It was renamed in version 0.2.0: write --sweep'
    >>> option_message("--heads", "access-av new plant")
    'No such option: --heads. It was renamed in version 0.2.0: write --heads-file'
    """
    options = names("options")
    of_command = (options.get(f"{word} {option}") for word in command.split())
    new = next(filter(None, of_command), options.get(option))
    if new is None:
        return None
    return f"No such option: {option}. It was renamed in version {VERSION}: write {new}"


def command_message(command: str) -> str | None:
    """Returns the message for an old ``command``; ``None`` for another command.

    Examples
    --------
    >>> command_message("readings")
    "No such command 'readings'. It was renamed in version 0.2.0: write interpretations"
    """
    new = names("commands").get(command)
    if new is None:
        return None
    return f"No such command '{command}'. It was renamed in version {VERSION}: write {new}"
