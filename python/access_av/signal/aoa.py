"""Angle of arrival with 2 to 16 antennas: in a row, or with `direction` in any places.

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
    DirectionEstimate,
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
    music,
    root_music,
    spectrum,
)

__all__ = [
    "AngleEstimate",
    "DirectionEstimate",
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
    "music",
    "root_music",
    "spectrum",
]
