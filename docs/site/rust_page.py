"""Reference page of the Rust crates: purpose and public modules, from their documentation."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CRATES = ("aoa", "nr-ssb", "onboard", "recording", "simulate", "node")
INTRODUCTION = """# Rust API

This page is generated from the crates. It lists the purpose and the public modules of each crate.
`cargo doc --no-deps --open` builds the complete reference of all items. [Embed the
pipeline](live.md) has an example.
"""


def page() -> str:
    """Returns the page as Markdown."""
    return "\n\n".join([INTRODUCTION.strip(), *(part for it in CRATES for part in _parts(it))])


def _parts(crate: str) -> list[str]:
    """Returns the section of one crate."""
    source = ROOT / "crates" / crate / "src"
    manifest = (source.parent / "Cargo.toml").read_text(encoding="utf-8")
    text = (source / "lib.rs").read_text(encoding="utf-8")
    rows = ["| module | content |", "|---|---|"]
    for name in re.findall(r"^pub mod (\w+);", text, flags=re.MULTILINE):
        file = source / f"{name}.rs"
        file = file if file.exists() else source / name / "mod.rs"
        paragraph = _plain(_module_text(file.read_text(encoding="utf-8")).split("\n\n")[0])
        rows.append(f"| `{name}` | {' '.join(paragraph.split())} |")
    (package,) = re.findall(r'^name = "([\w-]+)"', manifest, flags=re.MULTILINE)[:1]
    title = f"## `{crate}`" + (f" (package `{package}`)" if package != crate else "")
    return [title, _introduction(text), *(["\n".join(rows)] if len(rows) > 2 else [])]


def _module_text(source: str) -> str:
    """Returns the documentation of a module."""
    lines = []
    for line in source.splitlines():
        if line.startswith("//!"):
            lines.append(line[3:].removeprefix(" "))
        elif lines or line.strip():
            break
    return "\n".join(lines)


def _introduction(source: str) -> str:
    """Returns the paragraphs before the first heading or example."""
    text = re.split(r"^#|^```", _module_text(source), maxsplit=1, flags=re.MULTILINE)[0]
    return _plain(text).strip()


def _plain(text: str) -> str:
    """Replaces links to items by their labels."""
    text = re.sub(r"\[(`?[^\]`]*`?)\]\([^)]*\)", r"\1", text)
    return re.sub(r"\[(`[^\]]*`)\]", r"\1", re.sub(r"(?<!\!)\[(\w+)\](?!\()", r"`\1`", text))
