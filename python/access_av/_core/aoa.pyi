from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

_Samples = NDArray[np.complex64] | NDArray[np.complex128]
# Numbers for a single estimate, arrays for a batch or several sources.
_Values = float | NDArray[np.float64]

@final
class AngleEstimate:
    """Angles of arrival, each with what is known about it.

    Every field is a number for a single estimate and an array for a batch or several sources.
    """

    @property
    def angle_rad(self) -> _Values:
        """Angle from the array's axis, 0 to pi."""
    @property
    def sigma_rad(self) -> _Values:
        """Standard deviation of `angle_rad`: of noise, and of the misfit where there is one."""
    @property
    def phase_rad(self) -> _Values:
        """Electrical angle, the phase step from one antenna to the next: best for a filter."""
    @property
    def phase_sigma_rad(self) -> _Values:
        """Standard deviation of `phase_rad`."""
    @property
    def phase_noise_sigma_rad(self) -> _Values:
        """Standard deviation of `phase_rad` that noise alone makes."""
    @property
    def snr_db(self) -> _Values:
        """SNR per antenna and snapshot, as estimated."""
    @property
    def p_value(self) -> _Values:
        """Probability that plane waves in white noise fit as badly as this or worse."""
    @property
    def reliable(self) -> bool | NDArray[np.bool_]:
        """Whether the estimate may be relied on: it is resolved, and the model fits."""
    @property
    def doubt(self) -> str | NDArray[np.str_]:
        """Why it may not be relied on; empty where it may."""
    @property
    def resolved(self) -> bool | NDArray[np.bool_]:
        """Whether noise and geometry leave no doubt, if the model fits."""
    @property
    def verdict(self) -> str | NDArray[np.str_]:
        """`resolved`, or `unresolved: ` and the reason."""

@final
class DirectionEstimate:
    """Azimuth and elevation, with what is known about each.

    Every field is a number for a single item and an array for a batch.
    """

    @property
    def azimuth_rad(self) -> _Values:
        """Azimuth from the x axis, counter-clockwise, in (-pi, pi]."""
    @property
    def elevation_rad(self) -> _Values:
        """Elevation from the horizontal upwards."""
    @property
    def azimuth_sigma_rad(self) -> _Values:
        """Standard deviation of `azimuth_rad`."""
    @property
    def elevation_sigma_rad(self) -> _Values:
        """Standard deviation of `elevation_rad`; 0 where the elevation was given."""
    @property
    def noise_covariance(self) -> NDArray[np.float64]:
        """Part of `covariance` that is noise."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of azimuth and elevation in rad^2, `(2, 2)` or `(batch, 2, 2)`."""
    @property
    def snr_db(self) -> _Values:
        """SNR per antenna and snapshot, as estimated."""
    @property
    def p_value(self) -> _Values:
        """Probability that plane waves in white noise fit as badly as this or worse."""
    @property
    def reliable(self) -> bool | NDArray[np.bool_]:
        """Whether the estimate may be relied on: it is resolved, and the model fits."""
    @property
    def doubt(self) -> str | NDArray[np.str_]:
        """Why it may not be relied on; empty where it may."""
    @property
    def resolved(self) -> bool | NDArray[np.bool_]:
        """Whether noise and geometry leave no doubt, if the model fits."""
    @property
    def verdict(self) -> str | NDArray[np.str_]:
        """`resolved`, or `unresolved: ` and the reason."""

@final
class MeasuredManifold:
    """Measured response of an array to every direction, including element patterns and coupling."""

    def __new__(
        cls, responses: ArrayLike, elevations_rad: ArrayLike | None = None
    ) -> MeasuredManifold:
        """From responses of shape `(azimuths, antennas)` or `(elevations, azimuths, antennas)`."""

def direction(
    snapshots: _Samples,
    places_wavelengths: ArrayLike | MeasuredManifold,
    *,
    elevations_rad: tuple[float, float] = ...,
    sources: int = 1,
    noise_variance: float | None = None,
    calibration: ArrayLike | None = None,
) -> DirectionEstimate:
    """Azimuth and elevation by maximum likelihood, antennas in any places."""

def direction_spectrum(
    snapshots: _Samples,
    places_wavelengths: ArrayLike | MeasuredManifold,
    azimuths_rad: ArrayLike,
    elevations_rad: ArrayLike,
    *,
    method: Literal["bartlett", "capon", "music"] = "bartlett",
    sources: int = 1,
    calibration: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Spectrum `(elevations, azimuths)`, of a batch one for each, antennas in any places."""

def direction_crb_rad(
    places_wavelengths: ArrayLike | MeasuredManifold,
    azimuth_rad: float,
    elevation_rad: float,
    snr_db: float,
    *,
    snapshots: int = 20,
) -> tuple[float, float]:
    """Cramér–Rao bounds of azimuth and elevation: the least standard deviations."""

def music(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate:
    """Directions by MUSIC, of samples `(antennas, snapshots)` or `(batch, antennas, snapshots)`."""

def root_music(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate:
    """Directions by Root-MUSIC; parameters as of `music`."""

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
) -> AngleEstimate:
    """Directions by ESPRIT; parameters as of `music`."""

def maximum_likelihood(
    snapshots: _Samples,
    *,
    spacing_wavelengths: float = 0.5,
    sources: int = 1,
    forward_backward: bool = False,
    subarray: int | None = None,
    calibration: ArrayLike | None = None,
    threads: int = 1,
) -> AngleEstimate:
    """Directions by maximum likelihood, coherent sources too; parameters as of `music`."""

def maximum_likelihood_pilots(
    blocks: _Samples,
    *,
    noise_variance: float | ArrayLike | None = None,
    spacing_wavelengths: float = 0.5,
    calibration: ArrayLike | None = None,
) -> AngleEstimate:
    """Directions from despread pilots, `(antennas, blocks)` or `(batch, antennas, blocks)`."""

def covariance(snapshots: _Samples) -> NDArray[np.complex128]:
    """Sample covariance of the antennas, mean not removed: `(…, antennas, antennas)`."""

def forward_backward(covariance: ArrayLike) -> NDArray[np.complex128]:
    """Forward–backward average of a covariance: `(R + J conj(R) J) / 2`."""

def estimate_sources(
    snapshots: _Samples, *, criterion: Literal["mdl", "aic"] = "mdl"
) -> int | NDArray[np.int64]:
    """Number of sources, from the eigenvalues of the covariance."""

def spectrum(
    snapshots: _Samples,
    angles_rad: ArrayLike,
    *,
    method: Literal["bartlett", "capon", "music"] = "bartlett",
    sources: int = 1,
    spacing_wavelengths: float = 0.5,
    forward_backward: bool = False,
    calibration: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Spectrum at the given angles, `(angles,)` or `(batch, angles)`."""

def calibrate(
    snapshots: _Samples, angle_rad: float, *, spacing_wavelengths: float = 0.5
) -> NDArray[np.complex128]:
    """Complex gains of the channels, from a burst of one source in a known direction."""

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
) -> _Values:
    """Cramér–Rao bound: the least standard deviation of an angle, or of a phase."""
