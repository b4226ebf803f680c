"""Reference page of the command line: all commands and options, from the program itself."""

from __future__ import annotations

import inspect
import re
import typing
from enum import Enum
from pathlib import Path
from typing import Any

import typer

from access_av.cli.main import app

# A larger maximum is that of the number type, and not shown.
LARGE = 10**9

INTRODUCTION = """# Commands and options

This page is generated from the program. `access-av COMMAND --help` prints the section of one
command. Exit code 0: done; 2: invalid input, with a message; 3: the result misses a requirement,
as the section of the command describes. [The command line](command-line.md) shows the commands of
typical tasks.
"""


def page() -> str:
    """Returns the page as Markdown."""
    group: Any = typer.main.get_command(app)
    return "\n\n".join([INTRODUCTION.strip(), *_parts(group, "access-av")])


def _parts(group: Any, prefix: str) -> list[str]:
    parts = []
    for name, command in group.commands.items():
        path = f"{prefix} {name}"
        # Commands of a group without a command of its own are described below the group.
        if inner := getattr(command, "commands", None):
            parts += [f"## {path}", _text(command.help)]
            commands = "\n".join(f"| `{it}` | {_text(one.help)} |" for it, one in inner.items())
            parts += ["| command | task |\n|---|---|\n" + commands]
            parts += [it.replace("## ", "### ", 1) for it in _parts(command, path)]
        else:
            parts += [f"## {path}", _text(command.help), _parameters(command)]
            if command.epilog:
                parts.append(_text(command.epilog))
    return [it for it in parts if it]


def _parameters(command: Any) -> str:
    """Returns a table of the arguments and options of a command."""
    rows = ["| argument or option | value | default | meaning |", "|---|---|---|---|"]
    for one in command.params:
        if one.name == "help":
            continue
        is_argument = one.param_type_name == "argument"
        names = one.metavar or one.name.upper() if is_argument else ", ".join(one.opts)
        default = "required" if one.required else _default(one)
        help_text = _text(getattr(one, "help", "") or "")
        cells = [f"`{names}`", _value(one), default, help_text]
        rows.append("| " + " | ".join(it.replace("|", "\\|") for it in cells) + " |")
    return "\n".join(rows) if len(rows) > 2 else ""


def _value(parameter: Any) -> str:
    """Returns the type of a value, with its choices or its range."""
    if getattr(parameter, "is_flag", False):
        return "flag"
    kinds = _types(parameter.type_descriptor.annotation)
    names = {str: "text", int: "integer", float: "number", Path: "path"}
    texts = [
        ", ".join(f"`{it.value}`" for it in kind)
        if issubclass(kind, Enum)
        else names.get(kind, kind.__name__)
        for kind in kinds
    ]
    low, high = parameter.min, parameter.max
    if low is not None and high is not None:
        texts.append(f"{low} to {high}" if high < LARGE else f"at least {low}")
    elif low is not None or high is not None:
        texts.append(f"at least {low}" if high is None else f"at most {high}")
    repeatable = parameter.multiple or parameter.nargs == -1
    return ", ".join(texts) + ("; may be repeated" if repeatable else "")


def _types(annotation: Any) -> list[Any]:
    """Returns the types of a value or of the items of a list, without None."""
    inner = typing.get_args(annotation)
    if typing.get_origin(annotation) is typing.Literal or not inner:
        return [] if annotation is type(None) or inner else [annotation]
    return list(dict.fromkeys(it for one in inner for it in _types(one)))


def _default(parameter: Any) -> str:
    """Returns the default value, or its description."""
    shown = getattr(parameter, "show_default", None)
    if isinstance(shown, str):
        return shown
    value = parameter.default
    value = getattr(value, "value", value)
    if value is None or callable(value) or value in ((), [], "", False):
        return "–"
    return f"`{value}`"


def _text(text: str | None) -> str:
    """Returns a help text without the markup of the terminal."""
    plain = re.sub(r"\[bold\](.*?)\[/\]", r"`\1`", inspect.cleandoc(text or ""))
    plain = re.sub(r"\[/?[a-z ]*\]", "", plain)
    return "\n\n".join(" ".join(it.split()) for it in re.split(r"\n\s*\n", plain))
