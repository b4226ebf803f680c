from __future__ import annotations

import json
import re
import time
from itertools import pairwise
from typing import TYPE_CHECKING

import polars as pl
import pytest

from access_av.cli import terminal
from access_av.paper.statements import stated_claims
from conftest import commands

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

TRAJECTORY_COLUMNS = {
    "run", "time_s", "x_m", "y_m", "heading_rad", "true_x_m", "true_y_m", "error_x_m", "error_y_m",
}  # fmt: skip
# Maximum numbers of names after `access-av`, and of commands in all.
MOST_NAMES, MOST_COMMANDS = 8, 42


def test_commands_are_few_and_in_groups_by_task(access_av: Cli) -> None:
    assert len({command.split()[0] for command in commands()}) <= MOST_NAMES
    assert len(commands()) <= MOST_COMMANDS
    for group in ("", "paper", "design", "record", "file"):
        done = access_av(*group.split(), "--help")
        assert done.code == 0
        inner = {it.removeprefix(group).split()[0] for it in commands() if it.startswith(group)}
        for name in inner:
            assert f"│ {name} " in done.out
        assert "─ Commands ─" not in done.out, "each command belongs to a panel"


@pytest.mark.parametrize("command", commands())
def test_help_of_each_command_has_an_example(access_av: Cli, command: str) -> None:
    done = access_av(*command.split(), "--help", columns=60)
    assert done.code == 0
    assert f"access-av {command} " in " ".join(done.out.split())
    assert "Example" in done.out
    assert max(map(len, done.out.splitlines())) <= 60


@pytest.mark.parametrize("command", ["record locate", "design power"])
def test_help_breaks_a_line_only_where_the_next_word_has_no_room(
    access_av: Cli, command: str
) -> None:
    prose, _, _ = access_av(*command.split(), "--help", columns=60).out.partition("╭")
    _, _, prose = prose.partition(f"{command} [OPTIONS]")
    lines = [line.rstrip() for line in prose.splitlines()]
    for line, following in pairwise(lines):
        if line.strip() and following.strip():
            assert len(line) + len(f" {following.split()[0]}") >= 59, line


def test_run_writes_the_files_that_its_help_lists(access_av: Cli, tmp_path: Path) -> None:
    done = access_av("run", "paper", "--runs", "2", "--seed", "3", "--out", tmp_path / "r")
    assert done.code == 0, done.err
    table = pl.read_parquet(tmp_path / "r/trajectories.parquet")
    assert set(table.columns) >= TRAJECTORY_COLUMNS
    assert table["run"].unique().sort().to_list() == [0, 1]
    error = table["x_m"] - table["true_x_m"] - table["error_x_m"]
    assert error.abs().max() < 1e-9
    aoa_estimates = pl.read_parquet(tmp_path / "r/aoa_estimates.parquet")
    assert set(aoa_estimates.columns) >= {"run", "time_s"}
    manifest = json.loads((tmp_path / "r/manifest.json").read_text())
    assert manifest["seed"] == 3
    assert access_av("file", "check", "--kind", "scenario", tmp_path / "r/scenario.toml").code == 0
    # The platform's default value is written out.
    assert "base_ms = 80.0" in (tmp_path / "r/scenario.toml").read_text()
    assert not (tmp_path / "results").exists()
    for name in ("trajectory.tum", "truth.tum"):
        lines = (tmp_path / "r" / name).read_text().splitlines()
        assert all(re.fullmatch(r"\d+\.\d{9}( -?\d+\.\d+){7}", line) for line in lines)
        assert len(lines) == table.filter(run=0).height


