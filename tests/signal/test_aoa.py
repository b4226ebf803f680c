"""Public functions of `access_av.aoa`."""

from __future__ import annotations

import doctest
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import aoa

if TYPE_CHECKING:
    from collections.abc import Callable

METHODS = [aoa.music, aoa.root_music, aoa.esprit, aoa.maximum_likelihood]
SEVERAL = METHODS[:3]


def gaussian(rng: np.random.Generator, *shape: int) -> Any:
    return (rng.normal(size=(*shape, 2)) @ [1, 1j]) / np.sqrt(2)


def simulate(angles_rad: Any, snr_db: float, seed: int = 1, antennas: int = 4) -> Any:
    """One source per item: `(batch, antennas, 20)` in unit noise."""
    rng = np.random.default_rng(seed)
    angles_rad = np.atleast_1d(angles_rad)
    steering = np.exp(1j * np.pi * np.cos(angles_rad)[:, None] * np.arange(antennas))
    signal = 10 ** (snr_db / 20) * gaussian(rng, len(angles_rad), 1, 20)
    return steering[:, :, None] * signal + gaussian(rng, len(angles_rad), antennas, 20)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("snr_db", [10, 20, 30])
def test_rmse_is_near_the_bound(method: Callable[..., Any], snr_db: float) -> None:
    angles = np.radians(np.random.default_rng(3).uniform(20, 160, 4000))
    found = method(simulate(angles, snr_db))
    rmse = np.sqrt(np.mean((found.angle_rad - angles) ** 2))
    bound = np.sqrt(np.mean(aoa.crb_rad(angles, snr_db) ** 2))
    assert rmse / bound <= (1.14 if method is aoa.esprit else 1.08)
    # The reported standard deviation is correct.
    assert 0.9 < np.mean(((found.angle_rad - angles) / found.sigma_rad) ** 2) < 1.2
    assert np.median(found.snr_db) == pytest.approx(snr_db, abs=0.5)
    assert found.resolved.mean() > 0.99


@pytest.mark.parametrize("method", METHODS)
def test_a_single_call_returns_numbers(method: Callable[..., Any]) -> None:
    found = method(simulate(1.0, 20)[0])
    for field in ("angle_rad", "sigma_rad", "phase_rad", "phase_sigma_rad", "snr_db"):
        assert type(getattr(found, field)) is float
    assert found.verdict == "resolved"
    assert found.resolved is True
    assert found.phase_rad == pytest.approx(np.pi * np.cos(found.angle_rad))
    assert repr(found).startswith("AngleEstimate(angle_rad=1.0")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("antennas", range(2, 9))
def test_a_batch_gives_what_single_calls_give(method: Callable[..., Any], antennas: int) -> None:
    batch = simulate(np.linspace(0.3, 2.8, 30), 15, antennas=antennas)
    found = method(batch)
    assert found.angle_rad.shape == found.verdict.shape == found.resolved.shape == (30,)
    for item in (0, 7, 29):
        single = method(batch[item])
        assert found.angle_rad[item] == pytest.approx(single.angle_rad, abs=1e-9)
        assert found.sigma_rad[item] == pytest.approx(single.sigma_rad, rel=1e-6)
        assert found.verdict[item] == single.verdict
    narrow = method(batch.astype(np.complex64))
    assert narrow.angle_rad == pytest.approx(found.angle_rad, abs=1e-4)
    threaded = method(batch, threads=3)
    assert np.array_equal(threaded.angle_rad, found.angle_rad)


@pytest.mark.parametrize("method", METHODS)
def test_arrays_with_any_strides_give_equal_angles(method: Callable[..., Any]) -> None:
    batch = simulate(np.linspace(0.5, 2.5, 10), 20)
    expected = method(batch).angle_rad
    wide = np.zeros((10, 4, 40), complex)
    wide[:, :, ::2] = batch
    read_only = batch.copy()
    read_only.flags.writeable = False
    unaligned = np.frombuffer(b"x" + batch.tobytes(), np.complex128, offset=1).reshape(batch.shape)
    transposed = np.ascontiguousarray(batch.transpose(2, 0, 1)).transpose(1, 2, 0)
    for view in (
        wide[:, :, ::2],
        np.asfortranarray(batch),
        transposed,
        batch[::-1].copy()[::-1],
        read_only,
        unaligned,
    ):
        assert np.array_equal(method(view).angle_rad, expected)
    assert method(np.asfortranarray(batch[3])).angle_rad == pytest.approx(expected[3], abs=1e-9)


