"""Invalid user input, plug-ins and files are rejected with a message, or processed correctly.

One test for each kind of defect that a manual test has found. Random tests are in ``attack/``,
those of Ctrl-C in ``test_interrupt.py``.
"""

from __future__ import annotations

import copy
import fcntl
import json
import os
import pickle
import resource
import subprocess
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import access_av
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

SHORT = {"motion.start_at_m": 290.0}
LONGEST_MESSAGE = 520  # with "error: "


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    access_av.synthesize("paper-real-odometry-2", folder, duration_s=0.3)
    return folder


def refused(done: Finished, *named: str) -> None:
    assert done.code == 2, done.err
    assert "Traceback" not in done.err
    assert len(done.err) < LONGEST_MESSAGE, done.err[:1000]
    for part in named:
        assert part in done.err


def test_a_curvature_random_walk_has_a_bounded_error() -> None:
    scenario = access_av.Scenario.from_toml(
        """
        name = "wander"
        [site]
        name = "wander"
        [site.road]
        segments = [
            { length_m = 226.86 }, { length_m = 237.82 }, { length_m = 82.43, surveyed = false }
        ]
        [[site.radio_heads]]
        position_m = [337.093, 78.58, 0.0]
        [vehicle]
        name = "wander"
        localizer = { kind = "tracker" }
        integrity.enabled = false
        lane_keeping = { rms_m = 0.46, wavelength_m = 5.2176 }
        """
    )
    found = access_av.simulate(scenario, runs=4, seed=108, keep_trajectories=True)
    assert found.trajectories is not None
    # Errors are limited to the part without survey, where the odometer does not measure the bend.
    surveyed = found.trajectories.filter(pl.col("time_s") < 114.0)
    error_m = (pl.col("error_x_m") ** 2 + pl.col("error_y_m") ** 2).sqrt()
    assert surveyed.select(error_m.max()).item() < 5.0
    assert found.trajectories.select(error_m.max()).item() < 1.5 * 82.43


@pytest.mark.parametrize("seed", [1003, 1011, 1017])
def test_covariances_are_positive(seed: int) -> None:
    scenario = access_av.Scenario.load("paper-real-odometry").with_overrides(
        {"vehicle.integrity.enabled": False}
    )
    found = access_av.simulate(scenario, seed=seed, keep_trajectories=True)
    assert found.trajectories is not None
    xx, yy, xy = (found.trajectories[f"covariance_{it}_m2"] for it in ("xx", "yy", "xy"))
    assert xx.min() >= 0.0  # type: ignore[operator]
    assert yy.min() >= 0.0  # type: ignore[operator]
    # In units of the rounding error of two products.
    assert ((xx * yy - xy * xy) / (xx * yy)).min() >= -1e-12  # type: ignore[operator]


def test_an_exact_initial_heading_has_a_positive_variance() -> None:
    # In a bend, heading and position are correlated, and rounding made the variance negative.
    scenario = access_av.Scenario.load("yard").with_overrides(
        {
            "site.road": {"segments": [{"length_m": 90.0, "turn_rad": 1.5}]},
            "motion": {},
            "vehicle.start.position_std_m": 0.1,
            "vehicle.start.heading_std_rad": 0.0,
            "vehicle.lane_keeping": {"rms_m": 0.5, "wavelength_m": 20.0},
        }
    )
    found = access_av.simulate(scenario, runs=6, keep_trajectories=True)
    assert found.trajectories is not None
    assert found.trajectories["covariance_heading_rad2"].min() > 0.9e-12  # type: ignore[operator]


@pytest.mark.parametrize("name", access_av.Scenario.names())
def test_tables_hold_no_nan(name: str) -> None:
    scenario = access_av.Scenario.load(name)
    # The end of a trip with many similar parts; the whole trip of `yard` is simulated.
    start_at_m = 290.0 if name == "paper" else 700.0 if name.startswith("yard-") else 0.0
    if start_at_m:
        scenario = scenario.with_overrides({"motion.start_at_m": start_at_m})
    found = access_av.simulate(scenario, keep_trajectories=True)
    for table in (found.runs, found.steps, found.trajectories, found.aoa_estimates):
        assert table is not None
        for column in table.select(pl.col(pl.Float64)):
            assert column.is_finite().all(), column.name


