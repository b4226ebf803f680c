"""A case: a folder of files, and a command that is run in it."""

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
    """What a case is made of: its folder is the current directory of its command."""

    folder: Path

    def write(self, name: str, content: str | bytes | dict[str, Any]) -> str:
        """Put a file into the folder; a table becomes TOML."""
        if isinstance(content, dict):
            content = mutate.toml(content)
        if isinstance(content, str):
            content = content.encode("utf-8", "surrogatepass")
        (self.folder / name).write_bytes(content)
        return name

    def access_av(self, *arguments: object) -> list[str]:
        """Run the command line."""
        return self._command(["access-av", *map(str, arguments)])

    def python(self, script: str) -> list[str]:
        """Run a script."""
        self.write(SCRIPT, script)
        return self._command(["python", SCRIPT])

    def _command(self, words: list[str]) -> list[str]:
        self.write("command.sh", shlex.join(words) + "\n")
        return words
