"""Doubtful settings are rejected or cause a warning that names the correction."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import polars as pl
import pytest

import short_plant
from access_av import ImplausibleSettingsWarning, SettingsError, SettingsWarning, simulate
from access_av._core import Platform, Scenario, Site, Vehicle
from access_av.errors import InputError
from access_av.tables import validation
from access_av.tables.toml import tomllib
from conftest import ROOT, Finished

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# A plant: 600 m of road with a bend, three heads on masts, and a tugger that knows its start.
PLANT = """
name = "plant"
road = { segments = [
    { length_m = 250.0 }, { length_m = 26.0, turn_rad = 1.0472 }, { length_m = 324.0 },
] }
[[radio_heads]]
name = "gate"
position_m = [30.0, 25.0, 8.0]
pci = 11
[[radio_heads]]
name = "hall"
position_m = [260.0, -30.0, 8.0]
pci = 12
ssb_index = 1
[[radio_heads]]
name = "dock"
position_m = [370.0, 250.0, 8.0]
pci = 13
ssb_index = 2
"""
VEHICLE = """
extends = "tugger"
name = "cart"
array = { position_m = [0.5, 0.0, 1.8], mounting_std_rad = 0.01, phase_std_rad = 0.03 }
"""


def scenario(**overrides: object) -> Scenario:
    """The vehicle on the plant, with single keys set: `__` stands for a dot."""
    plain = Scenario.from_toml('name = "trip"\nsite = "yard"\nvehicle = "default"\n')
    held = {
        "site": json.loads(Site.from_toml(PLANT).to_json()),
        "vehicle": json.loads(Vehicle.from_toml(VEHICLE).to_json()),
    }
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    return plain.with_overrides(held).with_overrides(keys)


HEADS = [
    {"name": "gate", "pci": 11, "ssb_index": 0},
    {"name": "hall", "pci": 12, "ssb_index": 1},
    {"name": "dock", "pci": 13, "ssb_index": 2},
]


def heads(*positions_m: list[float]) -> dict[str, object]:
    """The plant's radio heads at other places."""
    at = zip(HEADS, positions_m, strict=True)
    return {"site.radio_heads": [{**head, "position_m": place} for head, place in at]}


STUCK = {"kind": "stuck-antenna", "antennas": [1]}
FAULT = {"from_s": 60_000.0, "until_s": 68_000.0, "what": STUCK}
PATH_AWAY = {"start": {"x_m": 3e4, "y_m": 4e4}, "segments": [{"length_m": 300.0}]}
SAME_INDEX = {"site.radio_heads[1].ssb_index": 0, "site.radio_heads[2].ssb_index": 0}

