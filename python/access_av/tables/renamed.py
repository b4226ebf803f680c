"""Names that were replaced: an old name is rejected with the new one.

``renamed.toml`` contains the names. The loader of settings files reads its table ``keys``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av.tables import toml

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

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
    >>> option_message("--heads", "access-av file new")
    'No such option: --heads. It was renamed in version 0.2.0: write --heads-file'
    """
    new = _option(option, command.split())
    if new is None:
        return None
    return f"No such option: {option}. It was renamed in version {VERSION}: write {new}"


def command_message(words: Sequence[str]) -> str | None:
    """Returns the message for an old command; ``None`` for another command.

    Parameters
    ----------
    words
        Arguments of the command line, which begin with the command.

    Examples
    --------
    >>> command_message(["chosen", "--runs", "2"])
    "No such command 'chosen'. It was renamed in version 0.2.0: write paper assumptions"
    """
    old, new = _command(words)
    if not old:
        return None
    return f"No such command '{old}'. It was renamed in version {VERSION}: write {new}"


def current(words: Sequence[str]) -> list[str]:
    """Returns a command line of an earlier version with the present names.

    Examples
    --------
    >>> current(["designs", "paper", "--space", "space.toml"])
    ['design', 'sweep', 'paper', '--space', 'space.toml']
    >>> current(["run", "yard", "--vary=site.rician_k_db=5,10"])
    ['run', 'yard', '--sweep=site.rician_k_db=5,10']
    """
    old, new = _command(words)
    command = new.split() or list(words[:1])
    found = [*command]
    for word in words[len(old.split()) or 1 :]:
        option, equals, value = word.partition("=")
        now = _option(option, command)
        if now is None:
            found.append(word)
        else:
            found += [f"{now}={value}"] if equals else now.split()
    return found


def _option(option: str, command: Iterable[str]) -> str | None:
    """Returns the present name of an old option of a command; ``None`` for another option."""
    options = names("options")
    of_command = (options.get(f"{word} {option}") for word in command)
    return next(filter(None, of_command), options.get(option))


def _command(words: Sequence[str]) -> tuple[str, str]:
    """Returns the old command at the start of ``words``, and the new one; otherwise ``""``."""
    commands = names("commands")
    for count in (2, 1):
        old = " ".join(words[:count])
        if old in commands:
            return old, commands[old]
    return "", ""