@pytest.mark.parametrize("method", SEVERAL)
def test_two_sources_are_exact_with_an_exact_covariance(method: Callable[..., Any]) -> None:
    # Orthogonal waveforms without noise: the sample covariance is exact.
    truth = np.array([64.0, 103.0])
    steering = np.exp(1j * np.pi * np.cos(np.radians(truth)) * np.arange(4)[:, None])
    waveforms = np.exp(2j * np.pi * np.outer([1, 5], np.arange(20)) / 20)
    found = method(steering @ waveforms, sources=2)
    assert found.angle_rad.shape == (2,)
    assert np.abs(np.degrees(found.angle_rad) - truth).max() <= 1e-6
    batch = method(np.stack([steering @ waveforms] * 3), sources=2)
    assert batch.angle_rad.shape == batch.verdict.shape == (3, 2)


@pytest.mark.parametrize("method", METHODS)
def test_constant_snapshots_are_as_good_as_random_ones(method: Callable[..., Any]) -> None:
    rng = np.random.default_rng(5)
    angles = np.radians(rng.uniform(20, 160, 2000))
    steering = np.exp(1j * np.pi * np.cos(angles)[:, None] * np.arange(4))
    snapshots = 10 * steering[:, :, None] + gaussian(rng, 2000, 4, 20)
    rmse = np.sqrt(np.mean((method(snapshots).angle_rad - angles) ** 2))
    bound = np.sqrt(np.mean(aoa.crb_rad(angles, 20, model="deterministic") ** 2))
    assert rmse / bound < 1.14


def test_esprit_accepts_least_and_total_least_squares() -> None:
    angles = np.radians([100, 65])  # -10 and 25 degrees from broadside
    steering = np.exp(1j * np.pi * np.cos(angles) * np.arange(8)[:, None])
    waveforms = np.exp(2j * np.pi * np.outer([1, 3], np.arange(16)) / 16)
    for total_least_squares in (False, True):
        found = aoa.esprit(steering @ waveforms, sources=2, total_least_squares=total_least_squares)
        assert np.sort(found.angle_rad) == pytest.approx(np.sort(angles), abs=1e-9)


def test_the_covariance_does_not_subtract_the_mean() -> None:
    snapshots = simulate([1.0, 2.0], 3)
    expected = snapshots @ snapshots.conj().swapaxes(1, 2) / 20
    assert aoa.covariance(snapshots) == pytest.approx(expected)
    assert aoa.covariance(snapshots[0]) == pytest.approx(expected[0])
    assert aoa.covariance(np.ones((2, 3), np.complex64)) == pytest.approx(np.ones((2, 2)))
    exchange = np.eye(4)[::-1]
    average = (expected + exchange @ expected.conj() @ exchange) / 2
    assert aoa.forward_backward(expected) == pytest.approx(average)
    assert aoa.forward_backward(expected[1]) == pytest.approx(average[1])


def test_coherent_sources_require_forward_backward_averaging() -> None:
    truth = np.radians([60, 105])
    steering = np.exp(1j * np.pi * np.cos(truth) * np.arange(4)[:, None])
    coherent = np.outer(steering @ [1, 0.8 * np.exp(1j)], np.ones(10))
    found = aoa.root_music(coherent, sources=2, forward_backward=True)
    assert found.angle_rad == pytest.approx(truth, abs=1e-6)


