"""Designs: spaces, interrupted campaigns, Pareto fronts, and suggested changes of limits."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import Scenario, columns
from access_av.designs import driven
from access_av.designs.driven import Design, Driven, designs_of, in_worlds
from access_av.designs.front import front, may_be_front, rows_of, rows_of_worlds
from access_av.designs.query import Query, what_to_change
from access_av.designs.search import Found, rounds, search, suggested
from access_av.designs.space import Space, sobol
from access_av.device.platform import Platform
from access_av.errors import InputError
from access_av.report.designs import render_designs
from access_av.run.campaign import Campaign, CampaignError, ResultCache, Task
from access_av.run.campaign import campaign as opened
from access_av.run.pairs import ErrorSamples

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Finished

# Spaces.


def test_sobol_points_are_spread_evenly() -> None:
    points = sobol(256, 10)
    for column in points.T:
        assert sorted(np.floor(column * 256).astype(int)) == list(range(256))
    for one, other in [(0, 1), (1, 2), (3, 7)]:
        cells = np.floor(points[:, [one, other]] * 4).astype(int)
        counts = np.unique(cells, axis=0, return_counts=True)[1]
        assert counts.tolist() == [16] * 16, (one, other)


def test_nested_tables_define_a_design_space() -> None:
    space = Space.of({"vehicle": {"platform": {"mode": [0, 2]}, "x": {"low": 1, "high": 4}}})
    assert [dimension.key for dimension in space.dimensions] == [
        "vehicle.platform.mode",
        "vehicle.x",
    ]
    assert space.sobol(2) == [
        {"vehicle.platform.mode": 0, "vehicle.x": 1.0},
        {"vehicle.platform.mode": 2, "vehicle.x": 2.5},
    ]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({}, "no key"),
        ({"a": []}, "a: the list is empty"),
        ({"a": 1}, "a: 1 is one value"),
        ({"a": {"low": 2, "high": 1}}, "a: `low` must be below `high`"),
        ({"a": {"low": 0, "high": 1, "log": True}}, "positive if `log`"),
        ({"a": {"low": 0, "high": 1, "step": 2}}, "a.step: unknown"),
        ({"site": {"rician_k_db": [5.0, 9.0]}}, r"this key cannot be chosen; write \[world\]"),
        ({"channel": {"model": ["umi"]}}, "channel.model: this key cannot be chosen"),
        ({"a": [1], "world": {"b": {"low": 0, "high": 1}}}, "world.b: a grid needs a list"),
        ({"a": [1], "world": {}}, "world: no key with a list"),
    ],
)
def test_bad_spaces_name_the_key(table: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Space.of(table)


def test_an_invalid_design_is_rejected_with_key_and_allowed_values() -> None:
    with pytest.raises(InputError, match=r"platform.mode.*has the modes 0, 1, 2"):
        designs_of(Scenario.load("paper"), [{"vehicle.platform.mode": 9}])


# Campaigns.


def part(number: int, pause_s: float = 0.0) -> dict[str, np.ndarray]:
    time.sleep(pause_s)
    return {"x": np.random.default_rng(number).normal(size=500)}


def tasks(count: int = 12, pause_s: float = 0.0) -> list[Task]:
    return [Task({"number": number}, part, (number, pause_s)) for number in range(count)]


def contents(path: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in sorted(path.glob("*.npz"))}


@pytest.fixture
def whole(tmp_path: Path) -> dict[str, bytes]:
    Campaign(ResultCache(tmp_path / "whole")).run(tasks())
    return contents(tmp_path / "whole")


def test_results_do_not_depend_on_the_executor(tmp_path: Path, whole: dict[str, bytes]) -> None:
    assert len(whole) == 12
    for number, pool in enumerate([ThreadPoolExecutor(3), ProcessPoolExecutor(2)]):
        with pool:
            found = Campaign(ResultCache(tmp_path / str(number)), pool).run(tasks())
        assert contents(tmp_path / str(number)) == whole
        assert all(np.array_equal(found[i]["x"], part(i)["x"]) for i in range(12))


def test_two_simultaneous_campaigns_share_one_directory(
    tmp_path: Path, whole: dict[str, bytes]
) -> None:
    parts = ResultCache(tmp_path / "both")
    both = [threading.Thread(target=Campaign(parts).run, args=(tasks(),)) for _ in range(2)]
    for one in both:
        one.start()
    for one in both:
        one.join()
    assert contents(parts.path) == whole
    assert not list(parts.path.glob("*.partial"))


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04", None])
def test_a_damaged_part_is_reported_and_computed_again(
    tmp_path: Path, whole: dict[str, bytes], damage: bytes | None
) -> None:
    parts = ResultCache(tmp_path / "whole")
    name, text = next(iter(whole.items()))
    bits = bytearray(text)
    bits[len(bits) // 2] ^= 0xFF
    (parts.path / name).write_bytes(bytes(bits) if damage is None else damage)
    with pytest.warns(UserWarning, match=f"{name}: damaged"):
        Campaign(parts).run(tasks())
    assert contents(parts.path) == whole


def test_a_full_disk_is_reported_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: dict[str, bytes]
) -> None:
    parts = ResultCache(tmp_path / "full")
    Campaign(parts).run(tasks()[::2])

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("access_av.tables.results_directory.os.fsync", full)
        with pytest.raises(OSError, match="No space left") as caught:
            Campaign(parts).run(tasks())
    assert str(caught.value.filename).startswith(str(parts.path))
    assert not list(parts.path.glob("*.partial"))
    assert len(contents(parts.path)) == 6
    Campaign(parts).run(tasks())
    assert contents(parts.path) == whole


class Dying(Executor):
    """Workers that end after a number of tasks."""

    def __init__(self, after: int) -> None:
        self.left = after

    def submit(self, work: Any, /, *arguments: Any, **_: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.left -= 1
        if self.left >= 0:
            future.set_result(work(*arguments))
        else:
            future.set_exception(BrokenProcessPool("a worker died"))
        return future


def test_finished_parts_survive_lost_workers(tmp_path: Path, whole: dict[str, bytes]) -> None:
    parts = ResultCache(tmp_path / "dying")
    with pytest.raises(CampaignError, match=r"workers have ended.*repeat the command to continue"):
        Campaign(parts, Dying(5)).run(tasks())
    assert len(contents(parts.path)) == 5
    Campaign(parts).run(tasks())
    assert contents(parts.path) == whole


def test_an_error_of_a_task_is_not_a_lost_worker(tmp_path: Path) -> None:
    bad = Task({"bad": 1}, int, ("not a number",))
    with ThreadPoolExecutor(1) as pool, pytest.raises(ValueError, match="invalid literal"):
        Campaign(ResultCache(tmp_path), pool).run([bad])


# Forks a campaign, kills it after each of the instants, and then lets it finish.
KILLER = """
import os, signal, sys, time
from pathlib import Path
sys.path.insert(0, {tests!r})
from access_av.run.campaign import Campaign
from access_av.run.campaign import ResultCache
from test_designs import tasks
campaign = Campaign(ResultCache(Path({parts!r})))
for instant in {instants!r}:
    child = os.fork()
    if child == 0:
        campaign.run(tasks(12, 0.02))
        os._exit(0)
    time.sleep(instant)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
