"""Link-level access to the channel models of a scenario's ``[channel]``.

``umi``, ``inf-sl``, ``inf-dl``, ``inf-sh`` and ``inf-dh`` are models of 3GPP TR 38.901 (V19.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from access_av import _core
from access_av.tables.columns import TABLES

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl
    from numpy.typing import NDArray


def drops(
    model: str,
    distance_m: Sequence[float] | NDArray[np.float64],
    *,
    head_height_m: float | None = None,
    array_height_m: float = 1.5,
    carrier_mhz: float = 3500.0,
    seed: int = 1,
) -> pl.DataFrame:
    """Draws independent links of a model, as in a 3GPP calibration.

    Parameters
    ----------
    model
        ``umi``, ``inf-sl``, ``inf-dl``, ``inf-sh`` or ``inf-dh``.
    distance_m
        Horizontal distance of each link.
    head_height_m
        Height of the radio head. Default: that of the model (10 m in ``umi``, 1.5 m in ``inf-sl``
        and ``inf-dl``, 8 m in ``inf-sh`` and ``inf-dh``).
    array_height_m
        Height of the array.
    carrier_mhz
        Carrier frequency.
    seed
        Seed of the random numbers.

    Returns
    -------
    polars.DataFrame
        One row per link; columns ``channel_drops`` of :mod:`access_av.columns`.

    Raises
    ------
    ValueError
        Unknown model, or numbers that are not finite and positive.

    Examples
    --------
    >>> table = drops("inf-sh", np.full(2000, 50.0))
    >>> bool(abs(table["line_of_sight"].mean() - np.exp(-50.0 / 583.0)) < 0.03)
    True
    """
    columns = _core.channel_drops(
        model,
        np.ascontiguousarray(distance_m, dtype=np.float64),
        head_height_m=head_height_m,
        array_height_m=array_height_m,
        carrier_mhz=carrier_mhz,
        seed=seed,
    )
    return TABLES["channel_drops"].frame(columns)