@pytest.mark.parametrize("start_s", ["-1e9", "1e9", "nan", "inf"])
def test_invalid_start_times_are_rejected(access_av: Cli, drive: Path, start_s: str) -> None:
    done = access_av(
        "record", "locate", "--recording", drive / "iq.sigmf-meta",
        "--odometry", drive / "odometry.csv",
        "--site", drive / "site.toml", "--vehicle", drive / "vehicle.toml",
        "--start-time-s", start_s,
    )  # fmt: skip
    refused(done)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("vehicle.array.rx_gain_dbi", 1e9),
        ("site.radio_heads[0].eirp_dbm", 1e9),
        ("site.carrier_mhz", 1e300),
        ("site.road.start.y_m", -1e308),
        ("site.radio_heads[0].position_m", [1e200, 0.0, 0.0]),
        ("vehicle.array.position_m", [0.0, 1e30, 0.0]),
        ("vehicle.receiver.noise_figure_db", 1e308),
        ("vehicle.odometer.scale_std", 1e6),
        ("site.road.segments[0].turn_rad", -1e308),
        ("vehicle.array.elements", 2**40),
        ("vehicle.start.pose", {"x_m": 1e12, "y_m": 0.0, "heading_rad": 0.0}),
        ("site.road.start.heading_rad", 1e15),
    ],
)
def test_physically_impossible_settings_are_rejected(key: str, value: Any) -> None:
    with pytest.raises(access_av.SettingsError, match=r"must|expected"):
        access_av.Scenario.load("paper").with_overrides({key: value})


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("site.road.segments", [{"length_m": 1e6}]),
        ("site.road.segments", [{"length_m": 1e5}] * 8),
        ("motion.top_speed_kmh", 1e-3),
        ("motion.acceleration_mps2", 1e-12),
        ("motion.stops", [{"at_m": 100.0, "dwell_s": 1e9}]),
        ("motion.stops", [{"at_m": 100.0, "dwell_s": 1e300}]),
        ("motion.stops", [{"at_m": 100.0, "dwell_s": 8e4}]),
    ],
)
def test_excessive_drive_durations_are_rejected(key: str, value: Any) -> None:
    with pytest.raises(access_av.SettingsError):
        access_av.Scenario.load("paper").with_overrides({key: value})