campaign.run(tasks(12, 0.02))
"""


def test_a_campaign_killed_at_20_random_times_gives_equal_bytes(
    tmp_path: Path, whole: dict[str, bytes]
) -> None:
    instants = np.random.default_rng(3).uniform(0.0, 0.05, 20)
    parts = tmp_path / "killed"
    text = KILLER.format(
        tests=str(Path(__file__).parent), parts=str(parts), instants=instants.tolist()
    )
    subprocess.run([sys.executable, "-c", text], check=True, capture_output=True)
    assert contents(parts) == whole


# Recipes of executors, as a user writes them.
RECIPES = {
    "threads": (
        "concurrent.futures",
        "from concurrent.futures import ThreadPoolExecutor\n"
        "def make():\n    return ThreadPoolExecutor(2)\n",
    ),
    "dask": (
        "distributed",
        "from distributed import Client, LocalCluster\n"
        "def make():\n"
        "    cluster = LocalCluster(n_workers=2, processes=False, dashboard_address=None)\n"
        "    return Client(cluster).get_executor(pure=False)\n",
    ),
    "executorlib": (
        "executorlib",
        "from executorlib import SingleNodeExecutor\n"
        "def make():\n    return SingleNodeExecutor(max_workers=2)\n",
    ),
}


@pytest.mark.parametrize("recipe", RECIPES)
def test_executors_of_the_documented_recipes_give_equal_bytes(
    tmp_path: Path, whole: dict[str, bytes], recipe: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, text = RECIPES[recipe]
    # Other processes import the work of the tasks from this file.
    here = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, here)))
    pytest.importorskip(module, reason=f"{module} is not installed")
    (tmp_path / "recipe.py").write_text(text)
    with opened(tmp_path / "parts", f"{tmp_path / 'recipe.py'}:make") as kept:
        kept.run(tasks())
    assert contents(tmp_path / "parts") == whole


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def make():\n    return 3\n", "returns int; it must return a concurrent.futures.Exec"),
        ("def make():\n    raise OSError('no scheduler')\n", "OSError: no scheduler"),
        ("make = 1\n", "no class or function make"),
    ],
)
def test_an_unusable_executor_is_reported(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "recipe.py"
    file.write_text(text)
    with pytest.raises(InputError, match=message), opened(tmp_path, f"{file}:make"):
        pass


# A local cluster in which one process ends after three parts.
DYING = """
import json, subprocess, sys, threading, time
from pathlib import Path
sys.path.insert(0, {tests!r})
from distributed import Client
from access_av.run.campaign import Campaign, CampaignError
from access_av.run.campaign import ResultCache
from test_designs import tasks
parts, file = Path({parts!r}), Path({parts!r}) / "scheduler.json"
parts.mkdir()
def started(program, *more):
    usual = ["--scheduler-file", str(file), "--no-dashboard", *more]
    return subprocess.Popen([sys.executable, "-m", f"distributed.cli.dask_{{program}}", *usual])
