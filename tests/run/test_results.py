"""Results: content, files, charts, sweeps and paired comparisons."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
import pytest

import access_av
from access_av import columns
from access_av.errors import InputError
from access_av.tables import result as result_files

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SHORT = access_av.Scenario.load("paper-real-odometry-2").with_overrides(
    {"motion.start_at_m": 285.0, "vehicle.integrity.enabled": False}
)


def bartlett(snapshots: np.ndarray) -> tuple[float, float]:
    angles_rad = np.linspace(0.0, np.pi, 361)
    steering = np.exp(1j * np.pi * np.outer(np.cos(angles_rad), np.arange(len(snapshots))))
    power = (abs(steering.conj() @ snapshots) ** 2).sum(axis=1)
    return float(angles_rad[power.argmax()]), 0.05


class EveryFifth:
    """Estimates at every fifth burst."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, _: Any) -> bool:
        self.count += 1
        return self.count % 5 == 0


def simulated(**keys: Any) -> access_av.Simulation:
    return access_av.simulate(SHORT, runs=2, keep_trajectories=True, errors_every=10, **keys)


MAKERS: dict[str, Callable[[], Any]] = {
    "simulation": simulated,
    "bound": lambda: access_av.bound(SHORT, map_step_m=60.0),
    "evaluation": lambda: access_av.evaluate(runs=2),
    "sweep": lambda: access_av.sweep(SHORT, {"site.rician_k_db": [0.0, 20.0]}, runs=2),
    "plan": lambda: access_av.plan("paper", add=1),
    "difference": lambda: access_av.difference(simulated(), simulated()),
}


@pytest.mark.parametrize("name", MAKERS)
def test_a_saved_and_loaded_result_is_unchanged(name: str, tmp_path: Path) -> None:
    found, again = MAKERS[name](), MAKERS[name]()
    assert found == again
    assert hash(found) == hash(again)
    file = found.save(tmp_path / "result.zip")
    loaded = type(found).load(file)
    assert loaded == found
    assert type(loaded) is type(found)
    # Equal content gives equal bytes, also after loading.
    for each in (again, loaded):
        other = tmp_path / "other.zip"
        if name == "evaluation":  # the computing time is not compared
            each = replace(each, duration_s=found.duration_s)
        each.save(other)
        assert other.read_bytes() == file.read_bytes()
    if name != "difference":
        assert found.origin.version == access_av.__version__
    if name not in ("difference", "plan"):
        spec = loaded.plot().to_dict()
        assert spec["datasets"]
        assert loaded.scenario == found.scenario


def test_any_difference_in_content_is_a_difference() -> None:
    found = simulated()
    changed = found.steps.with_columns(pl.col("rms_error_m") * (1.0 + 1e-12))
    assert found != replace(found, steps=changed)
    assert found != simulated(seed=2)
    assert found != access_av.bound(SHORT, map_step_m=60.0)
    other = replace(found, origin=result_files.Origin("0.0.0", "another"))
    assert found == other, "another version that obtains the same is no difference"


def test_files_of_another_kind_are_rejected(tmp_path: Path) -> None:
    text = tmp_path / "text.zip"
    text.write_text("no archive")
    with pytest.raises(InputError, match=r"text\.zip: not a result"):
        access_av.Simulation.load(text)
    file = access_av.bound(SHORT, map_step_m=60.0).save(tmp_path / "bound.zip")
    with pytest.raises(InputError, match="contains a ErrorBound, not a Simulation"):
        access_av.Simulation.load(file)
    for entry in (
        {"$": "object", "class": "os:system", "fields": {}},
        {"$": "object", "class": "access_av.tables.result:load", "fields": {"path": "x"}},
        {"$": "toml", "class": "access_av.errors:InputError", "text": ""},
        {"$": "array", "member": "../x.npy"},
        {},
    ):
        with zipfile.ZipFile(tmp_path / "evil.zip", "w") as archive:
            archive.writestr("result.json", json.dumps({"format": 1, "result": entry}))
        with pytest.raises(InputError, match="not a result"):
            access_av.Simulation.load(tmp_path / "evil.zip")
    with pytest.raises(TypeError, match="a function cannot be saved"):
        replace(simulated(), seed=bartlett).save(tmp_path / "x.zip")  # type: ignore[arg-type]


def test_a_sweep_equals_its_simulations() -> None:
    vary: dict[str, list[Any]] = {
        "estimator": [None, bartlett],
        "policy": [None, EveryFifth],
        "site.rician_k_db": [5.0, 20.0],
    }
    found = access_av.sweep(SHORT, vary, runs=2, seed=4)
    assert found.table.height == 8
    assert found.table.columns == list(columns.table("compared").columns)
    for row, result in zip(found.table.to_dicts(), found.results, strict=True):
        [exact] = [it for it in result.percentiles if it.percent == found.percent]
        assert row["percentile_m"] == exact.value
        assert row["percentile_low_m"] == exact.low <= exact.value
    assert found.values[-1] == {
        "estimator": "bartlett",
        "policy": "EveryFifth",
        "site.rician_k_db": 20.0,
    }
    alone = access_av.simulate(
        SHORT.with_overrides({"site.rician_k_db": 20.0}),
        runs=2,
        seed=4,
        errors_every=10,
        estimator=bartlett,
        policy=EveryFifth,
    )
    assert found.results[-1] == alone
    row = found.table.row(7, named=True)
    assert row["rms_error_m"] == alone.rms_error_m
    error_m = np.hypot(*np.moveaxis(found.results[7].errors_m.astype(float), -1, 0))  # type: ignore[union-attr]
    first_m = np.hypot(*np.moveaxis(found.results[0].errors_m.astype(float), -1, 0))  # type: ignore[union-attr]
    least = [np.quantile(it, 0.99, method="inverted_cdf") for it in (error_m, first_m)]
    assert row["delta_m"] == pytest.approx(least[0] - least[1])
    assert found.difference(7).delta_m == row["delta_m"]
    assert found.table["delta_m"][0] == 0.0


def test_paired_comparisons_need_pairs() -> None:
    found = simulated()
    same = access_av.difference(found, simulated())
    assert same.identical
    assert not same.is_significant
    with pytest.raises(InputError, match="seeds 2 and 1"):
        access_av.difference(simulated(seed=2), found)
    without = access_av.simulate(SHORT, runs=2)
    with pytest.raises(InputError, match="baseline: simulate it with keep_trajectories"):
        access_av.difference(found, without)
    one = access_av.simulate(SHORT, runs=1, keep_trajectories=True)
    with pytest.raises(InputError, match="1 and 2 runs"):
        access_av.difference(one, found)


def test_an_empty_space_is_rejected() -> None:
    for vary in ({}, {"site.rician_k_db": []}):
        with pytest.raises(InputError, match="at least one key"):
            access_av.sweep(SHORT, vary, runs=1)
