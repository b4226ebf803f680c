"""Mistakes in the files of a drive: each is rejected or reported."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING

import polars as pl
import pytest

from access_av._core import RecordingError
from robot import HEADS_M, MOUNTING_RAD, Robot, robot

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

    Cli = Callable[..., Finished]


def odometry(**columns: pl.Expr) -> Callable[[Robot], None]:
    def spoil(it: Robot) -> None:
        it.odometry = it.odometry.with_columns(**columns)

    return spoil


def angles(**columns: pl.Expr) -> Callable[[Robot], None]:
    def spoil(it: Robot) -> None:
        it.angles = it.angles.with_columns(**columns)

    return spoil


def as_angle(it: Robot, value: pl.Expr) -> None:
    """The log contains the angle from the axis instead of the electrical angle."""
    it.angles = it.angles.select(
        "time_s", "pci", angle_rad=value, angle_sigma_rad="phase_sigma_rad"
    )


def heads(place: Callable[[float, float], tuple[float, float]]) -> Callable[[Robot], None]:
    def spoil(it: Robot) -> None:
        it.heads_m = {pci: place(x, y) for pci, (x, y) in HEADS_M.items()}

    return spoil


def mounted(by_rad: float) -> Callable[[Robot], None]:
    def spoil(it: Robot) -> None:
        it.mounting_rad += by_rad

    return spoil


PHASE, SIGMA = pl.col("phase_rad"), pl.col("phase_sigma_rad")
YAW = pl.col("yaw_rate_radps")
DISTANCE, SPEED, TIME = pl.col("distance_m"), pl.col("speed_mps"), pl.col("time_s")
ANGLE = (PHASE / math.pi).clip(-1.0, 1.0).arccos()
OTHERS = pl.when(pl.int_range(pl.len()) % 2 == 0)

# Kind of mistake, change of the files, and the expected report: as a suspicion ...
SUSPECTED = {
    "sign of the phase": (angles(phase_rad=-PHASE), "order of the array's antennas is reversed"),
    "array mirrored": (mounted(-math.pi), "order of the array's antennas is reversed"),
    "angle in phase_rad": (angles(phase_rad=ANGLE), "phase_rad is the angle"),
    "phase in angle_rad": (lambda it: as_angle(it, PHASE), "angle_rad is the electrical angle"),
    "bearing in angle_rad": (
        lambda it: as_angle(it, MOUNTING_RAD - ANGLE),
        "angle_rad is measured from the vehicle's forward axis",
    ),
    "phase in degrees": (angles(phase_rad=PHASE.degrees()), "in degrees"),
    "axis to the front": (mounted(-math.pi / 2), "further to the left"),
    "axis to the back": (mounted(math.pi / 2), "further to the right"),
    "yaw rate in degrees": (odometry(yaw_rate_radps=YAW.degrees()), "degrees per second"),
    "yaw rate clockwise": (odometry(yaw_rate_radps=-YAW), "counts clockwise"),
    "backwards": (odometry(distance_m=-DISTANCE, speed_mps=-SPEED), "count backwards"),
    "millimetres": (
        odometry(distance_m=1e3 * DISTANCE, speed_mps=1e3 * SPEED),
        "are in millimetres",
    ),
    "heads mirrored in x": (heads(lambda x, y: (-x, y)), "x is mirrored"),
    "heads mirrored in y": (heads(lambda x, y: (x, -y)), "y is mirrored"),
    "x and y exchanged": (heads(lambda x, y: (y, x)), "x and y are exchanged"),
}  # fmt: skip

# ... as a remark on a located drive ...
REMARKED = {
    "distance in millimetres": (odometry(distance_m=1e3 * DISTANCE), "check the units"),
    "speed in km/h": (odometry(speed_mps=3.6 * SPEED), "check the units"),
    "unknown PCI": (
        angles(pci=OTHERS.then(999).otherwise("pci")),
        "pci 999, ssb_index 0, which the site does not have",
    ),
    "times repeated": (
        odometry(time_s=OTHERS.then(TIME).otherwise(TIME.shift(1))),
        "a second sample at",
    ),
    "all of the angle in degrees": (
        angles(phase_rad=PHASE.degrees(), phase_sigma_rad=0.6 * SIGMA.degrees()),
        "are in degrees",
    ),
    "deviation in degrees": (
        angles(phase_sigma_rad=OTHERS.then(SIGMA.degrees()).otherwise(SIGMA)),
        "check its unit",
    ),
    "no yaw rate": (
        lambda it: setattr(it, "odometry", it.odometry.drop("yaw_rate_radps")),
        "a differential drive has no source of the yaw rate",
    ),
    "no distance": (
        lambda it: setattr(it, "odometry", it.odometry.drop("distance_m")),
        "distance_m is taken from the speeds",
    ),
    "half of the yaw rates": (
        odometry(yaw_rate_radps=OTHERS.then(YAW).otherwise(None)),
        "yaw_rate_radps is empty in 450 of 900 samples",
    ),
    "one wild yaw rate": (
        odometry(yaw_rate_radps=pl.when(pl.int_range(pl.len()) == 600).then(20.0).otherwise(YAW)),
        "line 602: yaw_rate_radps is 20.000, far from the values next to it",
    ),
    "angles late": (angles(time_s=TIME + 0.1), "ms later than configured"),
    "twice as far": (
        odometry(distance_m=2 * DISTANCE, speed_mps=2 * SPEED),
        "check odometer.scale",
    ),
    "odometer": (
        odometry(distance_m=1.1 * DISTANCE, speed_mps=1.1 * SPEED),
        "check odometer.scale",
    ),
    "angles missing": (
        lambda it: setattr(it, "angles", it.angles.filter(~TIME.is_between(10.0, 40.0))),
        "no angle for",
    ),
}  # fmt: skip

# Durations (s) other than the usual one. If no angle fits, the search is long. A change of the
# direction at 40 s is a contradiction until later measurements have explained it.
LASTING_S = {
    "all of the angle in degrees": 2.0,
    "distance in millimetres": 90.0,
    "speed in km/h": 90.0,
}

# ... or as an error.
REFUSED = {
    "no usable angle": (angles(pci=pl.format("cell {}", "pci")), "line 2: left out, pci `cell 11`"),
    "all angles NaN": (angles(phase_rad=pl.lit(math.nan)), "no usable angle; .* phase_rad"),
    "no angle at all": (
        lambda it: setattr(it, "angles", it.angles.clear()),
        "no usable angle$",
    ),
    "time backwards": (
        lambda it: setattr(it, "odometry", it.odometry.reverse()),
        "fewer than two usable samples; odometry line 3: left out, .* comes after",
    ),
    "all yaw rates NaN": (
        odometry(yaw_rate_radps=pl.lit(math.nan)),
        "fewer than two usable samples; odometry line 2: left out, yaw_rate_radps is missing",
    ),
    "clocks": (angles(time_s=TIME + 1e9), "must use one clock"),
    "no radio head": (angles(pci=pl.lit(999)), "check pci and ssb_index"),
    "no deviation": (
        lambda it: setattr(it, "angles", it.angles.drop("phase_sigma_rad")),
        "phase_sigma_rad",
    ),
    "no angle": (lambda it: setattr(it, "angles", it.angles.drop("phase_rad")), "phase_rad"),
    "neither distance nor speed": (
        lambda it: setattr(it, "odometry", it.odometry.drop("distance_m", "speed_mps")),
        "distance_m",
    ),
}  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_correct_drive_has_no_suspicions(tmp_path: Path, seed: int) -> None:
    whole = robot(seed=seed)
    drive = whole.locate(tmp_path)
    assert drive.remarks == []
    assert drive.is_reliable
    assert whole.rms_error_m(drive) < 0.1


@pytest.mark.parametrize("kind", SUSPECTED)
def test_the_probable_mistake_is_reported(tmp_path: Path, kind: str) -> None:
    spoil, says = SUSPECTED[kind]
    # Speeds of kilometres per second cause a long search. Rejected yaw rates have no immediate
    # effect.
    spoilt = robot({"millimetres": 25.0, "yaw rate in degrees": 90.0}.get(kind, 40.0))
    spoil(spoilt)
    drive = spoilt.locate(tmp_path)
    assert len(drive.suspicions) == 1, drive.suspicions
    assert says in drive.suspicions[0]
    assert drive.suspicions[0] in drive.remarks
    assert not drive.is_reliable


def test_a_drive_with_wheel_distances_in_millimetres_is_not_reliable(tmp_path: Path) -> None:
    """With such distances, the filter can fit every angle."""
    whole = robot(30.0)
    whole.sheet = whole.sheet.replace("odometer = {", "odometer = { track_width_m = 0.26,")
    turned = 0.13 * (YAW * 0.05).cum_sum()
    whole.odometry = whole.odometry.select(
        "time_s", left_m=1e3 * (DISTANCE - turned), right_m=1e3 * (DISTANCE + turned)
    )
    drive = whole.locate(tmp_path)
    assert not drive.is_reliable
    assert ["top_speed_kmh is 15; check the units" in it for it in drive.suspicions] == [True]


@pytest.mark.parametrize(
    ("by_rad", "says"),
    [(-math.pi / 2, "further to the left"), (math.pi, "heading the other way")],
)
def test_a_wrong_heading_is_reported_and_corrected(
    tmp_path: Path, by_rad: float, says: str
) -> None:
    spoilt = robot()
    x, y, heading_rad = spoilt.start
    spoilt.start = (x, y, heading_rad + by_rad)
    drive = spoilt.locate(tmp_path)
    assert any(says in remark for remark in drive.remarks), drive.remarks
    assert any("found again" in remark for remark in drive.remarks)
    assert drive.suspicions == []


@pytest.mark.parametrize("kind", REMARKED)
def test_the_mistake_causes_a_remark(tmp_path: Path, kind: str) -> None:
    spoil, says = REMARKED[kind]
    spoilt = robot(LASTING_S.get(kind, 45.0))
    spoil(spoilt)
    drive = spoilt.locate(tmp_path)
    assert any(says in remark for remark in drive.remarks), drive.remarks
    assert len(drive.remarks) < 10
    assert drive.suspicions == []


@pytest.mark.parametrize("kind", REFUSED)
def test_the_mistake_is_rejected(tmp_path: Path, kind: str) -> None:
    spoil, says = REFUSED[kind]
    spoilt = robot()
    spoil(spoilt)
    with pytest.raises(RecordingError, match=says):
        spoilt.locate(tmp_path)


def test_a_truth_of_another_time_is_refused(access_av: Cli, tmp_path: Path) -> None:
    whole = robot(5.0)
    whole.truth = whole.truth.with_columns(time_s=TIME + 1e9)
    arguments = [*whole.write(tmp_path), "--truth", tmp_path / "truth.tum"]
    done = access_av(*arguments)
    assert done.code == 2
    assert "it is from 1000000000.000 to 1000000004.950 s, the drive from 0.000 to" in done.err
    (tmp_path / "truth.tum").write_text("# time x y z qx qy qz qw\n")
    done = access_av(*arguments)
    assert (done.code, "truth.tum: contains no pose" in done.err) == (2, True)


def test_a_misplaced_radio_head_is_reported(tmp_path: Path) -> None:
    """One of six radio heads at a wrong position is reported with its estimated position."""
    spoilt = robot()
    x, y = HEADS_M[13]
    spoilt.heads_m[13] = (x + 6.0, y - 8.0)
    drive = spoilt.locate(tmp_path)
    (diagnosis,) = drive.diagnoses
    assert "pci 13 is near" in diagnosis
    place_m = re.findall(r"-?\d+\.\d", diagnosis)[:2]
    assert [float(it) for it in place_m] == pytest.approx([x, y], abs=0.5), diagnosis
    assert diagnosis in drive.remarks
    assert drive.is_reliable == (spoilt.rms_error_m(drive) < 0.5)


def test_a_vehicle_that_is_never_found_is_no_success(access_av: Cli, tmp_path: Path) -> None:
    whole = robot(3.0)
    whole.angles = whole.angles.filter(pci=11)  # one radio head does not determine a position
    arguments = whole.write(tmp_path)
    arguments[arguments.index("--start") + 1] = "unknown"
    done = access_av(*arguments, "--json")
    assert done.code == 3
    assert json.loads(done.out)["lost_share"] == 1.0
    assert "never found" in done.err


def test_exit_codes_depend_on_the_mistake(access_av: Cli, tmp_path: Path) -> None:
    whole = robot(15.0)
    arguments = whole.write(tmp_path)
    assert access_av(*arguments).code == 0
    whole.heads_m = {pci: (-x, y) for pci, (x, y) in HEADS_M.items()}
    whole.write(tmp_path)
    done = access_av(*arguments)
    assert done.code == 3
    assert done.err.count("x is mirrored") == 1  # in the verdict, not among the remarks too
    for said in (done.err, (tmp_path / "out" / "report.html").read_text()):
        assert "x is mirrored" in " ".join(said.split()).replace("&#x27;", "'")
    again = [*arguments[:-1], tmp_path / "again"]
    result = json.loads(access_av(*again, "--json").out)
    assert "x is mirrored" in result["suspicions"][0]
    assert result["lost_share"] > 0.0
    assert json.loads((tmp_path / "again" / "manifest.json").read_text())["suspicions"]
    whole.angles = whole.angles.with_columns(time_s=TIME + 1e9)
    whole.write(tmp_path)
    assert access_av(*arguments[:-1], tmp_path / "refused").code == 2
    for code in ("0", "2", "3"):
        assert f"{code}: " in access_av("record", "locate", "--help", columns=200).out
