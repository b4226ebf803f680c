"""Angles of arrival from a recording of an array: calibration, then one estimate per burst.

The annotations of a recording mark its bursts. A burst with a label that starts with ``reference``
was sent from broadside and calibrates the channels for later bursts. An annotation can also contain
a ``channel_calibration``. Every other annotated burst is estimated.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av._core import Recording
from access_av.errors import InputError
from access_av.signal import aoa
from access_av.signal.array_annotations import SPACINGS, ArrayTruth, from_broadside_deg
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

SPEED_OF_LIGHT_MPS = 299_792_458.0

# Maximum length of a burst in samples: 0.1 s at 100 Msps.
MOST_SAMPLES = 10_000_000


@dataclass(frozen=True)
class BurstAngle:
    """Angle of arrival of one burst.

    Attributes
    ----------
    sample_start
        First sample of the burst.
    azimuth_deg
        Azimuth in degrees, counter-clockwise (seen from above) from the array's broadside, which is
        90° clockwise of the axis.
    sigma_deg
        Standard deviation in degrees: noise and, if detected, reflections.
    snr_db
        SNR per antenna and sample, in dB.
    verdict
        ``resolved``, or ``unresolved:`` with the reason (noise or geometry).
    doubt
        Reason why the angle is unreliable, including a misfit of the plane wave; otherwise empty.
    p_value
        Probability of an equal or larger misfit of a plane wave in white noise.
    truth_deg
        Measured azimuth in degrees, if annotated.
    """

    sample_start: int
    azimuth_deg: float
    sigma_deg: float
    snr_db: float
    label: str
    verdict: str
    doubt: str
    p_value: float
    truth_deg: float | None = None

    def as_record(self) -> dict[str, Any]:
        """Returns a row of the table ``cells`` for JSON; ``truth_deg`` only if it is known."""
        found = {key: value for key, value in vars(self).items() if value is not None}
        return {name: found[name] for name in TABLES["cells"].columns if name in found}


def estimate_bursts(
    path: str | Path, *, spacing_wavelengths: float | None = None
) -> list[BurstAngle]:
    """Estimates the angle of every annotated burst by one-source maximum likelihood.

    If the annotations contain antenna positions, azimuth and elevation are estimated jointly.

    Parameters
    ----------
    path
        SigMF recording: its name, its ``.sigmf-meta`` or its ``.sigmf-data``.
    spacing_wavelengths
        Element spacing. Default: from the metadata.

    Raises
    ------
    RecordingError
        Unreadable recording.
    InputError
        Recording with one channel, without annotated burst, or without element spacing.

    Notes
    -----
    Channel k is at (k − 1.5)·d along the array, to the left of broadside for larger k, and
    receives exp(−j2π·distance/λ). A wave from azimuth α to the left reaches larger k earlier, so
    the phase step is 2π(d/λ) sin α = 2π(d/λ) cos θ with θ = 90° − α, the angle from the axis.

    A plane wave has equal power at every antenna. Power differences between the channels of a burst
    are gain and multipath and contain no direction. Therefore every channel is normalized to equal
    power, and only its phase is calibrated.
    """
    recording = Recording.open(path)
    if recording.channels < 2:
        raise InputError(f"{path}: one channel; an angle needs an array of at least two")
    metadata = json.loads(recording.metadata_json())
    annotations = metadata.get("annotations", [])
    if not annotations:
        raise InputError(
            f"{path}: `annotations` is missing; it contains the positions of the bursts"
        )
    truths = stated_truths(recording, metadata)
    is_row = spacing_wavelengths is not None
    if spacing_wavelengths is None:
        spacing_wavelengths = stated_spacing(truths, metadata, recording.centre_frequency_hz)
    places = None if is_row else stated_places(truths)
    if spacing_wavelengths is None and places is None:
        raise InputError(f"{path}: the metadata contain no antenna spacing; give --spacing")

    calibration: NDArray[np.complex128] | None = None
    bursts = []
    for annotation, truth in zip(annotations, truths, strict=True):
        start = annotation["core:sample_start"]
        count = annotation.get("core:sample_count", recording.length - start)
        if not 0 < count <= MOST_SAMPLES:
            raise InputError(
                f"{path}: the annotation at sample {start} has {count} samples; a burst has 1 "
                f"to {MOST_SAMPLES}"
            )
        snapshots = recording.read(start, count)
        label = str(annotation.get("core:label", ""))
        if label.lower().startswith("reference") and spacing_wavelengths is not None:
            gains = aoa.calibrate(snapshots, math.pi / 2, spacing_wavelengths=spacing_wavelengths)
            calibration = gains / np.abs(gains)
            continue
        phases = calibration if truth.channel_phases is None else truth.channel_phases
        azimuth_deg, sigma_rad, found = _estimate(
            _equalised(snapshots), places, spacing_wavelengths, phases
        )
        bursts.append(
            BurstAngle(
                sample_start=start,
                azimuth_deg=azimuth_deg,
                sigma_deg=math.degrees(sigma_rad),
                snr_db=float(found.snr_db),
                label=label,
                verdict=str(found.verdict),
                doubt=str(found.doubt),
                p_value=float(found.p_value),
                truth_deg=truth.azimuth_from_broadside_deg,
            )
        )
    return bursts


def _estimate(
    snapshots: NDArray[np.complex64],
    places: NDArray[np.float64] | None,
    spacing_wavelengths: float | None,
    phases: NDArray[np.complex128] | None,
) -> tuple[float, float, aoa.DirectionEstimate | aoa.AngleEstimate]:
    """Returns azimuth from broadside (°), its standard deviation (rad), and the estimate."""
    if places is not None:
        source = aoa.direction(snapshots, places, calibration=phases)
        azimuth_deg = from_broadside_deg(math.degrees(float(source.azimuth_rad)))
        return azimuth_deg, float(source.azimuth_sigma_rad), source
    if spacing_wavelengths is None:
        raise InputError("neither the spacing nor the positions of the antennas are known")
    found = aoa.maximum_likelihood(
        snapshots, spacing_wavelengths=spacing_wavelengths, calibration=phases
    )
    return 90.0 - math.degrees(float(found.angle_rad)), float(found.sigma_rad), found


def mean_absolute_error_deg(bursts: Sequence[BurstAngle]) -> float | None:
    """Returns the mean absolute error against the annotated truth; ``None`` without truth."""
    errors = [
        abs((burst.azimuth_deg - burst.truth_deg + 180.0) % 360.0 - 180.0)
        for burst in bursts
        if burst.truth_deg is not None
    ]
    return sum(errors) / len(errors) if errors else None


def stated_truths(recording: Recording, metadata: dict[str, Any]) -> list[ArrayTruth]:
    """Returns the array data of each annotation of a recording.

    Raises
    ------
    InputError
        Invalid annotation; the message names it.
    """
    truths = []
    for index, annotation in enumerate(metadata.get("annotations", [])):
        try:
            truths.append(ArrayTruth.of(annotation, recording.channels))
        except InputError as error:
            raise InputError(f"annotations[{index}]: {error}") from error
    return truths


def stated_places(truths: Sequence[ArrayTruth]) -> NDArray[np.float64] | None:
    """Returns the antenna positions of the first annotation that contains them."""
    places = (truth.element_places_wavelengths for truth in truths)
    return next((it for it in places if it is not None), None)


def stated_spacing(
    truths: Sequence[ArrayTruth], metadata: dict[str, Any], frequency_hz: float | None
) -> float | None:
    """Returns the spacing in wavelengths from an annotation, or from metres in the description."""
    for truth in truths:
        if truth.element_spacing_wavelengths is not None:
            return truth.element_spacing_wavelengths
    description = str(metadata["global"].get("core:description", ""))
    metres = re.search(r"element spacing (\d+\.\d+) m\b", description)
    if metres is None or frequency_hz is None:
        return None
    spacing = float(metres[1]) * frequency_hz / SPEED_OF_LIGHT_MPS
    return spacing if SPACINGS[0] <= spacing <= SPACINGS[1] else None


def _equalised(snapshots: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """Normalizes every channel to unit mean power; a silent channel is unchanged."""
    power = np.mean(np.abs(snapshots) ** 2, axis=1, keepdims=True)
    return (snapshots / np.sqrt(np.where(power > 0.0, power, 1.0))).astype(np.complex64)