# Setting, key in the message, and correction in the message.
NONSENSE: dict[str, tuple[dict[str, object], str, str]] = {
    # Notations that users have written.
    "turn in degrees": (
        {"site.road.segments[1].turn_rad": 60.0}, "segments[1].turn_rad", "1.0472"),
    "heads in latitude and longitude": (
        heads([8.6821, 50.1109, 8.0], [8.6852, 50.1107, 8.0], [8.6866, 50.1131, 8.0]),
        "radio_heads[0].position_m", "specify metres"),
    "heads in UTM": (
        heads([477000.0, 5551000.0, 8.0], [477230.0, 5550950.0, 8.0], [477340.0, 5551225.0, 8.0]),
        "radio_heads[0].position_m", "subtract [477000, 5551000]"),
    "a head under the ground": (
        {"site.radio_heads[0].position_m": [30.0, 25.0, -8.0]}, "position_m[2]", "upwards: 8"),
    "three heads on one SSB index": (SAME_INDEX, "ssb_index", "unused are 1, 2, 3, 4, 5, 6, 7"),
    "an SSB index the band has not": (
        {"site.radio_heads[0].ssb_index": 9}, "radio_heads[0].ssb_index", "write 0 to 7"),
    "scale in percent": ({"vehicle.odometer.scale_std": 0.5}, "scale_std", "0.5 % are 0.005"),
    "speed in m/s": ({"vehicle.top_speed_kmh": 3.33}, "top_speed_kmh", "write km/h: 12"),
    "no such platform": ({"vehicle.platform.name": "jetson"}, "platform.name", "jetson-agx-xavier"),
    "no such mode": ({"vehicle.platform.mode": 99}, "platform.mode", "has the modes"),
    "spacing in metres": (
        {"vehicle.array.spacing_wavelengths": 0.043}, "spacing_wavelengths", "0.5"),
    "mounting in degrees": ({"vehicle.array.mounting_rad": 90.0}, "mounting_rad", "1.5708"),
    "carrier in GHz": ({"site.carrier_mhz": 3.7}, "carrier_mhz", "3700"),
    "a stop beyond the road": (
        {"motion.stops": [{"at_m": 900.0, "dwell_s": 5.0}]}, "stops[0].at_m", "600.0 m"),
    # Angles.
    "start heading in degrees": (
        {"vehicle.start.pose": {"heading_rad": 90.0}}, "pose.heading_rad", "1.5708"),
    "road heading in degrees": (
        {"site.road.start": {"heading_rad": 45.0}}, "start.heading_rad", "0.7854"),
    "a few degrees in a short bend": (
        {"site.road.segments[1].length_m": 1.0, "site.road.segments[1].turn_rad": 5.0,
         "site.road.segments[2].length_m": 5.0},
        "turn_rad", "0.0873"),
    "mounting deviation in degrees": (
        {"vehicle.array.mounting_std_rad": 1.0}, "mounting_std_rad", "0.0175"),
    "phase deviation in degrees": ({"vehicle.array.phase_std_rad": 2.0}, "phase_std_rad", "0.0349"),
    "start deviation in degrees": (
        {"vehicle.start.heading_std_rad": 5.0}, "heading_std_rad", "0.0873"),
    # Places.
    "one head in another frame": (
        {"site.radio_heads[1].position_m": [52600.0, -30.0, 8.0]},
        "radio_heads[1]", "one local frame"),
    "one head far away": (
        {"site.radio_heads[1].position_m": [-900.0, -30.0, 8.0]},
        "radio_heads[1]", "one local frame"),
    "road far from all heads": ({"motion.path": PATH_AWAY}, "radio_heads[0]", "one local frame"),
    "road in degrees": (
        {"site.road": {"polyline_m": [[8.68, 50.11], [8.685, 50.11], [8.686, 50.113]]}},
        "road", "specify metres"),
    "heights above the sea": (
        {"site.radio_heads[0].position_m": [30.0, 25.0, 412.0]},
        "position_m[2]", "above sea level"),
    "radio heads of a flat drawing": (
        heads([30.0, 25.0, 0.0], [170.0, -10.0, 0.0], [300.0, 40.0, 0.0]),
        "array.position_m[2]", "height of each radio head above the ground"),
    "dead reckoning with several heads": (
        {"vehicle.localizer": {"kind": "dead-reckoning"},
         "vehicle.wake_up": {"policy": "fixed", "interval_ms": 100.0}},
        "localizer.kind", 'kind = "tracker"'),
    "heights in millimetres": (
        {"site.radio_heads[0].position_m": [30.0, 25.0, 8000.0]}, "position_m[2]", "are 8"),
    "array under the ground": (
        {"vehicle.array.position_m": [0.5, 0.0, -1.8]}, "array.position_m[2]", "upwards: 1.8"),
    "array in centimetres": (
        {"vehicle.array.position_m": [50.0, 0.0, 1.8]}, "array.position_m[0]", "50 cm are 0.5"),
    "array in millimetres": (
        {"vehicle.array.position_m": [0.5, 0.0, 1800.0]}, "array.position_m[2]", "1800 mm are 1.8"),
    "two heads that are one": (
        {"site.radio_heads[1].position_m": [30.0, 25.01, 8.0]},
        "radio_heads[1]", "remove duplicates"),
    "two heads of one name": (
        {"site.radio_heads[1].name": "gate"}, "radio_heads[1].name", "gate-1"),
    "a start off the road": (
        {"vehicle.start.pose": {"x_m": 100.0, "y_m": 300.0}}, "start.pose", "frame of the road"),
    "a start where no SSB is received": (
        {"vehicle.drive": "differential", "vehicle.start.pose": {"x_m": 9e4, "y_m": 9e4}},
        "start.pose", "frame of the radio heads"),
    # Radio.
    "power in milliwatts": ({"site.radio_heads[0].eirp_dbm": 100.0}, "eirp_dbm", "100 mW are 20.0"),
    "hardly any power": ({"site.radio_heads[0].eirp_dbm": -90.0}, "radio_heads[0]", "dBm"),
    "noise figure": ({"vehicle.receiver.noise_figure_db": 35.0}, "noise_figure_db", "35 K is 0.5"),
    "gain with the amplifier's": ({"vehicle.array.rx_gain_dbi": 45.0}, "rx_gain_dbi", "amplifier"),
    "spacing of FR1 at 28 GHz": ({"site.carrier_mhz": 28000.0}, "subcarrier_spacing_khz", "120"),
    "spacing of FR2 at 3.5 GHz": (
        {"site.ssb.subcarrier_spacing_khz": 120.0}, "subcarrier_spacing_khz", "15 or 30"),
    "no band there": ({"site.carrier_mhz": 10000.0}, "carrier_mhz", "24250"),
    "index 5 at 2 GHz": (
        {"site.carrier_mhz": 2100.0, "site.radio_heads[0].ssb_index": 5}, "ssb_index", "0 to 3"),
    "index 64 at 28 GHz": (
        {
            "site.carrier_mhz": 28000.0,
            "site.ssb.subcarrier_spacing_khz": 120.0,
            "site.radio_heads[0].ssb_index": 64,
        },
        "ssb_index", "63"),
    "half a wavelength in metres at 700 MHz": (
        {"site.carrier_mhz": 700.0, "vehicle.array.spacing_wavelengths": 0.214,
         **{f"site.radio_heads[{n}].ssb_index": n for n in range(3)}},
        "spacing_wavelengths", "are 0.50"),
    "shadowing in percent": ({"channel.shadowing_std_db": 30.0}, "shadowing_std_db", "3 to 8"),
    # Motion, odometer and gyroscope.
    "stop in milliseconds": (
        {"motion.stops": [{"at_m": 100.0, "dwell_s": 8000.0}]}, "dwell_s", "8000 ms are 8"),
    "speed in m/min": ({"vehicle.top_speed_kmh": 180.0}, "top_speed_kmh", "10.8"),
    "motion in m/s": ({"motion.top_speed_kmh": 2.78}, "motion.top_speed_kmh", "write km/h: 10"),
    "faster than the vehicle": (
        {"motion.top_speed_kmh": 40.0}, "motion.top_speed_kmh", "vehicle.top_speed_kmh = 40"),
    "a bend no tyre holds": (
        {"vehicle.top_speed_kmh": 70.0}, "vehicle.top_speed_kmh", "or a larger radius"),
    "odometer noise in percent": (
        {"vehicle.odometer.noise_m_per_sqrt_m": 2.0}, "noise_m_per_sqrt_m", "0.02"),
    "odometer in another unit": ({"vehicle.odometer.scale": 0.621}, "odometer.scale", "about 1"),
    "gyroscope in degrees": (
        {"vehicle.gyroscope": {"bias_std_radps": 0.5}}, "bias_std_radps", "rad/s"),
    "gyroscope per root hour": (
        {"vehicle.gyroscope": {"noise_rad_per_sqrt_s": 0.3}}, "noise_rad_per_sqrt_s", "8.7e-5"),
    "survey in millimetres": (
        {"site.radio_heads[0].position_std_m": 50.0}, "position_std_m", "50 mm are 0.05"),
    "start in millimetres": ({"vehicle.start.position_std_m": 500.0}, "position_std_m", "are 0.5"),
    "lane in centimetres": ({"vehicle.lane_keeping.rms_m": 10.0}, "rms_m", "0.01"),
    "a lane wider than the road": ({"vehicle.lane_keeping.rms_m": 2.9}, "rms_m", "0.029"),
    "interval in seconds": (
        {"vehicle.wake_up": {"policy": "fixed", "interval_ms": 0.5}}, "interval_ms", "500"),
    "confidence in percent": ({"vehicle.wake_up.confidence": 90.0}, "confidence", "90 % are 0.9"),
    "latency in microseconds": ({"ssb_latency_ms": 6500.0}, "ssb_latency_ms", "6.5"),
    "a fault in milliseconds": ({"faults": [FAULT]}, "faults[0].from_s", "60"),
    "truth in degrees": (
        {"truth.vehicle": {"array": {"mounting_rad": 1.0}}},
        "truth.vehicle.array.mounting_rad", "0.0175"),
    "truth as a difference": (
        {"truth.site": {"radio_heads": {"dock": {"position_m": [2.0, 5.0, 8.0]}}}},
        "truth.site.radio_heads[2].position_m", "position in metres"),
    "truth in percent": (
        {"truth.vehicle": {"odometer": {"noise_m_per_sqrt_m": 3.0}}},
        "truth.vehicle.odometer.noise_m_per_sqrt_m", "3 % are 0.03"),
    "road survey in millimetres": ({"site.road.position_std_m": 50.0}, "position_std_m", "0.05"),
}  # fmt: skip


