"""Range offsets from known positions, and the position of a stationary receiver."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from access_av import InputError, Site, Vehicle
from access_av._core import RecordingError
from access_av.drives.range_survey import survey_offsets
from access_av.drives.stationary import locate_stationary

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

HEADS_M = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 30.0], [0.0, 30.0]])
OFFSETS_M = np.array([3.0, -2.0, 1.0, -2.0])
SCATTER_M = 0.3
# A sample of 100 MHz.
SAMPLE_RATE_HZ, FFT = 122.88e6, 4096
SAMPLE_M = 299_792_458.0 / SAMPLE_RATE_HZ
PLACES_M = ((4.0, 6.0), (15.0, 8.0), (6.0, 22.0), (16.0, 25.0), (11.0, 14.0))
SITE = 'name = "hall"\n[ssb]\nsubcarrier_spacing_khz = 30.0\n' + "".join(
    f"[[radio_heads]]\npci = {pci}\nposition_m = [{x_m}, {y_m}, 1.0]\n"
    for pci, (x_m, y_m) in enumerate(HEADS_M.tolist())
)
VEHICLE = (
    'name = "ue"\ndrive = "differential"\n[ranging]\nkind = "one-way"\noffset_std_m = 0.5\n'
    "position_m = [0.0, 0.0, 1.0]\n"
)


def log_text(place_m: tuple[float, float], rng: np.random.Generator, frames: int = 400) -> str:
    """Log of an OpenAirInterface UE whose clock walks, with a fifth of wild delays."""
    offsets_m = OFFSETS_M + SCATTER_M * rng.standard_normal(4)
    range_m = np.hypot(*(HEADS_M - place_m).T) + offsets_m
    lines, clock_m = [], 40.0
    for frame in range(frames):
        clock_m += 0.3 * rng.standard_normal()
        for pci in range(4):
            delay = (range_m[pci] + clock_m + 1.0 * rng.standard_normal()) / SAMPLE_M
            if rng.random() < 0.2:
                delay = rng.uniform(-2000.0, 2000.0)
            lines.append(
                f"[PHY]   [gNB {pci}][rsc 0][Rx 0][sfn {(1000 + frame) % 1024}][slot {2 + pci}] "
                f"DL PRS ToA ==> {round(delay):.1f} / {FFT} samples, "
                "peak channel power -53.9 dBm, SNR +4.0 dB, rsrp -77.4 dBm"
            )
    return "UE log\n" + "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One folder for each position, with a log and its truth; site and vehicle."""
    folder = tmp_path_factory.mktemp("positions")
    rng = np.random.default_rng(5)
    for number, (x_m, y_m) in enumerate(PLACES_M):
        (folder / str(number)).mkdir()
        (folder / f"{number}/ranges.log").write_text(log_text((x_m, y_m), rng))
        (folder / f"{number}/truth.tum").write_text(f"0 {x_m} {y_m} 0 0 0 0 1\n")
    (folder / "site.toml").write_text(SITE)
    (folder / "vehicle.toml").write_text(VEHICLE)
    return folder


def test_offsets_and_position_are_found(measured: Path) -> None:
    site, vehicle = str(measured / "site.toml"), str(measured / "vehicle.toml")
    nees = []
    for left_out in range(5):
        known = [measured / str(it) for it in range(5) if it != left_out]
        found = survey_offsets(site, vehicle, known)
        offsets_m = found.offsets["range_offset_m"].to_numpy()
        # The mean of four positions; 4 standard deviations.
        assert np.abs(offsets_m - OFFSETS_M).max() < 4.0 * SCATTER_M / 2.0
        std_m = found.offsets["range_offset_std_m"][0]
        assert 0.5 * SCATTER_M < std_m < 2.0 * SCATTER_M
        here = locate_stationary(found.site, vehicle, measured / f"{left_out}/ranges.log")
        x_m, y_m = PLACES_M[left_out]
        error_m = (here.x_m - x_m, here.y_m - y_m)
        assert np.hypot(*error_m) < 4.0 * here.std_m < 4.0
        assert not here.alternatives_m
        nees.append(here.nees_per_axis(error_m))
    # Five squared errors of two axes: 99.9 % quantile of χ² with ten degrees of freedom.
    assert np.mean(nees) < 2.96
    # Without the survey, the offsets contradict their specification.
    plain = locate_stationary(site, vehicle, measured / "4/ranges.log")
    assert any("contradict" in remark for remark in plain.remarks)


