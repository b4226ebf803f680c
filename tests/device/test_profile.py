"""`access-av design profile`: simulated sysfs trees with a known energy, and faulty sensors."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import stat
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av.device import counters, power_modes
from access_av.device import profile as device
from access_av.device.counters import SensorError
from access_av.device.energy import (
    Interval,
    Recording,
    TooShortError,
    Window,
    above_idle,
    energy_sampled,
)
from access_av.device.platform import Platform
from access_av.device.workload import Timing, repeat

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from conftest import Finished

RAILS = {"VDD_GPU_SOC": 3.0, "VDD_CPU_CV": 2.0, "VIN_SYS_5V0": 4.0}


def write(file: Path, text: object) -> None:
    """Writes a value atomically, as the kernel provides it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_name(f".{file.name}")
    partial.write_text(f"{text}\n")
    partial.replace(file)


def hwmon(sysfs: Path, number: int, name: str, channels: dict[int, tuple[str, float]]) -> Path:
    """An INA3221 or INA238 by hwmon; power in W per channel at 5 V, in the converter's steps."""
    chip = sysfs / f"bus/i2c/devices/1-004{number}/hwmon/hwmon{number}"
    write(chip / "name", name)
    for channel, (label, power_w) in channels.items():
        write(chip / f"in{channel}_label", label)
        write(chip / f"shunt{channel}_resistor", 5000)
        set_power(chip, channel, power_w)
    return chip


def set_power(chip: Path, channel: int, power_w: float) -> None:
    (chip / f"in{channel}_input").write_text("5000")
    (chip / f"curr{channel}_input").write_text(f"{round(power_w / 5.0 / 8e-3) * 8}")


def iio(sysfs: Path, rails: dict[str, float]) -> Path:
    chip = sysfs / "bus/i2c/devices/1-0040/iio:device0"
    for number, (label, power_w) in enumerate(rails.items()):
        write(chip / f"rail_name_{number}", label)
        write(chip / f"in_power{number}_input", round(power_w * 1e3))
    return chip


def rapl(sysfs: Path, zones: dict[str, str], range_uj: int = 262_143_328_850) -> Path:
    powercap = sysfs / "class/powercap"
    for zone, name in zones.items():
        write(powercap / zone / "name", name)
        write(powercap / zone / "max_energy_range_uj", range_uj)
        write(powercap / zone / "energy_uj", 1000)
    return powercap


def labels(sysfs: Path) -> list[str]:
    found = counters.find(sysfs)
    assert found is not None
    return [each.label for each in (*found.rails, *found.zones)]


# Sensors.


def test_jetpack_5_adds_rails_and_omits_missing_ones(tmp_path: Path) -> None:
    chip = hwmon(tmp_path, 0, "ina3221", dict(enumerate(RAILS.items(), start=1)))
    hwmon(tmp_path, 1, "ina3221", {1: ("NC", 9.0), 2: ("VDDQ_VDD2_1V8AO", 1.0)})
    write(chip / "in7_label", "sum of shunt voltages")
    write(chip / "in7_input", 99)
    assert labels(tmp_path) == [*RAILS, "VDDQ_VDD2_1V8AO"]


@pytest.mark.parametrize("total", ["VDD_IN", "POM_5V_IN"])
def test_total_contains_the_rails(tmp_path: Path, total: str) -> None:
    hwmon(tmp_path, 0, "ina3221", {1: (total, 9.0), 2: ("VDD_CPU_CV", 2.0)})
    assert labels(tmp_path) == [total]


def test_jetpack_4_reads_iio(tmp_path: Path) -> None:
    iio(tmp_path, {"GPU": 3.0, "CPU": 2.0, "NC": 5.0})
    found = counters.find(tmp_path)
    assert found is not None
    assert sum(rail.read_w()[0] for rail in found.rails) == pytest.approx(5.0)