def said(overrides: dict[str, object]) -> list[str]:
    """Returns the messages: rejections and warnings."""
    try:
        return [str(warning) for warning in scenario(**overrides).warnings()]
    except SettingsError as error:
        return [str(error)]


@pytest.mark.parametrize("what", NONSENSE)
def test_invalid_values_are_rejected_with_a_valid_example(what: str) -> None:
    overrides, key, write = NONSENSE[what]
    warnings = said(overrides)
    assert any(key in one.split(" is ")[0] and write in one for one in warnings), warnings


def test_the_unchanged_test_scenario_causes_no_warning() -> None:
    assert scenario().warnings() == []


# Contents of a file, and its message.
FILES = {
    "position_m = [3,5, 2,0, 8,0]": "write 3.5, not 3,5",
    'eirp_dbm = "3,5"': "write 3.5, not 3,5",
    'eirp_dbm = "3.5"': "write 3.5 without quotes",
    "eirp_dbm = 3,5": "write 3.5, not 3,5",
}


@pytest.mark.parametrize("line", FILES)
def test_decimal_commas_in_toml_are_rejected_with_a_correction(line: str) -> None:
    place = "" if "position_m" in line else "position_m = [0.0, 20.0, 8.0]\n"
    with pytest.raises(SettingsError, match=re.escape(FILES[line])):
        Site.from_toml(f'name = "mine"\n[[radio_heads]]\n{place}{line}\n')


