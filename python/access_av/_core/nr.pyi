from collections.abc import Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from access_av._core import Recording

__all__ = [
    "Cell",
    "Observables",
    "Receiver",
    "Scan",
    "Searcher",
    "build_burst",
    "scan",
    "search",
]

@final
class Cell:
    """Received SSB of a cell."""

    @property
    def pci(self) -> int:
        """Physical cell identity, 0 to 1007."""
    @property
    def ssb_index(self) -> int:
        """Index of the SSB in its burst; it identifies the beam."""
    @property
    def ssb_index_is_guess(self) -> bool:
        """Whether no PBCH was decoded, so that `ssb_index` is not certain."""
    @property
    def lmax(self) -> int | None:
        """Number of SSB indices of the cell (4, 8 or 64), if frequency or PBCH determine it."""
    @property
    def half_frame(self) -> int | None:
        """1 in the second half of a frame, if DM-RS or PBCH determine it."""
    @property
    def sfn(self) -> int | None:
        """System frame number; None if the CRC of the PBCH is wrong."""
    @property
    def mib_bits(self) -> str | None:
        """The 24 bits of the master information block, in the order of transmission."""
    @property
    def cfo_hz(self) -> float:
        """Carrier frequency offset in Hz."""
    @property
    def snr_db(self) -> float:
        """SNR of a resource element, mean over the antennas."""
    @property
    def sample_start(self) -> float:
        """First sample of the SSB including its cyclic prefix, at the rate of the recording."""
    @property
    def sample_count(self) -> float:
        """Length of the SSB in samples, at the rate of the recording."""
    @property
    def ssb_freq_hz(self) -> float:
        """Centre frequency of the SSB in Hz."""
    @property
    def scs_khz(self) -> int:
        """Subcarrier spacing in kHz."""
    @property
    def rsrp_dbfs(self) -> list[float]:
        """SS-RSRP of each antenna (TS 38.215)."""
    @property
    def rsrq_db(self) -> list[float]:
        """SS-RSRQ of each antenna."""
    @property
    def sinr_db(self) -> list[float]:
        """SS-SINR of each antenna."""
    @property
    def angle_rad(self) -> float | None:
        """Angle of arrival from the array's axis in rad; None with one antenna."""
    @property
    def sigma_rad(self) -> float | None:
        """Standard deviation of `angle_rad`, or of `azimuth_rad` for antennas not in a row."""
    @property
    def phase_rad(self) -> float | None:
        """Electrical angle in rad: phase difference between neighbouring antennas."""
    @property
    def phase_sigma_rad(self) -> float | None:
        """Standard deviation of `phase_rad`."""
    @property
    def azimuth_rad(self) -> float | None:
        """Azimuth, counter-clockwise from broadside; from the x axis for antennas not in a row."""
    @property
    def elevation_rad(self) -> float | None:
        """Elevation from the horizontal upwards; None if the antennas are in a row."""
    @property
    def elevation_sigma_rad(self) -> float | None:
        """Standard deviation of `elevation_rad`."""
    @property
    def verdict(self) -> str | None:
        """Verdict: `resolved`, or the reason why noise or geometry permit another angle."""
    @property
    def doubt(self) -> str | None:
        """Reason why the angle is unreliable (verdict or misfit); empty if it is reliable."""
    @property
    def p_value(self) -> float | None:
        """Probability of an equal or larger misfit of a plane wave in white noise."""
    @property
    def blocks(self) -> NDArray[np.complex128]:
        """Despread response of each symbol `(antennas, 4)`, in unit noise; input of `aoa`."""
    @property
    def channel(self) -> NDArray[np.complex64]:
        """Channel estimate of each subcarrier, complex64 `(antennas, 240)`."""
    @property
    def channel_covariance(self) -> NDArray[np.complex64]:
        """Noise covariance of `channel` divided by `noise_variance`, complex64 `(240, 240)`."""
    @property
    def noise_variance(self) -> list[float]:
        """Noise variance of a resource element for each antenna, in the scale of `channel`."""
    @property
    def observables(self) -> Observables | None:
        """Delay, carrier phase, range rate and power; None unless from a `Receiver`."""