def test_the_number_of_sources_is_estimated() -> None:
    rng = np.random.default_rng(6)
    steering = np.exp(1j * np.pi * np.cos([0.9, 1.6]) * np.arange(4)[:, None])
    snapshots = 3 * steering @ gaussian(rng, 100, 2, 80) + gaussian(rng, 100, 4, 80)
    assert (aoa.estimate_sources(snapshots) == 2).mean() > 0.97
    assert (aoa.estimate_sources(snapshots, criterion="aic") == 2).mean() > 0.8
    assert type(aoa.estimate_sources(snapshots[0])) is int


@pytest.mark.parametrize("method", METHODS)
def test_a_reference_burst_calibrates_the_channels(method: Callable[..., Any]) -> None:
    gains = np.array([1, 0.8 * np.exp(2j), 1.2 * np.exp(-1j), 0.9j])
    found = aoa.calibrate(gains[:, None] * simulate(1.1, 60)[0], 1.1)
    assert np.mean(np.abs(found) ** 2) == pytest.approx(1)
    scale = np.sqrt(np.mean(np.abs(gains) ** 2))
    assert found == pytest.approx(gains / scale, abs=1e-2)
    angles = np.linspace(0.5, 2.5, 9)
    measured = gains[:, None] * simulate(angles, 60)
    assert method(measured, calibration=found).angle_rad == pytest.approx(angles, abs=2e-3)


def test_element_spacing_is_used() -> None:
    steering = np.exp(2j * np.pi * 0.458 * np.cos(0.9) * np.arange(4))
    snapshots = np.outer(steering, np.ones(5))
    for method in METHODS:
        assert method(snapshots, spacing_wavelengths=0.458).angle_rad == pytest.approx(0.9)
    found = aoa.music(snapshots, spacing_wavelengths=1.4)
    assert found.verdict.startswith("unresolved: several directions fit")


def test_cramer_rao_bounds_equal_closed_forms() -> None:
    assert aoa.crb_rad(np.pi / 2, 10) == pytest.approx(
        np.sqrt(6 * (1 + 40) / (20 * 100 * 16 * 15)) / np.pi
    )
    angles = np.radians([60, 90, 120])
    one = aoa.crb_rad(angles, 10, model="deterministic")
    together = aoa.crb_rad(angles, [10, 10, 10], model="deterministic", joint=True)
    assert together.shape == (3,)
    assert (together > one).all()
    known = aoa.crb_rad(angles, 10, model="known", joint=True)
    assert known == pytest.approx(one)
    phase = aoa.crb_rad(angles, 10, quantity="phase")
    assert phase == pytest.approx(aoa.crb_rad(angles, 10) * np.pi * np.sin(angles))


GOOD = simulate(1.0, 10)[0]


