"""Directions from a switched array: one receiver, connected to one antenna after another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from access_av._core.aoa import DirectionEstimate, direction
from access_av.signal.manifold import ManifoldFit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


# Directions of the search, five degrees apart: eight elements half a wavelength apart lose 0.3 dB
# between two of them.
_AZIMUTHS = 72
# Frequencies of the search per inverse duration of a packet; 0.2 dB are lost between two of them.
_FREQUENCIES = 4
# Relative difference of moduli up to which samples are phases alone.
_ROUNDING = 1e-6
# Factor on a standard deviation from phases alone: the residual contains half of the noise.
_PHASES_ONLY = float(np.sqrt(2))
# Steps of Newton's method for the frequency.
_STEPS = 4


@dataclass(frozen=True, eq=False)
class SwitchedEstimate:
    """Directions from packets of a switched array.

    Attributes
    ----------
    direction
        Azimuth and standard deviation of every packet, see `DirectionEstimate`.
    azimuth_sigma_rad
        Standard deviation of the azimuth, ``(packets,)``. For phases alone it is that of
        `direction` times the root of two, because half of the noise is missing in the residual.
    frequency_hz
        Frequency of the received tone, ``(packets,)``.
    frequency_sigma_rad_s
        Standard deviation of the angular frequency, rad/s, ``(packets,)``.
    snapshots
        Mean response of each antenna at that frequency, ``(packets, antennas, 1)``: input of
        `direction` and, with ``snapshots[:, :, 0].T``, of `fit_manifold`.
    """

    direction: DirectionEstimate
    azimuth_sigma_rad: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    frequency_sigma_rad_s: NDArray[np.float64]
    snapshots: NDArray[np.complex128]


def switched_direction(
    samples: ArrayLike,
    elements: ArrayLike,
    times_s: ArrayLike,
    manifold: ArrayLike | ManifoldFit,
    *,
    frequency_hz: tuple[float, float],
) -> SwitchedEstimate:
    """Estimates azimuth and frequency of a tone jointly from the samples of a switched array.

    Maximum likelihood: the pair of azimuth ``a`` and frequency ``f`` that maximizes
    ``|sum x(t) exp(-2j pi f t) conj(response[element(t)](a))|^2`` over the power of the response.
    If an element is visited every ``T`` seconds, frequencies ``1 / T`` apart are ambiguous and only
    the manifold separates them. The frequency range should therefore be narrower than ``1 / T`` if
    the oscillators permit.

    Parameters
    ----------
    samples
        Complex, ``(samples,)`` or ``(packets, samples)``; or real: phases in rad.
    elements
        Number of the antenna of each sample, ``(samples,)``: the switching schedule.
    times_s
        Time of each sample in s, ``(samples,)``.
    manifold
        Places of the antennas in wavelengths, ``(antennas, 2)``, or a manifold of `fit_manifold`.
    frequency_hz
        Lowest and highest frequency of the tone in Hz.

    Raises
    ------
    ValueError
        Shapes that do not fit, values that are not finite, an element that is never visited, an
        empty range.

    Examples
    --------
    >>> import numpy as np
    >>> from access_av import aoa
    >>> turns = np.arange(8) * np.pi / 4
    >>> places = 0.485 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    >>> slots = np.arange(96) // 3
    >>> elements, times = slots % 8, slots * 4e-6 + np.arange(96) % 3 * 5e-7
    >>> response = np.exp(2j * np.pi * places @ [np.cos(1.0), np.sin(1.0)])
    >>> phases = np.angle(response[elements] * np.exp(2j * np.pi * 263e3 * times))
    >>> band = (250e3, 280e3)
    >>> found = aoa.switched_direction(phases, elements, times, places, frequency_hz=band)
    >>> round(float(found.direction.azimuth_rad[0]), 4), round(float(found.frequency_hz[0]))
    (1.0, 263000)
    """
    received, visited, times = _checked(samples, elements, times_s)
    antennas = int(visited.max()) + 1
    counts = np.bincount(visited, minlength=antennas)
    if not counts.all():
        missing = int(np.flatnonzero(counts == 0)[0])
        raise ValueError(
            f"elements does not contain antenna {missing}; every antenna from 0 to {antennas - 1} "
            "is needed"
        )
    low, high = frequency_hz
    if not (np.isfinite([low, high]).all() and low <= high):
        raise ValueError(
            f"frequency_hz is ({low}, {high}): write the minimum and the maximum frequency"
        )
    table = _table(manifold, antennas)
    # Every sample has equal weight, so that a response is weighted by its number of samples.
    powers = np.sqrt(np.abs(table) ** 2 @ counts)
    beams = table.conj() / powers[:, None]
    each = np.eye(antennas)[visited]
    duration = float(np.ptp(times)) or 1.0
    steps = int(np.ceil((high - low) * duration * _FREQUENCIES)) + 1
    best = np.full(len(received), -np.inf)
    frequency, place = np.full(len(received), low), np.zeros(len(received), np.intp)
    for trial in np.linspace(low, high, steps):
        sums = (received * np.exp(-2j * np.pi * trial * times)) @ each
        power = np.abs(sums @ beams.T) ** 2
        found = power.argmax(axis=1)
        power = power[np.arange(len(power)), found]
        better = power > best
        best[better], frequency[better], place[better] = power[better], trial, found[better]
    # Newton's method for the frequency; the received response replaces that of the best direction.
    centred = times - times.mean()
    for _ in range(_STEPS):
        turned = received * np.exp(-2j * np.pi * frequency[:, None] * times)
        sums = turned @ each
        slopes, bends = (turned * centred) @ each, (turned * centred**2) @ each
        first = np.sum(2 * np.imag(sums.conj() * slopes) / counts, axis=1)
        second = np.sum(2 * (np.abs(slopes) ** 2 - np.real(sums.conj() * bends)) / counts, axis=1)
        step = np.where(second < 0, -first / np.minimum(second, -1e-300), 0.0) / (2 * np.pi)
        frequency = np.clip(frequency + np.clip(step, -0.25 / duration, 0.25 / duration), low, high)
    turned = received * np.exp(-2j * np.pi * frequency[:, None] * times)
    snapshots = (turned @ each) / counts
    rest = np.sum(np.abs(turned - snapshots[:, visited]) ** 2, axis=1)
    freedom = max(received.shape[1] - antennas - 0.5, 0.5)
    spread = np.concatenate(
        [centred[visited == n] - centred[visited == n].mean() for n in range(antennas)]
    )
    power = np.mean(np.abs(received) ** 2, axis=1)
    information = 2 * power * np.sum(spread**2) / np.maximum(rest / freedom, 1e-300)
    with np.errstate(divide="ignore"):
        sigma = 1 / np.sqrt(information)
    kept = snapshots[:, :, None].copy()
    found = direction(
        kept,
        manifold.manifold if isinstance(manifold, ManifoldFit) else manifold,
        elevations_rad=(0.0, 0.0),
    )
    modulus = np.abs(received)
    widening = _PHASES_ONLY if np.ptp(modulus) <= _ROUNDING * modulus.max() else 1.0
    return SwitchedEstimate(
        direction=found,
        azimuth_sigma_rad=np.asarray(found.azimuth_sigma_rad) * widening,
        frequency_hz=frequency,
        frequency_sigma_rad_s=sigma * widening,
        snapshots=kept,
    )


def _checked(
    samples: ArrayLike, elements: ArrayLike, times_s: ArrayLike
) -> tuple[NDArray[np.complex128], NDArray[np.intp], NDArray[np.float64]]:
    given = np.atleast_2d(np.asarray(samples))
    received = given.astype(np.complex128) if np.iscomplexobj(given) else np.exp(1j * given)
    visited, times = np.asarray(elements), np.asarray(times_s, np.float64)
    expected = (received.shape[-1],)
    if received.ndim != 2 or visited.shape != expected or times.shape != expected:
        raise ValueError(
            f"samples of shape {given.shape}, elements {visited.shape} and times_s {times.shape}: "
            "allowed are (packets, samples), (samples,) and (samples,)"
        )
    if visited.dtype.kind not in "iu" or visited.min() < 0 or visited.max() > 15:
        raise ValueError("elements must be whole numbers from 0 to 15")
    if not (np.isfinite(received).all() and np.isfinite(times).all()):
        raise ValueError("samples and times_s must be finite")
    return received, visited.astype(np.intp), times


def _table(manifold: ArrayLike | ManifoldFit, antennas: int) -> NDArray[np.complex128]:
    """Returns the responses of the search, ``(azimuths, antennas)``."""
    if isinstance(manifold, ManifoldFit):
        table = manifold.responses
    else:
        places = np.asarray(manifold, np.float64)
        if places.ndim != 2 or places.shape[1] != 2:
            raise ValueError(f"places of shape {places.shape}: allowed is (antennas, 2)")
        azimuths = np.arange(_AZIMUTHS) * (2 * np.pi / _AZIMUTHS)
        towards = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1)
        table = np.exp(2j * np.pi * towards @ places.T)
    if table.ndim != 2 or table.shape[1] != antennas:
        raise ValueError(
            f"the manifold has {table.shape[-1]} antennas, and elements contains {antennas}"
        )
    return table
