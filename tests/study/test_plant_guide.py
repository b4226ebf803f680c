"""The commands and the Python code of docs/plant.md can be executed."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from typing import TYPE_CHECKING, Any

from access_av import Plant
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pytest

GUIDE = (ROOT / "docs" / "plant.md").read_text(encoding="utf-8")
# A few trips of a short road replace a minute of simulation.
FEW = ("--runs", "2")
SHORT = (
    ("length_m = 200.0", "length_m = 20.0"),
    ("radius_m = 25.0", "radius_m = 8.0"),
    ("radius_m = 30.0", "radius_m = 8.0"),
    ("length_m = 180.0", "length_m = 5.0"),
    (
        "length_m = 162.4",
        "length_m = 5.0",
    ),
    ("at_m = 320.0, dwell_s = 15.0", "at_m = 15.0, dwell_s = 1.0"),
)


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", GUIDE, flags=re.DOTALL)


def test_commands_and_python_code_of_the_guide_run(
    access_av: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # Other tests simulate every operation and set of measures.
    monkeypatch.setattr("access_av.study.points.METHODS", ())
    monkeypatch.setattr("access_av.study.points.FIXED_MS", (500.0,))
    monkeypatch.setattr("access_av.study.measures.MOST_SETS", 1)
    whole = [block.replace("\\\n", " ") for block in blocks("sh")]
    lines = [shlex.split(line) for block in whole for line in block.splitlines()]
    assert [line[1] for line in lines].count("study") == 2
    for _, *words in lines:
        count = 1 if words[0] in ("study", "run") else 2
        command, arguments = " ".join(words[:count]), words[count:]
        if command in ("study", "run", "design integrity"):
            kept = [it for it in arguments if it not in ("--runs", "4", "2")]
            arguments = [*kept, *FEW]
        if command == "run" and arguments[0] == "paper-real-odometry-2":
            arguments += ["--set", "motion.start_at_m=250"]
        if command == "file export" and arguments[0] == "mine.toml":
            Plant.load("mine.toml")
        done = access_av(*command.split(), *arguments)
        assert done.code == 0, (command, arguments, done.err)
        if command == "file new" and arguments[1] == "mine.toml":
            text = (tmp_path / "mine.toml").read_text("utf-8")
            for long, short in SHORT:
                assert long in text
                text = text.replace(long, short)
            (tmp_path / "mine.toml").write_text(text, "utf-8")
    assert (tmp_path / "study" / "report.html").is_file()
    for folder in ("what-if", "elements", "levels", "located"):
        assert (tmp_path / folder / "compared.parquet").is_file()

    (example,) = blocks("python")
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(example, {})
    assert "of the position errors are within" in printed.getvalue()
