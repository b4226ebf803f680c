from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from access_av._core import aoa as aoa
from access_av._core import interrupt as interrupt
from access_av._core import nr as nr

__all__ = [
    "ERROR_CORRELATION_S",
    "Bound",
    "Live",
    "LiveEnergy",
    "LiveHead",
    "LiveOutcome",
    "LiveStatus",
    "LocatedDrive",
    "LoggedDrive",
    "MeasurementTraces",
    "Plant",
    "Platform",
    "RadioHead",
    "Recording",
    "RecordingError",
    "Scenario",
    "SettingsError",
    "SettingsWarning",
    "SimulationResult",
    "Site",
    "Situation",
    "SsbDetection",
    "Vehicle",
    "__version__",
    "aoa",
    "brief",
    "channel_drops",
    "check_paths",
    "estimate_angles",
    "interrupt",
    "locate",
    "log_angles",
    "nr",
    "read_ranges",
    "read_tum",
    "simulate",
    "synthesize",
]

ERROR_CORRELATION_S: Final[float]
"""Correlation time of the position error, in seconds, of the integrity monitor."""

__version__: str

class SettingsError(ValueError): ...
class RecordingError(ValueError): ...

@final
class SettingsWarning:
    key: Final[str]
    value: Final[str]
    why: Final[str]
    write: Final[str]
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

class _Settings:
    """Base class of site, vehicle, scenario and platform."""

    @staticmethod
    def names() -> list[str]: ...
    @staticmethod
    def schema_json() -> str: ...
    def with_overrides(self, overrides: dict[str, Any]) -> Self: ...
    def warnings(self) -> list[SettingsWarning]: ...
    def to_toml(self) -> str: ...
    def to_json(self) -> str: ...
    name: Final[str]
    description: Final[str]
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def __reduce__(self) -> tuple[Callable[[str, str], Self], tuple[str, str]]: ...

@final
class LiveStatus:
    time_s: Final[float]
    pose: Final[tuple[float, float, float] | None]
    covariance: Final[list[list[float]] | None]
    speed_mps: Final[float]
    yaw_rate_radps: Final[float | None]
    state: Final[str]
    is_localized: Final[bool]
    reason: Final[str]
    what_to_do: Final[str]
    protection_level_m: Final[float | None]
    selected_hypothesis: Final[str | None]
    faulty: Final[int]
    last_angle_s: Final[float | None]
    odometry_age_s: Final[float | None]
    samples_age_s: Final[float | None]
    tracked: Final[int]
    tones: Final[list[tuple[float, float]]]
    faults: Final[list[tuple[str, str, float]]]

@final
class LiveOutcome:
    time_s: Final[float]
    pci: Final[int]
    ssb_index: Final[int]
    snr_db: Final[float]
    phase_rad: Final[float | None]
    phase_sigma_rad: Final[float | None]
    accepted: Final[bool]
    reason: Final[str]
    residual_rad: Final[float | None]
    pose: Final[tuple[float, float, float]]

@final
class LiveHead:
    pci: Final[int]
    ssb_index: Final[int]
    is_excluded: Final[bool]
    is_faulty: Final[bool]
    snr_db: Final[float | None]
    last_angle_s: Final[float | None]
    last_accepted_s: Final[float | None]
    residual_rad: Final[float | None]
    accepted: Final[int]
    refused: Final[int]

@final
class LiveEnergy:
    duration_s: Final[float]
    aoa_estimates: Final[int]
    bursts_received: Final[int]
    on_time_s: Final[float]
    total_j: Final[float | None]

