from __future__ import annotations

import fcntl
import importlib.util
import os
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parent.parent

# Remove the terminal size of parallel workers, which consoles would use.
for size in ("COLUMNS", "LINES"):
    os.environ.pop(size, None)

# One worker per core: further threads of linear algebra take ten times the CPU time, by waiting.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


# Files of slow tests, which `make check` skips: long simulations, attacks and started programs.
SLOW = {
    *("test_attack", "test_interrupt", "test_robustness", "test_readme", "test_site"),
    *("test_bags", "test_locate", "test_locate_mistakes", "test_real_drives", "test_survey"),
    *("test_channel", "test_plan", "test_designs", "test_tune", "test_profile"),
    *("test_bound", "test_drive", "test_plug_ins", "test_scatter", "test_truth"),
    *("test_codesign", "test_outlook", "test_interpretations", "test_second_implementation"),
    *("test_headline", "test_unknowns", "test_cli", "test_columns"),
    *("test_node", "test_radio", "test_aarch64", "test_live", "test_off_the_road"),
    *("test_fault_campaign", "test_manifold"),
    *("test_study", "test_study_tables", "test_study_page", "test_study_inputs"),
    *("test_compared", "test_plant_guide"),
    *("test_labels", "test_notebook", "test_plug_in_files", "test_recomputed"),
    "test_sensitivity",
    *("test_results", "test_rerun", "test_study_file"),
}


# The longest file: it waits for nodes that run in real time.
LONGEST = "test_fault_campaign"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.stem in SLOW:
            item.add_marker(pytest.mark.slow)
    # Workers start the longest files first, so that all of them end at about the same time.
    items.sort(key=lambda it: (it.path.stem != LONGEST, it.path.stem not in SLOW))


class Finished(NamedTuple):
    code: int
    out: str
    err: str


def commands() -> list[str]:
    """Returns all commands of the command line, such as ``paper evaluate``."""
    import typer.main

    from access_av.cli.main import app

    top: Any = typer.main.get_command(app)
    found = list[str]()
    for name, command in top.commands.items():
        inner = getattr(command, "commands", None)
        found += [name] if inner is None else [f"{name} {it}" for it in inner]
    return found


@pytest.fixture
def access_av(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Callable[..., Finished]:
    """Runs the command line in this process, with a separate results directory for each test."""
    from access_av.cli.main import main

    monkeypatch.setattr("access_av.tables.results_directory.RESULTS", tmp_path / "results")

    def run(*arguments: str, columns: int = 100) -> Finished:
        monkeypatch.setattr(sys, "argv", ["access-av", *map(str, arguments)])
        monkeypatch.setenv("COLUMNS", str(columns))
        capsys.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main()
        return Finished(int(stopped.value.code or 0), *capsys.readouterr())

    return run


def benchmark(name: str) -> Any:
    """Returns the module of a benchmark."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f"benches/{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def made_once(
    tmp_path_factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]
) -> Path:
    """Returns a directory that ``make`` fills once for all parallel workers."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent  # the workers have directories of their own in it
    folder, finished = base / name, base / f"{name}.finished"
    with (base / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not finished.exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            finished.touch()
    return folder


@pytest.fixture(scope="session")
def quick_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a small evaluation, in a temporary ``results/`` directory."""
    from access_av.report.paper import results as paper_results

    def make(results: Path) -> None:
        directory = results / "2000-01-01T000000.000-evaluate"
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("access_av.tables.results_directory.RESULTS", results)
            paper_results.run(["every-ssb", "gate"], runs=3, seed=5, out=directory)

    return made_once(tmp_path_factory, "quick-results", make)


@pytest.fixture(scope="session")
def short_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the command for the short plant, with all measures and one variant."""
    from access_av.cli.main import main
    from short_plant import PLANT

    def make(folder: Path) -> None:
        (folder / "short.toml").write_text(PLANT, "utf-8")
        command = ["access-av", "study", str(folder / "short.toml"), "--runs", "4"]
        more = ["--force-remedies", "--sweep", "site.rician_k_db=3", "--out", str(folder / "out")]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("access_av.tables.results_directory.RESULTS", folder / "results")
            patch.setattr(sys, "argv", [*command, *more])
            with pytest.raises(SystemExit) as stopped:
                main()
        assert not stopped.value.code

    return made_once(tmp_path_factory, "short-study", make) / "out"


@pytest.fixture
def data() -> Path:
    """Directory of the reference recordings; skips the test if it does not exist."""
    place = Path(os.environ.get("ACCESS_AV_DATA", ROOT.parent / "shared" / "data"))
    if not place.is_dir():
        pytest.skip(f"no reference data: neither {place} nor ACCESS_AV_DATA")
    return place
