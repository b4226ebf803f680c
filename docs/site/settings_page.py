"""Reference page of the settings: all keys of all settings files, from their JSON Schemas."""

from __future__ import annotations

import json
import re
from typing import Any

from access_av import Plant, Platform, Scenario, Site, Vehicle

Schema = dict[str, Any]

KINDS: dict[str, Any] = {
    "site": Site,
    "vehicle": Vehicle,
    "scenario": Scenario,
    "plant": Plant,
    "platform": Platform,
}
INTRODUCTION = """# Settings

This page is generated from the JSON Schemas of the settings files. `access-av file schema vehicle`
prints the schema of vehicle files for an editor; `site`, `scenario`, `plant` and `platform` have
the same command. Unknown keys, wrong types and values outside the range are rejected with exit
code 2. [Plausibility checks](checks.md) describes the warnings. [Messages of the
node](node-messages.md) and [the node](node.md) describe the settings of the program on the
vehicle.

Key names end with the unit. All lengths are in metres and all angles in radians unless the name
says otherwise.
"""
PLURALS = {"string": "text", "number": "number", "integer": "integer", "boolean": "`true`, `false`"}


def page() -> str:
    """Returns the page as Markdown."""
    return "\n\n".join([INTRODUCTION.strip(), *(part for it in KINDS for part in file_parts(it))])


def file_parts(kind: str) -> list[str]:
    """Returns the sections of one kind of file: its keys, then each of its tables."""
    schema = json.loads(KINDS[kind].schema_json())
    tables = _Tables(kind, schema.get("$defs", {}))
    parts = [f"## {kind.capitalize()} file", tables.rows(schema, "")]
    while tables.open:
        path, definition = tables.open.pop(0)
        parts += [f"### {kind.capitalize()}: `{path}`", *tables.section(definition, path)]
    return parts


class _Tables:
    """Tables of one kind of file. Each definition is described at its first occurrence."""

    def __init__(self, kind: str, definitions: dict[str, Schema]) -> None:
        self.kind = kind
        self.definitions = definitions
        self.open: list[tuple[str, Schema]] = []
        self.described: dict[str, str] = {}

    def section(self, definition: Schema, path: str) -> list[str]:
        """Returns a description and the keys of a table; one list of keys for each alternative."""
        # A description may begin with the name of the table, which is the heading.
        text = re.sub(r"^`\[+[\w.]+\]+`:? ?", "", _text(definition))
        parts = [text[:1].upper() + text[1:]]
        for one in [it for it in definition.get("oneOf", [definition]) if "properties" in it]:
            if one is not definition:
                parts.append(f"**{_alternative(one)}**: {_text(one)}")
            if any("const" not in it for it in one["properties"].values()):
                parts.append(self.rows(one, path))
        return [it for it in parts if it]

    def rows(self, table: Schema, path: str) -> str:
        """Returns the keys of a table as rows: key, value, default, meaning."""
        lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
        for key, item in table["properties"].items():
            if "const" in item:
                continue
            default = "required" if key in table.get("required", []) else _default(item)
            cells = [f"`{key}`", self.value(item, key, path), default, _text(item)]
            lines.append("| " + " | ".join(it.replace("|", "\\|") for it in cells) + " |")
        return "\n".join(lines)

    def value(self, item: Schema, key: str, path: str) -> str:
        """Returns the permitted values of a key."""
        options = [
            it for it in item.get("anyOf", item.get("oneOf", [])) if it.get("type") != "null"
        ]
        if "$ref" in item:
            return self.reference(item["$ref"].rsplit("/", 1)[1], key, path)
        if options:
            return " or ".join(dict.fromkeys(self.value(it, key, path) for it in options))
        if "enum" in item:
            return ", ".join(f"`{it}`" for it in item["enum"])
        if "const" in item:
            return f"`{item['const']}`"
        types = item.get("type", "any")
        types = [types] if isinstance(types, str) else [it for it in types if it != "null"]
        return " or ".join(self.plain(it, item, key, path) for it in types)

    def plain(self, name: str, item: Schema, key: str, path: str) -> str:
        """Returns a JSON type with its range."""
        if name == "array":
            inner = item.get("items", {})
            inside = self.value(inner, f"[{key}]", path) if isinstance(inner, dict) else "number"
            size = item.get("maxItems")
            fixed = size is not None and size == item.get("minItems")
            return f"list of {f'{size} × ' if fixed else ''}{inside}"
        if name == "object":
            inner = item.get("additionalProperties")
            return (
                f"table of {self.value(inner, key, path)}" if isinstance(inner, dict) else "table"
            )
        low, high = item.get("minimum"), item.get("maximum")
        low = item.get("exclusiveMinimum") if low is None else low
        text = PLURALS.get(name, name)
        if low is not None and high is not None:
            return f"{text}, {_number(low)} to {_number(high)}"
        if low is not None:
            return f"{text}, at least {_number(low)}"
        return f"{text}, at most {_number(high)}" if high is not None else text

    def reference(self, name: str, key: str, path: str) -> str:
        """Returns the values of a definition; a table becomes a section of its own."""
        definition = self.definitions[name]
        if name.lower() in KINDS and name.lower() != self.kind:
            return f"keys of a [{name.lower()} file](#{name.lower()}-file)"
        alternatives = definition.get("oneOf", [])
        if alternatives and not any("properties" in it for it in alternatives):
            return ", ".join(
                f"`{it.get('const')}` ({_text(it).rstrip('.')})" for it in alternatives
            )
        if "properties" not in definition and not alternatives:
            return self.value(definition, key, path)
        inner = f"{path.strip('[]')}.{key.strip('[]')}" if path else key.strip("[]")
        inner = f"[[{inner}]]" if key.startswith("[") else f"[{inner}]"
        if name not in self.described:
            self.described[name] = inner
            self.open.append((inner, definition))
        place = self.described[name]
        return f"[table `{place}`](#{_anchor(f'{self.kind}: {place}')})"


def _anchor(heading: str) -> str:
    """Returns the anchor of a heading in the site."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def _alternative(table: Schema) -> str:
    """Returns the key and value that select an alternative of a table."""
    for key, item in table["properties"].items():
        if "const" in item:
            return f"`{key} = {json.dumps(item['const'])}`"
    return "table"


def _text(item: Schema) -> str:
    """Returns a description as one line."""
    return " ".join(item.get("description", "").split())


def _default(item: Schema) -> str:
    """Returns the default value; defaults of tables are those of their keys."""
    value = item.get("default")
    if value is None or isinstance(value, dict) or value in ("", []):
        return "–"
    if isinstance(value, float):
        return _number(value)
    return f"`{json.dumps(value, ensure_ascii=False)}`"


def _number(value: float) -> str:
    text = re.sub(r"e([+-])0*(\d+)", lambda it: f"e{it[1].strip('+')}{it[2]}", f"{value:g}")
    return text.replace("-", "−", 1) if value < 0 else text