def test_a_sensor_with_two_names_is_read_once(tmp_path: Path) -> None:
    device = iio(tmp_path, {"VDD_IN": 3.0})
    for other in ("bus/iio/devices", "bus/i2c/drivers/ina3221x/1-0040"):
        (tmp_path / other).mkdir(parents=True)
        (tmp_path / other / "iio:device0").symlink_to(device)
    chip = hwmon(tmp_path / "five", 0, "ina3221", {1: ("VDD_CPU", 2.0)})
    (tmp_path / "five/class/hwmon").mkdir(parents=True)
    (tmp_path / "five/class/hwmon/hwmon0").symlink_to(chip)
    assert labels(tmp_path) == ["VDD_IN"]
    assert labels(tmp_path / "five") == ["VDD_CPU"]


def test_thor_reads_the_ina238(tmp_path: Path) -> None:
    hwmon(tmp_path, 0, "ina3221", {1: ("VDD_GPU", 9.0), 2: ("VDD_CPU_SOC_MSS", 2.0)})
    thor = hwmon(tmp_path, 1, "ina238", {1: ("VIN", 30.0)})
    assert labels(tmp_path) == ["VIN"]
    (thor / "in1_label").unlink()
    assert labels(tmp_path) == ["VIN"]
    (thor / "in1_input").unlink()
    (thor / "power1_input").write_text("30000000")
    found = counters.find(tmp_path)
    assert found is not None
    assert found.rails[0].read_w()[0] == pytest.approx(30.0)


def test_psys_includes_packages_and_packages_include_their_parts(tmp_path: Path) -> None:
    zones = {
        "intel-rapl:0": "package-0",
        "intel-rapl:0:0": "core",
        "intel-rapl-mmio:0": "package-0",
    }
    rapl(tmp_path, zones)
    assert labels(tmp_path) == ["package-0"]
    rapl(tmp_path, {"intel-rapl:1": "psys"})
    assert labels(tmp_path) == ["psys"]


def test_without_a_sensor_none_is_returned(tmp_path: Path) -> None:
    assert counters.find(tmp_path) is None


# Intervals contain the true value.


class Bench:
    """Simulated sensors with a known power and a simulated clock."""

    def __init__(self, root: Path, feed: Callable[[float, float], None]) -> None:
        self.root, self.feed, self.now_s = root, feed, 0.0

    def window(self, seconds: float, power_w: Callable[[float], float]) -> tuple[Window, float]:
        """Returns the window of a power over time, and the true energy."""
        found = counters.find(self.root)
        assert found is not None
        recording = Recording(found, clock=lambda: self.now_s, start_s=self.now_s)
        pauses = np.random.default_rng(1).uniform(3e-3, 9e-3, round(seconds / 6e-3))
        put_in_j, start_s = 0.0, self.now_s
        for pause_s in pauses:
            self.feed(power_w(self.now_s - start_s), pause_s)
            recording.look()
            put_in_j += power_w(self.now_s - start_s) * pause_s
            self.now_s += pause_s
        recording.look()
        recording.end_s = self.now_s
        return recording.window(), put_in_j


def jetpack_4(root: Path) -> Bench:
    chip = iio(root, dict.fromkeys(["GPU", "CPU", "SYS5V", "NC"], 1.0))

    def feed(power_w: float, _: float) -> None:
        for number in range(3):
            (chip / f"in_power{number}_input").write_text(f"{power_w / 3.0 * 1e3:.0f}")

    return Bench(root, feed)


def jetpack_5(root: Path) -> Bench:
    first = hwmon(root, 0, "ina3221", dict(enumerate(RAILS.items(), start=1)))
    hwmon(root, 1, "ina3221", {1: ("NC", 9.0)})
    (first / "update_interval").write_text("6")

    def feed(power_w: float, _: float) -> None:
        for channel in (1, 2, 3):
            set_power(first, channel, power_w / 3.0)

    return Bench(root, feed)


def jetpack_6(root: Path) -> Bench:
    chip = hwmon(root, 0, "ina3221", {1: ("VDD_IN", 1.0), 2: ("VDD_CPU_GPU_CV", 3.0)})
    return Bench(root, lambda power_w, _: set_power(chip, 1, power_w))


def thor(root: Path) -> Bench:
    hwmon(root, 0, "ina3221", {1: ("VDD_GPU", 9.0)})
    chip = hwmon(root, 1, "ina238", {1: ("VIN", 30.0)})
    return Bench(root, lambda power_w, _: set_power(chip, 1, power_w))


