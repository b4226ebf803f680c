"""The notebook runs from the first cell to the last."""

from __future__ import annotations

import ast
import json
from typing import TYPE_CHECKING, Any

import altair as alt

import access_av
from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    import pytest

NOTEBOOK = ROOT / "examples/research.ipynb"


def shown(source: str, names: dict[str, Any]) -> Any:
    """Runs a cell as a notebook does; returns the value of an expression at its end."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, NOTEBOOK.name, "exec"), names)
    if last is None:
        return None
    assert isinstance(last, ast.Expr)
    return eval(compile(ast.Expression(last.value), NOTEBOOK.name, "eval"), names)


def test_the_notebook_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    cells = ["".join(it["source"]) for it in notebook["cells"] if it["cell_type"] == "code"]
    names: dict[str, Any] = {}
    charts = []
    for cell in cells:
        value = shown(cell, names)
        if isinstance(value, alt.TopLevelMixin):
            charts.append(value.to_dict())
    printed = capsys.readouterr().out
    # Reproduce: a simulated claim and one by arithmetic.
    assert "a1_adaptive_worst_m" in printed
    assert "agrees (arithmetic)" in printed
    # Change one parameter: less multipath, smaller errors.
    assert names["sweep"].table["rms_error_m"].is_sorted(descending=True)
    # Add an estimator: it located the vehicle, and differs from the scenario's own.
    own = names["own"]
    assert own.table["rms_error_m"][1] < 1.0
    assert not own.difference(1).identical
    # Plot, save and load.
    assert len(charts) == 3
    assert all(chart["datasets"] for chart in charts)
    assert access_av.Simulation.load(tmp_path / "bartlett.zip") == own.results[1]
    assert "True paper-real-odometry-2 1" in printed
