"""Bound of the position error by kind of measurement, clocks and road.

A linear filter at the true trajectory gives the posterior Cramér-Rao bound (Tichavský, Muravchik
and Nehorai, IEEE Trans. Signal Processing 46, 1998). Its states are position, heading, odometer
scale and yaw rate bias of the vehicle, offset and drift of its clock, and an offset of the delays
and of the carrier phases of each radio head.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from access_av.run.error_bound import SPEED_OF_LIGHT_MPS, along_route
from access_av.settings import as_dict

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from access_av import _core

METRES_PER_NS = 1e-9 * SPEED_OF_LIGHT_MPS

# Standard deviation of the delay and of the carrier phase with multipath (K = 10 dB, delay spread
# 30 ns), in m.
DELAY_STD_M = 1.5
PHASE_STD_M = 0.002
# Standard deviation of the received power in dB, and its correlation length in m.
POWER_STD_DB = 3.0
POWER_CORRELATION_M = 10.0
# Standard deviation of the odometer scale, of the distance after 1 m (m), of the heading after 1 s
# (rad) and of the yaw rate bias (rad/s).
SCALE_STD = 0.003
ODOMETER_M_PER_SQRT_M = 0.01
GYROSCOPE_RAD_PER_SQRT_S = 0.001
BIAS_STD_RADPS = 0.001
# Standard deviation of unknown offsets (m), of the clock drift (m/s) and of its walk with a clock
# of 1 ns/√s (m/s/√s).
UNKNOWN_OFFSET_M = 100.0
DRIFT_STD_MPS = METRES_PER_NS * 2000.0
DRIFT_WALK_MPS_PER_SQRT_S = METRES_PER_NS * 0.1
# Lateral deviation from a known road (m), and the distance after which it is independent (m).
LANE_RMS_M = 0.1
LANE_CORRELATION_M = 15.0
# Number of bursts that are processed together.
BURSTS = 4
# Share of the drive before the mean bound, in which the offsets are learnt.
SETTLING_SHARE = 1.0 / 3.0

_X, _Y, _HEADING, _SCALE, _BIAS, _CLOCK, _DRIFT, _FIRST = range(8)

KINDS: Mapping[str, frozenset[str]] = {
    "angles": frozenset(),
    "angles, power": frozenset({"power"}),
    "angles, delays": frozenset({"delay"}),
    "angles, phases": frozenset({"phase"}),
}

# Numbers of radio heads of the table, in the order of the site file, in addition to all of them.
NUM_HEADS = (1, 2)


@dataclass(frozen=True)
class Clocks:
    """Random walk of the clocks of radio heads and vehicle in ns/√s."""

    heads_ns_per_sqrt_s: float
    vehicle_ns_per_sqrt_s: float


CLOCKS: Mapping[str, Clocks] = {
    "heads 1 ns/√s": Clocks(1.0, 1.0),
    "heads 0.1 ns/√s": Clocks(0.1, 1.0),
    "heads 0.01 ns/√s": Clocks(0.01, 1.0),
    "heads on one oscillator": Clocks(0.0, 1.0),
    "heads and vehicle 0.01 ns/√s": Clocks(0.01, 0.01),
}


def kinds_table(scenario: _core.Scenario) -> pl.DataFrame:
    """Computes the bound for every kind of measurement and clock, with and without a road.

    Parameters
    ----------
    scenario
        Scenario with the radio heads, the road and the array.

    Returns
    -------
    polars.DataFrame
        Columns ``bound_kinds`` of :mod:`access_av.columns`: RMS of the bound over the last two
        thirds of the route.
    """
    whole = _Drive.of(scenario)
    every = len(whole.heads_m)
    rows: list[dict[str, Any]] = []
    for number in [*(it for it in NUM_HEADS if it < every), every]:
        drive = replace(whole, heads_m=whole.heads_m[:number])
        for kinds, extra in KINDS.items():
            depends_on_clocks = bool(extra & {"delay", "phase"})
            for name, clocks in list(CLOCKS.items())[: None if depends_on_clocks else 1]:
                without, with_road = (
                    drive.bound_m(extra, clocks, road=road) for road in (False, True)
                )
                rows.append(
                    {
                        "num_heads": number,
                        "kinds": kinds,
                        "clocks": name if depends_on_clocks else "any",
                        "bound_without_road_m": without,
                        "bound_with_road_m": with_road,
                    }
                )
    return pl.DataFrame(rows)


@dataclass(frozen=True, eq=False)
class _Drive:
    """True trajectory, radio heads and array."""

    time_s: NDArray[np.float64]
    place_m: NDArray[np.float64]
    heads_m: NDArray[np.float64]
    array_height_m: float
    angle_information: float
    wavelength_m: float
    start_std_m: float
    start_heading_std_rad: float

    @classmethod
    def of(cls, scenario: _core.Scenario) -> _Drive:
        site, vehicle = as_dict(scenario.site), as_dict(scenario.vehicle)
        route = along_route(scenario)
        array = vehicle["array"]
        number = array["elements"]
        spacing = array["spacing_wavelengths"]
        # Variance of ω due to scatter: 1/(2 K A) with A the sum of the squared positions.
        aperture = number * (number**2 - 1) / 12.0
        rician_k = 10.0 ** (0.1 * site["rician_k_db"])
        start = vehicle["start"]
        return cls(
            time_s=route["time_s"].to_numpy()[::BURSTS],
            place_m=route.select("x_m", "y_m").to_numpy()[::BURSTS],
            heads_m=np.array([head["position_m"] for head in site["radio_heads"]], dtype=float),
            array_height_m=float(array["position_m"][2]),
            angle_information=2.0 * rician_k * aperture * (2.0 * math.pi * spacing) ** 2,
            wavelength_m=SPEED_OF_LIGHT_MPS / (site["carrier_mhz"] * 1e6),
            start_std_m=max(start["position_std_m"], 1e-3),
            start_heading_std_rad=max(start["heading_std_rad"], 1e-4),
        )

    def bound_m(self, kinds: frozenset[str], clocks: Clocks, *, road: bool) -> float:
        """Returns the RMS of the bound in m."""
        number = len(self.heads_m)
        count = _FIRST + 2 * number
        offset, phase = _FIRST, _FIRST + number
        covariance = np.zeros((count, count))
        stds = [
            self.start_std_m, self.start_std_m, self.start_heading_std_rad, SCALE_STD,
            BIAS_STD_RADPS, UNKNOWN_OFFSET_M, DRIFT_STD_MPS,
        ]  # fmt: skip
        stds += [UNKNOWN_OFFSET_M] * (2 * number)
        covariance[np.diag_indices(count)] = np.square(stds)
        # The clock of a radio head is part of the offsets of its delays and of its phases.
        heads_walk = (METRES_PER_NS * clocks.heads_ns_per_sqrt_s) ** 2
        vehicle_walk = (METRES_PER_NS * clocks.vehicle_ns_per_sqrt_s) ** 2
        drift_walk = (DRIFT_WALK_MPS_PER_SQRT_S * clocks.vehicle_ns_per_sqrt_s) ** 2
        squares = []
        for step in range(1, len(self.time_s)):
            duration_s = float(self.time_s[step] - self.time_s[step - 1])
            along = self.place_m[step] - self.place_m[step - 1]
            length_m = float(np.hypot(*along))
            if length_m == 0.0 or duration_s <= 0.0:
                continue
            motion = np.eye(count)
            motion[_X, _HEADING], motion[_Y, _HEADING] = -along[1], along[0]
            motion[_X, _SCALE], motion[_Y, _SCALE] = -along
            motion[_HEADING, _BIAS] = -duration_s
            motion[_CLOCK, _DRIFT] = duration_s
            covariance = motion @ covariance @ motion.T
            unit = along / length_m
            covariance[:2, :2] += ODOMETER_M_PER_SQRT_M**2 * length_m * np.outer(unit, unit)
            covariance[_HEADING, _HEADING] += GYROSCOPE_RAD_PER_SQRT_S**2 * duration_s
            covariance[_CLOCK, _CLOCK] += vehicle_walk * duration_s
            covariance[_DRIFT, _DRIFT] += drift_walk * duration_s
            for head in range(number):
                both = [offset + head, phase + head]
                covariance[np.ix_(both, both)] += heads_walk * duration_s
            rows, variances = self._measurements(step, kinds, unit, length_m, road=road)
            # Joseph form, because the variances differ by twelve orders of magnitude.
            innovation = rows @ covariance @ rows.T + np.diag(variances)
            gain = np.linalg.solve(innovation, rows @ covariance).T
            rest = np.eye(count) - gain @ rows
            covariance = rest @ covariance @ rest.T + (gain * variances) @ gain.T
            if step > SETTLING_SHARE * len(self.time_s):
                squares.append(covariance[_X, _X] + covariance[_Y, _Y])
        return math.sqrt(float(np.mean(squares)))

    def _measurements(
        self,
        step: int,
        kinds: frozenset[str],
        unit: NDArray[np.float64],
        length_m: float,
        *,
        road: bool,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns the Jacobian and the variances of the measurements of one burst."""
        number = len(self.heads_m)
        rows: list[NDArray[np.float64]] = []
        variances: list[float] = []

        def add(entries: dict[int, float], variance: float) -> None:
            row = np.zeros(_FIRST + 2 * number)
            for state, value in entries.items():
                row[state] = value
            rows.append(row)
            variances.append(variance)

        # Scatter is independent after half a wavelength.
        repeated = max(1.0 / BURSTS, 0.5 * self.wavelength_m / length_m)
        for head, place_m in enumerate(self.heads_m):
            away = self.place_m[step] - place_m[:2]
            ground_m = float(np.hypot(*away))
            range_m = math.hypot(ground_m, float(place_m[2]) - self.array_height_m)
            level = ground_m / range_m
            sine = float(unit[0] * away[1] - unit[1] * away[0]) / ground_m
            information = self.angle_information * (level * sine) ** 2
            if information > 0.0:
                turn = {
                    _X: -float(away[1]) / ground_m**2,
                    _Y: float(away[0]) / ground_m**2,
                    _HEADING: -1.0,
                }
                add(turn, repeated / information)
            longer = {_X: float(away[0]) / range_m, _Y: float(away[1]) / range_m}
            if "power" in kinds:
                std_m = range_m * math.log(10.0) / 20.0 * POWER_STD_DB
                add(longer, std_m**2 * max(1.0, POWER_CORRELATION_M / length_m))
            if "delay" in kinds:
                own = {**longer, _CLOCK: 1.0, _FIRST + head: 1.0}
                add(own, DELAY_STD_M**2 * repeated)
            if "phase" in kinds:
                own = {**longer, _CLOCK: 1.0, _FIRST + number + head: 1.0}
                add(own, PHASE_STD_M**2 * repeated)
        if road:
            weight = max(1.0, LANE_CORRELATION_M / length_m)
            add({_X: -float(unit[1]), _Y: float(unit[0])}, LANE_RMS_M**2 * weight)
            add({_HEADING: 1.0}, (LANE_RMS_M / LANE_CORRELATION_M) ** 2 * weight)
        return np.array(rows), np.array(variances)