alone = ["--nthreads", "1", "--no-nanny", "--death-timeout", "9"]
scheduler = started("scheduler", "--host", "127.0.0.1", "--port", "0")
workers = [started("worker", *alone) for _ in range(2)]
def kill():
    while len(list(parts.glob("*.npz"))) < 3:
        time.sleep(0.01)
    (scheduler if {dies!r} == "scheduler" else workers[0]).kill()
try:
    while not file.exists():
        time.sleep(0.05)
    address = json.loads(file.read_text())["address"]
    threading.Thread(target=kill, daemon=True).start()
    with Client(address).get_executor(pure=False) as pool:
        Campaign(ResultCache(parts), pool).run(tasks(12, 0.2))
    print("finished")
except CampaignError as error:
    print(error)
finally:
    for process in [scheduler, *workers]:
        process.kill()
"""


@pytest.mark.parametrize(
    ("dies", "says"),
    [("worker", "finished"), ("scheduler", "the workers have ended")],
)
def test_a_campaign_survives_the_end_of_a_cluster_process(
    tmp_path: Path, whole: dict[str, bytes], dies: str, says: str
) -> None:
    pytest.importorskip("distributed")
    tests, parts = str(Path(__file__).parent), tmp_path / "dask"
    text = DYING.format(tests=tests, parts=str(parts), dies=dies)
    done = subprocess.run(
        [sys.executable, "-c", text],
        env={**os.environ, "PYTHONPATH": tests},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert says in done.stdout, done.stderr
    left = contents(parts)
    assert len(left) == 12 if dies == "worker" else 3 <= len(left) < 12
    Campaign(ResultCache(parts)).run(tasks())
    assert contents(parts) == whole


# Pareto fronts of designs with known energy and error, and common noise.


def known(energy_j: float, rms_m: float, noise: np.ndarray, own: np.ndarray, label: str) -> Driven:
    design = Design({}, label, Scenario.load("paper"), Platform.load("jetson-agx-xavier"))
    square_m2 = rms_m**2 * (1.0 + 0.5 * noise + 0.02 * own)
    return Driven(
        design=design,
        square_m2=square_m2,
        energy_j=np.full(noise.size, energy_j),
        worst_m=3.0 * np.sqrt(square_m2),
        errors=ErrorSamples(
            errors_m=np.sqrt(square_m2)[:, None] * np.linspace(0.1, 2.0, 40, dtype=np.float32),
            duration_s=2.0,
        ),
        aoa_estimates=np.ones(noise.size),
        bursts_received=np.ones(noise.size),
        track_s=np.arange(3.0),
        track_m2=np.ones(3),
    )


def cloud(runs: int, pairs: list[tuple[float, float]]) -> list[Driven]:
    rng = np.random.default_rng(4)
    noise = rng.uniform(-1.0, 1.0, runs)
    return [
        known(*pair, noise, rng.uniform(-1.0, 1.0, runs), f"design {number}")
        for number, pair in enumerate(pairs)
    ]


PAIRS = [(1.0, 0.4), (2.0, 0.2), (2.1, 0.35), (4.0, 0.1), (4.1, 0.1), (8.0, 0.3)]


def test_the_pareto_front_considers_confidence() -> None:
    driven = cloud(20, PAIRS)
    assert set(front(driven)) - {4} == {0, 1, 3}
    # Designs that common random numbers do not separate may be on the front.
    assert {0, 1, 3} <= set(may_be_front(driven)) <= {0, 1, 3, 4}


def test_the_report_of_many_designs_draws_every_chart() -> None:
    rng = np.random.default_rng(5)
    few = cloud(4, PAIRS)
    driven = [
        replace(
            few[0], energy_j=np.full(4, energy_j), track_s=np.arange(161.0), track_m2=np.ones(161)
        )
        for energy_j in rng.uniform(0.1, 9.0, 300)
    ]
    page = render_designs(Scenario.load("paper"), driven, rows_of(driven), rows_of_worlds(driven))
    assert "energy of a trip / J" in page
    assert len(page) < 6_000_000


def test_the_table_has_its_documented_columns() -> None:
    driven = cloud(4, PAIRS)
    driven.append(replace(driven[0], energy_j=np.full(4, np.inf), square_m2=np.full(4, np.inf)))
    rows = rows_of(driven)
    assert rows.columns == list(columns.TABLES["operating_points"].of("`designs.parquet`"))
    assert rows["energy_j"].to_list()[-1] is rows["rms_error_m"].to_list()[-1] is None
    assert rows["on_front"].to_list()[-1] is False


def test_constraints_choose_the_least_energy() -> None:
    rows = rows_of(cloud(20, PAIRS))
    assert Query(max_rms_m=0.25).kept(rows)["design"][0] == 1
    assert Query(max_energy_j=3.0, max_rms_m=0.15).kept(rows).is_empty()


def test_an_unreachable_limit_reports_the_reachable_value() -> None:
    rows = rows_of(cloud(20, PAIRS))
    advice = what_to_change(Query(max_energy_j=3.0, max_rms_m=0.15), rows)
    assert advice[0].startswith("energy 4 J instead of 3 J: design 3")
    assert advice[1].startswith("RMS error 0.2")
    assert " m instead of 0.15 m: " in advice[1]
    assert "design 1" in advice[1]
    advice = what_to_change(Query(max_energy_j=0.0, max_rms_m=0.0), rows)
    assert advice[0].startswith("energy: no value of this limit alone is sufficient")


def test_a_design_is_rated_in_its_worst_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One design is better in one environment and much worse in the other."""

    def pretended(text: str, _seed: int, _first: int, runs: int) -> dict[str, np.ndarray]:
        scenario = json.loads(Scenario.from_toml(text).to_json())
        bold = scenario["vehicle"]["wake_up"]["interval_ms"] == 8000.0
        scattered = scenario["site"]["rician_k_db"] < 10.0
        rms_m = np.full(runs, (0.9 if scattered else 0.05) if bold else 0.2)
        count = np.full(runs, 10.0 if bold else 40.0)
        return {
            "aoa_estimates": count, "bursts_received": count, "rms_error_m": rms_m,
            "max_error_m": rms_m,
            "error_m": np.repeat(rms_m[:, None], 900, axis=1).astype(np.float32),
            "track_s": np.arange(0.0, 9001.0, 10.0), "track_m2": np.ones(901),
        }  # fmt: skip

    monkeypatch.setattr(driven, "simulated", pretended)
    space = Space.of(
        {
            "vehicle": {
                "platform": {"name": ["jetson-agx-xavier-engine"]},
                "wake_up": {"policy": ["fixed"], "interval_ms": [2000.0, 8000.0]},
            },
            "world": {"site": {"rician_k_db": [5.0, 15.0]}},
        }
    )
    assert list(space.worlds) == ["rician_k_db 5", "rician_k_db 15"]
    designs = in_worlds(Scenario.load("paper"), space.grid(), space.worlds)
    found = search(Campaign(ResultCache(tmp_path)), designs, runs=3, seed=1)
    assert found.drives == 2 * 2 * 3
    rows, of_worlds = rows_of(found.driven), rows_of_worlds(found.driven)
    assert rows["p99_error_m"].to_list() == pytest.approx([0.2, 0.9])
    assert rows["world"][1] == "rician_k_db 5"
    assert of_worlds["p99_error_m"].to_list() == pytest.approx([0.2, 0.2, 0.9, 0.05])
    assert of_worlds.columns == rows.columns
    kept = Query(max_error_m=0.3).kept(rows)
    assert kept["choice"].to_list() == ["interval_ms 2000"]
    page = render_designs(Scenario.load("paper"), found.driven, rows, of_worlds)
    assert "Worst environment" in page
    assert "Each environment" in page