# Plants that differ from the shipped ones: site, vehicle, motion.
MASTS = "\n".join(
    f"[[radio_heads]]\nposition_m = [{30.0 + 230.0 * (n % 5)}, {60.0 + 480.0 * (n // 5)}, 40.0]\n"
    f"pci = {n}\nssb_index = {n % 8}\neirp_dbm = 33.0"
    for n in range(10)
)
UNLIKE = {
    "28 GHz": (
        """
        carrier_mhz = 28000.0
        ssb = { subcarrier_spacing_khz = 120.0 }
        road = { polyline_m = [[0.0, 0.0], [150.0, 0.0], [150.0, 80.0]], corner_radius_m = 8.0 }
        [[radio_heads]]
        position_m = [20.0, 15.0, 6.0]
        ssb_index = 40
        eirp_dbm = 45.0
        [[radio_heads]]
        position_m = [160.0, 30.0, 6.0]
        ssb_index = 12
        eirp_dbm = 45.0
        """,
        """
        receiver = { noise_figure_db = 10.0 }
        array = { rx_gain_dbi = 12.0 }
        """,
        "",
    ),
    "a campus of a kilometre, ten masts of 40 m on eight indices": (
        f"""
        road.polyline_m = [[0.0, 0.0], [1000.0, 0.0], [1000.0, 480.0], [0.0, 480.0]]
        road.corner_radius_m = 20.0
        {MASTS}
        """,
        "top_speed_kmh = 30.0",
        "stops = [{ at_m = 300.0, dwell_s = 600.0 }]",
    ),
    "a robot of 0.3 m/s in a hall, heads at 12 m": (
        """
        [[radio_heads]]
        position_m = [0.0, 0.0, 12.0]
        [[radio_heads]]
        position_m = [40.0, 0.0, 12.0]
        ssb_index = 1
        [[radio_heads]]
        position_m = [20.0, 30.0, 12.0]
        ssb_index = 2
        eirp_dbm = -10.0
        """,
        """
        drive = "differential"
        top_speed_kmh = 1.08
        array = { position_m = [0.1, 0.0, 0.4] }
        odometer = { scale_std = 0.08, noise_m_per_sqrt_m = 0.05, track_width_m = 0.26 }
        gyroscope = { noise_rad_per_sqrt_s = 0.04, bias_std_radps = 0.01 }
        """,
        "path = { segments = [{ length_m = 20.0 }, { length_m = 2.0, turn_rad = 1.57 }] }",
    ),
    "a local frame of 5 km": (
        """
        road.polyline_m = [[-5000.0, 4000.0], [-4600.0, 4000.0], [-4600.0, 4300.0]]
        road.corner_radius_m = 12.0
        [[radio_heads]]
        position_m = [-4900.0, 4020.0, 10.0]
        [[radio_heads]]
        position_m = [-4620.0, 4200.0, 10.0]
        ssb_index = 1
        """,
        "start = { pose = { x_m = -5000.0, y_m = 4000.0, heading_rad = 0.0 } }",
        "",
    ),
    "three sectors of a mast, at 2.6 GHz": (
        """
        carrier_mhz = 2600.0
        ssb = { subcarrier_spacing_khz = 30.0 }
        road = { segments = [{ length_m = 300.0 }] }
        """
        + "".join(
            f"""
            [[radio_heads]]
            position_m = [{150.0 + 0.5 * sector}, 40.0, 25.0]
            ssb_index = {sector + 5}
            eirp_dbm = 46.0
            """
            for sector in range(3)
        ),
        "",
        "",
    ),
    "a shuttle of 5.5 km/h, at 700 MHz": (
        """
        carrier_mhz = 700.0
        road = { segments = [{ length_m = 80.0 }] }
        [[radio_heads]]
        position_m = [40.0, 12.0, 4.0]
        ssb_index = 3
        eirp_dbm = 20.0
        """,
        "top_speed_kmh = 5.5",
        "",
    ),
}


