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
    """Angles of arrival with standard deviations, SNR and verdict.

    Every field is a number for a single estimate and an array for a batch or several sources.
    """

    @property
    def angle_rad(self) -> _Values:
        """Angle from the array's axis, 0 to pi."""
    @property
    def sigma_rad(self) -> _Values:
        """Standard deviation of `angle_rad`: noise, and the misfit of the model if there is one."""
    @property
    def phase_rad(self) -> _Values:
        """Electrical angle: phase difference between neighbouring antennas, for use in filters."""
    @property
    def phase_sigma_rad(self) -> _Values:
        """Standard deviation of `phase_rad`."""
    @property
    def phase_noise_sigma_rad(self) -> _Values:
        """Standard deviation of `phase_rad` caused by noise."""
    @property
    def snr_db(self) -> _Values:
        """Estimated SNR per antenna and snapshot."""
    @property
    def p_value(self) -> _Values:
        """Probability of an equal or larger misfit of plane waves in white noise."""
    @property
    def reliable(self) -> bool | NDArray[np.bool_]:
        """Whether the estimate is reliable: it is resolved, and the model fits."""
    @property
    def doubt(self) -> str | NDArray[np.str_]:
        """Reason why the estimate is unreliable; empty if it is reliable."""
    @property
    def resolved(self) -> bool | NDArray[np.bool_]:
        """Whether noise and geometry permit no other angle, if the model fits."""
    @property
    def verdict(self) -> str | NDArray[np.str_]:
        """Verdict: `resolved`, or `unresolved: ` and the reason."""

@final
class DirectionEstimate:
    """Azimuth and elevation with covariance, SNR and verdict.

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
        """Standard deviation of `elevation_rad`; 0 if the elevation was given."""
    @property
    def noise_covariance(self) -> NDArray[np.float64]:
        """Part of `covariance` caused by noise, in rad^2."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of azimuth and elevation in rad^2, `(2, 2)` or `(batch, 2, 2)`."""
    @property
    def snr_db(self) -> _Values:
        """Estimated SNR per antenna and snapshot."""
    @property
    def p_value(self) -> _Values:
        """Probability of an equal or larger misfit of plane waves in white noise."""
    @property
    def reliable(self) -> bool | NDArray[np.bool_]:
        """Whether the estimate is reliable: it is resolved, and the model fits."""
    @property
    def doubt(self) -> str | NDArray[np.str_]:
        """Reason why the estimate is unreliable; empty if it is reliable."""
    @property
    def resolved(self) -> bool | NDArray[np.bool_]:
        """Whether noise and geometry permit no other angle, if the model fits."""
    @property
    def verdict(self) -> str | NDArray[np.str_]:
        """Verdict: `resolved`, or `unresolved: ` and the reason."""

@final
class MeasuredManifold:
    """Measured response of an array to every direction, including element patterns and coupling."""

    def __new__(
        cls, responses: ArrayLike, elevations_rad: ArrayLike | None = None
    ) -> MeasuredManifold:
        """From responses `(azimuths, antennas)` or `(elevations, azimuths, antennas)`."""

def direction(
    snapshots: _Samples,
    places_wavelengths: ArrayLike | MeasuredManifold,
    *,
    elevations_rad: tuple[float, float] = ...,
    sources: int = 1,
    noise_variance: float | None = None,
    calibration: ArrayLike | None = None,
) -> DirectionEstimate:
    """Estimates azimuth and elevation by maximum likelihood, for antennas at any positions."""

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
    """Returns the spectrum `(elevations, azimuths)` of each item, for antennas at any positions."""

def direction_crb_rad(
    places_wavelengths: ArrayLike | MeasuredManifold,
    azimuth_rad: float,
    elevation_rad: float,
    snr_db: float,
    *,
    snapshots: int = 20,
) -> tuple[float, float]:
    """Returns the Cramér–Rao bounds of the standard deviations of azimuth and elevation, in rad."""

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
    """Estimates angles by MUSIC from `(antennas, snapshots)` or `(batch, antennas, snapshots)`."""

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
    """Estimates angles by Root-MUSIC; parameters as in `music`."""

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
    """Estimates angles by ESPRIT; parameters as in `music`."""

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
    """Estimates angles by maximum likelihood, also of coherent sources; parameters: see `music`."""

def maximum_likelihood_pilots(
    blocks: _Samples,
    *,
    noise_variance: float | ArrayLike | None = None,
    spacing_wavelengths: float = 0.5,
    calibration: ArrayLike | None = None,
) -> AngleEstimate:
    """Estimates angles from despread pilots `(antennas, blocks)` or `(batch, antennas, blocks)`."""

def covariance(snapshots: _Samples) -> NDArray[np.complex128]:
    """Returns the sample covariance `(…, antennas, antennas)`; the mean is not removed."""

def forward_backward(covariance: ArrayLike) -> NDArray[np.complex128]:
    """Returns the forward–backward average of a covariance: `(R + J conj(R) J) / 2`."""

def estimate_sources(
    snapshots: _Samples, *, criterion: Literal["mdl", "aic"] = "mdl"
) -> int | NDArray[np.int64]:
    """Estimates the number of sources from the eigenvalues of the covariance."""

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
    """Returns the spectrum at the given angles, `(angles,)` or `(batch, angles)`."""

def calibrate(
    snapshots: _Samples, angle_rad: float, *, spacing_wavelengths: float = 0.5
) -> NDArray[np.complex128]:
    """Estimates the complex gains of the channels from a burst of one source at a known angle."""

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
    """Returns the Cramér–Rao bound of the standard deviation of an angle or a phase, in rad."""
