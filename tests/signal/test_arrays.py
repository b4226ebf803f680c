"""A circle of five antennas from synthesized samples to a pose."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from access_av import Recording, Scenario, bound, drives, nr
from access_av.signal.recorded_angles import estimate_bursts, mean_absolute_error_deg

if TYPE_CHECKING:
    from pathlib import Path

CIRCLE = {
    "vehicle.array.elements": 5,
    "vehicle.array.shape": {"kind": "circular"},
    "site.radio_heads[1].ssb_index": 2,  # one burst after the other
    "site.radio_heads[1].position_m": [250.0, -60.0, 30.0],
    "site.rician_k_db": 40.0,
}


@pytest.fixture(scope="module")
def circle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("circle")
    scenario = Scenario.load("paper-real-odometry-2").with_overrides(CIRCLE)
    drives.synthesize(scenario, directory, duration_s=3.0)
    return directory


def azimuth_errors_deg(cells: list[nr.Cell], recording: Recording) -> dict[int, list[float]]:
    annotations = json.loads(recording.metadata_json())["annotations"]
    errors: dict[int, list[float]] = {}
    for cell in cells:
        for it in annotations:
            ssb, truth = it["nr:ssb"], it["aoa:truth"]
            near = abs(ssb["ssb_first_sample_incl_cp"] - cell.sample_start) < 20
            if near and ssb["pci"] == cell.pci:
                assert cell.azimuth_rad is not None
                error = np.degrees(cell.azimuth_rad) + 90.0 - truth["azimuth_from_broadside_deg"]
                errors.setdefault(cell.pci, []).append((error + 180) % 360 - 180)
    return errors


def test_a_scan_reports_azimuth_and_elevation(circle: Path) -> None:
    recording = Recording.open(circle / "iq")
    cells = [cell for cell in nr.scan_as_recorded(recording).cells if cell.mib_bits]
    errors = azimuth_errors_deg(cells, recording)
    assert len(errors) == 2
    sigma_deg = np.degrees([cell.sigma_rad for cell in cells])
    for found in errors.values():
        assert np.abs(found).max() < 8 * sigma_deg.max()
    assert all(cell.angle_rad is None and cell.elevation_rad is not None for cell in cells)


def test_annotated_bursts_have_azimuths_too(circle: Path) -> None:
    error_deg = mean_absolute_error_deg(estimate_bursts(circle / "iq"))
    assert error_deg is not None
    assert error_deg < 3.0


def test_the_drive_is_located(circle: Path) -> None:
    drive = drives.locate(
        circle / "site.toml",
        circle / "odometry.csv",
        circle / "iq",
        vehicle=circle / "vehicle.toml",
    )
    assert drive.angles.filter(drive.angles["accepted"]).height > 200
    errors_m = drives.error_m(drive.poses, circle / "truth.tum")["error_m"]
    assert errors_m.max() < 0.5
    least = bound(Scenario.load("paper-real-odometry-2").with_overrides(CIRCLE), map_step_m=100.0)
    assert least.route["bound_m"].max() < 0.5


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"vehicle.array.shape": {"kind": "oval"}}, "circular"),
        ({"vehicle.array.elements": 2}, "array.shape"),
        ({"vehicle.array.phase_std_rad": 0.1}, "array.phase_std_rad"),
        (
            {"vehicle.array.shape": {"kind": "planar", "places_wavelengths": [[0.0, 0.0]]}},
            "array.shape",
        ),
    ],
)
def test_invalid_arrays_are_rejected(changes: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Scenario.load("paper-real-odometry-2").with_overrides(CIRCLE | changes)