@final
class Live:
    def __new__(
        cls,
        site: Site,
        vehicle: Vehicle,
        *,
        start: tuple[float, float, float] | None = None,
        rate_hz: float | None = None,
        centre_hz: float | None = None,
    ) -> Live: ...
    def samples(
        self,
        time_s: float,
        samples: NDArray[np.complexfloating[Any, Any]],
        *,
        arrival_s: float | None = None,
    ) -> str: ...
    def odometry(
        self,
        time_s: float,
        speed_mps: float,
        *,
        distance_m: float | None = None,
        yaw_rate_radps: float | None = None,
        arrival_s: float | None = None,
    ) -> bool: ...
    def angle(
        self,
        pci: int,
        time_s: float,
        phase_rad: float,
        sigma_rad: float,
        *,
        ssb_index: int = 0,
        snr_db: float | None = None,
        resolved: bool = True,
        at_head: bool = False,
        arrival_s: float | None = None,
    ) -> None: ...
    def range(
        self,
        pci: int,
        time_s: float,
        *,
        range_m: float | None = None,
        delay_ns: float | None = None,
        sigma: float | None = None,
        ssb_index: int = 0,
        arrival_s: float | None = None,
    ) -> str: ...
    def clock_step(self) -> float | None: ...
    def clock_disagreement_s(self) -> float | None: ...
    def flush(self) -> None: ...
    def outcomes(self) -> list[LiveOutcome]: ...
    def set_pose(
        self,
        time_s: float,
        pose: tuple[float, float, float],
        covariance: Sequence[Sequence[float]] | None = None,
    ) -> None: ...
    def reset(self) -> None: ...
    def exclude(self, pci: int) -> None: ...
    def readmit(self, pci: int) -> None: ...
    def status(self, now_s: float) -> LiveStatus: ...
    def heads(self) -> list[LiveHead]: ...
    def listens(self, time_s: float) -> bool: ...
    def next_wake_up_s(self, now_s: float) -> float: ...
    def energy(self) -> LiveEnergy: ...