def test_run_results_are_equal_for_one_and_two_threads(access_av: Cli, tmp_path: Path) -> None:
    for threads in ("1", "2"):
        access_av("run", "paper", "--runs", "3", "--threads", threads, "--out", tmp_path / threads)
    for name in ("trajectories.parquet", "aoa_estimates.parquet", "trajectory.tum"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_option_set_changes_one_key(access_av: Cli, tmp_path: Path) -> None:
    done = access_av(
        "run", "paper", "--set", "site.rician_k_db=7.5",
        "--set", "vehicle.estimator.method=esprit",
        "--out", tmp_path / "r",
    )  # fmt: skip
    assert done.code == 0, done.err
    written = (tmp_path / "r/scenario.toml").read_text()
    assert "rician_k_db = 7.5" in written
    assert 'method = "esprit"' in written
    assert "base_ms = " in written


def test_evaluation_writes_its_files(quick_study: Path) -> None:
    names = {path.name for path in (quick_study / "latest").iterdir()}
    assert names == {
        "ablation.svg", "ablations.parquet", "claims.json", "errors.parquet",
        "evaluation_runs.parquet", "equal_information.parquet", "resamples.parquet",
        "fixed_front.parquet", "fit_degrees_of_freedom.parquet", "front.svg", "manifest.json",
        "operating_points.parquet", "proposed_vs_paper.parquet", "platform.toml",
        "report.html", "scenario.toml", "snr.parquet",
    }  # fmt: skip
    claims = json.loads((quick_study / "latest/claims.json").read_text())
    assert len(claims) == 2 * len(stated_claims())


def test_explore_answers_from_the_last_evaluation(
    access_av: Cli, quick_study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "results").symlink_to(quick_study)
    monkeypatch.chdir(tmp_path)
    done = access_av("paper", "explore", "--max-energy-j", "1000", "--json")
    assert len(json.loads(done.out)) == 8
    assert access_av("paper", "explore", "--max-energy-j", "1000", "--fixed", columns=60).code == 0
    asked = ("paper", "explore", "--max-error-m", "9", "--percentile", "90", "--json")
    found = json.loads(access_av(*asked).out)
    assert all(each["p90_error_low_m"] <= each["p90_error_m"] for each in found)
    assert access_av("paper", "explore", "--max-error-m", "1", "--percentile", "12").code == 2
    none = access_av("paper", "explore", "--max-energy-j", "1")
    assert none.code == 3
    assert "No operating point has energy ≤ 1 J" in none.out


def test_output_of_evaluate_fits_one_screen(access_av: Cli, tmp_path: Path) -> None:
    """Verdict, three figures and the path of the report; the report contains everything else."""
    arguments = ("--interpretation", "gate", "--runs", "1", "--out", str(tmp_path / "e"))
    done = access_av("paper", "evaluate", *arguments, columns=60)
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines[:-1])) <= 60
    assert lines[-1].endswith(str(tmp_path / "e" / "report.html"))
    words = " ".join(done.out.split())
    assert words.startswith("The paper's accuracy and its saving do not hold together")
    claims = {it["id"]: it for it in json.loads((tmp_path / "e/claims.json").read_text())}
    for name in ("a1_adaptive_worst_m", "e4_average_saving_percent"):
        obtained, verdict = claims[name]["obtained"], claims[name]["verdict"]
        assert f"{obtained:.4g} {verdict}" in words
    verdicts = [it["verdict"] for it in claims.values()]
    reproduced = verdicts.count("reproduced")
    judged = reproduced + verdicts.count("not reproduced")
    assert f"reproduced claims {judged} {reproduced}" in words
    for private in ("reading", "freedom", "told"):
        assert private not in words


KINDS = ("site", "vehicle", "scenario", "platform", "plant")


@pytest.mark.parametrize("kind", KINDS)
def test_shipped_files_are_listed_shown_and_valid(
    access_av: Cli, tmp_path: Path, kind: str
) -> None:
    names = access_av("file", "list", kind).out.split()
    assert names
    for name in names:
        shown = access_av("file", "show", "--kind", kind, name)
        file = tmp_path / f"{name}.toml"
        file.write_text(shown.out)
        assert access_av("file", "check", "--kind", kind, str(file), name).code == 0
        # The keys of a complete file determine its kind.
        assert access_av("file", "check", str(file)).out.startswith(f"{file}: valid")
        assert access_av("file", "show", str(file)).out == shown.out
    assert json.loads(access_av("file", "schema", kind).out)["$schema"]


def test_the_kind_of_a_settings_file_is_recognised(access_av: Cli, tmp_path: Path) -> None:
    listed = access_av("file", "list").out.splitlines()
    assert {line.split(":")[0] for line in listed} == {*KINDS}
    assert "radio_heads" in access_av("file", "show", "trip-1", "--kind", "site").out
    assert "wake_up" in access_av("file", "show", "tugger").out  # the name of a vehicle only
    file = tmp_path / "mine.toml"
    for text, named in (
        ('extends = "yard"\nname = "mine"\n', ["could be a", "--kind site", "--kind scenario"]),
        ('name = "mine"\n[page]\n', ["node file", "access-av-node"]),
        ("a = " + "[" * 100_000, ["mine.toml"]),
    ):
        file.write_text(text)
        done = access_av("file", "check", file, columns=400)
        assert done.code == 2
        for part in named:
            assert part in done.err, done.err
    for name, part in (("nowhere", "no such file"), ("yard", "--kind plant or --kind site")):
        done = access_av("file", "show", name, columns=400)
        assert done.code == 2
        assert part in done.err, done.err


def test_options_of_sites_are_rejected_for_files_without_a_site(
    access_av: Cli, tmp_path: Path
) -> None:
    done = access_av("file", "new", "vehicle", tmp_path / "v.toml", "--heads-file", "heads.csv")
    assert done.code == 2
    assert "--heads-file: only for plant and site files, not for vehicle" in done.err
    assert not list(tmp_path.glob("*.toml"))