def test_two_way_ranges_need_two_radio_heads(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    (tmp_path / "site.toml").write_text(SITE)
    vehicle = Vehicle.from_toml(VEHICLE.replace("one-way", "two-way"))
    place_m = (7.0, 9.0)
    rows = [
        {"time_s": 0.1 * number, "pci": pci, "range_m": float(distance_m + rng.normal(0.0, 0.1))}
        for number in range(50)
        for pci, distance_m in enumerate(np.hypot(*(HEADS_M[:2] - place_m).T))
    ]
    pl.DataFrame(rows).write_csv(tmp_path / "ranges.csv")
    site = Site.load(str(tmp_path / "site.toml"))
    found = locate_stationary(site, vehicle, tmp_path / "ranges.csv", near_m=(5.0, 5.0))
    # 50 ranges of 0.1 m each; 5 standard deviations.
    assert np.hypot(found.x_m - 7.0, found.y_m - 9.0) < 5.0 * 0.1 / 50**0.5 * 2.0
    # The position mirrored at the line through both radio heads fits equally well.
    [(x_m, y_m)] = found.alternatives_m
    assert (x_m, y_m) == pytest.approx((7.0, -9.0), abs=0.2)
    pl.DataFrame(rows).filter(pci=0).write_csv(tmp_path / "one.csv")
    with pytest.raises(InputError, match="ranges of 1 radio heads"):
        locate_stationary(site, vehicle, tmp_path / "one.csv")


def test_survey_and_locate_commands_use_ranges(
    measured: Path, access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    site, vehicle = measured / "site.toml", measured / "vehicle.toml"
    known = [measured / str(it) for it in range(3)]
    done = access_av(
        "record", "survey", *known, "--site", site, "--vehicle", vehicle, "--out", tmp_path / "s"
    )
    assert done.code == 0, done.err
    assert "pci 3, ssb_index 0" in done.out
    done = access_av(
        "record", "locate", "--recording", measured / "4/ranges.log",
        "--site", tmp_path / "s/site.toml", "--vehicle", vehicle,
        "--truth", measured / "4/truth.tum", "--out", tmp_path / "l", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["error_m"] < 4.0 * found["std_m"]
    assert json.loads((tmp_path / "l/position.json").read_text())["x_m"] == found["x_m"]
    done = access_av(
        "record", "locate", "--recording", measured / "4/ranges.log", "--site", site,
        "--vehicle", vehicle, "--smooth",
    )  # fmt: skip
    assert done.code == 2
    assert "--odometry: missing" in done.err


def test_unusable_logs_are_rejected(measured: Path, tmp_path: Path) -> None:
    site, vehicle = str(measured / "site.toml"), str(measured / "vehicle.toml")
    slow = Site.from_toml(SITE.replace("30.0", "15.0", 1))
    log = measured / "0/ranges.log"
    fast = tmp_path / "late.log"
    fast.write_text(log.read_text().replace("[slot 5]", "[slot 15]"))
    with pytest.raises(RecordingError, match=r"line 5: slot.*subcarrier_spacing_khz"):
        locate_stationary(slow, vehicle, fast)
    (tmp_path / "other.log").write_text("nothing\n")
    with pytest.raises(RecordingError, match="DL PRS ToA"):
        locate_stationary(site, vehicle, tmp_path / "other.log")
    with pytest.raises(InputError, match="no range log"):
        survey_offsets(site, vehicle, [tmp_path])
    shutil.copy(log, tmp_path / "ranges.log")
    (tmp_path / "truth.tum").write_text("1000 0 0 0 0 0 0 1\n1001 5 0 0 0 0 0 1\n")
    with pytest.raises(InputError, match="no range belongs to a radio head"):
        survey_offsets(site, vehicle, [tmp_path])


def test_prs_delays_of_openairinterface_locate_a_receiver(data: Path, tmp_path: Path) -> None:
    """Real delays at three positions; offsets from the two others."""
    folder = data / "ranges/oai_prs"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    places = pl.read_csv(folder / "positions.csv")
    at = {name: (x_m, y_m) for name, x_m, y_m in places.iter_rows()}
    # Delays without a power are of empty channel estimates.
    table = pl.read_csv(folder / "toa.csv.gz").drop_nulls()
    table = table.filter(
        (pl.col("bandwidth_mhz") == 100) & (pl.col("oversampling") == 1) & (pl.col("frame") < 6000)
    )
    heads = "".join(
        f"[[radio_heads]]\npci = {pci}\nposition_m = [{at[f'gnb{pci}'][0]:f}, "
        f"{at[f'gnb{pci}'][1]:f}, 1.0]\n"
        for pci in range(4)
    )
    site = Site.from_toml(f'name = "lab"\n{heads}')
    vehicle = Vehicle.from_toml(VEHICLE.replace("offset_std_m = 0.5", "offset_std_m = 1.0"))
    for ue in range(3):
        (tmp_path / str(ue)).mkdir()
        x_m, y_m = at[f"ue{ue}"]
        (tmp_path / f"{ue}/truth.tum").write_text(f"0 {x_m} {y_m} 0 0 0 0 1\n")
        table.filter(ue=ue).select(
            # Frames start again in a second recording of a position.
            time_s=0.01 * pl.col("frame")
            + 0.0005 * pl.col("gnb")
            + 100.0 * (pl.col("frame").diff() < 0).fill_null(value=False).cum_sum(),
            pci="gnb",
            delay_samples="toa_samples",
            sample_rate_hz=pl.lit(SAMPLE_RATE_HZ),
        ).drop_nulls().write_csv(tmp_path / f"{ue}/ranges.csv")
    errors_m, nees = [], []
    for ue in range(3):
        known = [tmp_path / str(it) for it in range(3) if it != ue]
        found = survey_offsets(site, vehicle, known)
        here = locate_stationary(found.site, vehicle, tmp_path / f"{ue}/ranges.csv")
        error_m = (here.x_m - at[f"ue{ue}"][0], here.y_m - at[f"ue{ue}"][1])
        errors_m.append(float(np.hypot(*error_m)))
        nees.append(here.nees_per_axis(error_m))
    print(f"errors {np.round(errors_m, 2)} m, NEES/2 {np.round(nees, 2)}")
    # A frame has an error of 0.5 to 3 m (median over the frames of a position).
    assert np.median(errors_m) < 1.0
    assert np.mean(nees) < 1.5


def test_uwb_ranges_with_blocked_paths_locate_a_receiver(data: Path, tmp_path: Path) -> None:
    """Real ultra-wideband ranges from seven positions; two thirds of the paths are blocked."""
    file = data / "ranges/uwb_iiot/ranges.csv.gz"
    if not file.is_file():
        pytest.skip(f"no {file}")
    table = pl.read_csv(file).with_columns(
        pci=pl.col("anchorNumber").cast(pl.Int64),
        number=pl.int_range(pl.len()).over("location_ID", "anchorNumber"),
    )
    anchors = table.unique("pci").sort("pci")
    heads = "".join(
        f"[[radio_heads]]\npci = {pci}\nposition_m = [{x_m:f}, {y_m:f}, {z_m:f}]\n"
        for pci, x_m, y_m, z_m in anchors.select(
            "pci", "x_anchor_m", "y_anchor_m", "z_anchor_m"
        ).iter_rows()
    )
    site = Site.from_toml(f'name = "hall"\n{heads}')
    errors_m, nees = [], []
    # Five ranges of each anchor.
    blocks = table.with_columns(block=pl.col("number") // 5)
    for block in blocks.partition_by("location_ID", "block", maintain_order=True):
        if block["pci"].n_unique() < 4:
            continue
        x_m, y_m, z_m = block.select("x_tag_m", "y_tag_m", "z_tag_m").row(0)
        vehicle = Vehicle.from_toml(
            'name = "tag"\ndrive = "differential"\n[ranging]\nkind = "two-way"\nsigma_m = 0.1\n'
            f"offset_std_m = 0.3\nposition_m = [0.0, 0.0, {z_m:f}]\n"
        )
        block.select(
            time_s=0.1 * pl.col("number"), pci="pci", range_m="estimated_range_m"
        ).write_csv(tmp_path / "ranges.csv")
        here = locate_stationary(site, vehicle, tmp_path / "ranges.csv")
        error_m = (here.x_m - x_m, here.y_m - y_m)
        errors_m.append(float(np.hypot(*error_m)))
        nees.append(here.nees_per_axis(error_m))
    print(f"95 % of errors {np.quantile(errors_m, 0.95):.3f} m, NEES/2 {np.mean(nees):.2f}")
    # 95 % of the ranges of blocked paths have errors of up to 0.98 m.
    assert np.quantile(errors_m, 0.95) < 0.5
    assert np.mean(nees) < 1.5