def test_limits_are_not_met_with_too_few_runs() -> None:
    row = {"p99_error_m": 0.28, "p99_error_low_m": 0.2, "p99_error_high_m": 0.4}
    bound = Query(max_error_m=0.3, percentile=99.0)
    assert bound.keeps(row)
    assert not bound.keeps_surely(row)
    assert "too few runs" in bound.in_words(row)[0]
    assert bound.in_words({**row, "p99_error_high_m": 0.29})[0].endswith("met")
    assert bound.in_words({**row, "p99_error_m": 0.31})[0].endswith("missed")
    assert bound.in_words({**row, "p99_error_high_m": None})[0].endswith("too few runs")
    with pytest.raises(InputError, match=r"percentile 42: allowed are 50, 90, 95, 99, 99\.9"):
        Query(max_error_m=0.3, percentile=42.0)


def test_successive_halving_has_the_documented_rounds() -> None:
    assert rounds(20, halving=True) == [2, 6, 20]
    assert rounds(2, halving=True) == [2]
    assert rounds(1, halving=True) == [1]


def by_halving(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, halving: bool) -> Found:
    """Simulates 120 designs whose error decreases, and whose estimates increase, with ``bound``."""

    def pretended(text: str, seed: int, first_run: int, runs: int) -> dict[str, np.ndarray]:
        wake_up = Scenario.from_toml(text)
        settings = json.loads(wake_up.vehicle.to_json())["wake_up"]
        interval_ms = settings["interval_ms"]
        spoilt = json.loads(wake_up.vehicle.to_json())["receiver"]["snr_noise_db"]
        noise = np.array([np.random.default_rng([seed, run]).normal() for run in range(99)])
        own = np.random.default_rng(round(interval_ms * 100 + spoilt * 7)).normal(size=99)
        rms_m = 0.1 * (1.0 + spoilt) * np.sqrt(interval_ms / 1000.0)
        square_m2 = rms_m**2 * np.exp(0.3 * noise + 0.03 * own)
        mine = slice(first_run, first_run + runs)
        count = np.full(runs, 80_000.0 / interval_ms)
        return {
            "aoa_estimates": count, "bursts_received": count,
            "rms_error_m": np.sqrt(square_m2[mine]),
            "max_error_m": 3.0 * np.sqrt(square_m2[mine]), "track_s": np.arange(3.0),
            "error_m": np.sqrt(square_m2[mine])[:, None] * np.ones((1, 4), dtype=np.float32),
            "track_m2": np.ones(3),
        }  # fmt: skip

    monkeypatch.setattr(driven, "simulated", pretended)
    space = Space.of(
        {
            "vehicle": {
                "platform": {"name": ["jetson-agx-xavier-engine"]},
                "wake_up": {
                    "policy": ["fixed"],
                    "interval_ms": [250.0 * 1.25**k for k in range(10)],
                },
                "receiver": {"snr_noise_db": [0.03 * k**2 for k in range(12)]},
            }
        }
    )
    designs = in_worlds(Scenario.load("paper"), space.grid(), space.worlds)
    assert len(designs) == 120
    campaign = Campaign(ResultCache(tmp_path / str(halving)))
    return search(campaign, designs, runs=20, seed=1, halving=halving)


