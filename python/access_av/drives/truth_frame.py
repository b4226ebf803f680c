"""Plausibility of a reference trajectory: steps, unit and frame of its positions."""

from __future__ import annotations

import math

import numpy as np
import polars as pl

from access_av.errors import InputError

# Median distance (m) between truth and drive above which they are in different frames.
OTHER_FRAME_M = 1e4

# Maximum speed (m/s) of a step of the truth, and minimum length (m) of an impossible step.
MAX_SPEED_MPS = 50.0
MIN_JUMP_M = 1.0

# Extent of the truth relative to that of the drive below which its unit is not metres, and minimum
# extent of the drive (m) for the comparison of extents. A degree is 1e5 m.
MIN_EXTENT = 1e-3
MIN_EXTENT_OF_DRIVE_M = 1.0

# Percentiles of the coordinates that determine an extent.
OF_EXTENT = (5, 95)

# Units per metre of a truth that is not in metres, and the range of the ratio of two equal extents.
UNITS = {"millimetres": 1e3, "centimetres": 1e2, "kilometres": 1e-3}
EQUAL_EXTENTS = (0.7, 1.4)

# Minimum RMS error of a drive (m) for the search of a rigid motion of the truth, and maximum
# remaining share of the error after this motion.
MIN_ERROR_M = 1.0
REMAINING = 0.1


def check(which: str, known: pl.DataFrame, true: pl.DataFrame, errors: pl.DataFrame) -> None:
    """Rejects a truth with impossible steps, or in another frame or unit than the map's.

    Parameters
    ----------
    which
        Name of the truth in messages.
    known
        Poses of the drive: ``time_s``, ``x_m``, ``y_m``.
    true
        True poses: ``time_s``, ``x_m``, ``y_m``, in order of time.
    errors
        Errors of the drive: ``error_m``.

    Raises
    ------
    InputError
        When a check fails.
    """
    apart_m = errors["error_m"].median()
    if isinstance(apart_m, float) and apart_m > OTHER_FRAME_M:
        x_m, y_m = true["x_m"][0], true["y_m"][0]
        raise InputError(
            f"{which}: its first position ({x_m:.0f}, {y_m:.0f}) is in another frame, "
            f"{apart_m / 1e3:.0f} km from the drive (UTM coordinates?); it must be in metres in "
            "the frame of the site: subtract the site's origin"
        )
    within = true.filter(pl.col("time_s").is_between(known["time_s"][0], known["time_s"][-1]))
    if within.is_empty():
        return
    drive_m, true_m = _extent_m(known), _extent_m(within)
    if drive_m > MIN_EXTENT_OF_DRIVE_M:
        if true_m < MIN_EXTENT * EQUAL_EXTENTS[0] * drive_m:
            raise InputError(
                f"{which}: its positions extend over {true_m:.2g}, those of the drive over "
                f"{drive_m:.1f} m (longitude and latitude in degrees?); they must be in metres in "
                "the frame of the site"
            )
        for unit, per_metre in UNITS.items():
            if EQUAL_EXTENTS[0] < true_m / per_metre / drive_m < EQUAL_EXTENTS[1]:
                raise InputError(
                    f"{which}: its positions extend over {true_m:.4g}, those of the drive over "
                    f"{drive_m:.1f} m ({unit}?); they must be in metres in the frame of the site"
                )
    _check_steps(which, within)


def explanation(poses: pl.DataFrame, errors: pl.DataFrame) -> str | None:
    """Returns the rigid motion of the truth that removes most of the error; ``None`` without one.

    A truth in another frame has a large error that one displacement, rotation or reflection of the
    whole truth removes.

    Parameters
    ----------
    poses
        Poses of the drive: ``time_s``, ``x_m``, ``y_m``.
    errors
        Errors of the drive: ``time_s``, ``error_x_m``, ``error_y_m``.
    """
    both = errors.join(poses.select("time_s", "x_m", "y_m"), on="time_s", maintain_order="left")
    found = both.select("x_m", "y_m").to_numpy()
    true = found - both.select("error_x_m", "error_y_m").to_numpy()
    rms_m = float(np.sqrt(((found - true) ** 2).sum(axis=1).mean()))
    if not rms_m > MIN_ERROR_M:
        return None
    to, start = found.mean(axis=0), true.mean(axis=0)
    u, _, vt = np.linalg.svd((true - start).T @ (found - to))
    best = math.inf, ""
    for flip in (1.0, -1.0):
        sign = flip * np.sign(np.linalg.det(u @ vt))
        turn = (u @ np.diag([1.0, sign]) @ vt).T
        left = found - to - (true - start) @ turn.T
        left_m = float(np.sqrt((left**2).sum(axis=1).mean()))
        # A reflection must be clearly better than a rotation, which is more usual.
        if left_m < REMAINING * min(rms_m, best[0]):
            shift = to - turn @ start
            mirrored = ", with y reversed before" if flip < 0 else ""
            turned_rad = math.atan2(turn[1, 0], turn[0, 0])
            moved = f"turned by {turned_rad:.2f} rad{mirrored} and moved by ({shift[0]:.1f}, "
            text = (
                f"if all its positions are {moved}{shift[1]:.1f}) m, the RMS is {left_m:.3f} m in "
                f"place of {rms_m:.3f} m; check whether it is in the frame of the site, and the "
                "start pose"
            )
            best = left_m, text
    return best[1] or None


def _extent_m(of: pl.DataFrame) -> float:
    """Returns the extent of the positions in metres, without single outliers."""
    places = of.select("x_m", "y_m").to_numpy()
    low, high = np.percentile(places, OF_EXTENT, axis=0)
    return math.hypot(*(high - low))


def _check_steps(which: str, true: pl.DataFrame) -> None:
    """Rejects steps that no vehicle can make."""
    steps = true.with_columns(
        step_s=pl.col("time_s").diff(),
        step_m=(pl.col("x_m").diff() ** 2 + pl.col("y_m").diff() ** 2).sqrt(),
    )
    is_jump = (pl.col("step_m") > MIN_JUMP_M) & (
        pl.col("step_m") > MAX_SPEED_MPS * pl.col("step_s")
    )
    jumps = steps.filter(is_jump)
    if not jumps.is_empty():
        first = jumps.row(0, named=True)
        raise InputError(
            f"{which}: its position jumps by {first['step_m']:.4g} m in {first['step_s']:.4g} s "
            f"at {first['time_s']:.3f} s ({jumps.height} such steps); at most {MAX_SPEED_MPS:g} "
            "m/s is possible; remove the wrong poses"
        )
