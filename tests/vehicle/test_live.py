"""The pipeline with data in order of arrival, and the ROS 2 node."""

from __future__ import annotations

import json
import math
import runpy
import sys
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest
import tomllib

import access_av
from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

RATE_HZ = 3.84e6
EVERY_SSB = {"wake_up": {"policy": "fixed", "interval_ms": 1.0}}


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One second of samples: a vehicle with one clock, without monitor, receives every SSB."""
    out = tmp_path_factory.mktemp("live")
    scenario = access_av.Scenario.load("paper-real-odometry-2").with_overrides(
        {"vehicle.integrity.enabled": False, "vehicle.receiver.angle_time_offset_std_s": 0.0}
    )
    access_av.synthesize(scenario, out, duration_s=1.0, continuous=True)
    return out


def nominal(directory: Path) -> tuple[access_av.Site, access_av.Vehicle]:
    vehicle = access_av.Vehicle.load(str(directory / "vehicle.toml"))
    return (
        access_av.Site.load(str(directory / "site.toml")),
        vehicle.with_overrides(EVERY_SSB),
    )


def antennas(directory: Path) -> np.ndarray:
    raw = np.fromfile(directory / "iq.sigmf-data", dtype="<i2").astype(np.float32) / 32768
    return np.ascontiguousarray(raw.view(np.complex64).reshape(-1, 4).T)


def test_live_samples_give_the_poses_of_locate(drive: Path) -> None:
    site, vehicle = nominal(drive)
    recording, odometry_file = drive / "iq.sigmf-meta", drive / "odometry.csv"
    located = access_av.locate(site, odometry_file, recording, vehicle=vehicle)
    samples, odometry = antennas(drive), pl.read_csv(odometry_file)
    live = access_av.Live(site, vehicle, rate_hz=RATE_HZ, centre_hz=3.5e9)
    block, poses, angles = 19_200, [], []
    rows = odometry.iter_rows(named=True)
    row = next(rows, None)
    for first in range(0, samples.shape[1], block):
        while row is not None and row["time_s"] <= (first + block) / RATE_HZ:
            yaw_rate_radps = row.get("yaw_rate_radps")
            live.odometry(
                row["time_s"],
                row["speed_mps"],
                distance_m=row["distance_m"],
                yaw_rate_radps=yaw_rate_radps,
            )
            poses.append(live.status(row["time_s"]).pose)
            row = next(rows, None)
        live.samples(first / RATE_HZ, samples[:, first : first + block])
        angles += live.outcomes()
    live.flush()
    angles += live.outcomes()
    assert [it.phase_rad for it in angles] == located.angles["phase_rad"].to_list()
    assert [it.accepted for it in angles] == located.angles["accepted"].to_list()
    assert len(poses) > 40
    assert poses == list(located.poses.select("x_m", "y_m", "heading_rad").iter_rows())
    assert sum(head.accepted + head.refused for head in live.heads()) == len(angles)
    assert live.energy().aoa_estimates == len(angles)


def test_unreported_gaps_do_not_reduce_the_accuracy(drive: Path) -> None:
    site, vehicle = nominal(drive)
    samples, odometry = antennas(drive), pl.read_csv(drive / "odometry.csv")
    lost = round(7e-3 * RATE_HZ)
    at = round(0.45 * RATE_HZ)
    angles, poses = [], []
    for given in (samples, np.concatenate([samples[:, :at], samples[:, at + lost :]], axis=1)):
        live = access_av.Live(site, vehicle, rate_hz=RATE_HZ, centre_hz=3.5e9)
        block = 19_200
        rows = list(odometry.iter_rows(named=True))
        for first in range(0, given.shape[1], block):
            while rows and rows[0]["time_s"] <= (first + block) / RATE_HZ:
                row = rows.pop(0)
                live.odometry(row["time_s"], row["speed_mps"], distance_m=row["distance_m"])
            live.samples(first / RATE_HZ, given[:, first : first + block])
        live.flush()
        angles.append({(it.pci, round(it.time_s, 3)): it for it in live.outcomes()})
        poses.append(live.status(float(odometry["time_s"][-1])).pose)
    whole, cut = angles
    # A search notices it, at most 0.1 s and two periods later.
    late = {key for key in whole if key[1] > 0.6}
    assert len(late) >= 30
    assert late <= set(cut)
    for key in late:
        assert cut[key].accepted
        assert abs(cut[key].time_s - whole[key].time_s) < 1e-6
    assert math.dist(poses[0][:2], poses[1][:2]) < 0.02


def test_invalid_input_is_rejected_without_a_change(drive: Path) -> None:
    site, vehicle = nominal(drive)
    with pytest.raises(ValueError, match="both"):
        access_av.Live(site, vehicle, rate_hz=RATE_HZ)
    with pytest.raises(ValueError, match="0 Hz"):
        access_av.Live(site, vehicle, rate_hz=0.0, centre_hz=3.5e9)
    live = access_av.Live(site, vehicle)
    live.odometry(1.0, 1.5)
    before = live.status(1.0).pose
    for refused in (
        lambda: live.odometry(1.0, 1.5),
        lambda: live.odometry(math.nan, 1.5),
        lambda: live.odometry(1.1, math.inf),
        lambda: live.odometry(1.1, 1.0, distance_m=math.nan),
        lambda: live.angle(1, 1.1, 0.1, -0.1),
        lambda: live.angle(1, math.nan, 0.1, 0.1),
        lambda: live.samples(1.0, np.zeros((4, 8), np.complex64)),
        lambda: live.exclude(999),
        lambda: live.set_pose(1.0, (math.nan, 0.0, 0.0)),
        lambda: live.set_pose(5.0, (0.0, 0.0, 0.0)),
        lambda: live.status(math.nan),
    ):
        with pytest.raises(ValueError, match=r"."):
            refused()
    assert live.status(1.0).pose == before


def test_time_stamps_are_validated_against_arrivals_and_predecessors(drive: Path) -> None:
    site, vehicle = nominal(drive)
    live = access_av.Live(site, vehicle)

    def drives(time_s: float, arrival_s: float) -> None:
        live.odometry(time_s, 1.5, distance_m=1.5 * arrival_s, arrival_s=arrival_s)

    for step in range(50):
        drives(0.02 * step, 0.02 * step)
    before = live.status(0.98).pose
    for time_s, said in (
        (3.02, "after its expected time"),
        (1e300, "at most 1e11"),
        (1.7e12, "milliseconds"),
        (math.nan, "finite"),
        (0.98, "of which it is a copy"),
        (0.5, "before the last accepted message"),
    ):
        with pytest.raises(ValueError, match=said):
            drives(time_s, 0.98)
        assert live.status(0.98).pose == before
    with pytest.raises(ValueError, match="arrival_s"):
        live.odometry(1.0, 1.5, arrival_s=math.nan)
    assert live.clock_step() is None
    # The clock is 5 s behind from now on.
    rejected = 0
    for step in range(50, 100):
        try:
            drives(0.02 * step - 5.0, 0.02 * step)
        except ValueError:
            rejected += 1
    step_s = live.clock_step()
    assert step_s == pytest.approx(-5.0, abs=1e-6)
    assert 4 <= rejected <= 15
    status = live.status(1.98 - 5.0)
    assert status.pose is not None
    assert before is not None
    assert math.dist(status.pose[:2], before[:2]) == pytest.approx(1.5, abs=0.1)


class Anything(SimpleNamespace):
    """A message that creates its fields at first access."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        made = [0.0] * 36 if name == "covariance" else Anything()
        setattr(self, name, made)
        return made