@pytest.mark.parametrize("plant", UNLIKE)
def test_other_valid_plants_cause_no_warning(plant: str) -> None:
    site, vehicle, motion = UNLIKE[plant]
    plain = Site.from_toml(f'name = "other"\n{site}')
    carrier = Vehicle.from_toml(f'extends = "default"\nname = "other"\n{vehicle}')
    assert plain.warnings(carrier) == []
    if "road" in site:
        assert plain.warnings() == []
    over = Scenario.load("yard").with_overrides(
        {
            "site": json.loads(plain.to_json()),
            "vehicle": json.loads(carrier.to_json()),
            "motion": tomllib.loads(motion),
        }
    )
    assert over.warnings() == []


@pytest.mark.parametrize("kind", [Site, Vehicle, Scenario, Platform])
def test_shipped_files_cause_no_warning(kind: type[Site | Vehicle | Scenario | Platform]) -> None:
    doubtful = {name: kind.load(name).warnings() for name in kind.names()}
    assert {name: found for name, found in doubtful.items() if found} == {}


def test_sites_of_recorded_drives_cause_no_warning(data: Path) -> None:
    tables = sorted(data.glob("*/**/landmarks.csv"))
    assert len(tables) > 4
    for table in tables:
        at = pl.read_csv(table)
        z_m = at["z_m"] if "z_m" in at.columns else [0.0] * at.height
        text = 'name = "recorded"\n'
        if (road := table.parent / "road.toml").exists():
            text += road.read_text().replace("[track]", "[road]")
        for pci, *place in zip(at["pci"], at["x_m"], at["y_m"], z_m, strict=True):
            text += f"\n[[radio_heads]]\npci = {pci}\nposition_m = {place}"
        for drive in ("road", "differential"):
            robot = Vehicle.from_toml(f'name = "robot"\ndrive = "{drive}"\n')
            assert Site.from_toml(text).warnings(robot) == [], table


