"""Converts ray-traced paths to the file format of the simulator.

A table has one row per path in the map frame: ``x_m, y_m, z_m`` (position of the array), ``pci``,
``gain_re, gain_im`` (between isotropic antennas), ``delay_s``, ``azimuth_rad, elevation_rad`` of
arrival, and ``ssb_index`` if a cell has several radio heads. ``docs/ray-tracing.md`` describes how
to compute such a table with Sionna RT.
"""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.settings import as_dict
from access_av.tables import validation
from access_av.tables.results_directory import write_whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

_NUMBERS = ("gain_re", "gain_im", "delay_s", "azimuth_rad", "elevation_rad")
_PLACE = ("x_m", "y_m", "z_m")

# Maximum difference of the traced frequency and the carrier, because phases depend on it.
_SAME_CARRIER = 0.01


def import_paths(
    table: pl.DataFrame | str | Path, site: _core.Site | str, out: str | Path, *, carrier_mhz: float
) -> dict[str, int]:
    """Writes the paths of a table as an npz file for the simulator.

    Parameters
    ----------
    table
        Table with one row per path, or its Parquet or CSV file.
    site
        Site of the radio heads, or its name or path.
    out
        npz file to write; ``channel.paths`` of a scenario names it.
    carrier_mhz
        Carrier frequency of the traced paths.

    Returns
    -------
    dict
        Number of ``heads``, ``places`` and ``paths``.

    Raises
    ------
    InputError
        Missing column, number or radio head (with the row); a carrier other than the site's; paths
        that contradict the site, for example shorter than the line of sight. No file is written.

    Examples
    --------
    >>> import tempfile
    >>> table = from_arrays(
    ...     places_m=np.array([[0.0, 0.0, 1.5]]),
    ...     pcis=[7],
    ...     gain=np.array([[[1e-3 + 0j]]]),
    ...     delay_s=np.array([[[5e-7]]]),
    ...     azimuth_rad=np.array([[[0.3]]]),
    ...     zenith_rad=np.array([[[1.5]]]),
    ... )
    >>> site = _core.Site.load("yard").with_overrides({"radio_heads[0].pci": 7})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     import_paths(table, site, f"{folder}/paths.npz", carrier_mhz=3500.0)
    {'heads': 4, 'places': 1, 'paths': 1}
    """
    rows = (
        table if isinstance(table, pl.DataFrame) else validation.read(Path(table), "table of paths")
    )
    held = site if isinstance(site, _core.Site) else _core.Site.load(site)
    of_site = as_dict(held)
    heads, site_mhz = of_site["radio_heads"], of_site["carrier_mhz"]
    where = "paths" if isinstance(table, pl.DataFrame) else str(table)
    indices = {"ssb_index"} & set(rows.columns)
    needed = sorted({*_PLACE, "pci", *_NUMBERS, *indices})
    validation.check(rows, where, numbers=needed)
    rows = rows.with_columns(pl.col(needed).cast(pl.Float64))
    if rows.is_empty():
        raise InputError(f"{where}: the file contains no path")
    if not abs(carrier_mhz / site_mhz - 1.0) <= _SAME_CARRIER:
        raise InputError(
            f"{where}: traced at {carrier_mhz:g} MHz; the site's carrier is {site_mhz:g} MHz"
        )
    if "ssb_index" not in rows.columns:
        first = {head["pci"]: head["ssb_index"] for head in reversed(heads)}
        rows = rows.with_columns(
            ssb_index=pl.col("pci").replace_strict(first, default=0, return_dtype=pl.Float64)
        )
    keys = {(head["pci"], head["ssb_index"]): row for row, head in enumerate(heads)}
    sources = list(rows.select("pci", "ssb_index").unique(maintain_order=True).iter_rows())
    if unknown := [source for source in sources if source not in keys]:
        pci, ssb_index = unknown[0]
        has = ", ".join(f"pci={p} ssb_index={i}" for p, i in keys)
        raise InputError(
            f"{where}: the site has no radio head pci={pci:g} ssb_index={ssb_index:g}; it has {has}"
        )
    places = rows.select(_PLACE).unique(maintain_order=True).with_row_index("place")
    rows = rows.join(places, on=_PLACE, how="left", maintain_order="left")
    of_head = [keys[key] for key in rows.select("pci", "ssb_index").iter_rows()]
    gain = rows["gain_re"].to_numpy() + 1j * rows["gain_im"].to_numpy()
    out = Path(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    written = io.BytesIO()
    np.savez_compressed(
        written,
        carrier_mhz=np.float64(carrier_mhz),
        head_pci=np.array([head["pci"] for head in heads], dtype=np.int32),
        head_ssb_index=np.array([head["ssb_index"] for head in heads], dtype=np.int32),
        head_m=np.array([head["position_m"] for head in heads], dtype=np.float64),
        place_m=np.ascontiguousarray(places.select(_PLACE).to_numpy(), dtype=np.float64),
        path_head=np.array(of_head, dtype=np.int32),
        path_place=rows["place"].to_numpy().astype(np.int32),
        gain=gain.astype(np.complex64),
        delay_s=rows["delay_s"].to_numpy().astype(np.float64),
        azimuth_rad=rows["azimuth_rad"].to_numpy().astype(np.float32),
        elevation_rad=rows["elevation_rad"].to_numpy().astype(np.float32),
    )
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
        unchecked = Path(folder) / out.name
        unchecked.write_bytes(written.getbuffer())
        try:
            _core.check_paths(str(unchecked))
        except _core.SettingsError as error:
            raise InputError(str(error).replace(str(unchecked), where)) from None
    write_whole(out, written.getbuffer())
    return {"heads": len(heads), "places": places.height, "paths": rows.height}


def from_arrays(
    places_m: NDArray[np.float64],
    pcis: list[int],
    gain: NDArray[np.complex128],
    delay_s: NDArray[np.float64],
    azimuth_rad: NDArray[np.float64],
    zenith_rad: NDArray[np.float64],
    *,
    floor_db: float = 40.0,
) -> pl.DataFrame:
    """Converts the arrays of a ray tracer to a table of paths.

    Parameters
    ----------
    places_m
        Positions, shape (places, 3).
    pcis
        Physical cell identity of each radio head.
    gain, delay_s, azimuth_rad, zenith_rad
        Shape (places, heads, paths); a negative delay means no path. Angles of arrival point to the
        origin of the wave; the zenith angle is measured from the vertical.
    floor_db
        Paths weaker than the strongest one of their link by more than this are left out.
    """
    power = np.where(delay_s >= 0.0, np.abs(gain) ** 2, 0.0)
    strongest = power.max(axis=2, keepdims=True)
    place, head, path = np.nonzero((power > strongest * 10 ** (-0.1 * floor_db)) & (power > 0.0))
    kept = place, head, path
    x_m, y_m, z_m = np.asarray(places_m, dtype=np.float64)[place].T
    return pl.DataFrame(
        {
            "x_m": x_m,
            "y_m": y_m,
            "z_m": z_m,
            "pci": np.asarray(pcis)[head],
            "gain_re": gain[kept].real,
            "gain_im": gain[kept].imag,
            "delay_s": delay_s[kept],
            "azimuth_rad": azimuth_rad[kept],
            "elevation_rad": 0.5 * np.pi - zenith_rad[kept],
        }
    )
