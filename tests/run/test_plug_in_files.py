"""Plug-ins of files: in ``--against`` and in the space of ``designs``."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import polars as pl
import pytest

import access_av as product
from access_av.errors import InputError
from access_av.run import plug_in_files

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

MINE = """
import numpy as np


class Mine:
    energy_per_execution_j = 2.0

    def __call__(self, snapshots):
        antennas = np.arange(len(snapshots))
        angles_rad = np.linspace(0.0, np.pi, 361)
        steering = np.exp(1j * np.pi * np.outer(np.cos(angles_rad), antennas))
        power = (abs(steering.conj() @ snapshots) ** 2).sum(axis=1)
        return float(angles_rad[power.argmax()]), 0.05


class EveryTenth:
    def __init__(self):
        self.count = 0

    def __call__(self, situation):
        self.count += 1
        return self.count % 10 == 0
"""
SCENARIO = 'extends = "paper-real-odometry-2"\nname = "short"\n[motion]\nstart_at_m = 285.0\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "short.toml").write_text(SCENARIO)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_plug_ins_are_compared_on_the_command_line(
    access_av: Callable[..., Finished], folder: Path
) -> None:
    texts = ["estimator=mine.py:Mine", "policy=mine.py:EveryTenth"]
    compare = [part for text in texts for part in ("--against", text)]
    done = access_av("run", "short.toml", "--runs", "2", *compare, "--out", "out")
    assert done.code == 0, done.err
    rows = pl.read_parquet(folder / "out/compared.parquet")
    assert rows["variant"].unique(maintain_order=True).to_list() == ["unchanged", *texts]
    changed = rows.filter(pl.col("variant") != "unchanged")
    assert (changed["delta_m"] != 0.0).all()
    # The energy of an estimate is that of the plug-in.
    found = simulated(folder, estimator=plug_in_files.load("estimator", "mine.py:Mine"))
    energy_j = rows.filter(variant=texts[0])["energy_j"][0]
    assert energy_j == pytest.approx(float(found["energy_j"].to_numpy().mean()))
    manifest = json.loads((folder / "out/manifest.json").read_text())
    assert {*manifest["inputs"]} == {"short.toml", "mine.py"}
    again = access_av("rerun", "out")
    assert again.code == 0, again.out + again.err


def simulated(folder: Path, **plug_ins: object) -> pl.DataFrame:
    scenario = product.Scenario.load(str(folder / "short.toml"))
    return product.simulate(scenario, runs=2, seed=1, **plug_ins).runs  # type: ignore[arg-type]


def test_design_sweeps_accept_plug_ins(access_av: Callable[..., Finished], folder: Path) -> None:
    (folder / "space.toml").write_text(
        'estimator = ["", "mine.py:Mine"]\npolicy = ["", "mine.py:EveryTenth"]\n'
    )
    arguments = ("short.toml", "--space", "space.toml", "--runs", "2", "--out", "out")
    done = access_av("design", "sweep", *arguments)
    assert done.code == 0, done.err
    rows = pl.read_parquet(folder / "out/designs.parquet")
    assert rows.height == 4
    estimator = plug_in_files.load("estimator", "mine.py:Mine")
    policy = plug_in_files.load("policy", "mine.py:EveryTenth")
    both = simulated(folder, estimator=estimator, policy=policy)
    row = rows.filter(
        pl.col("choice").str.contains("Mine") & pl.col("choice").str.contains("EveryTenth")
    ).row(0, named=True)
    assert row["aoa_estimates"] == both["aoa_estimates"].to_numpy().mean()
    assert row["energy_j"] == pytest.approx(float(both["energy_j"].to_numpy().mean()))
    # Changed content of the file is another design: no stored part is used.
    (folder / "mine.py").write_text(MINE.replace("% 10", "% 5"))
    done = access_av("design", "sweep", *arguments[:-1], "again")
    assert done.code == 0, done.err
    more = pl.read_parquet(folder / "again/designs.parquet")
    assert (more["aoa_estimates"] > rows["aoa_estimates"]).sum() == 2
    assert (more["aoa_estimates"] == rows["aoa_estimates"]).sum() == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mine.py", "write FILE.py:NAME"),
        ("mine.txt:Mine", "write FILE.py:NAME"),
        ("other.py:Mine", "there is no file other.py"),
        ("mine.py:Yours", "has no class or function Yours"),
        ("mine.py:np2", "has no class or function np2"),
        ("broken.py:Mine", "broken.py fails with ZeroDivisionError"),
    ],
)
def test_an_invalid_plug_in_is_rejected(
    text: str, said: str, access_av: Callable[..., Finished], folder: Path
) -> None:
    (folder / "broken.py").write_text("1 / 0\n")
    with pytest.raises(InputError, match="estimator = "):
        plug_in_files.load("estimator", text)
    (folder / "space.toml").write_text(f'estimator = ["{text}"]\n')
    for arguments in (
        ("run", "short.toml", "--against", f"estimator={text}"),
        ("design", "sweep", "short.toml", "--space", "space.toml", "--runs", "1"),
    ):
        done = access_av(*arguments, columns=200)
        assert done.code == 2
        assert said in " ".join(done.err.split())
