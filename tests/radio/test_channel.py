"""Channels of TR 38.901 and of ray tracers, in Python and on the command line."""

from __future__ import annotations

import json
import runpy
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

import street_site
from access_av import Scenario, Site, bound, channel, columns, ray_paths, simulate
from conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

HALL = ROOT / "examples" / "hall"
SPEED_OF_LIGHT_MPS = 299_792_458.0


def test_drops_have_their_columns_and_statistics() -> None:
    found = channel.drops("inf-sl", np.full(20_000, 30.0), seed=3)
    assert tuple(found.columns) == columns.TABLES["channel_drops"].columns
    clear = found.filter("line_of_sight")
    # Table 7.4.2-1: e^(d ln(1 - r) / d_clutter); table 7.5-6: 7 ± 8 dB.
    assert abs(clear.height / 20_000 - np.exp(3.0 * np.log(0.8))) < 0.015
    assert abs(clear["rician_k_db"].mean() - 7.0) < 0.3
    assert abs(clear["rician_k_db"].std() - 8.0) < 0.3
    assert found.filter(~pl.col("line_of_sight"))["rician_k_db"].is_null().all()
    for model in ("rician", "InF-SL"):
        with pytest.raises(ValueError, match="inf-dh"):
            channel.drops(model, [10.0])
    with pytest.raises(ValueError, match="finite"):
        channel.drops("umi", [float("nan")])


def test_a_drive_under_every_model_and_with_blockage() -> None:
    yard = Scenario.load("yard").with_overrides(
        {"site.road.polyline_m": [[-140.0, 0.0], [-120.0, 0.0]], "motion.stops": []}
    )
    for model in ("umi", "inf-sl", "inf-dl", "inf-sh", "inf-dh"):
        scenario = yard.with_overrides(
            {"channel.model": model, "channel.blockage": {"per_minute": 12.0}}
        )
        first, again = (simulate(scenario, seed=2, threads=threads) for threads in (1, 2))
        assert first.steps.equals(again.steps)
        assert np.isfinite(first.rms_error_m)


def line_of_sight(site: Site, places_m: np.ndarray) -> pl.DataFrame:
    """Returns the line of sight from every radio head of a site to every position."""
    settings = json.loads(site.to_json())
    heads = settings["radio_heads"]
    towards_m = np.array([head["position_m"] for head in heads])[None] - places_m[:, None]
    length_m = np.linalg.norm(towards_m, axis=-1)
    wavelength_m = SPEED_OF_LIGHT_MPS / (1e6 * settings["carrier_mhz"])
    gain = wavelength_m / (4 * np.pi * length_m) * np.exp(-2j * np.pi * length_m / wavelength_m)
    return ray_paths.from_arrays(
        places_m,
        [head["pci"] for head in heads],
        gain[..., None],
        (length_m / SPEED_OF_LIGHT_MPS)[..., None],
        np.arctan2(towards_m[..., 1], towards_m[..., 0])[..., None],
        np.arccos(towards_m[..., 2] / length_m)[..., None],
    )


LANE_M = np.stack([np.arange(10.0, 50.1, 0.25), np.full(161, 12.0), np.full(161, 1.2)], axis=1)


def test_a_traced_line_of_sight_is_that_of_the_geometry(tmp_path: Path) -> None:
    site = Site.load(str(HALL / "site.toml"))
    table = line_of_sight(site, LANE_M)
    found = ray_paths.import_paths(table, site, tmp_path / "los.npz", carrier_mhz=3750.0)
    assert found == {"heads": 3, "places": 161, "paths": 483}
    hall = Scenario.load(str(HALL / "scenario.toml"))
    text = (HALL / "scenario.toml").read_text().split("[channel]")[0]
    untraced = Scenario.from_toml(
        f"{text}[channel]\nshadowing_std_db = 0.0\n", str(HALL / "scenario.toml")
    )
    drawn = {
        "truth.std_factor": 0.0,
        "vehicle.lane_keeping": {"rms_m": 0.0, "wavelength_m": 60.0},
    }
    for fidelity in ("snapshots", "iq"):
        traced = hall.with_overrides(
            {**drawn, "channel.paths": str(tmp_path / "los.npz"), "fidelity": fidelity}
        )
        # Without multipath, they differ by the plane-wave approximation over half a step only.
        free = untraced.with_overrides(
            {**drawn, "fidelity": fidelity, "truth.site.rician_k_db": 60.0}
        )
        results = [simulate(it, seed=5, keep_trajectories=True) for it in (traced, free)]
        snrs_db = [result.steps["mean_true_snr_db"].to_numpy() for result in results]
        assert np.abs(snrs_db[0] - snrs_db[1]).max() < 0.3
        assert all(result.aoa_estimates is not None for result in results)
        angles = [result.aoa_estimates.select("time_s", "pci", "phase_rad") for result in results]
        both = (
            angles[0]
            .with_columns(pl.col("time_s").round(3))
            .join(angles[1].with_columns(pl.col("time_s").round(3)), on=["time_s", "pci"])
        )
        apart = np.angle(np.exp(1j * (both["phase_rad"] - both["phase_rad_right"]).to_numpy()))
        assert both.height > 500
        assert np.sqrt(np.mean(apart**2)) < 0.03, fidelity


