"""The onboard computer: power modes, base wake-up times, energy per execution with its source."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from access_av import _core
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Mapping

BOUNDARIES = {
    "marginal": "above idle",
    "soc-rails": "rails of the system on chip",
    "wall": "wall socket",
    "unstated": "unknown, because the source does not define it",
}


@dataclass(frozen=True)
class Figure:
    """A number with its provenance and, if known, its range.

    ``provenance`` is ``measured``, ``fitted``, ``datasheet``, ``projected`` or ``assumed``.
    """

    value: float
    provenance: str
    source: str
    boundary: str
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class PowerMode:
    """One power mode of a platform.

    Attributes
    ----------
    base_wake_up_ms
        Minimum interval between executions on this computer, by method.
    energy_per_execution_j
        Energy of one execution, by method.
    """

    number: int
    name: str
    cpu_hz: float
    base_wake_up_ms: Mapping[str, float]
    energy_per_execution_j: Mapping[str, Figure]


@dataclass(frozen=True)
class Platform:
    """Validated platform file.

    Examples
    --------
    >>> Platform.load("jetson-agx-xavier").modes[0].base_wake_up_ms["music"]
    80.0
    """

    core: _core.Platform

    @classmethod
    def load(cls, name_or_path: str) -> Platform:
        """Loads a shipped platform by its name, or a platform file by its path.

        Raises
        ------
        SettingsError
            Unknown name, or unusable file; the message names the key and the allowed values.
        """
        return cls(_core.Platform.load(name_or_path))

    @staticmethod
    def names() -> list[str]:
        """Returns the names of the shipped platforms."""
        return _core.Platform.names()

    @staticmethod
    def schema_json() -> str:
        """Returns the JSON Schema of a platform file."""
        return _core.Platform.schema_json()

    def to_toml(self) -> str:
        """Returns the platform as TOML with all default values."""
        return self.core.to_toml()

    def with_energy(self, energies_j: Mapping[int, Mapping[str, Figure]]) -> Platform:
        """Returns the platform with other energies per execution, by mode number and method."""
        return Platform(
            self.core.with_overrides(
                {
                    f"modes[{index}].energy_per_execution_j.{method.replace('_', '-')}": {
                        key: value for key, value in vars(figure).items() if value is not None
                    }
                    for index, mode in enumerate(self.modes)
                    for method, figure in energies_j[mode.number].items()
                }
            )
        )

    @cached_property
    def name(self) -> str:
        """Returns the short name."""
        return str(as_dict(self.core)["name"])

    @cached_property
    def modes(self) -> tuple[PowerMode, ...]:
        """Returns the power modes in the order of the file."""
        return tuple(
            PowerMode(
                number=mode["mode"],
                name=mode["name"],
                cpu_hz=mode["cpu_mhz"] * 1e6,
                base_wake_up_ms=_by_method(mode["base_wake_up_ms"]),
                energy_per_execution_j={
                    method: Figure(**figure)
                    for method, figure in _by_method(mode["energy_per_execution_j"]).items()
                },
            )
            for mode in as_dict(self.core)["modes"]
        )

    @cached_property
    def energy_boundary(self) -> str:
        """Returns the boundary of the energies per execution as text."""
        found = {
            figure.boundary
            for mode in self.modes
            for figure in mode.energy_per_execution_j.values()
        }
        return "; ".join(BOUNDARIES[boundary] for boundary in sorted(found))


def _by_method(table: Mapping[str, Any]) -> dict[str, Any]:
    return {method.replace("-", "_"): value for method, value in table.items()}
