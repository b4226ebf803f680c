"""Site and paths of the ray-traced street among the reference data, for tests and benches."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from access_av import ray_paths

if TYPE_CHECKING:
    from pathlib import Path

CARRIER_MHZ = 3750.0


def write(street: Path, folder: Path, *, rician_k_db: float, of_each_head: str = "") -> int:
    """Writes ``street.toml`` and ``street.npz``; returns the number of traced positions.

    ``of_each_head`` contains further TOML lines of every radio head.
    """
    heads = pl.read_csv(street / "landmarks.csv").rows()
    road = (street / "road.toml").read_text().split("[track]", 1)[1]
    rows = "".join(
        f"[[radio_heads]]\npci = {pci}\nssb_index = {index}\nposition_m = [{x}, {y}, {z}]\n"
        f"{of_each_head}"
        for index, (pci, x, y, z) in enumerate(heads)
    )
    (folder / "street.toml").write_text(
        f'name = "street"\ncarrier_mhz = {CARRIER_MHZ}\nrician_k_db = {rician_k_db}\n'
        f"[ssb]\nsubcarrier_spacing_khz = 30.0\n[road]\n{road}\n{rows}"
    )
    found = ray_paths.import_paths(
        street / "paths.parquet", str(folder / "street.toml"), folder / "street.npz",
        carrier_mhz=CARRIER_MHZ,
    )  # fmt: skip
    return int(found["places"])