def ros(monkeypatch: pytest.MonkeyPatch, now_s: list[float]) -> SimpleNamespace:
    """A substitute for `rclpy` whose callbacks can be called."""
    seen = SimpleNamespace(callbacks={}, published={}, warned=[], timer=None)

    def publisher(_kind: object, topic: str, _depth: int) -> SimpleNamespace:
        return SimpleNamespace(publish=seen.published.setdefault(topic, []).append)

    def stamp() -> Anything:
        return Anything(sec=int(now_s[0]), nanosec=int(1e9 * (now_s[0] % 1.0)))

    node = SimpleNamespace(
        create_publisher=publisher,
        create_subscription=lambda _kind, topic, call, _depth: seen.callbacks.update({topic: call}),
        create_timer=lambda _period_s, call: setattr(seen, "timer", call),
        get_clock=lambda: SimpleNamespace(now=lambda: SimpleNamespace(to_msg=stamp)),
        get_logger=lambda: SimpleNamespace(warning=seen.warned.append),
    )
    for name, kinds in {
        "rclpy": (),
        "diagnostic_msgs": (),
        "diagnostic_msgs.msg": ("DiagnosticStatus",),
        "geometry_msgs": (),
        "geometry_msgs.msg": ("PoseWithCovarianceStamped",),
        "nav_msgs": (),
        "nav_msgs.msg": ("Odometry",),
        "std_msgs": (),
        "std_msgs.msg": ("String",),
    }.items():
        module = ModuleType(name)
        for kind in kinds:
            setattr(module, kind, Anything)
        monkeypatch.setitem(sys.modules, name, module)
    rclpy: Any = sys.modules["rclpy"]
    rclpy.init, rclpy.create_node, rclpy.spin = lambda: None, lambda _name: node, lambda _node: None
    return seen


