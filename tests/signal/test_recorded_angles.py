from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av.errors import InputError
from access_av.signal.recorded_angles import estimate_bursts, mean_absolute_error_deg

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import Finished

BURST = 400


def write(path: Path, azimuths_deg: list[float], **changes: Any) -> Path:
    """A recording with unknown channel phases: a reference and a target per azimuth."""
    rng = np.random.default_rng(3)
    phases = np.exp(1j * rng.uniform(-np.pi, np.pi, 4))
    places = (np.arange(4) - 1.5) * 0.458
    bursts, annotations = [], []
    for index, azimuth_deg in enumerate(azimuths_deg):
        for kind, angle_deg in (("reference", 0.0), ("target", azimuth_deg)):
            wave = np.exp(2j * np.pi * places * np.sin(np.radians(angle_deg)))
            noise = 0.05 * (rng.normal(size=(4, BURST, 2)) @ [1, 1j])
            bursts.append((phases * wave)[:, None] + noise)
            annotation = {
                "core:sample_start": BURST * (len(bursts) - 1),
                "core:sample_count": BURST,
                "core:label": f"{kind} {index}",
            }
            if kind == "target":
                annotation["aoa:truth"] = {"azimuth_from_broadside_deg": azimuth_deg}
            annotations.append(annotation)
    samples = np.concatenate(bursts, axis=1).T.astype("<c8")
    meta: dict[str, Any] = {
        "global": {
            "core:datatype": "cf32_le",
            "core:sample_rate": 1e6,
            "core:version": "1.2.0",
            "core:num_channels": 4,
            "core:description": "element spacing 0.15 m",
        },
        "captures": [{"core:sample_start": 0, "core:frequency": 0.458 * 299_792_458.0 / 0.15}],
        "annotations": annotations,
    }
    meta.update(changes)
    path.with_name(path.name + ".sigmf-meta").write_text(json.dumps(meta))
    path.with_name(path.name + ".sigmf-data").write_bytes(samples.tobytes())
    return path


def test_angles_of_a_calibrated_recording_have_the_correct_sign(tmp_path: Path) -> None:
    azimuths_deg = [-50.0, -10.0, 0.0, 35.0, 60.0]
    bursts = estimate_bursts(write(tmp_path / "array", azimuths_deg))
    assert [burst.sample_start for burst in bursts] == [BURST * (2 * k + 1) for k in range(5)]
    for burst, azimuth_deg in zip(bursts, azimuths_deg, strict=True):
        # The noise of the reference adds to that of the burst.
        assert abs(burst.azimuth_deg - azimuth_deg) < 6 * burst.sigma_deg


@pytest.mark.parametrize(("array", "bound_deg"), [(1, 2.5), (2, 2.9), (3, 6.4)])
def test_angles_of_real_recordings_have_the_documented_error(
    data: Path, array: int, bound_deg: float
) -> None:
    error_deg = mean_absolute_error_deg(
        estimate_bursts(data / "captures" / f"aoa4_day1_array{array}")
    )
    assert error_deg is not None
    assert error_deg <= bound_deg


def test_the_json_output_has_the_documented_keys(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    done = access_av("record", "aoa", str(write(tmp_path / "array", [20.0])), "--json")
    (burst,) = json.loads(done.out)
    assert set(burst) >= {"sample_start", "azimuth_deg", "sigma_deg", "truth_deg"}
    assert access_av("record", "aoa", str(tmp_path / "array"), columns=60).code == 0


def test_missing_parts_are_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="`annotations` is missing"):
        estimate_bursts(write(tmp_path / "a", [20.0], annotations=[]))
    silent = {"core:datatype": "cf32_le", "core:sample_rate": 1e6, "core:version": "1.2.0"}
    with pytest.raises(InputError, match="--spacing"):
        estimate_bursts(
            write(tmp_path / "b", [20.0], **{"global": {**silent, "core:num_channels": 4}})
        )
    with pytest.raises(InputError, match="at least two"):
        estimate_bursts(write(tmp_path / "c", [20.0], **{"global": silent}))


def test_truncated_data_ends_with_exit_code_2(
    access_av: Callable[..., Finished], tmp_path: Path
) -> None:
    path = write(tmp_path / "array", [20.0])
    file = path.with_name("array.sigmf-data")
    file.write_bytes(file.read_bytes()[:-5])
    done = access_av("record", "aoa", str(path))
    assert done.code == 2
    assert "array" in done.err
    assert "Traceback" not in done.err
