"""Angle of arrival with 2 to 16 antennas: in a row, or with `direction` in any places.

Angles are measured from the array's axis, in rad, 0 to pi; the electrical angle, the phase step
from one antenna to the next, is ``2 pi (d / lambda) cos(angle)``. Snapshots are complex arrays
``(antennas, snapshots)`` or ``(batch, antennas, snapshots)``; nothing removes their mean, so
despread pilots (the same vector in every snapshot) are welcome. Their noise must be independent: a
smoothed channel estimate says the same several times over.

Every estimate says what it is worth. ``p_value`` tests whether plane waves in white noise explain
what was received; where they do not, ``verdict`` says whether reflections (or antennas unlike those
described) or another source are the cause, and the standard deviations hold what that displaces,
as far as the residual shows it. A model that holds is doubted once in a hundred times.

Examples
--------
>>> import numpy as np
>>> from access_av import aoa
>>> steering = np.exp(1j * np.pi * np.cos(np.radians(40)) * np.arange(4))
>>> found = aoa.maximum_likelihood(np.outer(steering, np.ones(20)))
>>> round(float(np.degrees(found.angle_rad)), 6)
40.0
"""

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

__all__ = [
    "AngleEstimate",
    "DirectionEstimate",
    "MeasuredManifold",
    "calibrate",
    "covariance",
    "crb_rad",
    "direction",
    "direction_crb_rad",
    "direction_spectrum",
    "esprit",
    "estimate_sources",
    "forward_backward",
    "maximum_likelihood",
    "maximum_likelihood_pilots",
    "music",
    "root_music",
    "spectrum",
]