class FedRapl:
    """Counters in steps of 61 µJ that wrap around at 100 J."""

    def __init__(self, root: Path) -> None:
        self.powercap = rapl(root, {"intel-rapl:0": "package-0"}, 100_000_000)
        rapl(root, {"intel-rapl:1": "psys"}, 100_000_000)
        self.joules = 99.0
        self.add(0.0, 0.0)

    def add(self, power_w: float, seconds: float) -> None:
        self.joules += power_w * seconds
        counted_uj = int(self.joules / 2**-14) * 2**-14 * 1e6 % 100_000_000
        with (self.powercap / "intel-rapl:1/energy_uj").open("r+") as file:
            file.write(f"{counted_uj:012.0f}\n")  # constant length: never empty


def wrapping_rapl(root: Path) -> Bench:
    return Bench(root, FedRapl(root).add)


BENCHES = [jetpack_4, jetpack_5, jetpack_6, thor, wrapping_rapl]
POWERS = {
    "constant": lambda _: 15.0,
    "drifting": lambda t: 12.0 + 2.0 * t,
    "beating": lambda t: 15.0 + 3.0 * np.sin(2.0 * np.pi * 1.7 * t),
    "stepping": lambda t: 12.0 if t < 1.1 else 18.0,
}


@pytest.mark.parametrize("power", POWERS)
@pytest.mark.parametrize("bench", BENCHES)
def test_simulated_energy_is_in_the_interval(
    tmp_path: Path, bench: Callable[[Path], Bench], power: str
) -> None:
    window, put_in_j = bench(tmp_path).window(1.6, POWERS[power])
    assert window.energy_j.low <= put_in_j <= window.energy_j.high
    assert window.energy_j.half_width <= 0.02 * put_in_j


@pytest.mark.parametrize("bench", BENCHES)
def test_energy_above_idle_is_in_the_interval(
    tmp_path: Path, bench: Callable[[Path], Bench]
) -> None:
    rig = bench(tmp_path)
    idle, _ = rig.window(1.2, lambda _: 8.0)
    busy, _ = rig.window(1.2, lambda _: 28.0)
    energy_j = above_idle(busy, idle)
    assert energy_j.low <= 20.0 * busy.duration_s <= energy_j.high
    assert energy_j.half_width <= 0.02 * energy_j.value


def test_the_energy_interval_covers_noise_between_samples() -> None:
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(200):
        power_w = rng.uniform(5.0, 15.0, 20_000)
        times_s = (np.arange(20_000) + 0.5) * 1e-4
        at = np.sort(rng.choice(20_000, 1000, replace=False))
        window = energy_sampled(times_s[at], power_w[at], np.full(1000, 1e-3), None, (0.0, 2.0))
        held += window.energy_j.low <= float(np.sum(power_w)) * 1e-4 <= window.energy_j.high
    assert held >= 198  # 99.9 % each


# Faulty sensors.


def test_too_short_a_window_is_refused(tmp_path: Path) -> None:
    rig = jetpack_5(tmp_path)
    chip = next(tmp_path.glob("bus/i2c/devices/*/hwmon/hwmon0"))
    (chip / "update_interval").write_text("100")
    with pytest.raises(TooShortError, match=r"too short.*10 s are needed"):
        rig.window(2.0, lambda _: 15.0)


def test_a_sensor_that_stops_is_refused(tmp_path: Path) -> None:
    rig = jetpack_6(tmp_path)
    with pytest.raises(SensorError, match=r"stopped 1\.0. s into the window"):
        rig.window(3.0, lambda t: 15.0 + np.sin(40.0 * min(t, 1.05)))
    rig = wrapping_rapl(tmp_path / "rapl")
    with pytest.raises(SensorError, match="stopped"):
        rig.window(2.0, lambda t: 15.0 if t < 1.0 else 0.0)
    with pytest.raises(SensorError, match="the counter stopped"):
        rig.window(2.0, lambda _: 0.0)


@pytest.mark.parametrize("wild_w", [900.0, 0.1, -15.0])
def test_a_sensor_that_jumps_is_refused(tmp_path: Path, wild_w: float) -> None:
    rig = jetpack_6(tmp_path)
    with pytest.raises(SensorError, match=r"jumped from 15"):
        rig.window(2.0, lambda t: wild_w if 1.0 < t < 1.02 else 15.0)


