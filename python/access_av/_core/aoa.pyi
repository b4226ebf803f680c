from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

_Samples = NDArray[np.complex64] | NDArray[np.complex128]

@final
class AngleEstimate:
    # Numbers for a single estimate, arrays for a batch or several sources.
    @property
    def angle_rad(self) -> Any: ...
    @property
    def sigma_rad(self) -> Any: ...
    @property
    def phase_rad(self) -> Any: ...
    @property
    def phase_sigma_rad(self) -> Any: ...
    @property
    def snr_db(self) -> Any: ...
    @property
    def resolved(self) -> Any: ...
    @property
    def verdict(self) -> Any: ...

@final
class DirectionEstimate:
    # Numbers for a single item, arrays for a batch.
    @property
    def azimuth_rad(self) -> Any: ...
    @property
    def elevation_rad(self) -> Any: ...
    @property
    def azimuth_sigma_rad(self) -> Any: ...
    @property
    def elevation_sigma_rad(self) -> Any: ...
    @property
    def covariance(self) -> NDArray[np.float64]: ...
    @property
    def snr_db(self) -> Any: ...
    @property
    def resolved(self) -> Any: ...
    @property
    def verdict(self) -> Any: ...

def direction(
    snapshots: _Samples,
    places_wavelengths: ArrayLike,
    *,
    elevations_rad: tuple[float, float] = ...,
    calibration: ArrayLike | None = None,
) -> DirectionEstimate: ...
def direction_spectrum(
    snapshots: _Samples,
    places_wavelengths: ArrayLike,
    azimuths_rad: ArrayLike,
    elevations_rad: ArrayLike,
    *,
    method: Literal["bartlett", "capon", "music"] = "bartlett",
    sources: int = 1,
    calibration: ArrayLike | None = None,
) -> NDArray[np.float64]: ...
def direction_crb_rad(
    places_wavelengths: ArrayLike,
    azimuth_rad: float,
    elevation_rad: float,
    snr_db: float,
    *,
    snapshots: int = 20,
) -> tuple[float, float]: ...
def music(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate: ...
def root_music(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate: ...
def esprit(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    total_least_squares: bool = True,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate: ...
def maximum_likelihood(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate: ...
def covariance(snapshots: _Samples) -> NDArray[np.complex128]: ...
def forward_backward(covariance: ArrayLike) -> NDArray[np.complex128]: ...
def estimate_sources(snapshots: _Samples, *, criterion: Literal["mdl", "aic"] = "mdl") -> Any: ...
def spectrum(
    snapshots: _Samples,
    angles_rad: ArrayLike,
    *,
    method: Literal["bartlett", "capon", "music"] = "bartlett",
    sources: int = 1,
    spacing_wavelengths: float = 0.5,
    forward_backward: bool = False,
    calibration: ArrayLike | None = None,
) -> NDArray[np.float64]: ...
def calibrate(
    snapshots: _Samples, angle_rad: float, *, spacing_wavelengths: float = 0.5
) -> NDArray[np.complex128]: ...
def crb_rad(
    angle_rad: ArrayLike,
    snr_db: ArrayLike,
    *,
    antennas: int = 4,
    snapshots: int = 20,
    spacing_wavelengths: float = 0.5,
    model: Literal["stochastic", "deterministic", "known"] = "stochastic",
    quantity: Literal["angle", "phase"] = "angle",
    joint: bool = False,
) -> Any: ...
