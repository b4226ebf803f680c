from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest
from mcap.reader import make_reader

from access_av import Site, Vehicle, drives
from access_av._core import RecordingError
from access_av.tables.columns import TABLES
from access_av.tables.toml import tomllib
from conftest import ROOT
from robot import HEADS_M, RATE_HZ, TRACK_M, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]

SCENARIO = "paper-real-odometry-2"


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve seconds of a drive past two radio heads, as recorded."""
    directory = tmp_path_factory.mktemp("drive")
    drives.synthesize(SCENARIO, directory, duration_s=12.0)
    return directory


def arguments(drive: Path, out: Path) -> list[object]:
    return [
        "record", "locate", "--recording", drive / "iq.sigmf-meta",
        "--odometry", drive / "odometry.csv",
        "--site", drive / "site.toml", "--out", out, "--vehicle", drive / "vehicle.toml",
    ]  # fmt: skip


def locate(drive: Path, **given: Any) -> drives.Drive:
    """Locates a synthesized drive with replaced files."""
    return drives.locate(
        given.pop("site", drive / "site.toml"),
        given.pop("odometry", drive / "odometry.csv"),
        drive / "iq",
        vehicle=given.pop("vehicle", drive / "vehicle.toml"),
        **given,
    )


def test_a_synthesized_drive_is_located(access_av: Cli, drive: Path, tmp_path: Path) -> None:
    done = access_av(*arguments(drive, tmp_path), "--truth", drive / "truth.tum")
    assert done.code == 0, done.err
    poses = pl.read_parquet(tmp_path / "poses.parquet")
    angles = pl.read_parquet(tmp_path / "angles.parquet")
    assert poses.height == 601
    assert set(angles["pci"].unique()) <= {1, 2}
    assert angles["accepted"].mean() > 0.95  # type: ignore[operator]
    error = float(re.findall(r"RMS ([0-9.]+) m", done.out)[0])
    # An initial pose with a standard deviation of half a metre, and what two radio heads add.
    assert error < 0.6
    page = (tmp_path / "report.html").read_text()
    assert "http" not in re.sub(
        r"https?://(www\.w3\.org|vega\.github\.io)[^\"']*", "", page[:20_000]
    )
    assert json.loads((tmp_path / "manifest.json").read_text())["angles"] == angles.height


def test_mcap_agrees_with_ros_tools(access_av: Cli, drive: Path, tmp_path: Path) -> None:
    assert access_av(*arguments(drive, tmp_path)).code == 0
    with (tmp_path / "drive.mcap").open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        counts = {
            channel.topic: (
                summary.schemas[channel.schema_id].name,
                channel.message_encoding,
                summary.statistics.channel_message_counts[number],
            )
            for number, channel in summary.channels.items()
        }
    angles = pl.read_parquet(tmp_path / "angles.parquet").height
    assert counts == {
        "/access_av/odometry": ("nav_msgs/msg/Odometry", "cdr", 601),
        "/access_av/verdicts": ("access_av_msgs/msg/AngleVerdict", "cdr", angles),
        "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", "cdr", 13),
    }


def test_evo_finds_the_same_error_in_tum_and_mcap(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    access_av(*arguments(drive, tmp_path), "--truth", drive / "truth.tum")
    ours = json.loads((tmp_path / "manifest.json").read_text())["rms_error_m"]
    code = f"""
from evo.core import metrics, sync
from evo.tools import file_interface
from rosbags.rosbag2 import Reader
from pathlib import Path
truth = file_interface.read_tum_trajectory_file({str(drive / "truth.tum")!r})
tum = file_interface.read_tum_trajectory_file({str(tmp_path / "trajectory.tum")!r})
with Reader(Path({str(tmp_path / "drive.mcap")!r})) as bag:
    mcap = file_interface.read_bag_trajectory(bag, "/access_av/odometry")
for found in (tum, mcap):
    pair = sync.associate_trajectories(truth, found, max_diff=1e-4)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data(pair)
    print(ape.get_statistic(metrics.StatisticsType.rmse))