def test_halving_finds_the_front_of_the_grid_with_a_quarter_of_the_drives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    grid = by_halving(tmp_path, monkeypatch, halving=False)
    less = by_halving(tmp_path, monkeypatch, halving=True)
    assert less.drives <= grid.drives / 4
    sure = {grid.driven[index].design.label for index in may_be_front(grid.driven)}
    best = {less.driven[index].design.label for index in front(less.driven)}
    assert len(best) == 10
    assert best <= sure
    assert {grid.driven[index].design.label for index in front(grid.driven)} == best


def test_optuna_suggests_the_same_designs_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("optuna")
    computed = []

    def pretended(text: str, _seed: int, _first: int, runs: int) -> dict[str, np.ndarray]:
        computed.append(text)
        wake_up = json.loads(Scenario.from_toml(text).vehicle.to_json())["wake_up"]
        count = np.full(runs, 80_000.0 / wake_up["interval_ms"])
        rms_m = np.full(runs, 1e-3 * wake_up["interval_ms"] ** 0.5)
        return {
            "aoa_estimates": count, "bursts_received": count, "rms_error_m": rms_m,
            "max_error_m": rms_m,
            "error_m": rms_m[:, None], "track_s": np.arange(3.0), "track_m2": np.ones(3),
        }  # fmt: skip

    monkeypatch.setattr(driven, "simulated", pretended)
    space = Space.of(
        {
            "vehicle": {
                "platform": {"name": ["jetson-agx-xavier-engine"]},
                "wake_up": {"policy": ["fixed"], "interval_ms": {"low": 100, "high": 9000}},
            }
        }
    )
    campaign = Campaign(ResultCache(tmp_path))
    tables = [
        rows_of(suggested(campaign, Scenario.load("paper"), space, count=40, runs=2, seed=3).driven)
        for _ in range(2)
    ]
    assert tables[0].equals(tables[1])
    assert 16 < len(computed) <= 40
    assert len(set(computed)) == len(computed)