@pytest.mark.parametrize(
    ("snapshots", "message"),
    [
        (GOOD[0], r"shape \(antennas, snapshots\) or .*not \[20\]"),
        (GOOD[None, None], "shape"),
        (GOOD[:1], "2 to 16 antennas are allowed, not 1"),
        (np.ones((17, 20), complex), "2 to 16 antennas are allowed, not 17"),
        (GOOD[:, :0], "at least one snapshot"),
        (GOOD.real.copy(), "complex64 or complex128, not dtype float64"),
        ([[1j, 2], [3, 4]], "ndarray of complex64 or complex128, not <class 'list'>"),
        (GOOD * np.nan, "finite"),
        (GOOD * np.inf, "finite"),
        (GOOD * 0, "must not all be zero"),
        (np.stack([GOOD, GOOD * 0]), "item 1: .*zero"),
        (np.concatenate([np.stack([GOOD] * 99), GOOD[None] * np.nan]), "item 99: .*finite"),
    ],
)
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_invalid_snapshots_are_rejected(
    method: Callable[..., Any], snapshots: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        method(snapshots)


@pytest.mark.parametrize(
    ("method", "options", "message"),
    [
        (aoa.music, {"sources": 4}, "4 sources requested; allowed are 1 to 3"),
        (aoa.root_music, {"sources": 0}, "allowed are 1 to 3"),
        (aoa.maximum_likelihood, {"sources": 4}, "allowed are 1 to 3"),
        (aoa.esprit, {"spacing_wavelengths": 0.0}, "0.01 to 100 wavelengths, not 0"),
        (aoa.music, {"spacing_wavelengths": float("nan")}, "0.01 to 100 wavelengths"),
        (aoa.music, {"calibration": [1, 1]}, "one gain per antenna: 4, not 2"),
        (aoa.music, {"calibration": [1, 1, 0, 1]}, "channel 2 must be finite and not zero"),
        (aoa.music, {"calibration": "nothing"}, "one complex gain per antenna"),
    ],
)
def test_invalid_options_are_rejected(
    method: Callable[..., Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        method(GOOD, **options)


def test_invalid_threads_criteria_and_covariances_are_rejected() -> None:
    with pytest.raises(ValueError, match="`threads` is 0; it must be between 1 and 1024"):
        aoa.music(GOOD[None], threads=0)
    with pytest.raises(ValueError, match="'mdl' or 'aic', not 'bic'"):
        aoa.estimate_sources(GOOD, criterion="bic")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="between 0 and pi"):
        aoa.calibrate(GOOD, 4.0)
    with pytest.raises(ValueError, match=r"shape \(antennas, snapshots\)"):
        aoa.calibrate(GOOD[None], 1.0)
    with pytest.raises(ValueError, match="shape"):
        aoa.forward_backward(np.ones((3, 4)))
    with pytest.raises(ValueError, match="finite"):
        aoa.crb_rad(np.nan, 10)
    with pytest.raises(ValueError, match="cannot be separated"):
        aoa.crb_rad([1.0, 1.0], 10, joint=True)
    with pytest.raises(ValueError, match="sources requested"):
        aoa.crb_rad([0.5, 1.0, 1.5, 2.0], 10, joint=True)
    with pytest.raises(ValueError, match="'stochastic', 'deterministic' or 'known'"):
        aoa.crb_rad(1.0, 10, model="best")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", [None, *aoa.__all__])
def test_examples_in_docstrings_run(name: str | None) -> None:
    documented = aoa if name is None else getattr(aoa, name)
    assert documented.__doc__
    example = doctest.DocTestParser().get_doctest(documented.__doc__, {}, str(name), None, 0)
    assert doctest.DocTestRunner().run(example).failed == 0


def test_coherent_sources_are_resolved_by_subarrays() -> None:
    rng = np.random.default_rng(5)
    angles = np.radians([60, 100])
    steering = np.exp(1j * np.pi * np.cos(angles) * np.arange(6)[:, None])
    waveform = rng.normal(size=(100, 2)) @ [1, 1j]
    reflected = np.stack([waveform, 0.8 * waveform])  # rank one
    noise = 0.05 * (rng.normal(size=(6, 100, 2)) @ [1, 1j])
    samples = steering @ reflected + noise
    for method in (aoa.music, aoa.root_music, aoa.esprit):
        alone = method(samples, sources=2)
        assert all("correlated" in verdict for verdict in alone.verdict)
        found = method(samples, sources=2, subarray=4, forward_backward=True)
        assert found.resolved.all()
        assert (abs(found.angle_rad - angles) < 4 * found.sigma_rad).all()
        with pytest.raises(ValueError, match="2 to 6 antennas, not 7"):
            method(samples, subarray=7)
    # Maximum likelihood needs no subarrays.
    found = aoa.maximum_likelihood(samples, sources=2)
    assert found.resolved.all()
    assert (abs(found.angle_rad - angles) < 4 * found.sigma_rad).all()


@pytest.mark.parametrize("subarray", range(7, 17))
def test_subarrays_of_sixteen_antennas_resolve_coherent_sources(subarray: int) -> None:
    rng = np.random.default_rng(7)
    angles = np.radians([70, 100])
    steering = np.exp(1j * np.pi * np.cos(angles) * np.arange(16)[:, None])
    waveform = rng.normal(size=(50, 2)) @ [1, 1j]
    noise = 0.05 * (rng.normal(size=(16, 50, 2)) @ [1, 1j])
    samples = steering @ np.stack([waveform, -0.8 * waveform]) + noise
    found = aoa.root_music(samples, sources=2, subarray=subarray)
    # With all sixteen antennas, there is no average over subarrays.
    assert found.resolved.all() == (subarray < 16)
    if subarray < 16:
        assert (abs(found.angle_rad - angles) < 4 * found.sigma_rad).all()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_supports_sixteen_antennas(method: Callable[..., Any]) -> None:
    rng = np.random.default_rng(6)
    steering = np.exp(1j * np.pi * np.cos(1.1) * np.arange(16)[:, None])
    noise = 0.3 * (rng.normal(size=(16, 20, 2)) @ [1, 1j])
    found = method(steering * (rng.normal(size=(20, 2)) @ [1, 1j]) + noise)
    assert found.resolved
    assert abs(found.angle_rad - 1.1) < 4 * found.sigma_rad
    assert found.phase_sigma_rad < 2.0 * aoa.crb_rad(
        1.1, found.snr_db, antennas=16, quantity="phase"
    )


def test_spectra_peak_at_the_sources() -> None:
    rng = np.random.default_rng(6)
    angles = np.radians([50, 110])
    steering = np.exp(1j * np.pi * np.cos(angles) * np.arange(8)[:, None])
    signals = rng.normal(size=(2, 200, 2)) @ [1, 1j]
    samples = steering @ signals + 0.1 * (rng.normal(size=(8, 200, 2)) @ [1, 1j])
    grid = np.radians(np.arange(0, 181))
    for method in ("bartlett", "capon", "music"):
        values = aoa.spectrum(samples, grid, method=method, sources=2)
        inner = (values[1:-1] > values[:-2]) & (values[1:-1] > values[2:])
        peaks = 1 + np.flatnonzero(inner)
        strongest = sorted(peaks[np.argsort(values[peaks])[-2:]])
        assert np.allclose(strongest, [50, 110], atol=2), method
        batch = aoa.spectrum(np.stack([samples, samples]), grid, method=method, sources=2)
        assert batch.shape == (2, 181)
        assert np.array_equal(batch[1], values)
    with pytest.raises(ValueError, match="'bartlett', 'capon' or 'music'"):
        aoa.spectrum(samples, grid, method="esprit")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="between 0 and pi"):
        aoa.spectrum(samples, [-1.0])


def test_values_outside_the_limits_are_rejected() -> None:
    samples = np.ones((4, 4), complex)
    for call, message in (
        (lambda: aoa.music(samples, spacing_wavelengths=1e-300), "0.01 to 100"),
        (lambda: aoa.estimate_sources(samples), "at least 5 are needed"),
        (lambda: aoa.music(np.ones((2, 4, 9), complex), threads=6000), "between 1 and 1024"),
    ):
        with pytest.raises(ValueError, match=message):
            call()


TURNS = 2 * np.pi * np.arange(5) / 5
CIRCLE = 0.425 * np.stack([np.cos(TURNS), np.sin(TURNS)], axis=1)


def towards(azimuth_rad: Any, elevation_rad: Any) -> Any:
    """Snapshots of the circle: `(batch, 5, 1)`."""
    flat = np.stack([np.cos(azimuth_rad), np.sin(azimuth_rad)], axis=-1)
    return np.exp(2j * np.pi * np.cos(elevation_rad)[:, None] * (flat @ CIRCLE.T))[:, :, None]


def test_a_circle_finds_azimuth_and_elevation_at_the_bound() -> None:
    rng = np.random.default_rng(8)
    azimuth, elevation = rng.uniform(-np.pi, np.pi, 1000), rng.uniform(0.4, 1.2, 1000)
    signal = 10 * gaussian(rng, 1000, 1, 20)
    snapshots = towards(azimuth, elevation) * signal + gaussian(rng, 1000, 5, 20)
    found = aoa.direction(snapshots, CIRCLE)
    turned = (found.azimuth_rad - azimuth + np.pi) % (2 * np.pi) - np.pi
    errors = np.stack([turned, found.elevation_rad - elevation], axis=1)
    bounds = [
        aoa.direction_crb_rad(CIRCLE, az, el, 20) for az, el in zip(azimuth, elevation, strict=True)
    ]
    ratio = np.sqrt(np.mean(errors**2, axis=0) / np.mean(np.square(bounds), axis=0))
    assert ratio.max() < 1.1
    weighted = np.linalg.solve(found.covariance, errors[:, :, None])[:, :, 0]
    assert 1.8 < np.mean(np.sum(errors * weighted, axis=1)) < 2.2
    assert found.resolved.mean() > 0.98
    assert found.verdict.shape == found.azimuth_sigma_rad.shape == (1000,)
    single = aoa.direction(snapshots[3], CIRCLE)
    assert type(single.azimuth_rad) is float
    assert single.azimuth_rad == found.azimuth_rad[3]
    assert single.covariance.shape == (2, 2)
    assert single.verdict == "resolved"
    assert repr(single).startswith("DirectionEstimate(azimuth_rad=")
    level = aoa.direction(snapshots[3], CIRCLE, elevations_rad=(elevation[3], elevation[3]))
    assert (level.elevation_rad, level.elevation_sigma_rad) == (elevation[3], 0)


def test_a_spectrum_over_azimuth_and_elevation_peaks_at_the_source() -> None:
    snapshots = towards(np.array([1.0]), np.array([0.6]))[0] * np.ones(9)
    azimuths, elevations = np.linspace(-3, 3, 61), np.linspace(0, 1.5, 16)
    for method in ("bartlett", "music"):
        look = aoa.direction_spectrum(snapshots, CIRCLE, azimuths, elevations, method=method)
        row, column = np.unravel_index(np.argmax(look), look.shape)
        assert (azimuths[column], elevations[row]) == pytest.approx((1.0, 0.6))
    batch = aoa.direction_spectrum(np.stack([snapshots] * 3), CIRCLE, azimuths, elevations)
    assert batch.shape == (3, 16, 61)


@pytest.mark.parametrize(
    ("places", "options", "message"),
    [
        (CIRCLE[:4], {}, "one row per antenna: 5, not 4"),
        (CIRCLE[:, :1], {}, "antennas, 2 or 3"),
        ("nowhere", {}, "antennas, 2 or 3"),
        (CIRCLE * np.nan, {}, "element 0 must be within 100 wavelengths"),
        (CIRCLE * [0, 1], {}, "all elements are on one line"),
        (CIRCLE * 0, {}, "elements 0 and 1 have the same position"),
        (CIRCLE, {"elevations_rad": (1.0, 0.5)}, "elevations must ascend"),
        (CIRCLE, {"calibration": [1, 1]}, "one gain per antenna: 5, not 2"),
    ],
)
def test_invalid_antenna_positions_are_rejected(
    places: Any, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        aoa.direction(np.ones((5, 4), complex), places, **options)


def test_a_misfit_of_the_plane_wave_is_reported() -> None:
    rng = np.random.default_rng(21)
    count = 400
    noise = rng.normal(size=(count, 4, 20, 2)) @ [1, 1j] / np.sqrt(2)
    waveform = 10 * (rng.normal(size=(count, 1, 20, 2)) @ [1, 1j]) / np.sqrt(2)
    direct, echo = (np.exp(1j * phase * np.arange(4))[:, None] for phase in (0.4, -1.3))
    clean = aoa.maximum_likelihood(direct * waveform + noise)
    # False-alarm rate of 1 %, within statistical limits.
    assert clean.reliable.mean() == pytest.approx(0.99, abs=0.02)
    assert clean.p_value.mean() == pytest.approx(0.5, abs=0.1)
    named = aoa.maximum_likelihood((direct + 0.5j * echo) * waveform + noise)
    assert not named.reliable.any()
    assert np.char.startswith(named.doubt, "not a plane wave").mean() > 0.97
    assert (named.phase_sigma_rad > 2 * named.phase_noise_sigma_rad).all()
    other = 10 * (rng.normal(size=(count, 1, 20, 2)) @ [1, 1j]) / np.sqrt(2)
    two = aoa.maximum_likelihood(direct * waveform + echo * other + noise)
    assert np.char.startswith(two.doubt, "residual is not white noise").mean() > 0.9
    single = aoa.maximum_likelihood((direct + 0.5j * echo) * waveform[0] + noise[0])
    assert type(single.p_value) is float
    assert single.p_value < 0.01


def test_a_known_noise_variance_gives_consistent_pilot_estimates() -> None:
    rng = np.random.default_rng(22)
    phases = rng.uniform(-2.8, 2.8, 1000)
    steering = np.exp(1j * phases[:, None, None] * np.arange(4)[:, None])
    gains = 8 * np.exp(2j * np.pi * rng.uniform(size=(1000, 1, 4)))
    noise = rng.normal(size=(1000, 4, 4, 2)) @ [1, 1j] / np.sqrt(2)
    noise[:, 3] *= 3
    equal = aoa.maximum_likelihood_pilots(
        steering * gains + noise * [[1], [1], [1], [1 / 3]], noise_variance=1.0
    )
    unequal = aoa.maximum_likelihood_pilots(
        steering * gains + noise, noise_variance=[1.0, 1.0, 1.0, 9.0]
    )
    for found in (equal, unequal):
        z = (found.phase_rad - phases + np.pi) % (2 * np.pi) - np.pi
        # Four standard deviations of a mean of squares.
        assert np.mean((z / found.phase_sigma_rad) ** 2) == pytest.approx(1, abs=0.2)
        assert found.reliable.mean() > 0.97
    for wrong, message in (
        (-1.0, "noise_variance must be"),
        ([1.0, 1.0], "one number per antenna: 4, not 2"),
        ("much", "one number or one number per antenna"),
    ):
        with pytest.raises(ValueError, match=message):
            aoa.maximum_likelihood_pilots(np.ones((4, 3), complex), noise_variance=wrong)


def test_a_measured_manifold_resolves_several_sources() -> None:
    turns = np.arange(120) / 120 * 2 * np.pi
    flat = np.stack([np.cos(turns), np.sin(turns)])
    coupling = np.eye(5) + 0.2 * (np.eye(5, k=1) + np.eye(5, k=-1))
    table = aoa.MeasuredManifold((coupling @ np.exp(2j * np.pi * CIRCLE[:, :2] @ flat)).T)
    truth = np.array([-1.1, 0.9])
    towards_both = np.exp(2j * np.pi * CIRCLE[:, :2] @ [np.cos(truth), np.sin(truth)])
    rng = np.random.default_rng(23)
    signals = 30 * (rng.normal(size=(2, 60, 2)) @ [1, 1j])
    noise = rng.normal(size=(5, 60, 2)) @ [1, 1j]
    received = coupling @ towards_both @ signals + noise
    found = aoa.direction(received, table, elevations_rad=(0, 0), sources=2)
    assert found.azimuth_rad.shape == (2,)
    assert found.covariance.shape == (2, 2, 2)
    assert np.abs(found.azimuth_rad - truth).max() < 6 * found.azimuth_sigma_rad.max()
    batch = aoa.direction(np.stack([received] * 3), table, elevations_rad=(0, 0), sources=2)
    assert batch.azimuth_rad.shape == (3, 2)
    # A manifold without coupling is reported as a misfit.
    assert not aoa.direction(received, CIRCLE, elevations_rad=(0, 0), sources=2).reliable.any()
    with pytest.raises(ValueError, match="5 sources requested; allowed are 1 to 4"):
        aoa.direction(received, table, elevations_rad=(0, 0), sources=5)
    for responses, elevations in ((np.ones((3, 5)), None), (np.ones(5), None), (table, None)):
        with pytest.raises(ValueError, match=r"responses|four azimuths"):
            aoa.MeasuredManifold(responses, elevations)