"""
    environment = {"HOME": str(tmp_path), "PATH": "/usr/bin:/bin", "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True, text=True, env=environment, check=True,
    )  # fmt: skip
    found = [float(line) for line in done.stdout.split()[-2:]]
    assert found == pytest.approx([ours, ours], abs=1e-6)


def test_mcap_odometry_with_invalid_items_is_read(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    # Use the located poses in MCAP as odometry.
    access_av(*arguments(drive, tmp_path))
    located = locate(drive, odometry=tmp_path / "drive.mcap")
    assert located.poses.height == 601
    rows = (drive / "odometry.csv").read_text().splitlines()
    spoilt = tmp_path / "odometry.csv"
    spoilt.write_text("\n".join([*rows[:100], "nan,1,2", rows[50], "a,b", *rows[100:]]))
    given = arguments(drive, tmp_path / "again")
    given[5] = spoilt
    done = access_av(*given)
    assert done.code == 0, done.err
    assert done.err.count("left out") == 3


def test_samples_without_an_ssb_are_refused(drive: Path, tmp_path: Path) -> None:
    meta = json.loads((drive / "iq.sigmf-meta").read_text())
    del meta["global"]["core:sha512"]
    (tmp_path / "iq.sigmf-meta").write_text(json.dumps(meta))
    size = (drive / "iq.sigmf-data").stat().st_size
    noise = np.random.default_rng(1).integers(-100, 100, size // 2, dtype=np.int16)
    (tmp_path / "iq.sigmf-data").write_bytes(noise.tobytes())
    with pytest.raises(
        RecordingError, match=r"iq.sigmf-data: .* no SSB of a radio head of the site"
    ):
        drives.locate(
            drive / "site.toml",
            drive / "odometry.csv",
            tmp_path / "iq",
            vehicle=drive / "vehicle.toml",
        )


def test_poses_have_integrity_unless_the_monitor_is_disabled(drive: Path, tmp_path: Path) -> None:
    vehicle = tmp_path / "vehicle.toml"
    vehicle.write_text((drive / "vehicle.toml").read_text() + "[integrity]\n")
    poses = locate(drive, vehicle=vehicle).poses
    assert set(poses["integrity"].unique()) <= {"ok", "degraded", "unavailable"}
    assert poses["protection_level_m"].max() > 0.1  # type: ignore[operator]
    hypotheses = {"nominal", "uncalibrated_array", "noisy_odometer", "wheel_slip"}
    assert set(poses["selected_hypothesis"].unique()) <= hypotheses
    vehicle.write_text((drive / "vehicle.toml").read_text() + "[integrity]\nenabled = false\n")
    unmonitored = locate(drive, vehicle=vehicle).poses
    assert unmonitored.select("integrity", "selected_hypothesis").null_count().row(0) == (
        unmonitored.height, unmonitored.height,
    )  # fmt: skip
    assert not locate(drive).poses["integrity"].is_null().any()


def test_a_replayed_drive_honours_the_wake_up_policy(drive: Path) -> None:
    every = locate(drive).angles
    half = Vehicle.load(str(drive / "vehicle.toml")).with_overrides({"wake_up.interval_ms": 500.0})
    some = locate(drive, vehicle=half).angles
    # Every burst is received until angles have confirmed the start.
    confirmed = some.filter(pl.col("time_s") > 0.2)["time_s"].round(2)
    assert confirmed.diff().drop_nulls().is_in([0.0, 0.5, 0.52, 0.48]).all()
    assert 20 * some.height <= every.height * 1.2


def test_a_drive_that_cannot_be_located_has_a_reason(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site.toml"
    text = (drive / "site.toml").read_text()
    positions = re.findall(r"position_m = \[[^]]*\]", text)
    site.write_text(text.replace(positions[1], positions[0]))
    given = arguments(drive, tmp_path)
    given[7] = site
    done = access_av(*given)
    assert done.code == 2
    assert "radio_heads[1].position_m" in done.err
    given[7], given[5] = drive / "site.toml", tmp_path / "none.csv"
    assert access_av(*given).code == 2


def test_synth_rejects_unsupported_scenarios(access_av: Cli, tmp_path: Path) -> None:
    assert (
        access_av("record", "synth", "paper", "--out", tmp_path, "--datatype", "cf64_le").code == 2
    )
    done = access_av("record", "synth", "no-such", "--out", tmp_path)
    assert done.code == 2
    assert "no-such" in done.err


def without_start(vehicle: str) -> str:
    return re.sub(r"\[start\.pose\]\n(\w+ = .*\n)+", "", vehicle)


def test_without_an_initial_pose_the_vehicle_is_found(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    vehicle = tmp_path / "vehicle.toml"
    vehicle.write_text(without_start((drive / "vehicle.toml").read_text()))
    given = arguments(drive, tmp_path / "out")
    given[11] = vehicle
    done = access_av(*given, "--truth", drive / "truth.tum")
    assert done.code == 0, done.err
    driven_m = float(re.findall(r"Position found after ([0-9.]+) m", done.out)[0])
    poses = pl.read_parquet(tmp_path / "out" / "poses.parquet")
    known = poses.filter(~pl.col("searching"))
    assert 0.0 < driven_m < 32.0
    assert 0 < known.height < poses.height
    trajectory = (tmp_path / "out" / "trajectory.tum").read_text().splitlines()
    assert len(trajectory) == known.height
    # The vehicle is found when the standard deviation is below 0.4 m, which then decreases.
    errors = drives.error_m(poses, drive / "truth.tum")
    assert errors.height == known.height
    assert errors["error_m"].max() < 4 * 0.4  # type: ignore[operator]


def test_the_start_may_be_given_with_the_command(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    pose = tomllib.loads((drive / "vehicle.toml").read_text())["start"]["pose"]
    vehicle = tmp_path / "vehicle.toml"
    vehicle.write_text(without_start((drive / "vehicle.toml").read_text()))
    given = locate(drive).poses
    start = (pose["x_m"], pose["y_m"], pose["heading_rad"])
    with_start = locate(drive, vehicle=vehicle, start=start).poses
    assert with_start.equals(given)
    searched = arguments(drive, tmp_path / "out")
    assert "Position found after" in access_av(*searched, "--start", "unknown").out
    for bad in ("1,2", "1,2,x", "1,2,inf", "1,2,-95.8"):
        done = access_av(*searched, "--start", bad)
        assert done.code == 2
        assert "--start" in done.err


def test_one_radio_head_does_not_determine_the_position(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    vehicle = tmp_path / "vehicle.toml"
    text = without_start((drive / "vehicle.toml").read_text())
    vehicle.write_text(text.replace("[receiver]", "[receiver]\npci_allow_list = [1]"))
    given = arguments(drive, tmp_path / "out")
    given[11] = vehicle
    done = access_av(*given)
    assert done.code == 2
    assert "start.pose" in done.err
    assert "two radio heads" in done.err


def test_smoothing_writes_a_second_trajectory(access_av: Cli, drive: Path, tmp_path: Path) -> None:
    done = access_av(*arguments(drive, tmp_path), "--smooth", "--truth", drive / "truth.tum")
    assert done.code == 0, done.err
    numbers = json.loads((tmp_path / "manifest.json").read_text())
    assert f"Smoothed: RMS {numbers['smoothed_rms_error_m']:.3f} m" in done.out
    poses, smoothed = (
        pl.read_parquet(tmp_path / f"{name}.parquet") for name in ("poses", "smoothed")
    )
    assert smoothed["time_s"].equals(poses["time_s"])
    # Later measurements can only add information.
    variance_m2 = pl.col("covariance_xx_m2") + pl.col("covariance_yy_m2")
    before, after = (table.select(variance_m2).to_series() for table in (poses, smoothed))
    assert (after <= before * (1 + 1e-9)).all()
    assert after.sum() < before.sum()
    assert len((tmp_path / "smoothed.tum").read_text().splitlines()) == smoothed.height
    assert '"smoothed"' in (tmp_path / "report.html").read_text()
    with (tmp_path / "drive.mcap").open("rb") as file:
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert topics.count("/access_av/smoothed") == smoothed.height


def test_a_recording_of_two_antennas_is_refused(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    meta = json.loads((drive / "iq.sigmf-meta").read_text())
    meta["global"]["core:num_channels"] = 2
    meta["global"].pop("core:sha512", None)
    (tmp_path / "two.sigmf-meta").write_text(json.dumps(meta))
    (tmp_path / "two.sigmf-data").symlink_to(drive / "iq.sigmf-data")
    given = arguments(drive, tmp_path / "out")
    given[3] = tmp_path / "two.sigmf-meta"
    done = access_av(*given)
    assert done.code == 2
    assert "2 channels; the vehicle's array has 4" in done.err


@pytest.mark.parametrize("by", ["distance", "speed", "speed alone", "distance alone"])
def test_every_form_of_odometry_gives_equal_accuracy(tmp_path: Path, by: str) -> None:
    driven = robot()
    rows = driven.odometry.sort("time_s")
    turned = (rows["yaw_rate_radps"] / RATE_HZ).cum_sum()
    yaw, distance, speed = rows["yaw_rate_radps"], rows["distance_m"], rows["speed_mps"]
    columns = {
        "distance": {
            "left_m": distance - 0.5 * TRACK_M * turned,
            "right_m": distance + 0.5 * TRACK_M * turned,
        },
        "speed": {
            "left_mps": speed - 0.5 * TRACK_M * yaw,
            "right_mps": speed + 0.5 * TRACK_M * yaw,
        },
        "speed alone": {"speed_mps": speed, "yaw_rate_radps": yaw},
        "distance alone": {"distance_m": distance, "yaw_rate_radps": yaw},
    }
    as_rows = driven.rms_error_m(driven.locate(tmp_path))
    driven.odometry = rows.select("time_s", **columns[by])
    driven.sheet = driven.sheet.replace("odometer = {", f"odometer = {{ track_width_m = {TRACK_M},")
    assert driven.rms_error_m(driven.locate(tmp_path)) == pytest.approx(as_rows, abs=0.01)


def test_a_wider_track_than_specified_is_estimated(tmp_path: Path) -> None:
    driven = robot()
    turned = (driven.odometry["yaw_rate_radps"] / RATE_HZ).cum_sum()
    driven.odometry = driven.odometry.select(
        "time_s",
        left_m=pl.col("distance_m") - 0.5 * TRACK_M * turned,
        right_m=pl.col("distance_m") + 0.5 * TRACK_M * turned,
    )
    with pytest.raises(RecordingError, match=r"odometer\.track_width_m"):
        driven.locate(tmp_path)
    driven.sheet = driven.sheet.replace(
        "odometer = {", f"odometer = {{ track_width_m = {1.08 * TRACK_M}, track_width_std_m = 0.02,"
    )
    drive = driven.locate(tmp_path)
    found = drive.findings.row(by_predicate=pl.col("key") == "gyroscope.scale", named=True)
    assert found["before"] == 1.0
    assert abs(found["found"] - 1 / 1.08) < 4.0 * found["std"] < 0.05
    assert driven.rms_error_m(drive) < 0.1


def test_the_report_shows_what_was_found(access_av: Cli, tmp_path: Path) -> None:
    driven = robot(60.0)
    driven.sheet += "integrity = {}\n"
    arguments = driven.write(tmp_path)
    done = access_av(*arguments, "--truth", tmp_path / "truth.tum", "--smooth")
    assert done.code == 0, done.err
    page = (tmp_path / "out" / "report.html").read_text()
    specs = json.loads(re.search(r"const charts = (\{.*\});", page).group(1))  # type: ignore[union-attr]
    assert specs.keys() == {"track", "error", "angles", "heads"}
    drawn = {name: json.dumps(spec) for name, spec in specs.items()}
    for line in ("truth", "as driven", "smoothed", *(f"PCI {pci}" for pci in HEADS_M)):
        assert f'"{line}"' in drawn["track"], line
    for line in ("error", "error, smoothed", "deviation", "protection level"):
        assert f'"{line}"' in drawn["error"], line
    for pci in HEADS_M:
        assert f'"{pci}"' in drawn["heads"]
    for constant in ("odometer.scale", "gyroscope.bias_radps", "array.mounting_rad"):
        assert constant in page
    assert (tmp_path / "out" / "findings.parquet").exists()


def test_the_files_of_the_docs_can_be_used(access_av: Cli, tmp_path: Path) -> None:
    page = (ROOT / "docs/locate.md").read_text(encoding="utf-8")
    files = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    head, ranging, two_heads, delays, hall, road, vehicle = files
    (tmp_path / "two-heads.toml").write_text(two_heads)
    carrier = (ROOT / "vehicles/paper-carrier.toml").read_text(encoding="utf-8")
    (tmp_path / "vehicle.toml").write_text(carrier + ranging)
    (tmp_path / "delays.toml").write_text(delays.replace("site.toml", "two-heads.toml"))
    assert access_av("file", "check", "--kind", "scenario", tmp_path / "delays.toml").code == 0
    assert Site.from_toml('name = "hall"\n' + head).to_json()
    assert Site.from_toml(hall).to_json()
    assert Vehicle.from_toml('name = "robot"\n' + ranging).to_json()
    (tmp_path / "road.csv").write_text("x_m,y_m\n0,0\n50,0\n90,20\n")
    line = '{"type": "LineString", "coordinates": [[8.0, 60.0], [8.001, 60.0], [8.002, 60.001]]}'
    (tmp_path / "road.geojson").write_text(line)
    width = road[: road.index("polyline_m")]
    ways = re.findall(r"# or: (file = \S+|segments = .*?\])  ", road)
    assert len(ways) == 3
    for shape in (road, *(width + way for way in ways)):
        (tmp_path / "site.toml").write_text(hall + shape)
        assert access_av("file", "check", "--kind", "site", tmp_path / "site.toml").code == 0
    driven = robot(60.0)
    driven.sheet = re.sub(r"^array = .*\n", "", vehicle, flags=re.MULTILINE)
    done = access_av(*driven.write(tmp_path), "--truth", tmp_path / "truth.tum")
    assert done.code == 0, done.err
    shown = access_av("record", "locate", "--help", columns=200).out
    for row in re.findall(r"^\| (?:odometry|the same|angles).*$", page, re.MULTILINE):
        for column in re.findall(r"`(\w+_(?:s|m|mps|rad|radps|db)|pci|ssb_index)`", row):
            assert column in shown or column == "rician_k_db", column


def test_a_drive_is_located_by_variants_side_by_side(access_av: Cli, tmp_path: Path) -> None:
    logged = tmp_path / "logged"
    drives.log_angles(SCENARIO, logged, duration_s=45.0)
    other = tmp_path / "other.toml"
    other.write_text((logged / "vehicle.toml").read_text("utf-8"), "utf-8")
    command = [
        "record", "locate", "--recording", logged / "angles.csv",
        "--odometry", logged / "odometry.csv",
        "--site", logged / "site.toml", "--vehicle", logged / "vehicle.toml",
        "--sweep", "vehicle.odometer.scale=1.03", "--against", other, "--percentile", "90",
        "--out", tmp_path / "out",
    ]  # fmt: skip
    refused = access_av(*command)
    assert refused.code == 2
    assert "--truth" in refused.err
    command += ["--truth", logged / "truth.tum"]
    done = access_av(*command, columns=160)
    assert done.code == 0, done.err
    assert "Comparison, 4 stretches of 10 s of one drive each" in done.out
    compared = pl.read_parquet(tmp_path / "out" / "compared.parquet")
    assert tuple(compared.columns) == TABLES["compared"].columns
    assert compared["variant"].to_list() == [
        "unchanged",
        "vehicle.odometer.scale = 1.03",
        str(other),
    ]
    assert compared["runs"].to_list() == [4, 4, 4]
    first, worse, same = compared.iter_rows(named=True)
    poses = pl.read_parquet(tmp_path / "out" / "poses.parquet")
    errors_m = drives.error_m(poses, logged / "truth.tum")["error_m"]
    errors_m = errors_m.head(4 * (errors_m.len() // 4)).sort()  # in four sections of equal length
    assert first["percentile_m"] == errors_m[math.ceil(0.9 * errors_m.len()) - 1]
    assert first["delta_m"] is None
    # A scale error of 3 % is ten standard deviations of the odometer; the file is the same.
    assert worse["delta_m"] == pytest.approx(worse["percentile_m"] - first["percentile_m"])
    assert worse["delta_m"] > 0.0
    assert (same["delta_m"], same["delta_low_m"], same["delta_high_m"]) == (0.0, 0.0, 0.0)
    assert "Comparison of variants" in (tmp_path / "out" / "report.html").read_text("utf-8")

    refused = access_av(*command, "--sweep", "odometer.scale=1.03")
    assert refused.code == 2
    assert "site. or vehicle." in refused.err
