"""The examples of docs/outlook.md, compared with known results."""

from __future__ import annotations

import runpy
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from conftest import ROOT


@pytest.fixture(scope="module")
def imperfect() -> SimpleNamespace:
    sys.path.insert(0, str(ROOT / "examples/learned"))
    try:
        return SimpleNamespace(**runpy.run_path(str(ROOT / "examples/learned/imperfect.py")))
    finally:
        sys.path.pop(0)


def test_calibration_with_known_directions_estimates_the_array(imperfect: SimpleNamespace) -> None:
    random = np.random.default_rng(4)
    array = imperfect.imperfect_array(random)
    known = imperfect.looks(random, array, np.full(500, 20.0))
    found = imperfect.calibrate(*known)
    # Up to one complex factor, which no angle depends on.
    factor = np.vdot(found, array) / np.vdot(found, found)
    assert np.linalg.norm(array - factor * found) < 0.01 * np.linalg.norm(array)
    phase_rad, channels = imperfect.looks(random, array, np.full(2000, 10.0))
    errors = [
        imperfect.rms(imperfect.maximum_likelihood(channels, each), phase_rad)
        for each in (np.eye(imperfect.ELEMENTS), found, array)
    ]
    assert errors[1] == pytest.approx(errors[2], rel=0.02)
    assert errors[0] > 5.0 * errors[2]


def test_offset_and_scale_correct_an_array_with_linear_phase_errors(
    imperfect: SimpleNamespace,
) -> None:
    """An array without coupling and with a phase linear in the antenna has no residual."""
    random = np.random.default_rng(5)
    array = np.diag(np.exp(0.1j * np.arange(imperfect.ELEMENTS)))
    known = imperfect.looks(random, array, np.full(500, 20.0))
    corrected = imperfect.survey(*known)
    phase_rad, channels = imperfect.looks(random, array, np.full(2000, 20.0))
    ideal = imperfect.maximum_likelihood(channels, np.eye(imperfect.ELEMENTS))
    best = imperfect.maximum_likelihood(channels, array)
    assert imperfect.rms(ideal, phase_rad) == pytest.approx(0.1, rel=0.05)
    assert imperfect.rms(corrected(ideal), phase_rad) < 1.3 * imperfect.rms(best, phase_rad)


def test_ranging_bounds_scale_with_bandwidth_and_power() -> None:
    ranging = SimpleNamespace(**runpy.run_path(str(ROOT / "examples/outlook/ranging.py")))
    assert ranging.REFERENCES.size == 144
    delay_m, phase_mm = ranging.bounds(10.0, 15e3)
    # Twice the bandwidth halves the delay, ten times the power divides both by the root of ten.
    assert ranging.bounds(10.0, 30e3)[0] == pytest.approx(0.5 * delay_m)
    assert np.array(ranging.bounds(20.0, 15e3)) == pytest.approx(
        np.array([delay_m, phase_mm]) / np.sqrt(10.0)
    )
