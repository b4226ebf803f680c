"""All texts are plain technical English: a reject list of words and of sentence openings.

Texts are prose, comments, docstrings and messages; quotations are excluded.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from typing import TYPE_CHECKING

import pytest

from access_av.tables.toml import tomllib
from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

# Files without prose of the project.
EXCLUDED = ("target/", ".venv/", "tests/house/test_language.py")

# Words that a reader of the field does not understand at first reading, or that have a name.
REJECTED_WORDS = re.compile(
    r"\b(anew|beside|besides|lateness|hear|hears|heard|told|tells|tell|untold|believed|believes|"
    r"surely|likelier|nobody|vouch\w*|mend|mends|mended|guarded|whereto|whereof|"
    r"hangs (on|together)|is worth|by how much|so many|as it is|what is asked)\b",
    re.IGNORECASE,
)
REJECTED_OPENINGS = re.compile(r"^(Of|By|That|Those|What|The same|So)\b(?! the model)(?!.*\?$)")
WORDS_PER_SENTENCE = 30


def sentences(text: str) -> list[str]:
    """Splits prose into sentences."""
    text = re.sub(r"\s+", " ", text)
    parts = re.split(r"(?<=[.!?:;])\s+", text)
    return [part.strip() for part in parts if part.strip()]


def markdown_texts(text: str) -> list[str]:
    """Paragraphs, list items and table cells of a page, without code."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`", "code", text)
    # A heading, a table row and a list item are texts of their own.
    text = re.sub(r"^(#+ .*|\s*\|.*|\s*[-*] )", r"\n\n\1", text, flags=re.MULTILINE)
    texts = []
    for block in re.split(r"\n\s*\n", text):
        if block.strip().startswith("|"):
            texts += block.split("|")
        else:
            texts.append(re.sub(r"^(#+|\s*[-*]) ", "", block.strip()))
    return [item.strip() for item in texts if item.strip()]


def python_texts(text: str) -> list[str]:
    """Docstrings and comments of a Python file."""
    texts = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            texts.append(without_code(ast.get_docstring(node) or ""))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            texts.append(token.string.lstrip("# "))
    return [item for item in texts if item] + python_literals(text)


def without_code(text: str) -> str:
    """Replaces code in backticks."""
    return re.sub(r"``.*?``|`[^`]*`", "code", text, flags=re.DOTALL)


def python_literals(text: str) -> list[str]:
    """Messages of a Python file: string literals of three words or more, without placeholders."""
    nodes = list(ast.walk(ast.parse(text)))
    parts = {id(it) for node in nodes if isinstance(node, ast.JoinedStr) for it in node.values}
    # Docstrings are texts of their own.
    parts |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    texts = [
        "".join(it.value for it in node.values if isinstance(it, ast.Constant))
        for node in nodes
        if isinstance(node, ast.JoinedStr)
    ]
    texts += [
        node.value
        for node in nodes
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts
    ]
    return [item for item in texts if len(re.findall(r"[A-Za-z]{2,}", item)) > 2]


def hash_texts(text: str) -> list[str]:
    """Comment blocks of a file whose comments begin with `#`."""
    blocks, block = [], []
    for line in [*text.splitlines(), ""]:
        comment = re.match(r"\s*#+\s?(.*)", line)
        if comment:
            block.append(comment[1])
        elif block:
            blocks.append(" ".join(block))
            block = []
    return blocks


def toml_texts(text: str) -> list[str]:
    """Comments and string values of a TOML file; comments only of a template."""
    try:
        values = [tomllib.loads(text)]
    except tomllib.TOMLDecodeError:
        return hash_texts(text)
    texts = []
    while values:
        value = values.pop()
        if isinstance(value, dict):
            values += value.values()
        elif isinstance(value, list):
            values += value
        elif isinstance(value, str) and len(re.findall(r"[A-Za-z]{2,}", value)) > 2:
            texts.append(without_code(value))
    return hash_texts(text) + texts


def page_texts(text: str) -> list[str]:
    """Paragraphs of an HTML page, without tags and scripts."""
    text = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.DOTALL)
    return re.split(r"<[^>]*>|\n\s*\n", text)


def rust_texts(text: str) -> list[str]:
    """Comment blocks of a Rust file, without code."""
    blocks, block = [], []
    for line in [*text.splitlines(), ""]:
        comment = re.match(r"\s*//[/!]?\s?(.*)", line)
        if comment:
            block.append(comment[1])
        elif block:
            blocks.append("\n".join(block))
            block = []
    return [item for block in blocks for item in markdown_texts(block)] + rust_literals(text)


def rust_literals(text: str) -> list[str]:
    """Messages of a Rust file: string literals of three words or more, without placeholders."""
    code = re.sub(r"^\s*//.*$", "", text, flags=re.MULTILINE)
    literals = re.findall(r'"((?:[^"\\\n]|\\.|\\\n)*)"', code)
    messages = [re.sub(r"\{[^}]*\}", "", re.sub(r"\\\n\s*", "", item)) for item in literals]
    return [item for item in messages if len(re.findall(r"[A-Za-z]{2,}", item)) > 2]


READERS = {
    ".md": markdown_texts,
    ".py": python_texts,
    ".pyi": python_texts,
    ".rs": rust_texts,
    ".toml": toml_texts,
    ".yml": hash_texts,
    ".html": page_texts,
    "": hash_texts,
}


def project_files() -> list[Path]:
    """Text files of the project, without files that a build makes."""
    named = [ROOT / "Makefile", ROOT / ".ci/run"]
    found = [
        file
        for folder in ROOT.iterdir()
        if folder.is_dir() and not f"{folder.name}/".startswith((".", *EXCLUDED))
        for file in folder.rglob("*")
    ]
    found += ROOT.glob("*")
    texts = [it for it in found if it.suffix in READERS and it.suffix]
    named += [it for it in texts if not str(it.relative_to(ROOT)).startswith(EXCLUDED)]
    return sorted(named)


FILES = project_files()


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_text_is_plain(file: Path) -> None:
    texts = READERS[file.suffix](file.read_text(encoding="utf-8"))
    found = [text for text in texts if REJECTED_WORDS.search(text)]
    opened = [item for text in texts for item in sentences(text) if REJECTED_OPENINGS.match(item)]
    assert not found, found
    assert not opened, opened
    if file.suffix == ".md":
        long = [
            item
            for text in texts
            for item in sentences(text)
            if len(item.split()) > WORDS_PER_SENTENCE
        ]
        assert not long, long


@pytest.mark.parametrize(
    "text",
    ["A start that nobody vouches for.", "Of odometry the speed alone is enough."],
)
def test_rejects_the_private_grammar(text: str) -> None:
    assert REJECTED_WORDS.search(text) or any(map(REJECTED_OPENINGS.match, sentences(text)))