def test_check_continues_after_a_warning(
    tmp_path: Path, access_av: Callable[..., Finished]
) -> None:
    (tmp_path / "fine.toml").write_text(PLANT)
    (tmp_path / "deep.toml").write_text(PLANT.replace("25.0, 8.0]", "25.0, -8.0]"))
    done = access_av(
        "file", "check", "--kind", "site", tmp_path / "fine.toml", tmp_path / "deep.toml"
    )
    assert done.code == 0
    assert "fine.toml: valid" in done.out
    assert "deep.toml: valid, 1 warning" in done.out
    assert "specify metres above the ground, positive upwards: 8" in done.err
    (tmp_path / "cart.toml").write_text(VEHICLE + 'platform = { name = "jetson" }\n')
    done = access_av("file", "check", "--kind", "vehicle", tmp_path / "cart.toml")
    assert done.code == 2
    assert "`platform.name`" in done.err


def test_a_run_prints_warnings_first(
    tmp_path: Path, access_av: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Checks the terminal output, the manifest and the report."""
    monkeypatch.setattr("access_av.report.page.chart_code", lambda: "")
    deep = PLANT.replace("25.0, 8.0]", "25.0, -8.0]").replace("324.0", "4.0")
    (tmp_path / "deep.toml").write_text(deep.replace("250.0 }", "30.0 }"))
    (tmp_path / "cart.toml").write_text(VEHICLE)
    trip = 'name = "trip"\nsite = "deep.toml"\nvehicle = "cart.toml"\n'
    (tmp_path / "trip.toml").write_text(trip)
    write = "specify metres above the ground, positive upwards: 8"
    done = access_av("run", tmp_path / "trip.toml", "--out", tmp_path / "run")
    assert done.code == 0
    assert write in done.err
    [warned] = json.loads((tmp_path / "run" / "manifest.json").read_text())["warnings"]
    assert write in warned
    assert write in (tmp_path / "run" / "report.html").read_text()
    done = access_av("run", "yard", "--set", "vehicle.platform.mode=99", "--out", tmp_path / "none")
    assert done.code == 2
    assert "platform.mode" in done.err
    assert not (tmp_path / "none").exists()


SITE_AND_VEHICLE = ("--site", "yard", "--vehicle", "tugger")
COMMANDS = (
    ("run", "yard"),
    ("design", "bound", "yard"),
    ("design", "plan", "yard"),
    ("design", "integrity", "yard"),
    ("design", "tune", "yard"),
    ("design", "sweep", "yard", "--space", "space.toml"),
    ("record", "synth", "yard", "--out", "drive"),
    ("record", "locate", "--recording", "a.csv", "--odometry", "o.csv", *SITE_AND_VEHICLE),
    ("record", "survey", "drive", *SITE_AND_VEHICLE),
    ("record", "angles", "iq.sigmf-meta", *SITE_AND_VEHICLE),
    (
        "design",
        "import-paths",
        "t.csv",
        "--site",
        "yard",
        "--carrier-mhz",
        "3500",
        "--out",
        "p.npz",
    ),
)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: "-".join(command[:2]))
def test_every_command_prints_warnings_first(
    command: tuple[str, ...], access_av: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(_: str, warnings: list[SettingsWarning]) -> None:
        raise InputError(f"asked first: {len(warnings)} doubtful")

    monkeypatch.setattr("access_av.cli.options.announce", stop)
    done = access_av(*command)
    assert done.code == 2
    assert "asked first: 0 doubtful" in done.err


def test_radio_heads_with_the_same_fault_have_one_warning(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    """Every radio head is named, with its value, and the reason and the remedy once."""
    file = tmp_path / "plant.toml"
    file.write_text(PLANT.replace("8.0]", "8000.0]"), encoding="utf-8")
    text = " ".join(access_av("file", "check", str(file)).err.split())
    assert text.count("above sea level") == 1
    for number in range(3):
        assert f"`radio_heads[{number}].position_m[2]` is 8000" in text


def test_only_the_options_module_loads_settings_files() -> None:
    """`options` reads the inputs of every command and warns of doubtful settings."""
    for file in (ROOT / "python" / "access_av" / "cli").glob("*.py"):
        loads = re.findall(r"\b(?:Scenario|Site|Vehicle)\.load\(", file.read_text(encoding="utf-8"))
        assert not loads or file.name == "options.py", file.name


def test_csv_with_semicolons_and_decimal_commas_is_read(tmp_path: Path) -> None:
    file = tmp_path / "masts.csv"
    file.write_text("name;x_m;y_m\nTor, Süd;1,5;-2\nHalle;3;4,25\n", encoding="utf-8")
    rows = validation.read(file, "table of masts", {"name": pl.String})
    assert rows.rows() == [("Tor, Süd", 1.5, -2.0), ("Halle", 3.0, 4.25)]
    file.write_text("name;x_m;y_m\nTor;1,234;2.5\n", encoding="utf-8")
    with pytest.raises(InputError, match="ambiguous; write all numbers with a point"):
        validation.read(file, "table of masts", {"name": pl.String})


def test_a_warning_has_file_key_and_reason() -> None:
    [warning] = scenario(**{"vehicle.odometer.scale_std": 0.5}).warnings()
    assert isinstance(warning, SettingsWarning)
    assert (warning.key, warning.value) == ("vehicle.odometer.scale_std", "0.5")
    assert warning.why in str(warning)
    assert warning.write in str(warning)


def test_dead_reckoning_with_two_radio_heads_is_reported_by_varied_commands(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    off = ("--set", "vehicle.integrity.enabled=false", "--set", "motion.start_at_m=292.0")
    vary = ("--sweep", "vehicle.localizer.kind=dead-reckoning")
    said = "dead reckoning supports one radio head"
    done = access_av("run", "paper-real-odometry-2", *off, *vary, "--out", tmp_path / "r")
    assert done.code == 0, done.err
    assert " ".join(done.err.split()).count(said) == 1
    (tmp_path / "short.toml").write_text(
        'extends = "paper-real-odometry-2"\n[motion]\nstart_at_m = 292.0\n'
    )
    (tmp_path / "space.toml").write_text(
        '[vehicle.localizer]\nkind = ["tracker", "dead-reckoning"]\n'
        "[vehicle.integrity]\nenabled = [false]\n"
        "[vehicle.platform]\nmode = [0, 1]\n"
    )
    space = ("--space", tmp_path / "space.toml", "--runs", "1")
    done = access_av("design", "sweep", tmp_path / "short.toml", *space, "--out", tmp_path / "d")
    assert done.code == 0, done.err
    assert " ".join(done.err.split()).count(said) == 1


DEAD_RECKONING = """
[vehicle]
extends = "tugger"
[vehicle.localizer]
kind = "dead-reckoning"
[vehicle.integrity]
enabled = false
[vehicle.wake_up]
policy = "fixed"
interval_ms = 100.0
"""


def test_dead_reckoning_with_two_radio_heads_is_reported_by_study(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    plant = tmp_path / "plant.toml"
    plant.write_text(
        short_plant.PLANT.replace('vehicle = "tugger"', "") + DEAD_RECKONING, encoding="utf-8"
    )
    other = tmp_path / "other.toml"
    other.write_text('extends = "plant.toml"\n', encoding="utf-8")
    done = access_av("study", plant, "--against", other)
    assert done.code == 2
    said = "`vehicle.localizer.kind` is dead-reckoning"
    words = " ".join(done.err.split())
    assert f"plant.toml: {said}" in words
    assert f"other.toml: {said}" in words


def test_dead_reckoning_with_two_radio_heads_is_reported_by_simulate() -> None:
    dead_reckoning = {
        "vehicle.localizer.kind": "dead-reckoning",
        "vehicle.integrity.enabled": False,
        "motion.start_at_m": 292.0,
    }
    two = Scenario.load("paper-real-odometry-2").with_overrides(dead_reckoning)
    with pytest.warns(ImplausibleSettingsWarning, match=r"supports one radio head.*has 2"):
        simulate(two, runs=1)
    # The localizer supports one radio head; warnings are errors in these tests.
    one = json.loads(two.site.to_json())["radio_heads"][:1]
    simulate(two.with_overrides({"site.radio_heads": one}), runs=1)
