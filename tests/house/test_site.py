"""`make docs` builds the documentation site without warnings, with complete reference pages."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import access_av
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
    # The reference pages contain every key, command and public name.
    pages = ROOT / "target/docs/pages"
    settings = (pages / "settings.md").read_text(encoding="utf-8")
    for kind in ("Site", "Vehicle", "Scenario", "Plant", "Platform"):
        schema = json.loads(getattr(access_av, kind).schema_json())
        tables = [schema, *schema["$defs"].values()]
        for table in [one for it in tables for one in it.get("oneOf", [it])]:
            for key, item in table.get("properties", {}).items():
                assert "const" in item or f"| `{key}` |" in settings, key
    commands = (pages / "commands.md").read_text(encoding="utf-8")
    for command in ("run", "study", "record locate", "file schema"):
        assert f"## access-av {command}\n" in commands
    python = (pages / "python-api.md").read_text(encoding="utf-8")
    for name in access_av.__all__:
        assert name.startswith("_") or f"`access_av.{name}`" in python, name