def test_the_shipped_hall_contains_its_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = HALL / "paths.npz"
    assert shipped.stat().st_size < 50_000
    script = runpy.run_path(str(HALL / "trace.py"))
    (tmp_path / "site.toml").write_text((HALL / "site.toml").read_text())
    monkeypatch.setitem(script["main"].__globals__, "HERE", tmp_path)
    script["main"]()
    with np.load(shipped) as here, np.load(tmp_path / "paths.npz") as there:
        assert here.files == there.files
        for name in here.files:
            np.testing.assert_allclose(here[name], there[name], rtol=1e-5, atol=1e-9)
    result = simulate(str(HALL / "scenario.toml"), runs=2, seed=1)
    assert 0.005 < result.rms_error_m < 1.0


def test_the_bound_uses_the_rician_k_of_traced_paths(tmp_path: Path) -> None:
    site = Site.load(str(HALL / "site.toml"))
    table = line_of_sight(site, LANE_M)
    ray_paths.import_paths(table, site, tmp_path / "los.npz", carrier_mhz=3750.0)
    hall = Scenario.load(str(HALL / "scenario.toml"))
    clear = hall.with_overrides({"channel.paths": str(tmp_path / "los.npz")})
    traced_m, clear_m = (bound(it, map_step_m=1.0).route["bound_m"].max() for it in (hall, clear))
    assert clear_m < 0.8 * traced_m
    # Positions beyond the lane are not traced, so that the bound is unknown.
    assert bound(hall, map_step_m=4.0).site.filter(pl.col("y_m") > 20.0)["bound_m"].is_null().all()


def test_npz_arrays_in_column_major_order_are_read(tmp_path: Path) -> None:
    with np.load(HALL / "paths.npz") as held:
        arrays = {name: held[name] for name in held.files}
    by_columns = {name: np.asfortranarray(array) for name, array in arrays.items()}
    np.savez(tmp_path / "paths.npz", **by_columns)
    hall = Scenario.load(str(HALL / "scenario.toml"))
    other = hall.with_overrides({"channel.paths": str(tmp_path / "paths.npz")})
    assert simulate(other, seed=3).steps.equals(simulate(hall, seed=3).steps)


def test_no_two_cells_of_the_yard_send_at_once() -> None:
    heads = json.loads(Site.load("yard").to_json())["radio_heads"]
    assert len({head["ssb_index"] for head in heads}) == len(heads)


def test_bad_tables_are_refused(tmp_path: Path, access_av: Callable[..., Finished]) -> None:
    site = Site.load(str(HALL / "site.toml"))
    good = line_of_sight(site, LANE_M[:3])

    def refused(table: pl.DataFrame, carrier_mhz: float = 3750.0) -> str:
        table.write_parquet(tmp_path / "paths.parquet")
        done = access_av(
            "design", "import-paths", tmp_path / "paths.parquet", "--site", HALL / "site.toml",
            "--carrier-mhz", carrier_mhz, "--out", tmp_path / "paths.npz",
        )  # fmt: skip
        assert done.code == 2
        assert not list(tmp_path.glob("*.npz"))
        said = " ".join(done.err.split())
        assert f"{tmp_path / 'paths.parquet'}: " in said
        return said

    assert "gain_im is missing" in refused(good.drop("gain_im"))
    assert "the file contains no path" in refused(good.clear())
    gap = pl.when(pl.int_range(pl.len()) == 4).then(None).otherwise(pl.col("delay_s"))
    assert "delay_s is empty in row 5" in refused(good.with_columns(delay_s=gap))
    nan = pl.lit(float("nan"))
    assert "azimuth_rad is 'nan' in row 1" in refused(good.with_columns(azimuth_rad=nan))
    assert "no radio head pci=9" in refused(good.with_columns(pci=pl.lit(9)))
    moved = good.with_columns(x_m=pl.col("x_m") + 30.0)
    assert "not in one frame" in refused(moved)
    assert "from the horizon" in refused(good.with_columns(elevation_rad=pl.lit(2.0)))
    departing = good.with_columns(azimuth_rad=pl.col("azimuth_rad") + np.pi)
    assert "directions of arrival" in refused(departing)
    in_ns = good.with_columns(delay_s=1e9 * pl.col("delay_s"))
    assert "it must be in seconds" in refused(in_ns)
    in_db = good.with_columns(gain_re=pl.lit(-80.0), gain_im=pl.lit(0.0))
    assert "an amplitude between isotropic antennas" in refused(in_db)
    assert "no radio head pci=1.5" in refused(good.with_columns(pci=pl.col("pci") + 0.5))
    assert "the site's carrier is 3750 MHz" in refused(good, carrier_mhz=3500.0)
    named = good.with_columns(pl.col("pci").cast(pl.String))
    assert ray_paths.import_paths(named, site, tmp_path / "text.npz", carrier_mhz=3750.0)
    (tmp_path / "paths.csv").write_text("nothing")
    done = access_av(
        "design", "import-paths", tmp_path / "paths.csv", "--site", HALL / "site.toml",
        "--carrier-mhz", "3750", "--out", tmp_path / "paths.npz",
    )  # fmt: skip
    assert done.code == 2