@final
class Site(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Site: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Site: ...
    def warnings(self, vehicle: Vehicle | None = None) -> list[SettingsWarning]: ...

@final
class Vehicle(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Vehicle: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Vehicle: ...
    alert_limit_m: Final[float | None]
    def resolved(self, platform: Platform | None = None) -> Vehicle: ...

@final
class Scenario(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Scenario: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Scenario: ...
    site: Final[Site]
    vehicle: Final[Vehicle]
    size: Final[dict[str, float]]
    def resolved(self, platform: Platform | None = None) -> Scenario: ...

@final
class Plant(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Plant: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Plant: ...
    target: Final[tuple[float, float]]
    targets: Final[list[tuple[str, float, float, float, float]]]
    def scenario(self) -> Scenario: ...
    def poor_scenario(self) -> Scenario: ...

@final
class Platform(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Platform: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Platform: ...
    def energy_j(
        self,
        vehicle: Vehicle,
        aoa_estimates: int,
        bursts_received: int,
        duration_s: float,
        extent: str = "value",
    ) -> tuple[float, float, float, str] | None: ...
    def base_wake_up_s(self, vehicle: Vehicle) -> float: ...
    def busy_power_w(self, mode: int, cores: int) -> float | None: ...

@final
class RadioHead:
    pci: Final[int]
    ssb_index: Final[int]
    x_m: Final[float]
    y_m: Final[float]
    z_m: Final[float]

@final
class SsbDetection:
    pci: Final[int]
    ssb_index: Final[int]
    snr_db: Final[float]
    expected_snr_db: Final[float | None]

@final
class Situation:
    time_s: Final[float]
    speed_mps: Final[float]
    x_m: Final[float]
    y_m: Final[float]
    heading_rad: Final[float]
    covariance: Final[list[list[float]] | None]
    heads: Final[list[RadioHead]]
    sensed: Final[list[SsbDetection]]

@final
class SimulationResult:
    steps: Final[dict[str, NDArray[Any]]]
    runs: Final[dict[str, NDArray[Any]]]
    trajectories: Final[dict[str, NDArray[Any]] | None]
    integrity: Final[tuple[dict[str, NDArray[np.float64]], float] | None]
    aoa_estimates: Final[dict[str, Any] | None]
    error_quantiles_m: Final[dict[float, float]]
    errors_m: Final[NDArray[np.float32] | None]
    levels_m: Final[NDArray[np.float32] | None]

@final
class Bound:
    def __new__(cls, scenario: Scenario) -> Bound: ...
    def along_route(self) -> dict[str, NDArray[np.float64]]: ...
    def at(
        self,
        x_m: NDArray[np.float64],
        y_m: NDArray[np.float64],
        looks: float,
        heading_std_rad: float,
    ) -> NDArray[np.float64]: ...
    def snr_db(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]: ...

def brief(message: str) -> str: ...
def channel_drops(
    model: str,
    level_m: NDArray[np.float64],
    *,
    head_height_m: float | None = None,
    array_height_m: float,
    carrier_mhz: float,
    seed: int,
) -> dict[str, NDArray[Any]]: ...
def check_paths(file: str) -> None: ...
def simulate(
    scenario: Scenario,
    runs: int = 100,
    seed: int = 1,
    *,
    platform: Platform | None = None,
    threads: int | None = None,
    first_run: int = 0,
    keep_trajectories: bool = False,
    errors_every: int | None = None,
    estimator: Callable[[NDArray[np.complex128]], Any] | None = None,
    policy: Callable[[Situation], bool | Sequence[bool]] | None = None,
    localizer: Callable[..., Any] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> SimulationResult: ...

@final
class MeasurementTraces:
    @staticmethod
    def record(
        scenario: Scenario,
        runs: int = 100,
        seed: int = 1,
        *,
        methods: Sequence[str],
        platform: Platform | None = None,
        threads: int | None = None,
    ) -> MeasurementTraces | None: ...
    def serve(self, scenario: Scenario, *, platform: Platform | None = None) -> bool: ...
    def simulate(
        self,
        scenario: Scenario,
        *,
        platform: Platform | None = None,
        threads: int | None = None,
        errors_every: int | None = None,
    ) -> SimulationResult: ...

@final
class Recording:
    @staticmethod
    def open(path: str | PathLike[str], *, verify: bool = True) -> Recording: ...
    @staticmethod
    def open_raw(
        paths: Sequence[str | PathLike[str]],
        *,
        sample_rate_hz: float,
        centre_frequency_hz: float | None = None,
    ) -> Recording: ...
    sample_rate_hz: Final[float]
    centre_frequency_hz: Final[float | None]
    channels: Final[int]
    length: Final[int]
    datatype: Final[str]
    warnings: Final[list[str]]
    def metadata_json(self) -> str: ...
    def read(self, start: int, count: int) -> NDArray[np.complex64]: ...
    def __len__(self) -> int: ...

def synthesize(
    scenario: Scenario,
    directory: str | PathLike[str],
    *,
    seed: int = 1,
    run: int = 0,
    duration_s: float | None = None,
    continuous: bool = False,
    datatype: str = "ci16_le",
    progress: Callable[[float], object] | None = None,
) -> tuple[Path, int, int]: ...
def log_angles(
    scenario: Scenario,
    directory: str | PathLike[str],
    *,
    seed: int = 1,
    run: int = 0,
    duration_s: float | None = None,
) -> int: ...
def read_tum(file: str | PathLike[str]) -> dict[str, NDArray[np.float64]]: ...
def read_ranges(
    site: Site, file: str | PathLike[str]
) -> tuple[dict[str, NDArray[Any]], bool, float | None, list[str]]: ...
def estimate_angles(
    site: Site,
    vehicle: Vehicle,
    recording: str | PathLike[str],
    *,
    start_time_s: float = 0.0,
) -> tuple[dict[str, NDArray[Any]], Vehicle, list[str]]: ...
def locate(
    site: Site,
    vehicle: Vehicle,
    odometry: str | PathLike[str],
    recording: str | PathLike[str],
    *,
    angles: Mapping[str, NDArray[np.float64]] | None = None,
    topic: str | None = None,
    imu_topic: str | None = None,
    start_time_s: float = 0.0,
    start: tuple[float, float, float] | None = None,
    start_unknown: bool = False,
    smooth: bool = False,
) -> LocatedDrive: ...

@final
class LoggedDrive:
    def __new__(
        cls,
        odometry: str | PathLike[str],
        angles: str | PathLike[str],
        track_width_m: float | None = None,
    ) -> LoggedDrive: ...
    heads: Final[list[tuple[int, int]]]
    def innovations(
        self, site: Site, vehicle: Vehicle, used: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]: ...
    def __len__(self) -> int: ...

@final
class LocatedDrive:
    remarks: Final[list[str]]
    diagnoses: Final[list[str]]
    lost_share: Final[float]
    is_lost_for_long: Final[bool]
    suspicions: Final[list[str]]
    findings: Final[dict[str, Any]]
    poses: Final[dict[str, Any]]
    smoothed: Final[dict[str, Any]]
    angles: Final[dict[str, Any]]
    ranges: Final[dict[str, Any]]
    def write_mcap(self, path: str | PathLike[str]) -> None: ...
    def write_tum(self, path: str | PathLike[str]) -> None: ...
    def write_smoothed_tum(self, path: str | PathLike[str]) -> None: ...
