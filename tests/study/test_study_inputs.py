"""Invalid and implausible plants, and the command of a study."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from access_av import Plant, SettingsError, study_plant
from access_av.errors import InputError
from access_av.study.unverified import unverified
from short_plant import LAST_METRES, PLANT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def test_a_template_value_is_unverified_until_it_is_changed() -> None:
    bends = Plant.load("bends")
    keys = {it.key for it in unverified(bends)}
    assert {"site.rician_k_db", "site.radio_heads.eirp_dbm", "fleet.vehicles"} <= keys
    changed = bends.with_overrides({"site.rician_k_db": 9.0, "fleet.vehicles": 7})
    assert keys - {it.key for it in unverified(changed)} == {"site.rician_k_db", "fleet.vehicles"}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"site.radio_heads[0].position_std_m": 10.0}, "10 cm are 0.1"),
        ({"prices.grid_g_per_kwh": 0.38}, "0.38 kg are 380"),
        ({"prices.electricity_per_kwh": 25.0}, "25 cents are 0.25"),
    ],
)
def test_values_in_another_unit_cause_a_warning(settings: dict[str, Any], words: str) -> None:
    plant = Plant.from_toml(PLANT)
    assert not any(words in str(it) for it in plant.warnings())
    assert any(words in str(it) for it in plant.with_overrides(settings).warnings())


@pytest.mark.parametrize(("ends_m", "is_doubtful"), [((-60.0, 180.0), True), ((40.0, 80.0), False)])
def test_a_hidden_radio_head_that_fits_the_other_road_side_causes_a_warning(
    ends_m: tuple[float, float], is_doubtful: bool
) -> None:
    """Radio head `gate` of `bends`, 25 m to the left of a straight of 200 m, behind a long wall."""
    walls = [{"name": "hall", "polyline_m": [[at_m, 10.0] for at_m in ends_m]}]
    warnings = Plant.load("bends").with_overrides({"site.walls": walls}).warnings()
    assert any("[60.0, -25.0, 8]" in str(it) for it in warnings) is is_doubtful


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("lidar = 3000.0", 'lidar = "3000 EUR"'), "without its unit"),
        (("trips_per_day = 40", "trips_per_day = 40000"), "at most"),
        (('target = "0.2 m 90 %"', 'target = "0.2 90 %"'), "0.3 m 99 %"),
        (('vehicle = "tugger"', 'vehicle = "tuger"'), "tugger"),
        (("at_m = 12.0", "at_m = 1200.0"), "motion.stops[0].at_m"),
        (("turn_rad = 1.5707963267948966", "turn_deg = 90.0"), "turn_deg"),
        (("hours_per_day = 16.0", "hours_per_day = 25.0"), "fleet.hours_per_day"),
        (("vehicles = 6", "vehicles = 0"), "fleet.vehicles"),
        (("lidar = 3000.0", "lidar = -3000.0"), "prices.lidar"),
        (("lidar = 3000.0", "lidars = 3000.0"), "prices.lidars"),
        (('currency = "EUR"', 'currency = "SEK"'), "prices.currency_per_usd"),
        (("pci = 2\n", ""), "site.radio_heads[1].pci"),
        (("eirp_dbm = 10.0\n", ""), "site.radio_heads[0].eirp_dbm"),
        (("at_m = 28.0", "at_m = 2800.0"), "targets[0].at_m"),
    ],
)
def test_invalid_plants_are_rejected_with_their_key(change: tuple[str, str], said: str) -> None:
    text = PLANT.replace(*change)
    assert text != PLANT
    with pytest.raises(SettingsError, match=re.escape(said)):
        Plant.from_toml(text, "mine.toml")


def test_a_plant_without_integrity_monitor_is_rejected() -> None:
    plant = Plant.from_toml(PLANT).with_overrides({"vehicle.integrity": {"enabled": False}})
    with pytest.raises(InputError, match="integrity monitor"):
        study_plant(plant)
    assert all(
        Plant.load(name).scenario().vehicle.alert_limit_m is not None for name in Plant.names()
    )


def test_the_command_names_invalid_input(access_av: Callable[..., Any], tmp_path: Path) -> None:
    assert access_av("study", tmp_path).code == 2
    (tmp_path / "file").write_text("", "utf-8")
    done = access_av("study", "bends", "--out", tmp_path / "file")
    assert done.code == 2
    assert "is a file" in done.err
    done = access_av("study", "bends", "--sweep", "site.rician_k_db", "--out", tmp_path / "out")
    assert done.code == 2
    assert "KEY=a,b,c" in done.err


@pytest.mark.parametrize("more", [(), ("--json",)], ids=["text", "json"])
def test_a_closed_pipe_does_not_prevent_the_files(tmp_path: Path, more: tuple[str, ...]) -> None:
    (tmp_path / "short.toml").write_text(LAST_METRES, "utf-8")
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "access_av", "study", "short.toml", "--runs", "2"]
    try:
        done = subprocess.run(
            [*command, "--out", "out", *more],
            cwd=tmp_path,
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=600,
            check=False,
        )
    finally:
        os.close(writing)
    assert "Traceback" not in done.stderr
    assert "BrokenPipe" not in done.stderr
    written = {it.name for it in (tmp_path / "out").iterdir()}
    assert {"report.html", "study.json", "manifest.json", "plant.toml"} <= written
