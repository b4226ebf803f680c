from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from access_av._core import aoa as aoa
from access_av._core import interrupt as interrupt
from access_av._core import nr as nr

__all__ = [
    "Bound",
    "LocatedDrive",
    "LoggedDrive",
    "Plant",
    "Platform",
    "RadioHead",
    "Recording",
    "RecordingError",
    "Scenario",
    "SensedSsb",
    "SettingsError",
    "SettingsWarning",
    "SimulationResult",
    "Site",
    "Situation",
    "Tapes",
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
    "read_tum",
    "simulate",
    "synthesize",
]

__version__: str

class SettingsError(ValueError): ...
class RecordingError(ValueError): ...

@final
class SettingsWarning:
    @property
    def key(self) -> str: ...
    @property
    def value(self) -> str: ...
    @property
    def why(self) -> str: ...
    @property
    def write(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...

class _Settings:
    """What site, vehicle, scenario and platform have in common."""

    @staticmethod
    def names() -> list[str]: ...
    @staticmethod
    def schema_json() -> str: ...
    def with_overrides(self, overrides: dict[str, Any]) -> Self: ...
    def warnings(self) -> list[SettingsWarning]: ...
    def to_toml(self) -> str: ...
    def to_json(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self, /) -> int: ...
    def __reduce__(self) -> tuple[Callable[[str, str], Self], tuple[str, str]]: ...

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
    @property
    def alert_limit_m(self) -> float | None: ...
    def resolved(self, platform: Platform | None = None) -> Vehicle: ...

@final
class Scenario(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Scenario: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Scenario: ...
    @property
    def site(self) -> Site: ...
    @property
    def vehicle(self) -> Vehicle: ...
    @property
    def size(self) -> dict[str, float]: ...
    def resolved(self, platform: Platform | None = None) -> Scenario: ...

@final
class Plant(_Settings):
    @staticmethod
    def load(name_or_path: str) -> Plant: ...
    @staticmethod
    def from_toml(text: str, origin: str = "<string>") -> Plant: ...
    @property
    def target(self) -> tuple[float, float]: ...
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
        executions: int,
        listened: int,
        duration_s: float,
        extent: str = "value",
    ) -> tuple[float, float, float, str] | None: ...
    def base_wake_up_s(self, vehicle: Vehicle) -> float: ...
    def busy_power_w(self, mode: int, cores: int) -> float | None: ...

@final
class RadioHead:
    @property
    def pci(self) -> int: ...
    @property
    def ssb_index(self) -> int: ...
    @property
    def x_m(self) -> float: ...
    @property
    def y_m(self) -> float: ...
    @property
    def z_m(self) -> float: ...

@final
class SensedSsb:
    @property
    def pci(self) -> int: ...
    @property
    def ssb_index(self) -> int: ...
    @property
    def snr_db(self) -> float: ...
    @property
    def expected_snr_db(self) -> float | None: ...

@final
class Situation:
    @property
    def time_s(self) -> float: ...
    @property
    def speed_mps(self) -> float: ...
    @property
    def x_m(self) -> float: ...
    @property
    def y_m(self) -> float: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def covariance(self) -> list[list[float]] | None: ...
    @property
    def heads(self) -> list[RadioHead]: ...
    @property
    def sensed(self) -> list[SensedSsb]: ...

@final
class SimulationResult:
    @property
    def steps(self) -> dict[str, NDArray[Any]]: ...
    @property
    def runs(self) -> dict[str, NDArray[Any]]: ...
    @property
    def trajectories(self) -> dict[str, NDArray[Any]] | None: ...
    @property
    def integrity(self) -> tuple[dict[str, NDArray[np.float64]], float] | None: ...
    @property
    def executions(self) -> dict[str, Any] | None: ...
    @property
    def error_quantiles_m(self) -> dict[float, float]: ...
    @property
    def errors_m(self) -> NDArray[np.float32] | None: ...

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
class Tapes:
    @staticmethod
    def record(
        scenario: Scenario,
        runs: int = 100,
        seed: int = 1,
        *,
        methods: Sequence[str],
        platform: Platform | None = None,
        threads: int | None = None,
    ) -> Tapes | None: ...
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
    @property
    def sample_rate_hz(self) -> float: ...
    @property
    def centre_frequency_hz(self) -> float | None: ...
    @property
    def channels(self) -> int: ...
    @property
    def length(self) -> int: ...
    @property
    def datatype(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
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
    from_scratch: bool = False,
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
    @property
    def heads(self) -> list[tuple[int, int]]: ...
    def innovations(
        self, site: Site, vehicle: Vehicle, used: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]: ...
    def __len__(self) -> int: ...

@final
class LocatedDrive:
    @property
    def remarks(self) -> list[str]: ...
    @property
    def diagnoses(self) -> list[str]: ...
    @property
    def lost_share(self) -> float: ...
    @property
    def is_lost_for_long(self) -> bool: ...
    @property
    def suspicions(self) -> list[str]: ...
    @property
    def findings(self) -> dict[str, Any]: ...
    @property
    def poses(self) -> dict[str, Any]: ...
    @property
    def smoothed(self) -> dict[str, Any]: ...
    @property
    def angles(self) -> dict[str, Any]: ...
    def write_mcap(self, path: str | PathLike[str]) -> None: ...
    def write_tum(self, path: str | PathLike[str]) -> None: ...
    def write_smoothed_tum(self, path: str | PathLike[str]) -> None: ...
