"""Array data in the annotations of a recording (``aoa:truth``), validated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Permitted element spacings in wavelengths, equal to those of the command line.
SPACINGS = (0.01, 10.0)


@dataclass(frozen=True)
class ArrayTruth:
    """Array data of one annotation; missing values are ``None``.

    Attributes
    ----------
    azimuth_from_broadside_deg
        Measured azimuth in degrees, counter-clockwise from the array's broadside, which is 90°
        clockwise of the axis. For a linear array: 90° minus the angle from its axis. The keys
        ``angle_from_axis_deg`` (linear array) and ``azimuth_from_axis_deg`` (counter-clockwise from
        the axis) are accepted instead.
    element_spacing_wavelengths
        Element spacing of a linear array, in wavelengths.
    element_places_wavelengths
        Antenna positions of another array in wavelengths, along the axis and to its left, shape
        (channels, 2).
    channel_phases
        Phase errors of the channels as factors of modulus one, shape (channels,).
    """

    azimuth_from_broadside_deg: float | None = None
    element_spacing_wavelengths: float | None = None
    element_places_wavelengths: NDArray[np.float64] | None = None
    channel_phases: NDArray[np.complex128] | None = None

    @classmethod
    def of(cls, annotation: dict[str, Any], channels: int) -> ArrayTruth:
        """Reads an annotation.

        Raises
        ------
        InputError
            Value of a wrong type or out of range.

        Examples
        --------
        >>> ArrayTruth.of({"aoa:truth": {"element_spacing_wavelengths": 0.5}}, 4)
        ... # doctest: +ELLIPSIS
        ArrayTruth(..., element_spacing_wavelengths=0.5, ...)
        """
        truth = annotation.get("aoa:truth", {})
        if not isinstance(truth, dict):
            raise InputError("`aoa:truth` must be a table")
        return cls(
            _azimuth(truth),
            _number(truth, "element_spacing_wavelengths", *SPACINGS),
            _places(truth, channels),
            _phases(truth, channels),
        )


def from_broadside_deg(azimuth_from_axis_deg: float) -> float:
    """Returns an azimuth from broadside, −180° to 180°; broadside is 90° clockwise of the axis.

    Examples
    --------
    >>> from_broadside_deg(-90.0), from_broadside_deg(0.0), from_broadside_deg(100.0)
    (0.0, 90.0, -170.0)
    """
    return (azimuth_from_axis_deg + 270.0) % 360.0 - 180.0


def _azimuth(truth: dict[str, Any]) -> float | None:
    azimuth_deg = _number(truth, "azimuth_from_broadside_deg", -360.0, 360.0)
    angle_deg = _number(truth, "angle_from_axis_deg", 0.0, 180.0)
    from_axis_deg = _number(truth, "azimuth_from_axis_deg", -360.0, 360.0)
    if azimuth_deg is not None:
        return azimuth_deg
    if angle_deg is not None:
        return 90.0 - angle_deg
    return None if from_axis_deg is None else from_broadside_deg(from_axis_deg)


def _number(truth: dict[str, Any], key: str, low: float, high: float) -> float | None:
    value = truth.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(f"`aoa:truth.{key}` is {value}; it must be a number from {low} to {high}")
    return float(value)


def _places(truth: dict[str, Any], channels: int) -> NDArray[np.float64] | None:
    places = truth.get("element_places_wavelengths")
    if places is None:
        return None
    fine = (
        isinstance(places, list)
        and len(places) == channels
        and all(
            isinstance(place, list)
            and len(place) == 2
            and all(isinstance(it, int | float) and math.isfinite(it) for it in place)
            for place in places
        )
    )
    if not fine:
        raise InputError(
            f"`aoa:truth.element_places_wavelengths` must be a list of {channels} positions [x, "
            "y], one for each channel"
        )
    return np.array(places, dtype=float)


def _phases(truth: dict[str, Any], channels: int) -> NDArray[np.complex128] | None:
    parts = [truth.get(f"channel_calibration_{part}") for part in ("re", "im")]
    if parts == [None, None]:
        return None
    fine = all(
        isinstance(part, list)
        and len(part) == channels
        and all(isinstance(it, int | float) and math.isfinite(it) for it in part)
        for part in parts
    )
    gains = np.array(parts[0], dtype=complex) + 1j * np.array(parts[1]) if fine else np.zeros(1)
    size = np.abs(gains)
    if not (np.isfinite(size) & (size > 0.0)).all():
        raise InputError(
            "`aoa:truth.channel_calibration_re` and `_im` must each be a list of "
            f"{channels} numbers, one per channel, without 0"
        )
    return np.asarray(gains / size, dtype=np.complex128)
