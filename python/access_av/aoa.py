"""Angle of arrival with uniform linear arrays of 2 to 8 antennas.

Angles are measured from the array's axis, in rad, 0 to pi; the electrical angle, the phase step
from one antenna to the next, is ``2 pi (d / lambda) cos(angle)``. Snapshots are complex arrays
``(antennas, snapshots)`` or ``(batch, antennas, snapshots)``; nothing removes their mean, so
despread pilots (the same vector in every snapshot) are welcome.

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
    calibrate,
    covariance,
    crb_rad,
    esprit,
    estimate_sources,
    forward_backward,
    maximum_likelihood,
    music,
    root_music,
    spectrum,
)

__all__ = [
    "AngleEstimate",
    "calibrate",
    "covariance",
    "crb_rad",
    "esprit",
    "estimate_sources",
    "forward_backward",
    "maximum_likelihood",
    "music",
    "root_music",
    "spectrum",
]
