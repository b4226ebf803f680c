"""Synchronization signal blocks (SSBs) of 5G NR: search in samples and recordings, generation.

Examples
--------
A cell sends two beams; four antennas half a wavelength apart receive them from 60 degrees.

>>> import numpy as np
>>> from access_av import nr
>>> carrier = {"centre_frequency_hz": 3.7008e9, "ssb_freq_hz": 3.7008e9}
>>> burst = nr.build_burst(42, ssb_indices=[0, 5], sfn=512, ssb_freq_hz=3.7008e9)
>>> steering = np.exp(1j * np.pi * np.cos(np.radians(60)) * np.arange(4))
>>> noise = np.random.default_rng(1).normal(scale=1e-3, size=(4, burst.size, 2)) @ [1, 1j]
>>> cells = nr.search(np.outer(steering, burst) + noise, 7.68e6, **carrier)
>>> [(cell.pci, cell.ssb_index, cell.sfn) for cell in cells]
[(42, 0, 512), (42, 5, 512)]
>>> bool(abs(np.degrees(cells[0].angle_rad) - 60) < 1)
True
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from access_av._core import Recording
from access_av._core.nr import (
    Cell,
    Observables,
    Receiver,
    Scan,
    Searcher,
    build_burst,
    scan,
)
from access_av._core.nr import search as _search
from access_av.signal.recorded_angles import stated_places, stated_spacing, stated_truths

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import ArrayLike

__all__ = [
    "Cell", "Cells", "Observables", "Receiver", "Recording", "Scan", "Searcher", "build_burst",
    "record", "scan", "scan_as_recorded", "search",
]  # fmt: skip


class Cells(list[Cell]):
    """SSBs in the order of time.

    Attributes
    ----------
    faults
        Faults of the channels, and the DC offset and tones that were removed before the search.
    """

    faults: list[str]

    def __init__(self, cells: Iterable[Cell], faults: Iterable[str] = ()) -> None:
        super().__init__(cells)
        self.faults = list(faults)


def search(
    samples: ArrayLike,
    sample_rate_hz: float,
    *,
    centre_frequency_hz: float,
    **settings: Any,
) -> Cells:
    """Finds every SSB in samples. For repeated calls, `Searcher` is faster.

    Parameters
    ----------
    samples
        Complex samples, ``(samples,)`` or ``(antennas, samples)``.
    sample_rate_hz
        Any usual rate of at least 3.84 Msps, the bandwidth of an SSB.
    centre_frequency_hz
        Frequency at 0 Hz of the samples.
    **settings
        ``ssb_freq_hz``, ``scs_khz``, ``cfo_ppm``, ``spacing_wavelengths``, ``places_wavelengths``
        and ``calibration`` of :func:`scan`.

    Raises
    ------
    RecordingError
        A rate, band or length that cannot be searched; samples that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from access_av import nr
    >>> carrier = {"centre_frequency_hz": 3.7008e9, "ssb_freq_hz": 3.7008e9}
    >>> burst = nr.build_burst(42, ssb_indices=[1], sfn=7, ssb_freq_hz=3.7008e9)
    >>> noise = np.random.default_rng(1).normal(scale=1e-3, size=(burst.size, 2)) @ [1, 1j]
    >>> cells = nr.search(burst + noise + 0.1, 7.68e6, **carrier)
    >>> [(cell.pci, cell.ssb_index, cell.sfn) for cell in cells]
    [(42, 1, 7)]
    >>> cells.faults
    ['DC offset of -20.0 dBFS: removed']
    """
    found = _search(samples, sample_rate_hz, centre_frequency_hz=centre_frequency_hz, **settings)
    return Cells(found.cells, found.faults)


def scan_as_recorded(
    recording: Recording,
    *,
    spacing_wavelengths: float | None = None,
    calibration: Sequence[complex] | None = None,
    **where: Any,
) -> Scan:
    """Finds every SSB of a recording, with the array data of its annotations.

    Parameters
    ----------
    recording
        The recording.
    spacing_wavelengths
        Element spacing of a linear array. Default: spacing or positions of the annotations,
        otherwise 0.5.
    calibration
        Complex gain of each channel. Default: the annotation at each SSB, if any.
    **where
        ``centre_frequency_hz``, ``ssb_freq_hz``, ``scs_khz`` and ``cfo_ppm`` of :func:`scan`.

    Raises
    ------
    RecordingError
        A rate, band or length that cannot be searched; samples that are not finite.
    InputError
        Invalid array data in the annotations.
    """
    metadata = json.loads(recording.metadata_json())
    truths = stated_truths(recording, metadata)
    if spacing_wavelengths is None:
        stated = stated_spacing(truths, metadata, recording.centre_frequency_hz)
        spacing_wavelengths = 0.5 if stated is None else stated
        antennas = stated_places(truths)
        where["places_wavelengths"] = None if antennas is None else antennas.tolist()
    where["spacing_wavelengths"] = spacing_wavelengths
    found = scan(recording, calibration=calibration, **where)
    if calibration is not None or recording.channels < 2:
        return found
    stretches = [
        (annotation["core:sample_start"], truth.channel_phases)
        for annotation, truth in zip(metadata["annotations"], truths, strict=True)
        if truth.channel_phases is not None
    ]
    if not stretches:
        return found
    cells = list(found.cells)
    places = {(cell.ssb_freq_hz, cell.scs_khz) for cell in cells}
    for start, gains in stretches:
        for ssb_freq_hz, scs_khz in places:
            where |= {"ssb_freq_hz": ssb_freq_hz, "scs_khz": scs_khz}
            for cell in scan(recording, calibration=gains.tolist(), **where).cells:
                if abs(cell.sample_start - start) < 0.5 * cell.sample_count:
                    cells = [cell if _same(cell, other) else other for other in cells]
    return Scan(cells, found.faults, found.looked)


def _same(one: Cell, other: Cell) -> bool:
    return (one.pci, one.ssb_freq_hz) == (other.pci, other.ssb_freq_hz) and abs(
        one.sample_start - other.sample_start
    ) < 0.1 * one.sample_count


def record(cell: Cell) -> dict[str, Any]:
    """Returns the values of one SSB for JSON; angles in degrees, absent without an array.

    ``sample_start`` is the sample nearest to the start of the SSB, ``sample_offset`` the remaining
    fraction.
    """
    start = round(cell.sample_start)
    values: dict[str, Any] = {
        "pci": cell.pci,
        "ssb_index": cell.ssb_index,
        "ssb_index_is_guess": cell.ssb_index_is_guess,
        "half_frame": cell.half_frame,
        "sfn": cell.sfn,
        "cfo_hz": round(cell.cfo_hz, 2),
        "snr_db": round(cell.snr_db, 2),
        "sample_start": start,
        "sample_offset": round(cell.sample_start - start, 3),
        "mib_bits": cell.mib_bits,
        "ssb_freq_hz": cell.ssb_freq_hz,
        "scs_khz": cell.scs_khz,
        "lmax": cell.lmax,
        "rsrp_dbfs": [round(value, 2) for value in cell.rsrp_dbfs],
        "rsrq_db": [round(value, 2) for value in cell.rsrq_db],
        "sinr_db": [round(value, 2) for value in cell.sinr_db],
    }
    angles = {
        "angle_deg": cell.angle_rad,
        "azimuth_deg": cell.azimuth_rad,
        "elevation_deg": cell.elevation_rad,
        "sigma_deg": cell.sigma_rad,
    }
    values |= {
        name: round(angle_rad * 57.29577951308232, 4)
        for name, angle_rad in angles.items()
        if angle_rad is not None
    }
    if cell.verdict is not None:
        values |= {"verdict": cell.verdict, "doubt": cell.doubt, "p_value": cell.p_value}
    return values