# The command.

SPACE = """
vehicle.platform = { name = ["jetson-agx-xavier-engine"], mode = [0, 2] }
vehicle.localizer.kind = ["tracker"]
vehicle.integrity.enabled = [false]
vehicle.wake_up.policy = ["fixed"]
vehicle.wake_up.interval_ms = [2000.0, 8000.0]
"""


@pytest.fixture
def run(
    access_av: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Finished]:
    """Runs a command line in a directory, in this process."""

    def inside(cwd: Path, *arguments: str) -> Finished:
        monkeypatch.chdir(cwd)
        monkeypatch.setattr("access_av.tables.results_directory.RESULTS", cwd / "results")
        return access_av(*arguments)

    return inside


def test_the_sweep_command_accepts_any_scenario(
    tmp_path: Path, run: Callable[..., Finished]
) -> None:
    (tmp_path / "space.toml").write_text(SPACE)
    asked = ("yard", "--space", "space.toml", "--runs", "2", "--json", "--out", "o")
    done = run(tmp_path, "design", "sweep", *asked)
    assert done.code == 0, done.err
    assert 1 <= len(json.loads(done.out)["front"]) <= 4
    # A power mode without influence on the runs is not simulated again: two parts for four designs.
    assert len(list((tmp_path / "results/parts").glob("*.npz"))) == 2
    assert (tmp_path / "o/report.html").stat().st_size > 10_000
    some = run(tmp_path, "design", "select", "o", "--max-rms-m", "100", "--json")
    assert len(json.loads(some.out)["kept"]) == 4
    none = run(tmp_path, "design", "select", "o", "--max-rms-m", "0.0001", "--json")
    assert "m instead of 0.0001 m" in json.loads(none.out)["advice"][0]
    assert (some.code, none.code) == (0, 3)
    manifest = json.loads((tmp_path / "o/manifest.json").read_text())
    assert manifest["space"]["keys"]["vehicle.wake_up.interval_ms"] == [2000.0, 8000.0]
    # The printed command repeats the same drives and gives the same results.
    shutil.copytree(tmp_path / "results", tmp_path / "o/results")
    before = (tmp_path / "o/designs.parquet").read_bytes()
    again = run(tmp_path / "o", *shlex.split(manifest["repeat"])[1:], "--out", "again")
    assert again.code == 0, again.err
    assert (tmp_path / "o/again/designs.parquet").read_bytes() == before
    assert len(list((tmp_path / "o/results/parts").glob("*.npz"))) == 2
    for bad, message in (
        (("design", "sweep", *asked, "--shard", "5/2"), "write --executor FILE.py:NAME"),
        (("design", "select", "nowhere"), "no results of access-av design sweep"),
    ):
        done = run(tmp_path, *bad)
        assert (done.code, message in done.err) == (2, True)
