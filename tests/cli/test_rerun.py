"""`access-av rerun` repeats every command that writes a results directory."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl
import pytest

from access_av.cli.main import main
from access_av.tables.inputs import inputs
from short_plant import LAST_METRES

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Finished

    Cli = Callable[..., Finished]

SCENARIO = """\
extends = "paper-real-odometry-2"
name = "short"
[motion]
start_at_m = 285.0
"""
SPACE = "[vehicle.platform]\nmode = [0, 2]\n"
DRIVE = ("--site", "drive/site.toml", "--vehicle", "drive/vehicle.toml")
RANGES = ("--site", "hall.toml", "--vehicle", "receiver.toml")
RECORDED = ("--recording", "drive/iq.sigmf-meta", "--odometry", "drive/odometry.csv")
COMMANDS = {
    "run": (
        *("run", "short.toml", "--runs", "2", "--set", "site.radio_heads[0].eirp_dbm=5"),
        *("--sweep", "site.rician_k_db=0,20", "--against", "short.toml"),
    ),
    "synth": ("record", "synth", "short.toml"),
    "angles": ("record", "angles", "drive/iq.sigmf-meta", *DRIVE),
    "locate": ("record", "locate", *RECORDED, *DRIVE, "--truth", "drive/truth.tum", "--smooth"),
    "survey": ("record", "survey", "log1", "log2", *DRIVE),
    "position": ("record", "locate", "--recording", "stop1/ranges.csv", *RANGES),
    "offsets": ("record", "survey", "stop1", "stop2", "stop3", *RANGES),
    "bound": ("design", "bound", "short.toml", "--map-step-m", "60"),
    "plan": ("design", "plan", "short.toml"),
    "designs": ("design", "sweep", "short.toml", "--space", "space.toml", "--runs", "2"),
    "tune": ("design", "tune", "short.toml", "--runs", "2", "--designs", "2", "--max-error-m", "3"),
    "integrity": ("design", "integrity", "short.toml", "--runs", "2", "--fault", "none"),
    "evaluate": ("paper", "evaluate", "--interpretation", "gate", "--runs", "1"),
    "study": ("study", "plant.toml", "--runs", "2"),
}


RANGING = """
name = "receiver"
drive = "differential"
ranging = { kind = "two-way", sigma_m = 0.1, offset_std_m = 0.5 }
"""


def write_ranges(where: Path) -> None:
    """Writes the ranges of a receiver that stands at three positions, with its site and vehicle."""
    heads = {1: (0.0, 0.0), 2: (20.0, 0.0), 3: (20.0, 30.0), 4: (0.0, 30.0)}
    site = 'name = "hall"\n'
    for pci, (x_m, y_m) in heads.items():
        site += f"[[radio_heads]]\npci = {pci}\nposition_m = [{x_m}, {y_m}, 0.0]\n"
    (where / "hall.toml").write_text(site)
    (where / "receiver.toml").write_text(RANGING)
    for number, (x_m, y_m) in enumerate(((4.0, 6.0), (15.0, 8.0), (6.0, 22.0)), start=1):
        folder = where / f"stop{number}"
        folder.mkdir()
        (folder / "truth.tum").write_text(f"0 {x_m} {y_m} 0 0 0 0 1\n")
        rows = [
            f"{0.1 * epoch},{pci},{math.dist(place_m, (x_m, y_m)) + 0.05 * (-1) ** epoch}"
            for epoch in range(20)
            for pci, place_m in heads.items()
        ]
        (folder / "ranges.csv").write_text("\n".join(["time_s,pci,range_m", *rows]) + "\n")


@pytest.fixture
def run(access_av: Cli, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Finished]:
    """Runs the command line in this process; ``rerun`` repeats the command in another one."""

    def run(where: Path, *arguments: str) -> Finished:
        monkeypatch.chdir(where)
        return access_av(*arguments, columns=200)

    return run


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario, a space of designs, and three recorded drives."""
    where = tmp_path_factory.mktemp("rerun")
    (where / "short.toml").write_text(SCENARIO)
    (where / "space.toml").write_text(SPACE)
    (where / "plant.toml").write_text(LAST_METRES)
    write_ranges(where)
    drives = (
        ("drive", ()),
        ("log1", ("--angles",)),
        ("log2", ("--angles", "--run", "1")),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        patch.setattr("access_av.tables.results_directory.RESULTS", where / "results")
        for name, options in drives:
            words = ("record", "synth", "short.toml", *options, "--out", name)
            patch.setattr(sys, "argv", ["access-av", *words])
            with pytest.raises(SystemExit) as stopped:
                main()
            assert not stopped.value.code
    return where


@pytest.mark.parametrize("name", COMMANDS)
def test_the_results_of_every_command_are_repeated(name: str, folder: Path, run: Cli) -> None:
    if name == "tune":
        pytest.importorskip("optuna", reason="the extra `optuna` is not installed")
    done = run(folder, *COMMANDS[name], "--out", f"of-{name}")
    assert done.code in (0, 3), done.err
    repeated = run(folder, "rerun", f"of-{name}", "--json")
    assert repeated.code == 0, repeated.out + repeated.err
    record = json.loads(repeated.out)
    assert record["identical"]
    assert record["differences"] == record["changed_inputs"] == []
    files = [it for it in (folder / f"of-{name}").rglob("*") if it.is_file()]
    assert record["files"] == sum("parts" not in it.parts for it in files) > 1
    assert record["written_by"] == record["repeated_by"]


def test_a_command_line_of_an_earlier_version_is_repeated(
    folder: Path, tmp_path: Path, run: Cli
) -> None:
    done = run(folder, "design", "bound", "short.toml", "--out", str(tmp_path / "old"))
    assert done.code == 0, done.err
    file = tmp_path / "old/manifest.json"
    manifest = json.loads(file.read_text())
    program, *words = manifest["command"]
    assert words[:2] == ["design", "bound"]
    file.write_text(json.dumps({**manifest, "command": [program, *words[1:]]}))
    repeated = run(folder, "rerun", str(tmp_path / "old"))
    assert repeated.code == 0, repeated.out + repeated.err


def test_every_command_with_results_is_tried() -> None:
    from access_av.cli.main import app

    source = Path(__file__).parents[2] / "python/access_av"
    creating = [
        file
        for file in (*source.glob("cli/*.py"), source / "report/paper/results.py")
        if "ResultsDirectory.create(" in file.read_text(encoding="utf-8")
    ]
    number = sum(
        it.read_text(encoding="utf-8").count("ResultsDirectory.create(") for it in creating
    )
    assert number == len(COMMANDS)
    assert app.registered_groups


@pytest.fixture
def results(folder: Path, tmp_path: Path, run: Cli) -> Path:
    done = run(folder, "run", "short.toml", "--out", str(tmp_path / "mine"))
    assert done.code == 0, done.err
    return tmp_path / "mine"


def test_differences_are_listed(folder: Path, results: Path, run: Cli) -> None:
    table = pl.read_parquet(results / "aoa_estimates.parquet")
    moved = table.with_columns(pl.col("time_s") + 0.25)
    moved.write_parquet(results / "aoa_estimates.parquet")
    (results / "truth.tum").write_text("0 0 0\n" + (results / "truth.tum").read_text())
    (results / "report.html").unlink()
    (results / "notes.txt").write_text("mine")
    manifest = json.loads((results / "manifest.json").read_text())
    (results / "manifest.json").write_text(json.dumps({**manifest, "seed": 7}))
    done = run(folder, "rerun", str(results))
    assert done.code == 3, done.err
    lines = dict(line.split(": ", 1) for line in done.out.splitlines() if ": " in line)
    assert lines["aoa_estimates.parquet"] == "columns differ: time_s by up to 0.25"
    assert lines["truth.tum"].startswith("line 1: '0 0 0' instead of ")
    assert lines["report.html"] == "only in the new results"
    assert lines["notes.txt"] == "missing in the new results"
    assert lines["manifest.json"] == "entries differ: seed"
    assert "5 of " in done.out


def test_the_copy_of_the_settings_replaces_a_changed_input(
    folder: Path, results: Path, run: Cli
) -> None:
    scenario = folder / "short.toml"
    try:
        scenario.write_text(SCENARIO.replace("285", "280"))
        changed = run(folder, "rerun", str(results), "--json")
        scenario.unlink()
        missing = run(folder, "rerun", str(results), "--json")
    finally:
        scenario.write_text(SCENARIO)
    for done, said in ((changed, "has changed"), (missing, "is missing")):
        assert said in " ".join(done.err.split())
        record = json.loads(done.out)
        # The page shows the settings as they were given, here those of the copy.
        assert {it["file"] for it in record["differences"]} <= {"report.html"}, record
        assert len(record["changed_inputs"]) == 1


def test_results_that_cannot_be_repeated_are_reported(
    folder: Path, results: Path, run: Cli
) -> None:
    def refused(*arguments: str) -> str:
        done = run(folder, "rerun", *arguments)
        assert done.code == 2, done.out
        return " ".join(done.err.split())

    assert "no results of a command (" in refused(str(folder))
    assert "working directory does not exist" in refused(str(results), "--directory", "nowhere")
    assert "--keep needs a new directory" in refused(str(results), "--keep", str(folder))
    manifest = json.loads((results / "manifest.json").read_text())
    (results / "manifest.json").write_text(
        json.dumps({**manifest, "command": ["access-av", "fly"]})
    )
    assert "the command failed again (exit code 2): access-av fly" in refused(str(results))
    (results / "manifest.json").write_text("{}")
    assert "`command` is missing" in refused(str(results))


def test_inputs_are_the_files_that_arguments_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.toml", "b.csv", "mine.py", "iq.sigmf-meta", "iq.sigmf-data", "out/c.toml"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(name)
    arguments = ["run", "a.toml", "--set", "road.file=b.csv", "--against", "policy=mine.py:P"]
    arguments += ["iq.sigmf-meta", "out/c.toml", "yard", "x" * 5000, "\0"]
    found = inputs(arguments, Path("out"))
    assert list(found) == ["a.toml", "b.csv", "mine.py", "iq.sigmf-meta", "iq.sigmf-data"]
    assert found["a.toml"]["bytes"] == 6
