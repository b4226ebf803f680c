"""Propagation paths of a small hall by the image method: writes the file ``paths.npz``.

The hall measures 60 m × 24 m × 8 m. Each of the four walls, the floor and the ceiling reflects
once. Three radio heads serve a lane of 40 m through the middle::

    python examples/hall/trace.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from access_av import Site, ray_paths

HERE = Path(__file__).parent
HALL_M = np.array([60.0, 24.0, 8.0])
ARRAY_HEIGHT_M = 1.2
STEP_M = 0.5
# Power reflection coefficient of concrete, at all angles.
REFLECTION = -np.sqrt(0.5)
SPEED_OF_LIGHT_MPS = 299_792_458.0


def images(head_m: np.ndarray) -> np.ndarray:
    """Positions (m) of the head and of its mirror images in the six surfaces, shape (7, 3)."""
    mirrored = np.repeat(head_m[None], 7, axis=0)
    for axis in range(3):
        mirrored[1 + axis, axis] = -head_m[axis]
        mirrored[4 + axis, axis] = 2.0 * HALL_M[axis] - head_m[axis]
    return mirrored


def main() -> None:
    """Computes the paths and writes them."""
    site = Site.load(str(HERE / "site.toml"))
    settings = json.loads(site.to_json())
    heads, carrier_hz = settings["radio_heads"], 1e6 * settings["carrier_mhz"]
    x_m = np.arange(10.0, 50.0 + STEP_M, STEP_M)
    places_m = np.stack([x_m, np.full_like(x_m, 12.0), np.full_like(x_m, ARRAY_HEIGHT_M)], axis=1)
    sources_m = np.stack([images(np.array(head["position_m"])) for head in heads])
    towards_m = sources_m[None] - places_m[:, None, None]
    length_m = np.linalg.norm(towards_m, axis=-1)
    wavelength_m = SPEED_OF_LIGHT_MPS / carrier_hz
    reflection = np.array([1.0] + 6 * [REFLECTION])
    gain = (
        reflection
        * wavelength_m
        / (4.0 * np.pi * length_m)
        * np.exp(-2j * np.pi * length_m / wavelength_m)
    )
    table = ray_paths.from_arrays(
        places_m,
        [head["pci"] for head in heads],
        gain,
        length_m / SPEED_OF_LIGHT_MPS,
        np.arctan2(towards_m[..., 1], towards_m[..., 0]),
        np.arccos(towards_m[..., 2] / length_m),
    )
    print(ray_paths.import_paths(table, site, HERE / "paths.npz", carrier_mhz=1e-6 * carrier_hz))


if __name__ == "__main__":
    main()
