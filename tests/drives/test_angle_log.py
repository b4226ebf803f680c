"""From samples to a log of angles, and from the log to the trajectory."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import InputError, RecordingError, Site, drives, estimate_angles
from access_av.signal.array_annotations import ArrayTruth
from access_av.signal.recorded_angles import estimate_bursts
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]


# Radio head that is nearer.
STRONGER = 2
INDEPENDENT = 300


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("drive")
    drives.synthesize("paper-real-odometry-2", place, duration_s=8.0)
    return place


@pytest.fixture(scope="module")
def log(drive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files that the command writes."""
    place = tmp_path_factory.mktemp("log")
    found = estimate_angles(
        drive / "site.toml", drive / "iq.sigmf-meta", vehicle=drive / "vehicle.toml"
    )
    (place / "angles.csv").write_text(found.csv())
    found.angles.write_parquet(place / "angles.parquet")
    (place / "vehicle.toml").write_text(found.vehicle.to_toml())
    return place


def test_an_angle_log_gives_the_poses_of_its_samples(
    access_av: Cli, drive: Path, tmp_path: Path
) -> None:
    site, vehicle = drive / "site.toml", drive / "vehicle.toml"
    out = tmp_path / "angles"
    done = access_av(
        "record",
        "angles",
        drive / "iq.sigmf-meta",
        "--site",
        site,
        "--vehicle",
        vehicle,
        "--out",
        out,
    )
    assert done.code == 0, done.err
    text = (out / "angles.csv").read_text()
    comments = [line for line in text.splitlines() if line.startswith("#")]
    assert "receiver noise and the site's scatter (rician_k_db = " in comments[0]
    assert "phase_noise_sigma_rad: receiver noise only" in comments[1]
    rows = pl.read_parquet(out / "angles.parquet")
    assert tuple(rows.columns) == TABLES["measurements"].of("`estimate_angles(…)`")
    assert (rows["phase_sigma_rad"] > rows["phase_noise_sigma_rad"]).all()

    def located(recording: Path, vehicle_file: Path) -> drives.Drive:
        return drives.locate(
            out / "site.toml", drive / "odometry.csv", recording, vehicle=vehicle_file
        )

    by_samples = located(drive / "iq.sigmf-meta", vehicle)
    by_csv = located(out / "angles.csv", out / "vehicle.toml")
    by_parquet = located(out / "angles.parquet", out / "vehicle.toml")
    assert by_csv.poses.equals(by_parquet.poses)
    # The angles are equal: the log contains all angles that were estimated from the samples.
    received = by_samples.angles.join(rows, on=["time_s", "pci", "ssb_index"])
    assert received.height == by_samples.angles.height
    np.testing.assert_allclose(received["phase_rad"], received["phase_rad_right"], atol=1e-12)
    np.testing.assert_allclose(
        received["phase_sigma_rad"], received["phase_noise_sigma_rad"], rtol=1e-12
    )
    apart_m = (
        (by_samples.poses["x_m"] - by_csv.poses["x_m"]) ** 2
        + (by_samples.poses["y_m"] - by_csv.poses["y_m"]) ** 2
    ).sqrt()
    deviation_m = (
        by_samples.poses["covariance_xx_m2"] + by_samples.poses["covariance_yy_m2"]
    ).sqrt()
    # Correlated scatter instead of white noise changes the pose by less than its uncertainty.
    assert (apart_m < deviation_m).all()


def test_the_standard_deviation_covers_the_whole_error(drive: Path, log: Path) -> None:
    """The noise alone is far below the error; with the scatter, the mean normalized square is
    one."""
    truth = json.loads((drive / "iq.sigmf-meta").read_text())
    rate_hz = truth["global"]["core:sample_rate"]
    spacing = truth["annotations"][0]["aoa:truth"]["element_spacing_wavelengths"]
    starts = {it["core:sample_start"]: it["core:global_index"] for it in truth["captures"]}
    phases = []
    for one in truth["annotations"]:
        first = max(start for start in starts if start <= one["core:sample_start"])
        time_s = (starts[first] + one["core:sample_start"] - first) / rate_hz
        azimuth_rad = math.radians(one["aoa:truth"]["azimuth_from_broadside_deg"])
        phase_rad = 2 * math.pi * spacing * math.sin(azimuth_rad)
        phases.append((time_s, one["nr:ssb"]["pci"], phase_rad))
    true = pl.DataFrame(phases, schema=["time_s", "pci", "true_rad"], orient="row")
    true = true.with_columns(pl.col("pci").cast(pl.UInt16)).sort("time_s")
    found = pl.read_parquet(log / "angles.parquet").filter("resolved").sort("time_s")
    parts = [
        found.filter(pci=pci).join_asof(
            true.filter(pci=pci).drop("pci"), on="time_s", strategy="nearest", tolerance=1e-3
        )
        for pci in (1, 2)
    ]
    both = pl.concat(parts)
    assert both["true_rad"].null_count() == 0
    error = both["phase_rad"] - both["true_rad"]
    by_noise = float(((error / both["phase_noise_sigma_rad"]) ** 2).mean())  # type: ignore[arg-type]
    by_all = float(((error / both["phase_sigma_rad"]) ** 2).mean())  # type: ignore[arg-type]
    assert by_noise > 4.0
    # Angles are independent every half wavelength: about a hundred here, with squares of variance
    # 2.
    assert abs(by_all - 1.0) < 4.0 * (2.0 / INDEPENDENT) ** 0.5


