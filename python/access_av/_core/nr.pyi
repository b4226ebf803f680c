from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from access_av._core import Recording

__all__ = ["Cell", "Scan", "Searcher", "build_burst", "scan", "search"]

@final
class Cell:
    @property
    def pci(self) -> int: ...
    @property
    def ssb_index(self) -> int: ...
    @property
    def lmax(self) -> int | None: ...
    @property
    def half_frame(self) -> int | None: ...
    @property
    def sfn(self) -> int | None: ...
    @property
    def mib_bits(self) -> str | None: ...
    @property
    def cfo_hz(self) -> float: ...
    @property
    def snr_db(self) -> float: ...
    @property
    def sample_start(self) -> float: ...
    @property
    def sample_count(self) -> float: ...
    @property
    def ssb_freq_hz(self) -> float: ...
    @property
    def scs_khz(self) -> int: ...
    @property
    def rsrp_dbfs(self) -> list[float]: ...
    @property
    def rsrq_db(self) -> list[float]: ...
    @property
    def sinr_db(self) -> list[float]: ...
    @property
    def angle_rad(self) -> float | None: ...
    @property
    def sigma_rad(self) -> float | None: ...
    @property
    def phase_rad(self) -> float | None: ...
    @property
    def phase_sigma_rad(self) -> float | None: ...
    @property
    def azimuth_rad(self) -> float | None: ...
    @property
    def verdict(self) -> str | None: ...

@final
class Scan:
    def __new__(
        cls, cells: Sequence[Cell], faults: Sequence[str], looked: Sequence[str]
    ) -> Scan: ...
    @property
    def cells(self) -> list[Cell]: ...
    @property
    def faults(self) -> list[str]: ...
    @property
    def looked(self) -> list[str]: ...

@final
class Searcher:
    def __new__(
        cls,
        sample_rate_hz: float,
        *,
        centre_frequency_hz: float,
        ssb_freq_hz: float,
        scs_khz: int,
        antennas: int,
        spacing_wavelengths: float = 0.5,
        calibration: Sequence[complex] | None = None,
    ) -> Searcher: ...
    def search(self, samples: ArrayLike) -> list[Cell]: ...

def scan(
    recording: Recording,
    *,
    centre_frequency_hz: float | None = None,
    ssb_freq_hz: float | None = None,
    scs_khz: int | None = None,
    cfo_ppm: float | None = None,
    spacing_wavelengths: float = 0.5,
    calibration: Sequence[complex] | None = None,
) -> Scan: ...
def search(
    samples: ArrayLike,
    sample_rate_hz: float,
    *,
    centre_frequency_hz: float,
    ssb_freq_hz: float | None = None,
    scs_khz: int | None = None,
    cfo_ppm: float | None = None,
    spacing_wavelengths: float = 0.5,
    calibration: Sequence[complex] | None = None,
) -> list[Cell]: ...
def build_burst(
    pci: int,
    *,
    ssb_indices: Sequence[int] = ...,
    gains: Sequence[complex] | None = None,
    case: str = "C",
    lmax: int = 8,
    sfn: int = 0,
    half_frame: bool = False,
    mib_bits: str | None = None,
    ssb_freq_hz: float | None = None,
    sample_rate_hz: float = 7.68e6,
) -> NDArray[np.complex64]: ...
