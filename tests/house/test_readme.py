"""The README's examples run as they are written."""

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
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_python_example(tmp_path: Path) -> None:
    (example,) = blocks("python")
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "worst error in Y" in done.stdout


def test_command_line_examples(tmp_path: Path, quick_study: Path) -> None:
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    commands = [shlex.split(line)[1:] for line in lines if ".venv/bin/access-av" in line]
    assert [command[0] for command in commands] == ["run", "explore", "bound"]
    shutil.copytree(quick_study, tmp_path / "results", symlinks=True)
    for command in commands:
        done = subprocess.run(
            [sys.executable, "-m", "access_av", *command],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        # Of so few runs nothing may qualify, which is an answer too.
        missed = "No operating point" in done.stdout
        assert done.returncode == (3 if missed else 0), done.stderr
    assert (tmp_path / "results/first/trajectories.parquet").is_file()
    assert (tmp_path / "results/yard-bound/report.html").is_file()


def test_make_commands_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make ([a-z]+)", "\n".join(blocks("sh")), flags=re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE)


@pytest.mark.parametrize("path", ["docs/report.png", "LICENSE-MIT", "LICENSE-APACHE"])
def test_files_it_shows_exist(path: str) -> None:
    assert (ROOT / path).stat().st_size < 300_000


@pytest.mark.parametrize("page", ["README.md", *(f"docs/{it.name}" for it in DOCS)])
def test_figures_exist_and_are_small(page: str) -> None:
    place = ROOT / page
    for name in re.findall(r"!\[[^]]*\]\(([^)]+)\)", place.read_text(encoding="utf-8")):
        assert (place.parent / name).stat().st_size < 300_000, name