def test_a_scenario_refuses_paths_of_another_site(
    tmp_path: Path, access_av: Callable[..., Finished]
) -> None:
    site = Site.load(str(HALL / "site.toml"))

    def refused(table: pl.DataFrame, of: Site = site, carrier_mhz: float = 3750.0) -> str:
        ray_paths.import_paths(table, of, tmp_path / "paths.npz", carrier_mhz=carrier_mhz)
        done = access_av(
            "run", HALL / "scenario.toml", "--set", f'channel.paths="{tmp_path / "paths.npz"}"'
        )
        assert done.code == 2
        return " ".join(done.err.split())

    table = line_of_sight(site, LANE_M)
    other = site.with_overrides({"carrier_mhz": 3500.0})
    assert "channel.paths" in refused(table, other, carrier_mhz=3500.0)
    assert "of 3500 MHz" in refused(table, other, carrier_mhz=3500.0)
    assert "no position within 1 m of the road" in refused(line_of_sight(site, LANE_M[:100]))
    of = site.with_overrides({"radio_heads[1].position_m": [10.0, 21.0, 7.0]})
    assert "m from its position in the site" in refused(line_of_sight(of, LANE_M), of)
    alone = table.filter(pl.col("pci") != 3)
    assert "no path from its radio head pci=3" in refused(alone)
    under = site.with_overrides({"radio_heads[1].position_m": [30.0, 21.0, -1.0]})
    with pytest.raises(ValueError, match="is below the road"):
        refused(line_of_sight(under, LANE_M), under)
    for override, message in (
        ('channel.paths="nowhere.npz"', "nowhere.npz"),
        ('channel.model="umi"', "channel.paths"),
    ):
        done = access_av("run", HALL / "scenario.toml", "--set", override)
        assert done.code == 2
        assert message in done.err


def test_the_street_can_be_simulated(tmp_path: Path, data: Path) -> None:
    street = data / "street"
    if not street.is_dir():
        pytest.skip("no ray-traced street among the reference data")
    assert street_site.write(street, tmp_path, rician_k_db=0.0) > 1500
    (tmp_path / "drive.toml").write_text(
        'name = "drive"\nsite = "street.toml"\n'
        '[vehicle]\nextends = "carrier"\nname = "street"\n'
        "[vehicle.array]\nposition_m = [0.0, 0.0, 1.5]\n"
        '[vehicle.wake_up]\npolicy = "fixed"\ninterval_ms = 500.0\n'
        '[channel]\nmodel = "paths"\npaths = "street.npz"\n'
    )
    result = simulate(str(tmp_path / "drive.toml"), runs=2, seed=1, keep_trajectories=True)
    assert 0.02 < result.rms_error_m < 1.0
    # Beyond the traced part of the road no SSB is received, and the position remains known.
    assert result.aoa_estimates is not None
    assert result.aoa_estimates["snr_db"].is_finite().all()
    every = Scenario.load(str(tmp_path / "drive.toml")).with_overrides(
        {"vehicle.wake_up.interval_ms": 20.0}
    )
    result = simulate(every, seed=1, keep_trajectories=True)
    assert result.steps["mean_abs_error_x_m"].max() < 3.0
    assert result.aoa_estimates is not None
    assert result.aoa_estimates["time_s"].max() < result.steps["time_s"].max() - 3.0