@final
class Observables:
    """Delay, carrier phase, range rate and power of one SSB, with standard deviations."""

    @property
    def first_path_start(self) -> float:
        """First sample of the SSB on the first path, at the rate of the input."""
    @property
    def delay_offset_s(self) -> float:
        """Delay of the first path relative to `Cell.sample_start`, in seconds."""
    @property
    def delay_sigma_s(self) -> float:
        """Standard deviation of `first_path_start` in seconds: noise and multipath."""
    @property
    def delay_noise_sigma_s(self) -> float:
        """Standard deviation of `first_path_start` in seconds due to noise."""
    @property
    def multipath(self) -> str:
        """`not detected`, `separated` or `uncertain` (first path weak or blocked)."""
    @property
    def carrier_phase_rad(self) -> float:
        """Carrier phase of antenna 0 at `reference_start`, within pi, in rad."""
    @property
    def carrier_phase_sigma_rad(self) -> float:
        """Standard deviation of `carrier_phase_rad` in rad: noise and multipath."""
    @property
    def carrier_phase_multipath_sigma_rad(self) -> float:
        """Standard deviation of the phase of one antenna due to multipath, in rad."""
    @property
    def reference_start(self) -> float:
        """Sample to which phase, amplitudes and frequency refer, at the rate of the input."""
    @property
    def frequency_hz(self) -> float:
        """Carrier frequency offset from `rate_source` in Hz."""
    @property
    def frequency_sigma_hz(self) -> float:
        """Standard deviation of `frequency_hz` in Hz."""
    @property
    def range_rate_m_s(self) -> float:
        """Rate of the pseudorange in m/s, including the offset of both oscillators."""
    @property
    def range_rate_sigma_m_s(self) -> float:
        """Standard deviation of `range_rate_m_s` in m/s."""
    @property
    def rate_source(self) -> str:
        """`phase difference` to the previous SSB, or `within SSB`."""
    @property
    def interval_s(self) -> float:
        """Time since the previous SSB of the beam in seconds; 0 without one."""
    @property
    def phase_change_rad(self) -> float:
        """Carrier phase minus that of the previous SSB, within pi, in rad."""
    @property
    def phase_change_sigma_rad(self) -> float:
        """Standard deviation of `phase_change_rad` in rad; infinite without a previous SSB."""
    @property
    def ambiguity_m_s(self) -> float:
        """Change of the range rate for one cycle of `phase_change_rad`, in m/s."""
    @property
    def wrong_cycles_probability(self) -> float:
        """Probability of a wrong number of cycles in a rate from a phase difference."""
    @property
    def rsrp_dbfs(self) -> float:
        """Power of a resource element of all paths, mean over the antennas, in dBFS."""
    @property
    def rsrp_sigma_db(self) -> float:
        """Standard deviation of `rsrp_dbfs` in dB."""
    @property
    def first_path_dbfs(self) -> float:
        """Power of a resource element of the first path in dBFS."""
    @property
    def first_path_sigma_db(self) -> float:
        """Standard deviation of `first_path_dbfs` in dB."""
    @property
    def amplitudes(self) -> NDArray[np.complex128]:
        """Amplitude of every antenna with the carrier phase, complex128 `(antennas,)`."""
    @property
    def amplitude_variance(self) -> NDArray[np.float64]:
        """Noise variance of `amplitudes`, float64 `(antennas,)`."""
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of delay (s), phase (rad), frequency offset (Hz), float64 `(3, 3)`."""

@final
class Scan:
    """Result of a scan of a recording."""

    def __new__(
        cls, cells: Sequence[Cell], faults: Sequence[str], looked: Sequence[str]
    ) -> Scan: ...
    @property
    def cells(self) -> list[Cell]:
        """SSBs in the order of time."""
    @property
    def faults(self) -> list[str]:
        """Faults of the channels and removed tones, as text."""
    @property
    def looked(self) -> list[str]:
        """Searched frequencies and subcarrier spacings, as text."""

@final
class Receiver:
    """Receiver of a sample stream that searches for and tracks the cells of one SSB frequency."""

    def __new__(
        cls,
        sample_rate_hz: float,
        *,
        centre_frequency_hz: float,
        ssb_freq_hz: float,
        scs_khz: int,
        antennas: int,
        period_s: float = 0.02,
        search_every_s: float = 1.0,
        cfo_ppm: float | None = None,
        spacing_wavelengths: float = 0.5,
        places_wavelengths: Sequence[tuple[float, float]] | None = None,
        calibration: Sequence[complex] | None = None,
    ) -> Receiver: ...
    def push(self, samples: ArrayLike) -> list[Cell]:
        """Returns the SSBs that end in the next `(samples,)` or `(antennas, samples)`."""

    def finish(self) -> list[Cell]:
        """Ends the stream; returns the remaining SSBs."""

    @property
    def tones(self) -> list[tuple[float, float]]:
        """Currently removed tones: frequency in Hz, power in dBFS."""

@final
class Searcher:
    """Search for the SSBs of one frequency that reuses its buffers between calls."""

    def __new__(
        cls,
        sample_rate_hz: float,
        *,
        centre_frequency_hz: float,
        ssb_freq_hz: float,
        scs_khz: int,
        antennas: int,
        spacing_wavelengths: float = 0.5,
        places_wavelengths: Sequence[tuple[float, float]] | None = None,
        calibration: Sequence[complex] | None = None,
    ) -> Searcher: ...
    def search(self, samples: ArrayLike) -> list[Cell]:
        """Returns every SSB in `(samples,)` or `(antennas, samples)`, in the order of time."""

    @property
    def tones(self) -> list[tuple[float, float]]:
        """Tones removed in the last search: frequency in Hz, power in dBFS."""

def scan(
    recording: Recording,
    *,
    centre_frequency_hz: float | None = None,
    ssb_freq_hz: float | None = None,
    scs_khz: int | None = None,
    cfo_ppm: float | None = None,
    spacing_wavelengths: float = 0.5,
    places_wavelengths: Sequence[tuple[float, float]] | None = None,
    calibration: Sequence[complex] | None = None,
) -> Scan:
    """Returns every SSB of a recording."""

def search(
    samples: ArrayLike,
    sample_rate_hz: float,
    *,
    centre_frequency_hz: float,
    ssb_freq_hz: float | None = None,
    scs_khz: int | None = None,
    cfo_ppm: float | None = None,
    spacing_wavelengths: float = 0.5,
    places_wavelengths: Sequence[tuple[float, float]] | None = None,
    calibration: Sequence[complex] | None = None,
) -> Scan:
    """Returns every SSB in `(samples,)` or `(antennas, samples)`, in the order of time."""

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
) -> NDArray[np.complex64]:
    """Returns the samples of one burst set: complex64, 5 ms, centre frequency 0 Hz."""
