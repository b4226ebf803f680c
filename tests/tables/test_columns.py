"""Every table has the columns of `access_av.columns`, and null values only under its conditions."""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

from access_av import (
    Scenario,
    Vehicle,
    bound,
    columns,
    drives,
    estimate_angles,
    nr,
    simulate,
    statistics,
)
from access_av.device.platform import Platform
from access_av.paper.sampled_interpretations import sample
from access_av.paper.unknowns import sobol
from access_av.run.campaign import Campaign, ResultCache
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Finished

UNITS = {
    "m": "m", "m2": "m²", "s": "s", "ms": "ms", "rad": "rad", "rad2": "rad²", "deg": "°",
    "db": "dB", "dbfs": "dB", "hz": "Hz", "khz": "kHz", "mps": "m/s", "radps": "rad/s",
    "j": "J", "w": "W",
}  # fmt: skip


def check(name: str, found: pl.DataFrame | list[dict[str, Any]]) -> None:
    table = columns.table(name)
    if isinstance(found, pl.DataFrame):
        kinds = sorted({it for kinds in table.absent.values() for it in kinds})
        assert tuple(found.columns) in [table.of(kind) for kind in kinds or [""]]
        for series in found.iter_columns():
            if series.dtype.is_float():
                assert not series.is_nan().any(), series.name
            assert series.name in table.null or series.null_count() == 0, series.name
    else:
        for record in found:
            assert [*record] == [key for key in table.columns if key in record]
            assert set(table.columns) - record.keys() <= table.absent.keys()
            assert {key for key, value in record.items() if value is None} <= table.null.keys()


def test_every_name_is_in_a_table_and_explained() -> None:
    used = {name for table in columns.TABLES.values() for name in table.columns}
    assert used == columns.GLOSSARY.keys()
    for table in columns.TABLES.values():
        assert len(set(table.columns)) == len(table.columns), table.name
        assert {*table.null, *table.absent} <= set(table.columns), table.name


def test_units_in_names_are_the_units() -> None:
    for column in columns.GLOSSARY.values():
        suffix = column.name.rsplit("_", 1)[-1]
        if column.name.endswith("m_rad"):
            assert column.unit == "m·rad"
        elif suffix in UNITS:
            assert column.unit == UNITS[suffix], column.name
        else:
            assert column.unit in ("1", "text", "true or false", "any"), column.name


def test_the_page_is_generated_from_the_table() -> None:
    page = (ROOT / "docs/columns.md").read_text(encoding="utf-8")
    assert page == columns.markdown(), "make docs"


GUARDED = {"vehicle.integrity": {}}
LOST = {"vehicle.start.known": False, "site.radio_heads[0].eirp_dbm": -140.0}


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("paper", {}),
        ("paper-real-odometry-2", GUARDED),
        ("paper-real-odometry-2", LOST | {"site.radio_heads[1].eirp_dbm": -140.0}),
        ("nlos-and-faults", {}),
    ],
    ids=["dead-reckoning", "guarded", "lost", "faults"],
)
def test_simulation_tables_have_the_documented_columns(
    scenario: str, changes: dict[str, object]
) -> None:
    found = simulate(
        Scenario.load(scenario).with_overrides(changes), runs=1, keep_trajectories=True
    )
    for name in ("steps", "runs", "trajectories", "aoa_estimates"):
        check(name.replace("aoa_estimates", "measurements"), getattr(found, name))
    assert found.trajectories is not None
    check("nees", statistics.nees(found.trajectories))
    check("mean_nees", statistics.mean_nees(found.trajectories))


def test_tables_of_located_drives_have_the_documented_columns(tmp_path: Path) -> None:
    drives.synthesize("paper-real-odometry-2", tmp_path, duration_s=6.0)
    site, odometry = tmp_path / "site.toml", tmp_path / "odometry.csv"
    vehicle = tmp_path / "vehicle.toml"
    drive = drives.locate(site, odometry, tmp_path / "iq", vehicle=vehicle, smooth=True)
    assert drive.smoothed is not None
    check("trajectories", drive.poses)
    check("trajectories", drive.smoothed)
    assert drive.smoothed["protection_level_m"].is_null().all()
    check("measurements", drive.angles)
    check("survey", drive.findings)
    found = estimate_angles(site, tmp_path / "iq", vehicle=vehicle)
    check("measurements", found.angles)
    check("position_errors", drives.error_m(drive.poses, tmp_path / "truth.tum"))
    without_gyroscope = pl.read_csv(odometry).columns
    assert without_gyroscope == list(columns.TABLES["odometry"].columns[:3])
    # The angle log has the columns of its table, and can be read.
    log = tmp_path / "angles.csv"
    drive.angles.select(columns.TABLES["measurements"].columns[1:8]).drop_nulls().write_csv(log)
    assert drives.locate(site, odometry, log, vehicle=vehicle).angles.height > 0
    ranges = tmp_path / "ranges.csv"
    ranges.write_text("time_s,pci,range_m,sigma_m\n1.0,1,30.0,5.0\n2.0,2,40.0,\n")
    of_ranges = Vehicle.load(str(vehicle)).with_overrides({"ranging.sigma_m": 5.0})
    check("measurements", drives.locate(site, odometry, ranges, vehicle=of_ranges).ranges)


