from __future__ import annotations

import json
import os
import re
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av.tables.results_directory import ResultsDirectory, tum_trajectory, write_whole

if TYPE_CHECKING:
    from pathlib import Path

NUMBER = r"-?\d+\.\d+"


def test_tum_lines_have_eight_fields_and_nothing_else() -> None:
    rng = np.random.default_rng(1)
    text = tum_trajectory(np.arange(50) * 0.02, *rng.normal(size=(3, 50)))
    lines = text.split("\n")
    assert lines.pop() == ""
    assert len(lines) == 50
    for line in lines:
        assert re.fullmatch(rf"\d+\.\d{{9}}( {NUMBER}){{7}}", line)


def test_tum_is_read_by_evo(tmp_path: Path) -> None:
    file_interface = pytest.importorskip("evo.tools.file_interface")
    heading_rad = np.linspace(-3.0, 3.0, 7)
    file = tmp_path / "trajectory.tum"
    file.write_text(tum_trajectory(np.arange(7.0), np.arange(7.0), np.zeros(7), heading_rad))
    poses = file_interface.read_tum_trajectory_file(file)
    assert poses.positions_xyz[:, 0] == pytest.approx(np.arange(7.0))
    assert poses.get_orientations_euler()[:, 2] == pytest.approx(heading_rad)


def test_latest_points_to_the_newest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        directory = ResultsDirectory.create("evaluate")
        directory.write_json("claims.json", [])
        directory.link_latest()
    assert (tmp_path / "results" / "latest").resolve() == directory.path.resolve()
    assert json.loads((tmp_path / "results/latest/claims.json").read_text()) == []


def test_another_output_directory_is_used_without_a_latest_link(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    directory = ResultsDirectory.create("run", tmp_path / "else" / "here")
    directory.write_table("table.parquet", pl.DataFrame({"run": [0]}))
    directory.link_latest()
    assert [path.name for path in directory.path.iterdir()] == ["table.parquet"]
    assert [path.name for path in tmp_path.iterdir()] == ["else"]


def test_latest_also_points_to_a_named_directory_under_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    directory = ResultsDirectory.create("run", tmp_path / "results" / "mine")
    directory.write_table("table.parquet", pl.DataFrame({"run": [0]}))
    directory.link_latest()
    assert (tmp_path / "results/latest/table.parquet").samefile(directory.path / "table.parquet")


def test_an_existing_file_that_blocks_the_output_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="--out takes a directory"):
        ResultsDirectory.create("run", tmp_path / "file")


def test_output_to_a_pipe_or_link_does_not_replace_it(tmp_path: Path) -> None:
    pipe, link, file = tmp_path / "pipe", tmp_path / "link", tmp_path / "file"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_whole(pipe, "a = 1\n")
        assert os.read(reader, 100) == b"a = 1\n"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    file.write_text("a = 0\n", encoding="utf-8")
    link.symlink_to(file)
    assert write_whole(link, "a = 2\n") == link
    assert link.is_symlink()
    assert file.read_text(encoding="utf-8") == "a = 2\n"
    assert sorted(it.name for it in tmp_path.iterdir()) == ["file", "link", "pipe"]
