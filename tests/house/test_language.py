"""Texts that are written in plain technical English stay so: a reject list of words and openings.

`PLAIN` lists the files that have been rewritten. A new text file belongs on the list; a file leaves
it only by being deleted. `notes/` and quotations are excluded.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from typing import TYPE_CHECKING

import pytest

from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

PLAIN = [
    "CONTRIBUTING.md",
    "README.md",
    "attack/*.py",
    "attack/node/*.py",
    "benches/*.py",
    "crates/aoa/README.md",
    "crates/aoa/benches/*.rs",
    "crates/aoa/examples/*.rs",
    "crates/aoa/src/*.rs",
    "crates/aoa/src/array/*.rs",
    "crates/aoa/src/covariance/*.rs",
    "crates/aoa/src/estimate/*.rs",
    "crates/aoa/src/kernel/*.rs",
    "crates/aoa/src/linalg/*.rs",
    "crates/aoa/src/method/*.rs",
    "crates/aoa/src/result/*.rs",
    "crates/aoa/src/simd/*.rs",
    "crates/aoa/src/spectrum/*.rs",
    "crates/node/src/engine/*.rs",
    "crates/node/src/settings/*.rs",
    "crates/node/src/sink/*.rs",
    "crates/node/src/address.rs",
    "crates/node/src/angle_watch.rs",
    "crates/node/src/clock.rs",
    "crates/node/src/engine.rs",
    "crates/node/src/events.rs",
    "crates/node/src/gate.rs",
    "crates/node/src/health.rs",
    "crates/node/src/inbox.rs",
    "crates/node/src/interruption.rs",
    "crates/node/src/lib.rs",
    "crates/node/src/main.rs",
    "crates/node/src/playback.rs",
    "crates/node/src/state.rs",
    "crates/node/src/statistics.rs",
    "crates/node/src/supervisor.rs",
    "crates/node/src/source/*.rs",
    "crates/node/src/web/*.rs",
    "crates/node/tests/**/*.rs",
    "crates/nr-ssb/README.md",
    "crates/nr-ssb/benches/*.rs",
    "crates/nr-ssb/examples/*.rs",
    "crates/python/src/**/*.rs",
    "crates/recording/examples/*/*.rs",
    "crates/recording/examples/*.rs",
    "crates/recording/src/angle_*.rs",
    "crates/recording/src/clock_faults.rs",
    "crates/recording/src/counter_jumps.rs",
    "crates/recording/src/error.rs",
    "crates/recording/src/file.rs",
    "crates/recording/src/foreign.rs",
    "crates/recording/src/lib.rs",
    "crates/recording/src/library.rs",
    "crates/recording/src/mcap/*.rs",
    "crates/recording/src/number.rs",
    "crates/recording/src/odometry*.rs",
    "crates/recording/src/replay/*.rs",
    "crates/recording/src/road_file.rs",
    "crates/recording/src/scan/*.rs",
    "crates/recording/src/sigmf/*.rs",
    "crates/recording/src/table.rs",
    "crates/recording/src/text.rs",
    "crates/recording/src/tum.rs",
    "crates/simulate/**/*.rs",
    "crates/onboard/src/estimator/*.rs",
    "crates/onboard/src/gaussian/*.rs",
    "crates/onboard/src/localize/**/*.rs",
    "crates/onboard/src/plausible/*.rs",
    "crates/onboard/src/receive/*.rs",
    "crates/onboard/src/road/*.rs",
    "crates/onboard/src/settings/*.rs",
    "crates/onboard/src/wake_up/*.rs",
    "docs/README.md",
    "docs/architecture.md",
    "docs/checks.md",
    "docs/columns.md",
    "docs/command-line.md",
    "docs/designs.md",
    "docs/energy.md",
    "docs/estimator.md",
    "docs/install-jetson.md",
    "docs/install-usrp.md",
    "docs/integrity.md",
    "docs/live.md",
    "docs/locate.md",
    "docs/measured.md",
    "docs/node-messages.md",
    "docs/node.md",
    "docs/outlook.md",
    "docs/paper.md",
    "docs/plant.md",
    "docs/plug-ins.md",
    "docs/profile.md",
    "docs/python.md",
    "docs/ray-tracing.md",
    "docs/site/*.py",
    "examples/*.py",
    "examples/*/*.py",
    "fuzz/README.md",
    "fuzz/bodies/*.rs",
    "packaging/*.py",
    "python/access_av/cli/*.py",
    "python/access_av/designs/*.py",
    "python/access_av/device/*.py",
    "python/access_av/drives/*.py",
    "python/access_av/radio/*.py",
    "python/access_av/report/c*.py",
    "python/access_av/report/designs.py",
    "python/access_av/report/drive_charts.py",
    "python/access_av/report/integrity.py",
    "python/access_av/report/located_charts.py",
    "python/access_av/report/pa*.py",
    "python/access_av/report/placement.py",
    "python/access_av/report/site_map.py",
    "python/access_av/signal/*.py",
    "python/access_av/site_files/*.py",
    "python/access_av/tables/**/*.py",
    "tests/bag.py",
    "tests/browser.py",
    "tests/hall_drive.py",
    "tests/layout.py",
    "tests/node.py",
    "tests/robot.py",
    "tests/second_implementation.py",
    "tests/site_plans.py",
    "tests/synthetic.py",
    "tests/house/test_language.py",
]

# Words that a reader of the field does not understand at first reading, or that have a name.
REJECTED_WORDS = re.compile(
    r"\b(anew|beside|besides|lateness|hear|hears|heard|told|tells|tell|untold|believed|believes|"
    r"surely|likelier|nobody|vouch\w*|mend|mends|mended|guarded|whereto|whereof|"
    r"hangs (on|together)|is worth|by how much|so many|as it is|what is asked)\b",
    re.IGNORECASE,
)
REJECTED_OPENINGS = re.compile(r"^(Of|By|That|Those|What|The same|So)\b(?! the model)")
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
    text = re.sub(r"^(#+ .*|\|.*|\s*[-*] )", r"\n\n\1", text, flags=re.MULTILINE)
    texts = []
    for block in re.split(r"\n\s*\n", text):
        if block.startswith("|"):
            texts += block.split("|")
        else:
            texts.append(re.sub(r"^(#+|\s*[-*]) ", "", block.strip()))
    return [item.strip() for item in texts if item.strip()]


def python_texts(text: str) -> list[str]:
    """Docstrings and comments of a Python file."""
    texts = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            texts.append(re.sub(r"`[^`]*`", "code", ast.get_docstring(node) or ""))
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            texts.append(token.string.lstrip("# "))
    return [item for item in texts if item]


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


READERS = {".md": markdown_texts, ".py": python_texts, ".rs": rust_texts}
FILES = sorted({file for pattern in PLAIN for file in ROOT.glob(pattern)})


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


def test_every_entry_names_a_file() -> None:
    assert all(any(ROOT.glob(pattern)) for pattern in PLAIN)


@pytest.mark.parametrize(
    "text",
    ["A start that nobody vouches for.", "Of odometry the speed alone is enough."],
)
def test_rejects_the_private_grammar(text: str) -> None:
    assert REJECTED_WORDS.search(text) or any(map(REJECTED_OPENINGS.match, sentences(text)))