def test_bound_tables_have_the_documented_columns() -> None:
    for scenario in ("paper", "yard"):
        found = bound(scenario, map_step_m=50.0)
        check("positions", found.route)
        check("positions", found.site)
        check("radio_heads", found.heads)


def test_evaluation_tables_have_the_documented_columns(quick_study: Path) -> None:
    for name in ("errors", "snr"):
        check("steps", pl.read_parquet(quick_study / "latest" / f"{name}.parquet"))
    merged = {"fixed_front": "operating_points", "evaluation_runs": "runs", "resamples": "runs"}
    merged |= dict.fromkeys(("ablations", "proposed_vs_paper", "equal_information"), "comparisons")
    names = ("operating_points", "ablations", "fixed_front", "proposed_vs_paper",
             "equal_information",
             "evaluation_runs", "resamples",
             "fit_degrees_of_freedom")  # fmt: skip
    for name in names:
        table = pl.read_parquet(quick_study / "latest" / f"{name}.parquet")
        check(merged.get(name, name), table)
    check("claims", json.loads((quick_study / "latest/claims.json").read_text()))


def test_assumptions_have_the_documented_columns(access_av: Callable[..., Finished]) -> None:
    done = access_av("paper", "assumptions", "--runs", "1", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    check("assumptions", found)
    shipped = [one for one in found if one["is_shipped"]]
    assert len({one["rms_error_m"] for one in shipped}) == 1, "the same interpretation each time"
    assert len(found) > 2 * len(shipped) - 1, "each has an alternative"


def test_sensitivity_tables_have_the_documented_columns() -> None:
    platform = Platform.load("jetson-agx-xavier")
    with tempfile.TemporaryDirectory() as parts:
        kept = Campaign(ResultCache(Path(parts)))
        drawn = sample(kept, platform, worlds=2, controllers=2, runs=1, everything=True)
    assert drawn is not None
    for name, found in sobol(drawn, 1, count=3).tables().items():
        check(name, found)


def test_cells_and_bursts_have_the_documented_columns(
    access_av: Callable[..., Finished], data: Path
) -> None:
    captures = data / "captures"
    one = access_av("record", "scan", captures / "oai-n78.sigmf-meta", "--unconfirmed", "--json")
    array = captures / "semireal4_singtel-n1_day1_array1.sigmf-meta"
    several = access_av("record", "scan", array, "--unconfirmed", "--json")
    for done in (one, several):
        check("cells", json.loads(done.out))
    check(
        "cells",
        json.loads(access_av("record", "aoa", captures / "aoa4_day1_array1", "--json").out),
    )


def test_cells_of_a_search_have_the_documented_columns() -> None:
    burst = nr.build_burst(42, ssb_freq_hz=3.7008e9)
    noise = np.random.default_rng(1).normal(scale=1e-3, size=(burst.size, 2)) @ [1, 1j]
    carrier = {"centre_frequency_hz": 3.7008e9, "ssb_freq_hz": 3.7008e9}
    [cell] = nr.search((burst + noise)[None], 7.68e6, **carrier)
    check("cells", [{"recording": "", **nr.record(cell)}])


def test_the_columns_command_describes_every_column(access_av: Callable[..., Finished]) -> None:
    done = access_av("file", "columns", "measurements", columns=100)
    assert done.code == 0
    for name in columns.TABLES["measurements"].columns:
        assert re.search(rf"^ {name} ", done.out, flags=re.MULTILINE)
    assert "no angle could be estimated" in done.out
    tables = json.loads(access_av("file", "columns", "--json").out)
    assert tables.keys() == columns.TABLES.keys()
    assert tables["nees"]["columns"][1] == {
        "name": "time_s", "unit": "s", "null": "never",
        "meaning": "Time from the start of the drive, or by the recording's clock",
    }  # fmt: skip
    assert access_av("file", "columns", columns=60).code == 0
    wrong = access_av("file", "columns", "mesurements")
    assert wrong.code == 2
    assert "measurements" in wrong.err
    assert "see operating_points" in access_av("file", "columns", "design_worlds").err
    of_file = json.loads(access_av("file", "columns", "worlds.parquet", "--json").out)
    names = [it["name"] for it in of_file["worlds.parquet"]["columns"]]
    assert tuple(names) == columns.TABLES["operating_points"].of("`worlds.parquet`")
    assert "on_front" in names
    assert "interpretation" not in names
    ambiguous = access_av("file", "columns", "errors.parquet")
    assert ambiguous.code == 2
    assert "see steps or position_errors" in ambiguous.err