def test_the_truth_of_a_synthetic_recording_is_shown(drive: Path) -> None:
    """The annotated angle is that of the radio head from the annotated pose."""
    site = json.loads(Site.load(str(drive / "site.toml")).to_json())
    heads_m = {head["pci"]: head["position_m"] for head in site["radio_heads"]}
    annotations = json.loads((drive / "iq.sigmf-meta").read_text())["annotations"]
    bursts = estimate_bursts(drive / "iq.sigmf-meta")
    errors_deg = []
    for burst, annotation in zip(bursts, annotations, strict=True):
        pose, pci = annotation["access_av:truth"], annotation["nr:ssb"]["pci"]
        dx, dy = heads_m[pci][0] - pose["x_m"], heads_m[pci][1] - pose["y_m"]
        from_axis_rad = math.atan2(dy, dx) - pose["heading_rad"]
        assert burst.truth_deg == pytest.approx(math.degrees(math.asin(math.cos(from_axis_rad))))
        if pci == STRONGER:
            errors_deg.append(burst.azimuth_deg - burst.truth_deg)
    # Both cells transmit simultaneously; the estimated direction is that of the stronger one.
    assert np.median(np.abs(errors_deg)) < math.degrees(0.1)


def test_annotated_angles_from_the_array_axis_are_converted() -> None:
    def truth_deg(**stated: float) -> float | None:
        return ArrayTruth.of({"aoa:truth": stated}, 4).azimuth_from_broadside_deg

    assert truth_deg(angle_from_axis_deg=30.0) == 60.0
    assert truth_deg(azimuth_from_axis_deg=-30.0) == 60.0
    assert truth_deg(azimuth_from_broadside_deg=-10.0, angle_from_axis_deg=30.0) == -10.0
    assert truth_deg() is None


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"time_s": [1.0], "pci": [1]}, "`phase_rad` is missing"),
        ({"time_s": [1.0], "pci": [1], "phase_rad": [0.1]}, "`phase_sigma_rad` is missing"),
        ({"pci": [1], "phase_rad": [0.1], "phase_sigma_rad": [0.1]}, "`time_s` is missing"),
        ({"time_s": ["1.0"], "pci": [1]}, "`time_s` is String; it must be numbers"),
        (
            {"time_s": [1.0], "pci": [1.5], "phase_rad": [0.1], "phase_sigma_rad": [0.1]},
            "pci 1.5 is not an integer",
        ),
        (
            {"time_s": [1.0], "pci": [1], "phase_rad": [None], "phase_sigma_rad": [0.1]},
            "phase_rad and angle_rad are both missing",
        ),
    ],
)
def test_parquet_that_is_no_log_is_refused(
    drive: Path, tmp_path: Path, columns: dict[str, list[object]], said: str
) -> None:
    file = tmp_path / "angles.parquet"
    pl.DataFrame(columns).write_parquet(file)
    with pytest.raises((RecordingError, InputError), match=said):
        drives.locate(
            drive / "site.toml", drive / "odometry.csv", file, vehicle=drive / "vehicle.toml"
        )


def test_damaged_parquet_is_refused(access_av: Cli, drive: Path, log: Path, tmp_path: Path) -> None:
    whole = (log / "angles.parquet").read_bytes()
    for number, content in enumerate(
        (b"", whole[:100], whole[:-20], b"PAR1" + bytes(64) + b"PAR1")
    ):
        file = tmp_path / f"{number}.parquet"
        file.write_bytes(content)
        done = access_av(
            "record", "locate", "--recording", file, "--odometry", drive / "odometry.csv",
            "--site", drive / "site.toml", "--vehicle", drive / "vehicle.toml",
            "--out", tmp_path / "out",
        )  # fmt: skip
        assert done.code == 2
        assert f"{number}.parquet" in done.err


def test_samples_without_angles_are_refused(access_av: Cli, drive: Path, tmp_path: Path) -> None:
    site = (drive / "site.toml").read_text()
    other = tmp_path / "site.toml"
    other.write_text(site.replace("pci = 1\n", "pci = 501\n").replace("pci = 2\n", "pci = 502\n"))
    given = ["record", "angles", drive / "iq.sigmf-meta", "--vehicle", drive / "vehicle.toml"]
    done = access_av(*given, "--site", other, "--out", tmp_path / "out")
    assert done.code == 2
    assert "no SSB of a radio head of the site" in " ".join(done.err.split())
    assert not (tmp_path / "out").exists()
    late = access_av(*given, "--site", drive / "site.toml", "--start-time-s", "nan")
    assert late.code == 2
