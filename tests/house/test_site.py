"""`make docs` builds the documentation site without warnings."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

SITE_LIMIT_BYTES = 5_000_000


def test_site_builds_without_warnings() -> None:
    if shutil.which("zensical", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("zensical is not installed (extra `docs`)")
    done = subprocess.run(
        [sys.executable, ROOT / "docs/site/build.py"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    files = [file for file in (ROOT / "target/docs/site").rglob("*") if file.is_file()]
    assert (ROOT / "target/docs/site/estimator.html") in files
    assert sum(file.stat().st_size for file in files) <= SITE_LIMIT_BYTES
