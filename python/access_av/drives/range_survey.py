"""Survey of the range offsets of radio heads, from ranges at known positions.

With the distance R to radio head i, the offset b of the radio head and the clock c of the receiver,
which is common to the ranges of an epoch (one-way delays only), a range is

    r = R + b_i + c_t + v

At each position, the medians of the ranges (of one-way delays: of the differences between two radio
heads) determine the offsets, because up to half of the ranges may be outliers. Their mean over the
positions is the offset of the radio head. Multipath makes them differ between positions:
the scatter determines the standard deviation of the offset at another position, with
``ranging.offset_std_m`` as its prior of one degree of freedom.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av import _core
from access_av.errors import InputError
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

# Names of a range log in the folder of a survey.
LOGS = ("ranges.csv", "ranges.log", "ranges.txt")
# Maximum time between successive ranges of an epoch, during which the clock is constant (s).
EPOCH_GAP_S = 0.005
# Maximum movement of a stationary receiver (m): its truth needs no common time with the ranges.
STATIONARY_M = 0.02
# Minimum number of epochs with the ranges of two radio heads.
LEAST_EPOCHS = 10
# Alternating least squares of offsets and clocks over the positions converges within a few steps.
ITERATIONS = 50


@dataclass(frozen=True)
class OffsetSurvey:
    """Surveyed range offsets.

    Attributes
    ----------
    site
        Site with ``range_offset_m`` and ``range_offset_std_m`` of the surveyed radio heads.
    offsets
        One row per radio head: ``pci``, ``ssb_index``, ``range_offset_m``, ``range_offset_std_m``
        (null if there are too few positions and radio heads), ``positions``, ``ranges``.
    remarks
        Defects of single lines of the logs.
    """

    site: _core.Site
    offsets: pl.DataFrame
    remarks: list[str]


@dataclass(frozen=True)
class Ranging:
    """``[ranging]`` of a vehicle.

    Attributes
    ----------
    offset_std_m
        σ of the range offset of a radio head that was not surveyed, in m.
    sigma_m
        σ of a range in m; ``None`` if not specified.
    antenna_m
        Position of the ranging antenna in the vehicle: forward, left and up, in m.
    """

    offset_std_m: float
    sigma_m: float | None
    antenna_m: tuple[float, float, float]

    @classmethod
    def of(cls, vehicle: _core.Vehicle) -> Ranging:
        """Returns the settings of a vehicle; default values if it has no ``[ranging]``."""
        settings = as_dict(vehicle)
        if "ranging" not in settings:
            settings = as_dict(vehicle.with_overrides({"ranging.kind": "one-way"}))
        ranging = settings["ranging"]
        antenna_m = ranging.get("position_m") or settings["array"]["position_m"]
        return cls(ranging["offset_std_m"], ranging.get("sigma_m"), tuple(antenna_m))


def places_of(columns: dict[str, NDArray[Any]], heads: list[dict[str, Any]]) -> NDArray[np.int_]:
    """Returns the number of the radio head of each range; -1 for others."""
    places = {(head["pci"], head["ssb_index"]): at for at, head in enumerate(heads)}
    pairs = zip(columns["pci"].tolist(), columns["ssb_index"].tolist(), strict=True)
    return np.array([places.get(pair, -1) for pair in pairs], int)


def epochs(time_s: Numbers) -> NDArray[np.int_]:
    """Returns the number of the epoch of each time; the times are sorted."""
    return np.cumsum(np.diff(time_s, prepend=-np.inf) > EPOCH_GAP_S) - 1


def log_of(folder: str | Path) -> Path | None:
    """Returns the range log in a folder; ``None`` if there is none."""
    return next((Path(folder) / it for it in LOGS if (Path(folder) / it).is_file()), None)


def survey_offsets(
    site: _core.Site | str, vehicle: _core.Vehicle | str, folders: Sequence[str | Path]
) -> OffsetSurvey:
    """Estimates the range offsets of radio heads from ranges at known positions.

    Parameters
    ----------
    site
        Site, or the name or path of a site file.
    vehicle
        Vehicle, or the name or path of a vehicle file: position of its ranging antenna.
    folders
        One folder per position or drive with ``ranges.csv`` (or ``ranges.log``) and the position,
        ``truth.tum``. The position of a stationary receiver is one line; otherwise the truth must
        have the time of the ranges.

    Raises
    ------
    InputError
        Ranges and truth without common time, or fewer than two radio heads with ranges.
    RecordingError, SettingsError
        When a file is unusable.
    """
    site = _core.Site.load(site) if isinstance(site, str) else site
    vehicle = _core.Vehicle.load(vehicle) if isinstance(vehicle, str) else vehicle
    heads = as_dict(site)["radio_heads"]
    ranging = Ranging.of(vehicle)
    positions_m = np.array([head["position_m"] for head in heads])
    found = np.full((len(folders), len(heads)), np.nan)
    ranges = np.zeros(len(heads), int)
    remarks: list[str] = []
    one_way = False
    for row, folder in enumerate(folders):
        log = log_of(folder)
        if log is None:
            raise InputError(f"{folder}: no range log; add one of {', '.join(LOGS)}")
        columns, one_way, sample_m, said = _core.read_ranges(site, log)
        remarks += [f"{log}: {it}" for it in said]
        index = places_of(columns, heads)
        time_s = columns["time_s"]
        antenna_m = _antenna_m(Path(folder) / "truth.tum", ranging.antenna_m, time_s)
        known = (index >= 0) & np.isfinite(antenna_m[:, 0])
        if not known.any():
            raise InputError(
                f"{log}: no range belongs to a radio head of {site.name} and to the time span of "
                "truth.tum; write one line into truth.tum for a stationary receiver"
            )
        index, time_s, antenna_m = index[known], time_s[known], antenna_m[known]
        distance_m = np.linalg.norm(antenna_m - positions_m[index], axis=1)
        excess_m = columns["range_m"][known] - distance_m
        epoch = epochs(time_s) if one_way else None
        found[row] = median_ranges(excess_m, index, epoch, len(heads), sample_m)
        ranges += np.bincount(index, minlength=len(heads))
    if one_way and np.isfinite(found).any(axis=0).sum() < 2:
        raise InputError(
            "one-way delays of one radio head do not separate its offset from the vehicle clock; "
            "add delays of a second radio head"
        )
    mean_m, std_m = _over_positions(found, ranging.offset_std_m, common=one_way)
    changed: dict[str, Any] = {}
    for at in np.flatnonzero(np.isfinite(mean_m)).tolist():
        changed[f"radio_heads[{at}].range_offset_m"] = float(mean_m[at])
        if std_m is not None:
            changed[f"radio_heads[{at}].range_offset_std_m"] = std_m
    offsets = pl.DataFrame(
        {
            "pci": [it["pci"] for it in heads],
            "ssb_index": [it["ssb_index"] for it in heads],
            "range_offset_m": [None if np.isnan(it) else float(it) for it in mean_m],
            "range_offset_std_m": [None if np.isnan(it) else std_m for it in mean_m],
            "positions": np.isfinite(found).sum(axis=0),
            "ranges": ranges,
        },
        schema_overrides={"range_offset_m": pl.Float64, "range_offset_std_m": pl.Float64},
    )
    return OffsetSurvey(site.with_overrides(changed), offsets, remarks)


def _antenna_m(truth: Path, lever_m: tuple[float, float, float], time_s: Numbers) -> Numbers:
    """Returns x, y and z of the ranging antenna at the times, in m; NaN without truth."""
    true = _core.read_tum(truth)
    x_m, y_m, heading = true["x_m"], true["y_m"], np.unwrap(true["heading_rad"])
    if max(np.ptp(x_m), np.ptp(y_m)) < STATIONARY_M:
        here = [np.full(len(time_s), np.median(it)) for it in (x_m, y_m, heading)]
    else:
        order = np.argsort(true["time_s"])
        here = [
            np.interp(time_s, true["time_s"][order], it[order], np.nan, np.nan)
            for it in (x_m, y_m, heading)
        ]
    forward_m, left_m, up_m = lever_m
    sin, cos = np.sin(here[2]), np.cos(here[2])
    return np.column_stack(
        [
            here[0] + forward_m * cos - left_m * sin,
            here[1] + forward_m * sin + left_m * cos,
            np.full(len(time_s), up_m),
        ]
    )


def median_ranges(
    range_m: Numbers,
    head: NDArray[np.int_],
    epoch: NDArray[np.int_] | None,
    heads: int,
    sample_m: float | None,
) -> Numbers:
    """Returns the median range of each radio head in m; NaN without ranges.

    Parameters
    ----------
    range_m
        Ranges, possibly minus their distances, in m.
    head
        Number of the radio head of each range.
    epoch
        Number of the epoch of each range, whose clock is unknown: the medians are those of the
        differences between radio heads, and the result has the sum 0. ``None`` without a clock.
    heads
        Number of radio heads.
    sample_m
        Interval to which the ranges are rounded in m; ``None`` if they are not rounded.
    """
    width_m = sample_m or 0.0
    if epoch is None:
        means = [_median(range_m[head == at], width_m) for at in range(heads)]
        return np.array(means)
    table = np.full((int(epoch[-1]) + 1, heads), np.nan)
    table[epoch, head] = range_m
    rows, differences_m = [], []
    for one in range(heads):
        for other in range(one):
            difference_m = table[:, one] - table[:, other]
            difference_m = difference_m[np.isfinite(difference_m)]
            if len(difference_m) < LEAST_EPOCHS:
                continue
            # Each difference counts by the square root of its number of epochs.
            weight = math.sqrt(len(difference_m))
            row = np.zeros(heads)
            row[one], row[other] = weight, -weight
            rows.append(row)
            differences_m.append(weight * _median(difference_m, width_m))
    found_m = np.full(heads, np.nan)
    if rows:
        matrix = np.array(rows)
        linked = np.flatnonzero(np.abs(matrix).sum(axis=0))
        solved_m, _, rank, _ = np.linalg.lstsq(
            matrix[:, linked], np.array(differences_m), rcond=None
        )
        # The solution of least norm has the sum 0 if all radio heads are linked by differences.
        if rank == len(linked) - 1:
            found_m[linked] = solved_m
    return found_m


def _median(values: Numbers, width: float) -> float:
    """Returns the median of values that are rounded to multiples of ``width``; NaN of none.

    The values in the interval of the median are uniformly distributed in it (grouped median), so
    that the result is not rounded.
    """
    if len(values) == 0:
        return math.nan
    median = float(np.median(values))
    low = median - 0.5 * width
    inside = int(((values >= low) & (values <= low + width)).sum())
    if width == 0.0 or inside == 0:
        return median
    below = int((values < low).sum())
    return low + (0.5 * len(values) - below) / inside * width


def _over_positions(
    found_m: Numbers, prior_m: float, *, common: bool
) -> tuple[Numbers, float | None]:
    """Returns the offset of each radio head over the positions, and its σ at another position.

    Parameters
    ----------
    found_m
        Offsets in m, one row per position; NaN without ranges.
    prior_m
        σ of the scatter before the survey, in m.
    common
        Whether each position has an unknown common offset, the clock.
    """
    known = np.isfinite(found_m)
    mean_m = np.full(found_m.shape[1], np.nan)
    seen = known.any(axis=0)
    shift_m = np.zeros((len(found_m), 1))
    for _ in range(ITERATIONS):
        mean_m[seen] = np.nanmean((found_m - shift_m)[:, seen], axis=0)
        if not common:
            break
        shift_m = np.nanmean(found_m - mean_m, axis=1, keepdims=True)
    if common:
        mean_m = mean_m - np.nanmean(mean_m)
    residual_m = (found_m - shift_m - mean_m)[known]
    # The mean of each radio head, and one clock per position, of which the first defines the frame.
    freedom = known.sum() - seen.sum() - (len(found_m) - 1 if common else 0)
    if common:
        residual_m = residual_m - residual_m.mean()
    if freedom < 2:
        return mean_m, None
    # Posterior mean of the variance (scaled inverse χ² with a prior of one degree of freedom), so
    # that positions that agree by chance are not taken for exact. The mean is uncertain, too.
    scatter = (prior_m**2 + float((residual_m**2).sum())) / (freedom - 1)
    return mean_m, math.sqrt(scatter * (1.0 + 1.0 / len(found_m)))