def test_a_counter_that_jumps_is_refused(tmp_path: Path) -> None:
    rig = wrapping_rapl(tmp_path)
    with pytest.raises(SensorError, match="jumped"):
        rig.window(2.0, lambda t: 15.0 if abs(t - 1.0) > 2e-3 else 20_000.0)


def test_a_sensor_without_response_to_the_load_has_stopped() -> None:
    still = Window(0.0, 2.0, Interval(10.0, 0.1), is_constant=True)
    with pytest.raises(SensorError, match="equal in the idle and in the busy phase"):
        above_idle(still, still)


def test_a_missing_sensor_is_reported(tmp_path: Path) -> None:
    rig = jetpack_6(tmp_path)
    found = counters.find(tmp_path)
    assert found is not None
    next(tmp_path.glob("bus/i2c/devices/*/hwmon/hwmon0/curr1_input")).unlink()
    with Recording(found) as recording:
        pass
    with pytest.raises(SensorError, match=r"curr1_input: the sensor stopped answering"):
        recording.window()
    assert rig.root == tmp_path


# On a device.

NVPMODEL = """
< POWER_MODEL ID=0 NAME=MAXN >
CPU_ONLINE CORE_0 1
CPU_ONLINE CORE_1 1
CPU_A78_0 MAX_FREQ -1
EMC MAX_FREQ 0
< POWER_MODEL ID=1 NAME=MODE_10W >
CPU_ONLINE CORE_0 1
CPU_ONLINE CORE_1 0
CPU_A78_0 MAX_FREQ 1200000
EMC MAX_FREQ 1065600000
< POWER_MODEL ID=3 NAME=NEEDS_REBOOT >
CPU_ONLINE CORE_0 1
CPU_A78_0 MAX_FREQ 900000
"""
FAKE_NVPMODEL = """#!/bin/sh
case "$1" in
-q) echo "NV Power Mode: X"; cat "$STATE" ;;
-m) [ "$2" = 3 ] || echo "$2" > "$STATE" ;;
esac
"""


