"""Logs of angles: estimation from samples, writing, and reading of Parquet."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.settings import as_dict
from access_av.tables import validation
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from access_av._core import Site, Vehicle

# Columns of a log that localization uses.
USED = (
    "time_s", "pci", "ssb_index", "phase_rad", "phase_sigma_rad", "angle_rad", "angle_sigma_rad",
    "snr_db", "resolved", "at_head",
)  # fmt: skip


@dataclass(frozen=True)
class AngleLog:
    """The angles of a recording.

    Attributes
    ----------
    angles
        One row per angle. ``phase_sigma_rad`` covers receiver noise and the site's scatter,
        ``phase_noise_sigma_rad`` only receiver noise. Neither covers mounting and calibration of
        the array. An angle that is not ``resolved`` gets a reduced weight.
    site
        Site whose radio heads were received.
    vehicle
        Vehicle whose receiver settings match these standard deviations.
    warnings
        Suspected faults of the recording.
    """

    angles: pl.DataFrame
    site: Site
    vehicle: Vehicle
    warnings: list[str]

    def by_ssb(self) -> pl.DataFrame:
        """Returns per SSB: number of angles, resolved angles, medians of SNR and σ."""
        return (
            self.angles.group_by("pci", "ssb_index")
            .agg(
                pl.len().alias("angles"),
                pl.sum("resolved"),
                pl.median("snr_db", "phase_sigma_rad", "phase_noise_sigma_rad"),
            )
            .sort("pci", "ssb_index")
        )

    def csv(self) -> str:
        """Returns the angles as CSV; leading comments explain the standard deviations."""
        rician_k_db = as_dict(self.site)["rician_k_db"]
        return (
            "# phase_sigma_rad: receiver noise and the site's "
            f"scatter (rician_k_db = {rician_k_db:g})\n"
            "# phase_noise_sigma_rad: receiver noise only\n"
            "# not included: mounting and calibration of the array (vehicle file)\n"
            f"{self.angles.cast({'resolved': pl.UInt8}).write_csv()}"
        )


def estimate_angles(
    site: Site | str | Path,
    recording: str | Path,
    *,
    vehicle: Vehicle | str | Path = "default",
    start_time_s: float = 0.0,
) -> AngleLog:
    """Estimates the angles of a recording with the vehicle's receiver, without localization.

    Parameters
    ----------
    site
        Radio heads, carrier and scatter; or the name or path of a site file.
    recording
        SigMF recording of the array's samples.
    vehicle
        Array, receiver and estimator; or the name or path of a vehicle file.
    start_time_s
        Time of the recording's first sample by the odometry's clock.

    Raises
    ------
    RecordingError
        Unusable recording, or no SSB of the site.
    SettingsError
        Unusable site or vehicle file.

    Examples
    --------
    >>> import tempfile
    >>> import access_av
    >>> with tempfile.TemporaryDirectory() as drive:
    ...     _ = access_av.synthesize("paper-real-odometry-2", drive, duration_s=1.0)
    ...     log = estimate_angles(
    ...         f"{drive}/site.toml", f"{drive}/iq.sigmf-meta", vehicle=f"{drive}/vehicle.toml"
    ...     )
    >>> log.angles["pci"].unique().sort().to_list()
    [1, 2]
    """
    plant = site if isinstance(site, _core.Site) else _core.Site.load(str(site))
    carrier = vehicle if isinstance(vehicle, _core.Vehicle) else _core.Vehicle.load(str(vehicle))
    columns, remarks, warnings = _core.estimate_angles(
        plant, carrier, recording, start_time_s=start_time_s
    )
    angles = TABLES["measurements"].frame(columns).with_columns(pl.col("resolved").cast(pl.Boolean))
    return AngleLog(angles, plant, remarks, warnings)


def columns_of(path: str | Path) -> dict[str, NDArray[np.float64]] | None:
    """Returns the columns of a Parquet log, NaN for missing values; ``None`` for other files.

    Raises
    ------
    InputError
        Damaged file, or a used column without numbers.
    """
    path = Path(path)
    if path.suffix.lower() != ".parquet":
        return None
    table = validation.read(path, "log of angles")
    for name in USED:
        found = table.schema.get(name)
        if found is not None and not (found.is_numeric() or found in (pl.Boolean(), pl.Null())):
            raise InputError(f"{path}: `{name}` is {found}; it must be numbers")
    numbers = table.select(
        pl.col(name).cast(pl.Float64).fill_null(float("nan")) for name in USED if name in table
    )
    return {name: np.ascontiguousarray(numbers[name].to_numpy()) for name in numbers.columns}
