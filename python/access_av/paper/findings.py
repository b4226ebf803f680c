"""What an evaluation obtains for each claim of the paper.

Errors are the mean over the runs of the absolute error, worst along the track. What the paper
states is in ``paper.toml``; how each number is obtained is here. All are arrays over variants
(:mod:`access_av.paper.outcome`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.cost import Saving, roadside_units, sensor_cost_ratio
from access_av.methods import label
from access_av.paper.methods import METHODS
from access_av.paper.statements import of_claim, paper_numbers

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from access_av.paper.outcome import Drives, Numbers, Outcome


class MissingFigureError(Exception):
    """A power mode or an energy that a claim is about and the platform does not have."""


@dataclass(frozen=True)
class Finding:
    """What is obtained for a claim.

    Attributes
    ----------
    value
        The obtained value: an array over variants, or several by name.
    note
        What else there is to say.
    conflict
        What there is to say when the claim is not met.
    """

    value: Numbers | Mapping[Any, Any]
    note: str = ""
    conflict: str = field(default="")


# --- Accuracy -------------------------------------------------------------------------------------


def _largest(values: list[Numbers]) -> Numbers:
    return np.asarray(np.max(np.broadcast_arrays(*values), axis=0), dtype=np.float64)


def _a1(outcome: Outcome) -> Finding:
    drives = list(outcome.adaptive.values())
    worst_x_m, worst_y_m = (
        _largest([getattr(each, name) for each in drives]) for name in ("worst_x_m", "worst_y_m")
    )
    return Finding(
        np.maximum(worst_x_m, worst_y_m),
        note=f"Worst over the modes: X {worst_x_m[0]:.3f} m, Y {worst_y_m[0]:.3f} m.",
    )


def _a2(outcome: Outcome) -> Finding:
    shares = {
        (mode, method): _share_below(ours, outcome.fixed[mode, method])
        for mode, ours in outcome.adaptive.items()
        for method in METHODS
    }
    mode, method = min(shares, key=lambda key: shares[key][0])
    least = np.min(np.broadcast_arrays(*shares.values()), axis=0)
    return Finding(least, note=f"Closest rival: {label(method)} in mode {mode}.")


def _share_below(ours: Drives, rival: Drives) -> Numbers:
    return np.asarray((ours.horizontal_m < rival.horizontal_m).mean(axis=1))


def _a3(outcome: Outcome) -> Finding:
    worst = {method: outcome.every_ssb[method].worst_m for method in METHODS}
    each = ", ".join(f"{label(method)} {value[0]:.2f} m" for method, value in worst.items())
    return Finding(np.mean(list(worst.values()), axis=0), note=f"{each}.")


def _worst_y(outcome: Outcome, method: str) -> Finding:
    fixed = {mode: drives for (mode, of), drives in outcome.fixed.items() if of == method}
    each = {"at every SSB": outcome.every_ssb[method].worst_y_m} | {
        f"in mode {mode}": drives.worst_y_m for mode, drives in fixed.items()
    }
    where = max(each, key=lambda key: each[key][0])
    return Finding(_largest(list(each.values())), note=f"Worst {where}.")


def _a6(outcome: Outcome) -> Finding:
    return Finding(
        _largest([_adaptive(outcome, mode).worst_m for mode in (1, 2, 3)]),
        conflict="Modes 1, 2 and 3 wake up least often.",
    )


# --- Energy ---------------------------------------------------------------------------------------


def _adaptive(outcome: Outcome, mode: int) -> Drives:
    if mode not in outcome.adaptive:
        raise MissingFigureError(f"Platform {outcome.platform} has no mode {mode}.")
    return outcome.adaptive[mode]


def energy_j(outcome: Outcome, mode: int, method: str, *, adaptive: bool = False) -> Numbers:
    """Energy of a trip in a mode.

    Raises
    ------
    MissingFigureError
        When the platform lacks the mode, or an energy per execution of the method in it.
    """
    drives = _adaptive(outcome, mode) if adaptive else None
    if drives is None:
        _adaptive(outcome, mode)
        drives = outcome.fixed[mode, method]
    per_execution_j = outcome.energy_per_execution_j[mode].get(method)
    if per_execution_j is None:
        raise MissingFigureError(
            f"Platform {outcome.platform} has no energy per execution of {label(method)} in "
            f"mode {mode}."
        )
    return np.asarray(drives.executions * per_execution_j + drives.besides_j)


def savings_percent(outcome: Outcome, mode: int) -> dict[str, Numbers]:
    """Energy that adaptive MUSIC saves in a mode, against each fixed method."""
    adaptive_j = energy_j(outcome, mode, "music", adaptive=True)
    return {
        method: np.asarray(100.0 * (1.0 - adaptive_j / energy_j(outcome, mode, method)))
        for method in METHODS
    }


def _mean_saving_percent(outcome: Outcome, mode: int) -> Numbers:
    return np.asarray(np.mean(list(savings_percent(outcome, mode).values()), axis=0))


def _e1(outcome: Outcome) -> Finding:
    return Finding({method: energy_j(outcome, 0, method) for method in METHODS})


def _executions(outcome: Outcome, modes: tuple[int, ...]) -> Finding:
    for mode in modes:
        _adaptive(outcome, mode)
    return Finding(
        {
            method: np.min([outcome.fixed[mode, method].executions for mode in modes], axis=0)
            for method in METHODS
        }
    )


def _e3_saving(outcome: Outcome) -> Finding:
    each = "; ".join(
        f"mode {mode}: "
        + ", ".join(
            f"{label(method)} {percent[0]:.1f} %"
            for method, percent in savings_percent(outcome, mode).items()
        )
        for mode in (6, 7)
    )
    return Finding(
        np.minimum(*(_mean_saving_percent(outcome, mode) for mode in (6, 7))),
        note=f"Mean over the three fixed methods, the lesser of both modes ({each}).",
    )


def _e4(outcome: Outcome) -> Finding:
    means = [_mean_saving_percent(outcome, mode) for mode in outcome.adaptive]
    music = np.mean([savings_percent(outcome, mode)["music"] for mode in outcome.adaptive], axis=0)
    return Finding(
        np.mean(means, axis=0),
        note=(
            "Mean over modes and methods. Against fixed MUSIC alone, where the energy per "
            f"execution cancels out and nothing is fitted: {music[0]:.1f} %."
        ),
        conflict="No power of ESPRIT and Root-MUSIC between half and twice MUSIC's makes it so.",
    )


def saved_per_trip_j(outcome: Outcome, mode: int) -> Numbers:
    """What adaptive MUSIC saves in a mode against MUSIC at its base wake-up time."""
    adaptive_j = energy_j(outcome, mode, "music", adaptive=True)
    return np.asarray(energy_j(outcome, mode, "music") - adaptive_j)


def saving(outcome: Outcome, mode: int) -> Saving:
    """The same as a saving by day and fleet, of the sample as it is."""
    return Saving(
        per_trip_j=float(saved_per_trip_j(outcome, mode)[0]),
        trip_s=outcome.trip_s,
        duty=outcome.duty,
    )


def _e5(outcome: Outcome) -> Finding:
    trips = Saving(0.0, outcome.trip_s, outcome.duty).trips_per_day
    return Finding(saved_per_trip_j(outcome, 0) * trips / 1e3)


def _e6(outcome: Outcome) -> Finding:
    fleet = paper_numbers()["day"]["fleet"]
    return Finding(np.asarray(_e5(outcome).value) * fleet / 1e3, note=f"{fleet} times e5.")


# --- Design space and cost ------------------------------------------------------------------------


def _design_space(outcome: Outcome) -> Finding:
    return Finding(
        {
            mode: {
                "energy_j": energy_j(outcome, mode, "music", adaptive=True),
                "rms_m": drives.rms_error_m,
            }
            for mode, drives in outcome.adaptive.items()
        }
    )


def _d2(outcome: Outcome) -> Finding:
    found = _design_space(outcome)
    return Finding(
        found.value,
        conflict=(
            "Modes 6 and 7 have the same base wake-up time (100 ms), so the adaptive drive and its "
            "error are the same in both; mode 7 needs "
            f"{of_claim('d1_budget_210_j')['energy_j']} J (d1). Whatever bound admits mode 6 "
            "admits mode 7 too, and the paper's list leaves it out."
        ),
    )


def _c1(_: Outcome) -> Finding:
    return Finding(np.array([sensor_cost_ratio()]))


def _c2(_: Outcome) -> Finding:
    four = roadside_units(4)
    return Finding(
        {
            "capital_low": np.array([four.capital_low_usd]),
            "capital_high": np.array([four.capital_high_usd]),
            "yearly": np.array([four.yearly_usd]),
        }
    )


FINDINGS: dict[str, Callable[[Outcome], Finding]] = {
    "a1_adaptive_worst_m": _a1,
    "a2_adaptive_beats_fixed": _a2,
    "a3_theoretical_20ms_worst_m": _a3,
    "a4_esprit_worst_y_m": lambda outcome: _worst_y(outcome, "esprit"),
    "a5_root_music_worst_y_m": lambda outcome: _worst_y(outcome, "root_music"),
    "a6_modes_1_2_3_adaptive_worst_m": _a6,
    "e1_mode0_fixed_j": _e1,
    "e2_mode0_executions": lambda outcome: _executions(outcome, (0,)),
    "e3_mode67_saving_percent": _e3_saving,
    "e3_mode67_executions": lambda outcome: _executions(outcome, (6, 7)),
    "e4_average_saving_percent": _e4,
    "e5_mode0_saved_per_day_kj": _e5,
    "e6_fleet_of_100_saved_per_day_mj": _e6,
    "d1_budget_210_j": _design_space,
    "d2_budget_260_j_rms_015_m": _d2,
    "c1_sensor_cost_ratio_above": _c1,
    "c2_four_rsu_usd": _c2,
}
