"""The examples of the README and of the pages that it links to run as they are written."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

DOCS = sorted((ROOT / "docs").glob("*.md"))
README = ROOT / "README.md"
COMMAND_LINE = ROOT / "docs/command-line.md"
PYTHON = ROOT / "docs/python.md"


def blocks(page: Path, language: str) -> list[str]:
    text = page.read_text(encoding="utf-8")
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [block for name, block in fenced if name == language]


def commands(page: Path) -> list[list[str]]:
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    return [shlex.split(line, comments=True)[1:] for line in lines if ".venv/bin/access-av" in line]


def test_the_python_example_of_the_docs_runs(tmp_path: Path) -> None:
    example = "\n".join(blocks(PYTHON, "python"))
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "worst error in Y" in done.stdout


def test_the_command_line_examples_of_the_docs_run(tmp_path: Path, quick_study: Path) -> None:
    examples = commands(COMMAND_LINE)
    assert [command[:2] for command in examples] == [
        ["run", "paper"],
        ["paper", "explore"],
        ["design", "bound"],
    ]
    shutil.copytree(quick_study, tmp_path / "results", symlinks=True)
    for command in examples:
        done = subprocess.run(
            [sys.executable, "-m", "access_av", *command],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        # With so few runs, no operating point may qualify; this is a valid answer.
        missed = "No operating point" in done.stdout
        assert done.returncode == (3 if missed else 0), done.stderr
    assert (tmp_path / "results/first/trajectories.parquet").is_file()
    assert (tmp_path / "results/yard-bound/report.html").is_file()


def test_readme_prints_the_output_of_its_command(tmp_path: Path) -> None:
    (command,) = commands(README)
    done = subprocess.run(
        [sys.executable, "-m", "access_av", *command],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    (output,) = blocks(README, "")
    printed = {" ".join(line.split()) for line in done.stdout.splitlines()}
    for line in output.splitlines():
        assert " ".join(line.split()) in printed, line


def test_readme_fits_one_screen() -> None:
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 70


def test_make_commands_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    text = README.read_text(encoding="utf-8")
    for target in re.findall(r"(?:^|`)make ([a-z-]+)", text, flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


@pytest.mark.parametrize("path", ["docs/study.png", "LICENSE-MIT", "LICENSE-APACHE"])
def test_files_named_in_the_readme_exist_and_are_small(path: str) -> None:
    assert (ROOT / path).stat().st_size < 300_000


@pytest.mark.parametrize("page", ["README.md", *(f"docs/{it.name}" for it in DOCS)])
def test_figures_exist_and_are_small(page: str) -> None:
    place = ROOT / page
    for name in re.findall(r"!\[[^]]*\]\(([^)]+)\)", place.read_text(encoding="utf-8")):
        assert (place.parent / name).stat().st_size < 300_000, name