@pytest.fixture
def jetson(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A simulated Jetson with three power modes, in mode 1, whose counter follows the load."""
    root = tmp_path / "jetson"
    write(root / "etc/nvpmodel.conf", NVPMODEL)
    write(root / "sys/devices/system/cpu/cpufreq/policy0/cpuinfo_max_freq", 2201600)
    write(root / "proc/device-tree/model", "A Jetson\0")
    fake = tmp_path / "bin/nvpmodel"
    write(fake, FAKE_NVPMODEL)
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    write(tmp_path / "state", 1)
    monkeypatch.setenv("PATH", f"{fake.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("STATE", str(tmp_path / "state"))
    return root


@contextlib.contextmanager
def powered(meter: FedRapl) -> Iterator[Callable[[float, float], None]]:
    """Feeds the meter all the time; yields a function that draws a power for a duration."""
    power_w = [5.0]
    ended = threading.Event()

    def feed() -> None:
        before_s = time.perf_counter()
        while not ended.wait(2e-4):
            now_s = time.perf_counter()
            meter.add(power_w[0], now_s - before_s)
            before_s = now_s

    def draw(watts: float, seconds: float) -> None:
        power_w[0] = watts
        time.sleep(seconds)

    feeder = threading.Thread(target=feed)
    feeder.start()
    try:
        yield draw
    finally:
        ended.set()
        feeder.join()


def test_profile_of_a_board_with_modes(jetson: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with powered(FedRapl(jetson / "sys")) as draw:
        monkeypatch.setattr(device, "sleep", lambda seconds: draw(5.0, seconds))
        works = {"music": lambda: draw(15.0, 2e-3), "ssb-chain": lambda: draw(25.0, 4e-3)}
        monkeypatch.setattr(device, "workloads", lambda: works)
        found = device.profile(jetson, window_s=1.2)
    assert found.machine == "A Jetson"
    assert found.sensors == "psys (RAPL)"
    assert found.warnings == ("mode 3 (NEEDS_REBOOT) needs a reboot: it is not measured",)
    assert Path(os.environ["STATE"]).read_text().strip() == "1"
    assert [(each.mode.number, each.workload) for each in found.measured] == [
        (mode, work) for mode in (0, 1) for work in works
    ]
    for each in found.measured:
        assert each.energy_j is not None, each.why_not
        above_w = 10.0 if each.workload == "music" else 20.0
        true_j = above_w * each.busy.duration_s / each.timing.executions
        assert each.energy_j.value == pytest.approx(true_j, rel=0.1)
    platform = Platform(found.platform("jetson"))
    assert [mode.cpu_hz for mode in platform.modes] == [2201.6e6, 1200e6]
    energy = platform.modes[1].energy_per_execution_j["music"]
    assert (energy.provenance, energy.boundary) == ("measured", "marginal")
    assert "A Jetson" in energy.source
    assert energy.low < energy.value < energy.high
    chain, music = found.measured[3].timing, found.measured[2].timing
    assert platform.modes[1].base_wake_up_ms["music"] == pytest.approx(
        1e3 * (chain.p99_s + music.p99_s)
    )


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_mode_is_restored_after_an_interruption(jetson: Path, ending: signal.Signals) -> None:
    board = power_modes.find(jetson, jetson / "sys")

    def work() -> None:
        with board.restored():
            board.switch(board.modes[0])
            assert Path(os.environ["STATE"]).read_text().strip() == "0"
            os.kill(os.getpid(), ending)
            time.sleep(1.0)

    with pytest.raises(KeyboardInterrupt):
        work()
    assert Path(os.environ["STATE"]).read_text().strip() == "1"


def test_cpufreq_clocks_are_restored(tmp_path: Path) -> None:
    policy = tmp_path / "sys/devices/system/cpu/cpufreq/policy0"
    write(policy / "scaling_available_frequencies", "600000 1500000 2400000")
    write(policy / "scaling_max_freq", 1500000)
    board = power_modes.find(tmp_path, tmp_path / "sys")
    assert [mode.cpu_mhz for mode in board.modes] == [2400.0, 1500.0, 600.0]
    with board.restored():
        board.switch(board.modes[2])
        assert (policy / "scaling_max_freq").read_text() == "600000"
    assert (policy / "scaling_max_freq").read_text().strip() == "1500000"


def test_windows_of_a_sensor_without_response_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hwmon(tmp_path / "sys", 0, "ina3221", {1: ("VDD_IN", 15.0)})
    monkeypatch.setattr(device, "workloads", lambda: {"ssb-chain": lambda: time.sleep(1e-3)})
    found = device.profile(tmp_path, window_s=1.0)
    (each,) = found.measured
    assert each.energy_j is None
    assert "equal in the idle and in the busy phase" in str(each.why_not)
    for window in (each.idle, each.busy):
        assert window is not None
        assert window.energy_j.low <= 15.0 * window.duration_s <= window.energy_j.high
    assert found.warnings == (f"mode 0, ssb-chain: energy not measured: {each.why_not}",)


def test_command_on_a_machine_without_sensor(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av(
        "design", "profile", "--sysfs-root", str(tmp_path), "--window-s", "0.05", "--json",
        "--out", str(tmp_path / "board.toml"),
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "energy not measured: no power sensor" in done.err
    report = json.loads(done.out)
    assert {each["energy_j"] for each in report["measured"]} == {None}
    assert all(each["p99_s"] >= each["median_s"] > 0.0 for each in report["measured"])
    board = Platform.load(str(tmp_path / "board.toml"))
    assert set(board.modes[0].base_wake_up_ms) == {
        "music", "esprit", "root_music", "maximum_likelihood",
    }  # fmt: skip
    assert board.modes[0].energy_per_execution_j == {}


def test_bad_input_ends_with_one_message(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av("design", "profile", "--sysfs-root", tmp_path / "none")
    assert (done.code, "no such directory" in done.err) == (2, True)
    done = access_av("design", "profile", "--sysfs-root", tmp_path, "--mode", "9")
    assert (done.code, "this computer has 0" in done.err) == (2, True)


def test_repeated_work_is_timed() -> None:
    timing = repeat(lambda: time.sleep(1e-3), 0.01)
    assert isinstance(timing, Timing)
    assert timing.executions >= 100
    assert 1e-3 <= timing.median_s <= timing.p99_s
    assert timing.cpu_median_s < timing.median_s
