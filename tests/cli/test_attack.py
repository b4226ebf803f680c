"""Short attack with fixed seeds; ``make attack`` uses a new seed and more mutations."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path


def attack(tmp_path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "attack", "--keep", str(tmp_path / "kept"), *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


def test_a_short_attack_finds_no_defect(tmp_path: Path) -> None:
    done = attack(tmp_path, "--seed", "2024", "--inputs", "60", "--drives", "6")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "seed 2024" in done.stdout
    assert "no findings" in done.stdout


def test_damaged_parquet_that_aborts_its_reader_is_rejected(tmp_path: Path) -> None:
    done = attack(tmp_path, "--seed", "2798264004", "--only", "results-13804")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("harm", "found"),
    [
        ("raise RuntimeError('x')", "traceback"),
        ("import os; os.abort()", "abort"),
        ("bytes(3 << 30)", "traceback"),
        ("open('x.json', 'w').write('[NaN]')", "nan"),
        ("open('.x.partial', 'w')", "half-written"),
        ("import sys; print('error: ' + 'x' * 999, file=sys.stderr)", "long-message"),
        ("import sys; print('\\x1b[2J', file=sys.stderr)", "control-character"),
        ("raise SystemExit(7)", "code"),
    ],
)
def test_the_layout_check_detects_faults(tmp_path: Path, harm: str, found: str) -> None:
    script = (
        "import sys, pathlib; from attack import kinds, worker\n"
        f"kinds.KINDS['drive'] = (lambda random, case: case.python({harm!r}), 0)\n"
        "sys.argv = ['worker', '1', sys.argv[1]]; worker.main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        input="drive 0\n",
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    answered = done.stdout.splitlines()[1:]
    assert (found == "abort") == (not answered)
    assert found == "abort" or found in answered[0]
