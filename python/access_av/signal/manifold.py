"""Fits array manifolds to measured snapshots.

Public interface: `access_av.aoa`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from access_av._core.aoa import MeasuredManifold

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


# Azimuths of a fitted table, one degree apart: cubics between them are exact to 1e-9.
_AZIMUTHS = 360
# Maximum number of Fourier terms that cross-validation tries.
_MOST_TERMS = 5
# Rounds of gains, coefficients and orientations. Each of the last ones changes an orientation by
# less than 0.1 degrees.
_ROUNDS = 8
# Regularization of the coefficients, relative to the trace of the normal equations: far below what
# noise changes.
_RIDGE = 1e-12
# Parts of the snapshots that are left out in turn: up to eight groups, one by one.
_FOLDS = 8


@dataclass(frozen=True, eq=False)
class ManifoldFit:
    """A manifold fitted by `fit_manifold`.

    Attributes
    ----------
    manifold
        For `direction`, `direction_spectrum` and `direction_crb_rad`.
    responses
        The table of `manifold`, ``(azimuths, antennas)``, at azimuths ``2 pi i / azimuths``.
    terms
        Order of the Fourier series, selected by cross-validation.
    orientations_rad
        Rotation of the array in each group, by the group's label: azimuth in the array's frame
        minus the given azimuth. 0 if the orientation is known.
    residual
        Share of each snapshot's power that the manifold does not explain, ``(snapshots,)``, 0 to 1.
    azimuth_error_rad
        Azimuth of each snapshot, estimated by a manifold that was fitted without it,
        minus the given azimuth, in ``(-pi, pi]``.
    sigma_rad
        RMS of `azimuth_error_rad`, including outliers by reflections, because reflections are as
        frequent at other positions. To be added in quadrature to the standard deviation of an
        estimate, which does not contain the error of the manifold.
    """

    manifold: MeasuredManifold
    responses: NDArray[np.complex128]
    terms: int
    orientations_rad: dict[object, float]
    residual: NDArray[np.float64]
    azimuth_error_rad: NDArray[np.float64]
    sigma_rad: float


class _Series:
    """Responses of the positions times a Fourier series in the azimuth for each antenna."""

    def __init__(self, places: NDArray[np.float64] | None, coefficients: NDArray[np.complex128]):
        self.places, self.coefficients = places, coefficients
        self.table = self.at(_grid())
        lengths = np.linalg.norm(self.table, axis=1, keepdims=True)
        self.directions = self.table / np.maximum(lengths, 1e-12)

    def at(self, azimuths: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Returns the responses, ``(azimuths, antennas)``."""
        order = self.coefficients.shape[1] // 2
        series = _harmonics(azimuths, order) @ self.coefficients.T
        responses: NDArray[np.complex128] = _geometry(self.places, azimuths) * series
        return responses

    def azimuths(
        self, snapshots: NDArray[np.complex128]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns each snapshot's azimuth of the maximum, and its unexplained share of power."""
        beams = np.abs(snapshots.conj() @ self.directions.T) ** 2
        best = beams.argmax(axis=1)
        rows = np.arange(len(beams))
        before, here = beams[rows, best - 1], beams[rows, best]
        after = beams[rows, (best + 1) % _AZIMUTHS]
        bend = np.minimum(before - 2 * here + after, -1e-300)
        place = best + np.clip(0.5 * (before - after) / bend, -0.5, 0.5)
        left = 1 - here / np.maximum(np.sum(np.abs(snapshots) ** 2, axis=1), 1e-300)
        return wrapped(place * (2 * np.pi / _AZIMUTHS)), np.clip(left, 0, 1)

    def misfits(
        self, snapshots: NDArray[np.complex128], azimuths: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Returns each unit-length snapshot's share of power outside the response."""
        expected = self.at(azimuths)
        power = np.maximum(np.sum(np.abs(expected) ** 2, axis=1), 1e-300)
        left: NDArray[np.float64] = (
            1 - np.abs(np.sum(snapshots * expected.conj(), axis=1)) ** 2 / power
        )
        return left


def fit_manifold(
    snapshots: ArrayLike,
    azimuths_rad: ArrayLike,
    *,
    places_wavelengths: ArrayLike | None = None,
    groups: ArrayLike | None = None,
    unknown_orientation: bool = False,
    terms: int | None = None,
) -> ManifoldFit:
    """Fits the manifold of an array to snapshots of single sources at known azimuths.

    The response of antenna ``n`` is that of its position, ``exp(2j pi (x cos(azimuth) + y
    sin(azimuth)))``, times a Fourier series ``sum c[n, k] exp(1j k azimuth)`` of ``k = -terms ..
    terms``. The series represents gains, coupling, patterns of the elements and errors of their
    places; without places it represents the geometry too. Coefficients are fitted by least squares,
    alternating with the gain of every snapshot; snapshots that fit badly, such as those with
    reflections, get small weights (Cauchy).

    Parameters
    ----------
    snapshots
        Complex, ``(antennas, snapshots)``; 2 to 16 antennas. Phases alone are allowed: samples of
        modulus one.
    azimuths_rad
        Azimuth of the source of each snapshot, counter-clockwise from the x axis, ``(snapshots,)``.
    places_wavelengths
        Places ``(x, y)`` of the antennas in wavelengths, ``(antennas, 2)``.
    groups
        Label of each snapshot, for example of the position where it was measured. Cross-validation
        leaves out whole groups, because errors within one are correlated. Each snapshot is its own
        group by default.
    unknown_orientation
        Whether the array's orientation is unknown in every group. It is then estimated for each;
        needs `places_wavelengths`, which the frame of the result follows, and sources in two
        directions or more per group.
    terms
        Order of the series; selected by cross-validation by default.

    Raises
    ------
    ValueError
        Shapes that do not fit, values that are not finite, too few snapshots, or an unknown
        orientation without places or groups.

    Examples
    --------
    >>> import numpy as np
    >>> from access_av import aoa
    >>> places = 0.2 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    >>> azimuths = np.radians(np.arange(0, 360, 10))
    >>> towards = np.stack([np.cos(azimuths), np.sin(azimuths)])
    >>> coupling = np.eye(4) + 0.2 * np.roll(np.eye(4), 1, axis=0)
    >>> snapshots = coupling @ np.exp(2j * np.pi * places @ towards)
    >>> fit = aoa.fit_manifold(snapshots, azimuths, places_wavelengths=places, terms=5)
    >>> bool(np.abs(fit.azimuth_error_rad).max() < np.radians(0.5))
    True
    """
    received, azimuths, places, labels = _checked(
        snapshots, azimuths_rad, places_wavelengths, groups, unknown_orientation
    )
    names, members = np.unique(labels, return_inverse=True)
    folds = members % min(_FOLDS, len(names))
    # Normalize the gain and phase of each snapshot, which do not depend on the array.
    received = received / np.linalg.norm(received, axis=1, keepdims=True)

    def left_out(order: int) -> tuple[float, NDArray[np.float64]]:
        misfits, errors = np.empty(len(received)), np.empty(len(received))
        for fold in np.unique(folds):
            out = folds == fold
            kept = ~out if not out.all() else out
            series, _ = _fit(
                received[kept], azimuths[kept], places, members[kept], order, unknown_orientation
            )
            found, _ = series.azimuths(received[out])
            errors[out] = _errors(found, azimuths[out], members[out], unknown_orientation)
            # The misfit in the given direction, in the frame of the estimated orientation.
            misfits[out] = series.misfits(received[out], found - errors[out])
        return float(np.mean(misfits)), errors

    most = _MOST_TERMS if terms is None else terms
    fewest = 0 if terms is None else terms
    # The number of coefficients is limited by the number of different azimuths.
    distinct = len(np.unique(np.round(azimuths, 3)))
    limit = max((distinct - 1) // 2, 0)
    if fewest > limit and not unknown_orientation:
        raise ValueError(f"terms is {terms}; {distinct} azimuths allow at most {limit}")
    order, (score, errors) = fewest, left_out(fewest)
    for more in range(fewest + 1, (most if unknown_orientation else min(most, limit)) + 1):
        next_score, next_errors = left_out(more)
        if next_score < score:
            order, score, errors = more, next_score, next_errors
    series, orientations = _fit(received, azimuths, places, members, order, unknown_orientation)
    _, residual = series.azimuths(received)
    return ManifoldFit(
        manifold=MeasuredManifold(series.table),
        responses=series.table,
        terms=order,
        orientations_rad={
            name.item(): float(turn) for name, turn in zip(names, orientations, strict=True)
        },
        residual=residual,
        azimuth_error_rad=errors,
        sigma_rad=float(np.sqrt(np.mean(errors**2))),
    )


def _checked(
    snapshots: ArrayLike,
    azimuths_rad: ArrayLike,
    places_wavelengths: ArrayLike | None,
    groups: ArrayLike | None,
    unknown_orientation: bool,
) -> tuple[
    NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64] | None, NDArray[np.generic]
]:
    received = np.asarray(snapshots, np.complex128)
    azimuths = np.asarray(azimuths_rad, np.float64)
    if received.ndim != 2 or not 2 <= received.shape[0] <= 16:
        raise ValueError(
            f"snapshots of shape {received.shape}: allowed is (2 to 16 antennas, snapshots)"
        )
    antennas, count = received.shape
    if azimuths.shape != (count,):
        raise ValueError(
            f"azimuths_rad of shape {azimuths.shape}: {count} snapshots need ({count},)"
        )
    places = None if places_wavelengths is None else np.asarray(places_wavelengths, np.float64)
    if places is not None and places.shape != (antennas, 2):
        raise ValueError(
            f"places_wavelengths of shape {places.shape}: {antennas} antennas need ({antennas}, 2)"
        )
    labels = np.arange(count) if groups is None else np.asarray(groups)
    if labels.shape != (count,):
        raise ValueError(f"groups of shape {labels.shape}: {count} snapshots need ({count},)")
    if unknown_orientation and (places is None or groups is None):
        raise ValueError("unknown_orientation needs places_wavelengths and groups")
    finite = np.isfinite(received).all() and np.isfinite(azimuths).all()
    if not (finite and (places is None or np.isfinite(places).all())):
        raise ValueError("snapshots, azimuths_rad and places_wavelengths must be finite")
    if not (np.abs(received).sum(axis=0) > 0).all():
        raise ValueError("every snapshot must have power")
    if count < 4:
        raise ValueError(f"{count} snapshots: four or more are needed")
    return received.T.copy(), azimuths, places, labels


def _grid() -> NDArray[np.float64]:
    return np.arange(_AZIMUTHS, dtype=np.float64) * (2 * np.pi / _AZIMUTHS)


def _harmonics(azimuths: NDArray[np.float64], order: int) -> NDArray[np.complex128]:
    waves: NDArray[np.complex128] = np.exp(1j * azimuths[:, None] * np.arange(-order, order + 1))
    return waves


def _geometry(
    places: NDArray[np.float64] | None, azimuths: NDArray[np.float64]
) -> NDArray[np.complex128] | float:
    if places is None:
        return 1.0
    towards = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1)
    responses: NDArray[np.complex128] = np.exp(2j * np.pi * towards @ places.T)
    return responses


def wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Returns angles in radians between −π (exclusive) and π."""
    return -((-angles + np.pi) % (2 * np.pi) - np.pi)


def _fit(
    received: NDArray[np.complex128],
    azimuths: NDArray[np.float64],
    places: NDArray[np.float64] | None,
    members: NDArray[np.intp],
    order: int,
    unknown_orientation: bool,
) -> tuple[_Series, NDArray[np.float64]]:
    """Fits the series of an order, and the orientation of every group."""
    antennas = received.shape[1]
    present = np.unique(members)
    coefficients = np.zeros((antennas, 2 * order + 1), np.complex128)
    coefficients[:, order] = 1
    series = _Series(places, coefficients)
    orientations = np.zeros(len(present))
    given = places is not None
    for round_number in range(_ROUNDS):
        if unknown_orientation:
            # Rotate every group to the directions estimated with the present manifold.
            found, _ = series.azimuths(received)
            turns = [_centre(wrapped(found - azimuths)[members == group]) for group in present]
            orientations = np.array(turns)
        turned = azimuths + orientations[np.searchsorted(present, members)]
        base = _geometry(places, turned) * np.ones_like(received)
        basis = _harmonics(turned, order)
        # Estimate the snapshot gains with the present manifold, or from the first antenna's phase.
        if given or round_number > 0:
            expected = series.at(turned)
        else:
            expected = received * np.exp(-1j * np.angle(received[:, :1]))
        power = np.maximum(np.sum(np.abs(expected) ** 2, axis=1), 1e-300)
        gains = np.sum(received * expected.conj(), axis=1) / power
        rest = np.sum(np.abs(received - gains[:, None] * expected) ** 2, axis=1)
        weights = 1 / (1 + rest / max(float(np.median(rest)), 1e-12))
        # Solve weighted least squares for every antenna with a common basis.
        weights = weights * np.abs(gains) ** 2
        target = received / gains[:, None] * base.conj()
        weighted = basis.conj() * weights[:, None]
        normal = weighted.T @ basis
        ridge = _RIDGE * np.trace(normal).real * np.eye(len(normal))
        coefficients = np.linalg.solve(normal + ridge, weighted.T @ target).T
        series = _Series(places, coefficients)
    return series, orientations


def _centre(angles: NDArray[np.float64]) -> float:
    """Returns the circular median of wrapped angles: the angle with the smallest mean distance."""
    trials = np.linspace(-np.pi, np.pi, 180, endpoint=False)
    # Two wrapped angles are π minus this apart; `wrapped` divides, which takes much longer.
    nearness = np.abs(np.abs(angles[:, None] - trials) - np.pi).mean(axis=0)
    middle = trials[nearness.argmax()]
    return float(middle + np.median(wrapped(angles - middle)))


def _errors(
    found: NDArray[np.float64],
    azimuths: NDArray[np.float64],
    members: NDArray[np.intp],
    unknown_orientation: bool,
) -> NDArray[np.float64]:
    errors = wrapped(found - azimuths)
    if unknown_orientation:
        for group in np.unique(members):
            own = members == group
            errors[own] = wrapped(errors[own] - _centre(errors[own]))
    return errors