def test_large_runs_can_be_permitted(access_av: Cli, tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_text('extends = "paper"\nmotion.stops = [{ at_m = 100.0, dwell_s = 8e4 }]\n')
    refused(access_av("file", "check", "--kind", "scenario", file), "22", "allow_large", "stops")
    assert access_av("file", "check", "--kind", "scenario", "--allow-large", file).code == 0


@pytest.mark.parametrize(
    "words",
    [
        ["--threads", "100000"],
        ["--runs", "1000000000"],
        ["--runs", "1000000"],
        ["--runs", str(2**63)],
        ["--runs", str(2**64)],
        ["--seed", str(2**64)],
    ],
    ids=" ".join,
)
def test_excessive_numbers_of_runs_and_threads_are_rejected(
    access_av: Cli, words: list[str]
) -> None:
    done = access_av("run", "paper", *words)
    assert done.code == 2, done.err
    assert "Traceback" not in done.err


THREADS = """
import os
import threading
import numpy as np
from access_av import aoa, simulate
batch = np.exp(1j * np.arange(4 * 20 * 256)).reshape(256, 4, 20)
alone = aoa.music(batch)
assert np.array_equal(aoa.music(batch, threads=1000).angle_rad, alone.angle_rad)
simulate("paper", runs=1, threads=1)  # libraries have started their threads
before = most = len(os.listdir("/proc/self/task"))
drives = threading.Thread(target=lambda: simulate("paper", threads=1000))
drives.start()
while drives.is_alive():
    most = max(most, len(os.listdir("/proc/self/task")))
print(most - before)
"""


def test_more_threads_than_cores() -> None:
    done = subprocess.run(
        [sys.executable, "-c", THREADS], capture_output=True, text=True, check=True
    )
    # One worker per core, the calling thread, and a few threads of libraries.
    assert 2 <= int(done.stdout) <= (os.cpu_count() or 1) + 16


@pytest.mark.parametrize("words", [["paper", "fit", "x" * 2000], ["x" * 2000], ["--" + "x" * 2000]])
def test_usage_errors_are_brief(access_av: Cli, words: list[str]) -> None:
    done = access_av(*words)
    assert done.code == 2
    assert "xxx" in done.err
    assert done.err.count("x") < 500
    assert "\x1b" not in access_av("paper", "fit", "\x1b[2J").err


def test_too_many_radio_heads(access_av: Cli, tmp_path: Path) -> None:
    head = "[[radio_heads]]\nposition_m = [{}.0, 40.0, 8.0]\npci = {}\nssb_index = {}\n"
    heads = (head.format(n, n % 1008, n // 1008) for n in range(16_000))
    file = tmp_path / "site.toml"
    file.write_text('name = "many"\n' + "".join(heads))
    began_s = time.monotonic()
    refused(access_av("file", "check", "--kind", "site", file), "radio_heads", "1000")
    assert time.monotonic() - began_s < 10.0


def test_devices_and_pipes_are_rejected_as_input_files(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    refused(
        access_av("file", "check", "--kind", "scenario", "/dev/zero"), "/dev/zero", "regular file"
    )
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    refused(access_av("file", "check", "--kind", "site", pipe), "regular file")
    zeros = tmp_path / "zeros.toml"
    zeros.write_bytes(bytes(1 << 20))
    refused(access_av("file", "check", "--kind", "site", zeros), "zeros.toml")
    with zeros.open("r+b") as file:
        file.truncate(1 << 40)
    refused(access_av("file", "check", "--kind", "site", zeros), "zeros.toml")
    for option in ("--odometry", "--recording", "--truth"):
        words = {
            "--recording": drive / "iq.sigmf-meta",
            "--odometry": drive / "odometry.csv",
            "--site": drive / "site.toml",
            "--vehicle": drive / "vehicle.toml",
            option: pipe,
        }
        flat = [word for pair in words.items() for word in pair]
        refused(access_av("record", "locate", *flat, "--out", tmp_path / "out"), "regular file")


def test_cyclic_and_deeply_nested_files(access_av: Cli, tmp_path: Path) -> None:
    one, other = tmp_path / "one.toml", tmp_path / "other.toml"
    one.write_text(f'extends = "{other}"\n')
    other.write_text(f'extends = "{one}"\n')
    refused(access_av("file", "check", "--kind", "site", one), "extends")
    one.write_text("a = " + "[" * 100_000)
    refused(access_av("file", "check", "--kind", "site", one))
    # A dotted key in a tagged table, which is read as a whole.
    one.write_text('name = "x"\n[wake_up]\npolicy = "fixed"\n".." = 1\n')
    refused(access_av("file", "check", "--kind", "vehicle", one), "wake_up")


TUM = b"0.0 0 0 0 0 0 0 1\n0.3 0.1 0 0 0 0 0 1\n"


@pytest.mark.parametrize(
    ("truth", "code"),
    [
        (b"these are words\n", 2),
        (TUM.decode().encode("utf-16"), 0),
        (TUM.decode().encode("utf-16-le"), 2),
        (TUM.replace(b"0.3 0.1", b"0.3 nan"), 2),
        # The heading of the reference is not used.
        (TUM.replace(b"0 1\n", b"0 0\n"), 0),
        (b"", 2),
        (b"\xef\xbb\xbf# a comment\n" + TUM, 0),
    ],
    ids=["words", "utf-16", "utf-16-without-mark", "nan", "no-turn", "empty", "bom-and-comment"],
)
def test_invalid_truth_trajectories_are_reported(
    access_av: Cli, drive: Path, tmp_path: Path, truth: bytes, code: int
) -> None:
    file = tmp_path / "truth.tum"
    file.write_bytes(truth)
    done = access_av(
        "record", "locate", "--recording", drive / "iq.sigmf-meta",
        "--odometry", drive / "odometry.csv",
        "--site", drive / "site.toml", "--vehicle", drive / "vehicle.toml", "--truth", file,
        "--out", tmp_path / "out",
    )  # fmt: skip
    assert done.code == code, done.err
    assert "Traceback" not in done.err
    assert code == 0 or "truth.tum" in done.err


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("aoa:truth", []),
        ("aoa:truth", {"element_spacing_wavelengths": "half"}),
        ("aoa:truth", {"element_spacing_wavelengths": -1.0}),
        ("aoa:truth", {"azimuth_from_broadside_deg": "left"}),
        ("aoa:truth", {"channel_calibration_re": [1, 1], "channel_calibration_im": [0]}),
        ("aoa:truth", {"channel_calibration_re": [0] * 4, "channel_calibration_im": [0] * 4}),
        ("core:sample_count", 10**15),
    ],
)
def test_invalid_angle_annotations_are_rejected(
    access_av: Cli, drive: Path, tmp_path: Path, key: str, value: Any
) -> None:
    metadata = json.loads((drive / "iq.sigmf-meta").read_text())
    metadata["annotations"][3][key] = value
    (tmp_path / "iq.sigmf-meta").write_text(json.dumps(metadata))
    (tmp_path / "iq.sigmf-data").symlink_to(drive / "iq.sigmf-data")
    refused(access_av("record", "aoa", tmp_path / "iq"))


def test_an_excessive_map_spacing_causes_no_traceback(access_av: Cli, tmp_path: Path) -> None:
    done = access_av("design", "bound", "yard", "--map-step-m", "1e300", "--out", tmp_path / "out")
    assert done.code in (0, 2)
    assert "Traceback" not in done.err


def test_a_table_of_another_program_is_rejected(access_av: Cli, tmp_path: Path) -> None:
    file = tmp_path / "operating_points.parquet"
    pl.DataFrame({"mode": ["a"], "energy_j": ["b"]}).write_parquet(file)
    refused(access_av("paper", "explore", "--results", tmp_path), "operating_points.parquet")
    file.write_bytes(b"PAR1 and no more")
    refused(access_av("paper", "explore", "--results", tmp_path), "operating_points.parquet")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_output_works_with_every_terminal_encoding(encoding: str) -> None:
    done = shell("file", "columns", "trajectories", PYTHONIOENCODING=encoding)  # m², …
    assert done.returncode == 0, done.stderr
    name = shell("file", "check", "größe-日本", PYTHONIOENCODING=encoding)
    assert name.returncode == 2, name.stderr
    assert b"Traceback" not in name.stderr


def shell(*words: object, **environment: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-m", "access_av", *map(str, words)],
        capture_output=True,
        env={**os.environ, **environment},
    )


def test_a_folder_whose_name_is_not_valid_text(tmp_path: Path) -> None:
    folder = os.fsencode(tmp_path) + b"/\xff\xfe"
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "access_av",
            "design",
            "bound",
            "yard",
            "--map-step-m",
            "50",
            "--out",
            folder,
        ],
        capture_output=True,
    )
    assert done.returncode in (0, 2), done.stderr
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["../../../x", "[/]", "[red]", "a/b", "", "x" * 65, "\x1b[2J"])
def test_invalid_scenario_names_are_rejected(name: str) -> None:
    with pytest.raises(access_av.SettingsError, match="name"):
        access_av.Scenario.load("paper").with_overrides({"name": name})


