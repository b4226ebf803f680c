"""Angle of arrival with 2 to 16 antennas: in a row, or with `direction` in any places.

Angles are measured from the array's axis, in rad, 0 to pi; the electrical angle, the phase step
from one antenna to the next, is ``2 pi (d / lambda) cos(angle)``. Snapshots are complex arrays
``(antennas, snapshots)`` or ``(batch, antennas, snapshots)``; nothing removes their mean, so
despread pilots (the same vector in every snapshot) are welcome. Their noise must be independent: a
smoothed channel estimate says the same several times over, and goes through `whiten` first.

Every estimate says what it is worth. ``p_value`` tests whether plane waves in white noise explain
what was received; where they do not, ``verdict`` says whether reflections (or antennas unlike those
described) or another source are the cause, and the standard deviations hold what that displaces,
as far as the residual shows it. A model that holds is doubted once in a hundred times. With few
snapshots the noise itself is uncertain: standard deviations allow for that, and with fewer than
eight degrees of freedom (one snapshot of up to five antennas, two of two or three) no angle is
reliable. Samples of one modulus are taken for phases, in which half of the noise is missing.

Examples
--------
>>> import numpy as np
>>> from access_av import aoa
>>> steering = np.exp(1j * np.pi * np.cos(np.radians(40)) * np.arange(4))
>>> found = aoa.maximum_likelihood(np.outer(steering, np.ones(20)))
>>> round(float(np.degrees(found.angle_rad)), 6)
40.0
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from access_av._core.aoa import (
    AngleEstimate,
    DirectionEstimate,
    MeasuredManifold,
    calibrate,
    covariance,
    crb_rad,
    direction,
    direction_crb_rad,
    direction_spectrum,
    esprit,
    estimate_sources,
    forward_backward,
    maximum_likelihood,
    maximum_likelihood_pilots,
    music,
    root_music,
    spectrum,
)
from access_av.signal.manifold import ManifoldFit, fit_manifold
from access_av.signal.switched import SwitchedEstimate, switched_direction

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = [
    "AngleEstimate",
    "DirectionEstimate",
    "ManifoldFit",
    "MeasuredManifold",
    "SwitchedEstimate",
    "calibrate",
    "covariance",
    "crb_rad",
    "direction",
    "direction_crb_rad",
    "direction_spectrum",
    "esprit",
    "estimate_sources",
    "fit_manifold",
    "forward_backward",
    "maximum_likelihood",
    "maximum_likelihood_pilots",
    "music",
    "root_music",
    "spectrum",
    "switched_direction",
    "whiten",
]

# Of the largest eigenvalue: what a smoothing has left less of than this is rounding.
_LEAST_EIGENVALUE = 1e-4


def whiten(
    channel: NDArray[np.complexfloating], covariance: NDArray[np.complexfloating]
) -> NDArray[np.complex128]:
    """Snapshots in independent noise of a channel estimate whose noise is not.

    With the eigenvectors ``u_j`` of the covariance and its eigenvalues ``l_j``, look ``j`` of an
    antenna is ``u_j^H h / sqrt(l_j)``. There are as many as the estimate has degrees of freedom, be
    it of ever so many subcarriers, and what `maximum_likelihood` makes of them is as honest as of
    snapshots.

    Parameters
    ----------
    channel : ndarray
        Complex, ``(antennas, subcarriers)``; all antennas are smoothed alike.
    covariance : ndarray
        Complex, ``(subcarriers, subcarriers)``, Hermitian: ``E[e e^H]`` of an antenna's noise ``e``
        over its variance.

    Returns
    -------
    ndarray
        Complex, ``(antennas, looks)``, in noise of that variance.

    Raises
    ------
    ValueError
        Shapes that do not fit, values that are not finite, or a covariance of nothing.

    Examples
    --------
    >>> import numpy as np
    >>> from access_av.aoa import whiten
    >>> channel = np.outer(np.exp(0.7j * np.arange(4)), np.ones(240))
    >>> mean = np.full((240, 240), 1 / 240)  # over all subcarriers: one look
    >>> whiten(channel, mean).shape
    (4, 1)
    """
    channel, covariance = np.asarray(channel), np.asarray(covariance)
    subcarriers = channel.shape[-1] if channel.ndim == 2 else -1
    if covariance.shape != (subcarriers, subcarriers):
        raise ValueError(
            f"channel of shape {channel.shape} and covariance of shape {covariance.shape}: allowed "
            "are (antennas, subcarriers) and (subcarriers, subcarriers)"
        )
    if not (np.isfinite(channel).all() and np.isfinite(covariance).all()):
        raise ValueError("channel and covariance must be finite")
    values, vectors = np.linalg.eigh(covariance.astype(np.complex128))
    kept = values > max(_LEAST_EIGENVALUE * float(values[-1]), 0.0)
    if not kept.any():
        raise ValueError("the covariance has no positive eigenvalue")
    looks: NDArray[np.complex128] = channel @ vectors[:, kept].conj() / np.sqrt(values[kept])
    return looks