def phases(site_name: str, vehicle_name: str, x_m: float) -> list[tuple[int, int, float]]:
    """PCI, SSB index and electrical angle of two radio heads, seen from the x axis, along it."""
    site = tomllib.loads(access_av.Site.load(site_name).to_toml())
    vehicle = tomllib.loads(access_av.Vehicle.load(vehicle_name).to_toml())
    forward_m, left_m, up_m = vehicle["array"].get("position_m", [0.0, 0.0, 0.0])
    found = []
    for head in site["radio_heads"]:
        dx, dy = head["position_m"][0] - x_m - forward_m, head["position_m"][1] - left_m
        range_m = math.hypot(dx, dy, head["position_m"][2] - up_m)
        found.append((range_m, head["pci"], head.get("ssb_index", 0), math.pi * dx / range_m))
    return [(pci, index, phase_rad) for _, pci, index, phase_rad in sorted(found)[:2]]


def test_the_ros_node_follows_its_topics(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [1.0]
    seen = ros(monkeypatch, now_s)
    runpy.run_path(str(ROOT / "examples/rclpy_node.py"))["main"](["yard", "tugger"])
    seen.timer()
    assert "no odometry has arrived" in seen.published["access_av/status"][-1].message
    assert not seen.published["access_av/pose"]

    def header() -> Anything:
        return Anything(stamp=Anything(sec=int(now_s[0]), nanosec=int(1e9 * (now_s[0] % 1.0))))

    def drives() -> None:
        message = Anything(header=header())
        message.twist.twist.linear.x, message.twist.twist.angular.z = 1.5, 0.0
        seen.callbacks["odom"](message)

    drives()
    given = Anything(header=header())
    given.pose.pose.position.x, given.pose.pose.position.y = -50.0, 0.0
    given.pose.pose.orientation.z, given.pose.pose.orientation.w = 0.0, 1.0
    for axis in (0, 1, 5):
        given.pose.covariance[7 * axis] = 0.01
    seen.callbacks["initialpose"](given)
    for _ in range(10):
        now_s[0] += 0.1
        drives()
    angle = {"pci": 999, "time_s": now_s[0], "phase_rad": 0.1, "sigma_rad": 0.02}
    seen.callbacks["angles"](SimpleNamespace(data=json.dumps(angle)))
    assert not seen.warned
    # A given pose is published once angles have confirmed it.
    seen.timer()
    assert not seen.published["access_av/pose"]
    assert "have not confirmed" in seen.published["access_av/status"][-1].message
    for pci, ssb_index, phase_rad in phases("yard", "tugger", -48.5):
        for _ in range(3):
            now_s[0] += 0.01
            drives()
            angle = {"pci": pci, "ssb_index": ssb_index, "time_s": now_s[0]}
            angle |= {"phase_rad": phase_rad, "sigma_rad": 0.2}
            seen.callbacks["angles"](SimpleNamespace(data=json.dumps(angle)))
    drives_on = now_s[0] - 2.0
    now_s[0] += 0.02
    drives()
    seen.timer()
    pose = seen.published["access_av/pose"][-1]
    assert pose.header.frame_id == "map"
    assert pose.pose.pose.position.x == pytest.approx(-48.5 + 1.5 * drives_on, abs=0.4)
    assert 0.005 < pose.pose.covariance[0] < 0.1
    # Rejected input is reported, and the node continues.
    seen.callbacks["angles"](SimpleNamespace(data="{"))
    seen.callbacks["angles"](SimpleNamespace(data='{"pci": -1}'))
    drives()
    assert len(seen.warned) == 3


def test_ranges_correct_a_wrong_odometer() -> None:
    heads = {1: (-20.0, 12.0, 5.0), 2: (20.0, -10.0, 5.0), 3: (60.0, 14.0, 5.0)}
    text = "".join(
        f"[[radio_heads]]\npci = {pci}\nposition_m = {list(place)}\n"
        for pci, place in heads.items()
    )
    site = access_av.Site.from_toml(f'name = "hall"\n{text}')
    vehicle = access_av.Vehicle.from_toml(
        'name = "cart"\ndrive = "differential"\n[start]\npose = [0.0, 0.0, 0.0]\n'
        "[ranging]\nsigma_m = 0.1\nscale_std = 0.0\noffset_std_m = 0.1\n"
    )
    live = access_av.Live(site, vehicle)
    live.odometry(0.0, 1.545, distance_m=0.0, yaw_rate_radps=0.0)
    for step in range(1, 200):
        time_s = 0.1 * step
        # The odometer measures 3 % too much: 0.9 m after 20 s.
        live.odometry(time_s, 1.545, distance_m=1.545 * time_s, yaw_rate_radps=0.0)
        pci = 1 + step % 3
        x_m, y_m, z_m = heads[pci]
        range_m = math.hypot(1.5 * time_s - x_m, y_m, z_m)
        assert live.range(pci, time_s, range_m=range_m) == "consistent"
    pose = live.status(19.9).pose
    assert pose is not None
    assert math.hypot(pose[0] - 1.5 * 19.9, pose[1]) < 0.3
    with pytest.raises(ValueError, match="one-way"):
        live.range(1, 20.0, delay_ns=100.0)
    with pytest.raises(ValueError, match="either"):
        live.range(1, 20.0)
