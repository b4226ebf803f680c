"""Reference page of the Python package: all public names, from their docstrings."""

from __future__ import annotations

import inspect
import re
from types import ModuleType
from typing import Any

import access_av

INTRODUCTION = """# Python API

This page is generated from the docstrings of the package. `help(access_av.simulate)` prints one
of its sections. [Python](python.md) shows typical uses. The columns of returned tables are in
[columns.md](columns.md).
"""
# Sections of a docstring whose items are a name and an indented text.
ITEMS = {"Parameters", "Attributes", "Returns", "Raises", "Warns", "Other Parameters", "Yields"}


def page() -> str:
    """Returns the page as Markdown."""
    names = [it for it in access_av.__all__ if not it.startswith("_")]
    objects = {name: getattr(access_av, name) for name in names}
    modules = {name: it for name, it in objects.items() if isinstance(it, ModuleType)}
    parts = [INTRODUCTION.strip(), "## Functions and classes"]
    for name, it in objects.items():
        if name not in modules:
            parts += _parts(f"access_av.{name}", it, "###")
    for name, module in modules.items():
        parts += [f"## Module `access_av.{name}`", _docstring(module)]
        for inner in getattr(module, "__all__", []):
            one = getattr(module, inner)
            if callable(one) and getattr(one, "__doc__", None) and one not in objects.values():
                parts += _parts(f"access_av.{name}.{inner}", one, "###")
    return "\n\n".join(it for it in parts if it)


def _parts(name: str, it: Any, level: str) -> list[str]:
    """Returns the section of a function or a class, with its public methods and properties."""
    parts = [f"{level} `{name}`", _signature(name.rsplit(".", 1)[1], it), _docstring(it)]
    if not inspect.isclass(it) or issubclass(it, Exception):
        return parts
    rows = []
    for key, member in vars(it).items():
        member = getattr(it, key) if isinstance(member, classmethod | staticmethod) else member
        if key.startswith("_") or not (text := inspect.getdoc(member)):
            continue
        if not callable(member) and not hasattr(member, "__get__"):
            continue
        call = f"{key}()" if callable(member) else key
        first = " ".join(text.split("\n\n")[0].split())
        rows.append(f"| `{call}` | {_plain(first)} |".replace("\n", " "))
    if rows:
        parts.append("\n".join(["| member | meaning |", "|---|---|", *rows]))
    return parts


def _signature(name: str, it: Any) -> str:
    """Returns the call of a function, without types."""
    try:
        found = inspect.signature(it)
    except (TypeError, ValueError):
        return ""
    empty = inspect.Parameter.empty
    inputs = [one.replace(annotation=empty) for one in found.parameters.values()]
    text = str(found.replace(parameters=inputs, return_annotation=inspect.Signature.empty))
    text = re.sub(r"<factory>|<[^>]* at 0x[0-9a-f]+>", "…", text)
    return f"```python\n{name}{text}\n```" if inputs else ""


def _docstring(it: Any) -> str:
    """Returns a docstring as Markdown: sections become lists and blocks of code."""
    text = inspect.getdoc(it) or ""
    parts = re.split(r"^(\w[\w ]*)\n-{3,}\n", text, flags=re.MULTILINE)
    found = [_body(parts[0])]
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        found.append(f"**{title}**")
        found.append(_items(body) if title in ITEMS else _body(body))
    return "\n\n".join(it for it in found if it)


def _items(body: str) -> str:
    """Returns names with indented texts as a list."""
    lines = []
    for line in inspect.cleandoc(body).splitlines():
        if line and not line[0].isspace():
            lines.append(f"- `{line.strip('`')}`:")
        elif line.strip() and lines:
            lines[-1] += f" {_plain(line.strip())}"
        elif line.strip():
            lines.append(f"- {_plain(line.strip())}")
    return "\n".join(it.removesuffix(":") for it in lines)


def _body(body: str) -> str:
    """Returns paragraphs; examples and tables of reStructuredText become blocks of code."""
    found = []
    for block in re.split(r"\n\s*\n", body.strip("\n")):
        if block.lstrip().startswith((">>>", "===")) or block.startswith("    "):
            found.append(f"```\n{inspect.cleandoc(block)}\n```")
        elif block.strip():
            found.append(_plain(block))
    return "\n\n".join(found)


def _plain(text: str) -> str:
    """Returns reStructuredText as Markdown."""
    text = re.sub(r":\w+:`~?([^`]*)`", r"`\1`", text)
    text = re.sub(r"``(.*?)``", r"`\1`", text)
    return re.sub(r"::$", ":", text)