def test_no_escape_sequence_reaches_the_terminal(access_av: Cli, tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text('name = "x"\n"\\u001b[2J" = 1\n[red]\n')
    done = access_av("file", "check", "--kind", "site", file)
    refused(done, "\\x1b[2J")
    assert "\x1b" not in done.err


def test_html_in_names_is_escaped(access_av: Cli, tmp_path: Path) -> None:
    name = "</script><!--<script>"
    scenario = access_av_scenario({"site.radio_heads[0].name": name})
    file = tmp_path / "x.toml"
    file.write_text(scenario.to_toml())
    assert access_av("design", "bound", file, "--out", tmp_path / "out").code == 0
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert name not in page


def access_av_scenario(overrides: dict[str, Any]) -> access_av.Scenario:
    return access_av.Scenario.load("paper").with_overrides(overrides)


def test_latest_link_that_cannot_be_created(access_av: Cli, tmp_path: Path) -> None:
    (tmp_path / "results/latest").mkdir(parents=True)
    (tmp_path / "results/latest/kept").write_text("")
    with pytest.warns(UserWarning, match="latest"):
        done = access_av(
            "run", "paper", "--set", "motion.start_at_m=290", "--out", tmp_path / "results/out"
        )
    assert done.code == 0, done.err


def test_a_results_directory_in_use_is_rejected(access_av: Cli, tmp_path: Path) -> None:
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    try:
        for words in (
            ("run", "paper"),
            ("design", "bound", "yard"),
            ("paper", "evaluate"),
            ("record", "synth", "paper"),
        ):
            refused(access_av(*words, "--out", tmp_path), "another run is writing here")
    finally:
        os.close(folder)
    assert list(tmp_path.iterdir()) in ([], [tmp_path / "results"])


# Size of the simulated disk; table, recording and samples are larger.
FULL_BYTES = 20_000


@pytest.mark.parametrize(
    "words",
    [
        ("run", "paper-real-odometry-2", "--set", "motion.start_at_m=250"),
        ("record", "synth", "paper-real-odometry-2", "--duration-s", "1"),
        ("design", "bound", "yard"),
    ],
    ids=lambda words: words[0],
)
def test_a_full_disk_is_reported(tmp_path: Path, words: tuple[str, ...]) -> None:
    def fill() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (FULL_BYTES, FULL_BYTES))

    done = subprocess.run(
        [sys.executable, "-m", "access_av", *words, "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        preexec_fn=fill,
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert str(tmp_path / "out") in done.stderr.replace("\n", "")
    assert "File too large" in done.stderr.replace("\n", " ")
    assert not list(tmp_path.rglob("*.partial"))


def test_a_directory_without_write_permission_is_reported(access_av: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused(access_av("run", "paper", "--out", tmp_path / "file/out"), "file")
    refused(access_av("design", "bound", "yard", "--out", "/proc/none"), "/proc/none")
    refused(
        access_av("paper", "fit", "--runs", "1", "--out", tmp_path / "none/x.toml"), "none/x.toml"
    )


def test_a_full_standard_output_is_reported() -> None:
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [sys.executable, "-m", "access_av", "file", "show", "--kind", "scenario", "paper"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.returncode == 2, done.stderr
    assert "No space left" in done.stderr
    assert "Exception ignored" not in done.stderr


@pytest.mark.parametrize(("key", "value"), [("music", 3), ("a.b", 3), ("music", {"a.b": 1})])
def test_errors_name_the_key(key: str, value: Any) -> None:
    platform = access_av.Platform.load("jetson-agx-xavier").core
    with pytest.raises(access_av.SettingsError, match="energy_per_execution_j") as raised:
        platform.with_overrides({"modes[0].energy_per_execution_j": {key: value}})
    assert "?" not in str(raised.value)
    assert key in str(raised.value)


@pytest.mark.parametrize(
    "kind", [access_av.Scenario, access_av.Site, access_av.Vehicle, access_av.Platform]
)
def test_settings_are_equal_and_hashable_by_value(kind: Any) -> None:
    names = kind.names()
    one, same = kind.load(names[0]), kind.load(names[0])
    assert one == same
    assert hash(one) == hash(same)
    assert len({one, same}) == 1
    for made in (pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)):
        assert made == one
        assert hash(made) == hash(one)
    for other in names[1:2]:
        assert kind.load(other) != one
    assert one != "paper"


def test_objects_that_cannot_be_pickled_are_rejected_with_a_reason(drive: Path) -> None:
    recording = access_av.Recording.open(drive / "iq.sigmf-meta")
    with pytest.raises(TypeError, match="Recording"):
        pickle.dumps(recording)


def test_the_plug_ins_page_warns_of_fork() -> None:
    page = (ROOT / "docs/plug-ins.md").read_text(encoding="utf-8")
    assert "fork" in page
    assert "spawn" in page


def test_recordings_and_searchers_work_in_several_threads(drive: Path) -> None:
    recording = access_av.Recording.open(drive / "iq.sigmf-meta")
    expected = [recording.read(start, 500) for start in range(0, 4000, 500)]
    searcher = access_av.nr.Searcher(
        7.68e6, centre_frequency_hz=3.7008e9, ssb_freq_hz=3.7008e9, scs_khz=30, antennas=1
    )
    burst = access_av.nr.build_burst(42, ssb_indices=[1], sfn=7, ssb_freq_hz=3.7008e9)
    wrong: list[object] = []

    def work() -> None:
        try:
            for _ in range(20):
                for number, samples in enumerate(expected):
                    if not np.array_equal(recording.read(500 * number, 500), samples):
                        wrong.append(number)
                if [cell.pci for cell in searcher.search(burst)] != [42]:
                    wrong.append("search")
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