SCENARIO = (
    'name = "mine"\nvehicle = "paper"\n[site]\nname = "mine"\n'
    "[site.road]\nsegments = [{ length_m = 300.0, turn_rad = 0.25 }]\n"
)
HEAD = "[[site.radio_heads]]\nposition_m = [205.0, 100.0, 0.0]\n"
PID = '[vehicle]\nextends = "paper"\n[vehicle.wake_up.trigger]\nbase_ms = 300.0\n'


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (SCENARIO + HEAD + "[chanel]\n", ["chanel", "channel"]),
        (SCENARIO + HEAD + "[channel]\nray = 3\n", ["channel.ray", "rays"]),
        (SCENARIO + HEAD + '[channel]\nrays = "ten"\n', ["channel.rays"]),
        (SCENARIO + HEAD + "[channel]\nshadowing_std_db = nan\n", ["shadowing_std_db", "finite"]),
        (SCENARIO.replace("300.0", "-300.0") + HEAD, ["site.road.segments[0].length_m", "-300"]),
        (SCENARIO + HEAD.replace("[205.0, 100.0,", "[0.0, 0.0,"), ["site.radio_heads[0]"]),
        (
            SCENARIO.replace('vehicle = "paper"\n', "") + HEAD + PID,
            ["vehicle.wake_up.trigger.target_error_m", "t_max of 240.0 ms"],
        ),
        (SCENARIO + HEAD + "[truth.vehicle.array]\nmountin_rad = 1\n",
         ["truth.vehicle.array.mountin_rad", "mounting_rad"]),
        (SCENARIO + HEAD + "[truth.vehicle.gyroscope]\nbias_radps = 1.0\n",
         ["truth.vehicle.gyroscope", "the nominal model has no such key"]),
        (SCENARIO + HEAD + '[truth.vehicle.localizer]\nkind = "tracker"\n',
         ["truth.vehicle.localizer", "only in physical keys"]),
        (SCENARIO.replace('vehicle = "paper"', 'vehicle = "papr"') + HEAD, ["vehicle", "papr"]),
        (SCENARIO, ["radio_heads"]),
        ("name = \n", ["TOML"]),
    ],
    ids=[
        "table", "key", "type", "nan", "negative", "head-on-road", "t-max", "truth-key",
        "truth-unbelieved", "truth-setting", "vehicle-name", "missing", "syntax",
    ],
)  # fmt: skip
def test_bad_scenarios_end_with_2_and_name_file_and_key(
    access_av: Cli, tmp_path: Path, text: str, named: list[str]
) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    for arguments in (("run", file), ("file", "check", file)):
        done = access_av(*map(str, arguments))
        assert done.code == 2
        for part in ("mine.toml", *named):
            assert part in done.err
        assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["run", "papier"], ["papier", "paper"]),
        (["run", "paper", "--set", "site.rician_k=3"], ["rician_k", "rician_k_db"]),
        (["run", "paper", "--set", "nonsense"], ["KEY=VALUE"]),
        (["run", "paper", "--runs", "0"], ["--runs"]),
        (["run", "paper", "--seed", "-1"], ["--seed"]),
        (["paper", "evaluate", "--platform", "jetson"], ["jetson", "jetson-agx-xavier"]),
        (["paper", "evaluate", "--scenario", "nowhere.toml"], ["nowhere.toml"]),
        (["paper", "explore", "--max-energy-j", "nan"], ["--max-energy-j"]),
        (["paper", "explore", "--max-energy-j", "inf"], ["finite"]),
        (["paper", "explore", "--max-rms-m", "-1"], ["--max-rms-m"]),
        (["paper", "explore", "--results", "."], ["operating_points.parquet"]),
        (["design", "bound", "papier"], ["papier", "paper"]),
        (["design", "bound", "yard", "--map-step-m", "0"], ["--map-step-m", "above 0"]),
        (["design", "bound", "yard", "--map-step-m", "nan"], ["--map-step-m", "above 0"]),
        (["design", "bound", "yard", "--map-step-m", "0.01"], ["--map-step-m", "at most"]),
        (["design", "bound", "paper", "--out", "pyproject.toml"], ["--out takes a directory"]),
        (["record", "aoa", "nowhere"], ["nowhere", ".sigmf-meta"]),
        (["frobnicate"], ["frobnicate"]),
    ],
    ids=" ".join,
)
def test_bad_arguments_end_with_2(access_av: Cli, arguments: list[str], named: list[str]) -> None:
    done = access_av(*arguments)
    assert done.code == 2
    for part in named:
        assert part in done.err
    assert "Traceback" not in done.err


def test_option_out_rejects_an_existing_file(access_av: Cli, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    done = access_av("run", "paper", "--out", str(tmp_path / "taken"))
    assert done.code == 2
    assert "--out takes a directory" in done.err


def test_progress_is_printed_as_lines_in_a_pipe(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("access_av.cli.terminal.FIRST_LINE_S", 0.05)
    with terminal.progress("Driving") as tick:
        tick(3, 12)
        time.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert lines
    assert all(line.startswith("Driving: 3 of 12, 0 s, about ") for line in lines)
    with terminal.progress("Evaluating", percent=True) as tick:
        tick(3, 12)
        time.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert lines
    assert all(line.startswith("Evaluating: 25 %, 0 s, about ") for line in lines)
    with terminal.progress("Driving") as tick:
        tick(3, 4, "nominal channel")
        tick(0, 8, "measures")
        time.sleep(0.2)
        tick(2, 8, "measures")
        time.sleep(0.2)
    lines = capsys.readouterr().err.splitlines()
    assert all(line.startswith("Driving, measures: ") for line in lines)
    assert lines[-1].startswith("Driving, measures: 2 of 8, 0 s, about ")
    with terminal.progress("Soon over") as tick:
        tick(1, 2)
    assert capsys.readouterr().err == ""
