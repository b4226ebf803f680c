"""A case: a folder of files, and a command that runs in it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from attack import mutate

if TYPE_CHECKING:
    from pathlib import Path

SCRIPT = "case.py"


@dataclass(frozen=True)
class Case:
    """A case; its folder is the current directory of its command."""

    folder: Path

    def write(self, name: str, content: str | bytes | dict[str, Any]) -> str:
        """Writes a file into the folder; a table is written as TOML."""
        if isinstance(content, dict):
            content = mutate.toml(content)
        if isinstance(content, str):
            content = content.encode("utf-8", "surrogatepass")
        (self.folder / name).write_bytes(content)
        return name

    def access_av(self, *arguments: object) -> list[str]:
        """Returns a command of the command line."""
        return self._command(["access-av", *map(str, arguments)])

    def python(self, script: str) -> list[str]:
        """Returns a command that runs a script."""
        self.write(SCRIPT, script)
        return self._command(["python", SCRIPT])

    def _command(self, words: list[str]) -> list[str]:
        self.write("command.sh", shlex.join(words) + "\n")
        return words
