"""Angles of arrival with 2 to 16 antennas: a linear array, or any positions with `direction`.

Angles are measured from the array's axis, in rad, 0 to pi; the electrical angle, the phase step
from one antenna to the next, is ``2 pi (d / lambda) cos(angle)``. Snapshots are complex arrays
``(antennas, snapshots)`` or ``(batch, antennas, snapshots)``. Their mean is not removed, so that
despread pilots (equal vectors in all snapshots) can be used. Their noise must be independent. A
smoothed channel estimate has correlated noise and must be passed through `whiten` first.

``p_value`` tests whether plane waves in white noise explain the snapshots (false-alarm rate 1 %).
If they do not, ``verdict`` gives the cause: reflections or a wrong array model, or another source.
The standard deviations then include the displacement that the residual shows. They also include the
uncertainty of the noise variance of few snapshots. No angle is reliable if that variance has fewer
than eight degrees of freedom: one snapshot of up to five antennas, up to two snapshots of three
antennas, up to four snapshots of two antennas. Samples of constant modulus are treated as phases,
which contain only half of the noise.

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
    "AngleEstimate", "DirectionEstimate", "ManifoldFit", "MeasuredManifold", "SwitchedEstimate",
    "calibrate", "covariance", "crb_rad", "direction", "direction_crb_rad",
    "direction_spectrum", "esprit", "estimate_sources", "fit_manifold", "forward_backward",
    "maximum_likelihood", "maximum_likelihood_pilots", "music", "root_music", "spectrum",
    "switched_direction", "whiten",
]  # fmt: skip

# Eigenvalues below this fraction of the largest one are rounding errors.
_LEAST_EIGENVALUE = 1e-4


def whiten(
    channel: NDArray[np.complexfloating], covariance: NDArray[np.complexfloating]
) -> NDArray[np.complex128]:
    """Converts a channel estimate with correlated noise to snapshots with independent noise.

    With the eigenvectors ``u_j`` and eigenvalues ``l_j`` of the covariance, snapshot ``j`` of an
    antenna is ``u_j^H h / sqrt(l_j)``. The number of snapshots is the number of degrees of freedom
    of the estimate, independent of the number of subcarriers. `maximum_likelihood` gives consistent
    standard deviations for them.

    Parameters
    ----------
    channel : ndarray
        Complex, ``(antennas, subcarriers)``; equal smoothing for all antennas.
    covariance : ndarray
        Complex, ``(subcarriers, subcarriers)``, Hermitian: ``E[e e^H]`` of an antenna's noise ``e``
        divided by its variance.

    Returns
    -------
    ndarray
        Complex, ``(antennas, snapshots)``, with noise of that variance.

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, or a covariance without positive eigenvalue.

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
