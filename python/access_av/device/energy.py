"""Energy of a time window from sensor values, as an interval.

The interval covers the resolution of the sensor, the age of its value at both ends of the window,
and the power between two values. It does not cover the gain error of the sensor (INA3221: 0.25 %
plus the tolerance of the shunt).
"""

from __future__ import annotations

import random
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from access_av.device.counters import RAPL_UNIT_J, Counters, SensorError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from numpy.typing import NDArray


# Mean interval of sensor reads (s); varied by half, so that no load is synchronous to it.
LOOK_S = 2e-3
# Minimum number of periods in a window: an age of one period at each end is then 2 %.
LEAST_PERIODS = 100
# Two-sided 99.9 % of a normal distribution.
SURE = 3.29
# Maximum ratio of the power of a steady load to its median, in both directions.
MOST_FACTOR = 10.0


class TooShortError(SensorError):
    """Window with too few sensor values."""


@dataclass(frozen=True)
class Interval:
    """A value and the half-width of its symmetric interval."""

    value: float
    half_width: float

    @property
    def low(self) -> float:
        """Returns the lower end."""
        return self.value - self.half_width

    @property
    def high(self) -> float:
        """Returns the upper end."""
        return self.value + self.half_width

    def scaled(self, factor: float) -> Interval:
        """Returns value and half-width multiplied by a factor."""
        return Interval(self.value * factor, self.half_width * factor)


@dataclass(frozen=True)
class Window:
    """Energy of a time window.

    Attributes
    ----------
    start_s, duration_s
        Start time by the clock of the reads, and duration.
    energy_j
        Total energy by the sensor.
    is_constant
        Whether all sensor values were equal.
    """

    start_s: float
    duration_s: float
    energy_j: Interval
    is_constant: bool

    @property
    def power_w(self) -> Interval:
        """Returns the mean power in watts."""
        return self.energy_j.scaled(1.0 / self.duration_s)


def above_idle(busy: Window, idle: Window) -> Interval:
    """Returns the energy of a busy window above that of the idle board, in joules.

    Raises
    ------
    SensorError
        Constant equal values of both windows, because the sensor has stopped.
    """
    if busy.is_constant and idle.is_constant and busy.power_w.value == idle.power_w.value:
        raise SensorError(
            "the sensor stopped: its value is equal in the idle and in the busy phase"
        )
    ratio = busy.duration_s / idle.duration_s
    idle_j = idle.energy_j.scaled(ratio)
    return Interval(
        busy.energy_j.value - idle_j.value, busy.energy_j.half_width + idle_j.half_width
    )


@dataclass
class Recording:
    """Reads sensors in a thread while it is open, and returns the window.

    Attributes
    ----------
    clock
        Monotonic time in seconds.
    look_s
        Mean interval of the reads in seconds.
    start_s, end_s
        Times of opening and closing.
    times_s, values, rounded_w
        Result of each read: time; watts of all rails, or joules of each zone; maximum rounding
        error of the watts.
    """

    counters: Counters
    clock: Callable[[], float] = time.perf_counter
    look_s: float = LOOK_S
    start_s: float = 0.0
    end_s: float = 0.0
    times_s: list[float] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)
    rounded_w: list[float] = field(default_factory=list)
    _failed: SensorError | None = None
    _stop: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def __enter__(self) -> Recording:
        self.start_s = self.clock()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self.end_s = self.clock()

    def _run(self) -> None:
        pauses = random.Random(1)
        try:
            self.look()
            while not self._stop.wait(self.look_s * pauses.uniform(0.5, 1.5)):
                self.look()
            self.look()
        except SensorError as error:
            self._failed = error

    def look(self) -> None:
        """Reads the sensors once."""
        before_s = self.clock()
        if self.counters.zones:
            read = [zone.read_j() for zone in self.counters.zones]
        else:
            pairs = [rail.read_w() for rail in self.counters.rails]
            read = [sum(power_w for power_w, _ in pairs)]
            self.rounded_w.append(sum(rounded_w for _, rounded_w in pairs))
        self.values.append(read)
        self.times_s.append(0.5 * (before_s + self.clock()))

    def window(self) -> Window:
        """Returns the energy between opening and closing.

        Raises
        ------
        SensorError
            Failed, stopped or jumping sensor, or a window that is too short.
        """
        if self._failed is not None:
            raise self._failed
        times_s, values = np.array(self.times_s), np.array(self.values)
        bounds_s = (self.start_s, self.end_s)
        if self.counters.zones:
            ranges_j = [zone.range_j for zone in self.counters.zones]
            return energy_counted(times_s, values, ranges_j, bounds_s)
        rounded_w = np.array(self.rounded_w)
        return energy_sampled(times_s, values[:, 0], rounded_w, self.counters.period_s, bounds_s)


def energy_sampled(
    times_s: NDArray[np.float64],
    power_w: NDArray[np.float64],
    rounded_w: NDArray[np.float64],
    period_s: float | None,
    bounds_s: tuple[float, float],
) -> Window:
    r"""Returns the energy of power samples, each held until the next one.

    Parameters
    ----------
    times_s, power_w, rounded_w
        Times, values and maximum rounding errors of the reads, shape (n,).
    period_s
        Time between two conversions. Default: estimated from the changes of the value.
    bounds_s
        Start and end of the window.

    Notes
    -----
    The power between two values is unknown. Its variance is estimated from successive differences
    (von Neumann), :math:`\delta^2 = \tfrac12 \overline{(p_{k+1}-p_k)^2}`, and the
    energy error is :math:`3.29\,\delta\sqrt{\sum h_k^2}` over steps of :math:`h_k`. A slow drift
    does not contribute. Each end has an error of at most one step.
    """
    start_s, end_s = bounds_s
    duration_s = end_s - start_s
    changes = np.flatnonzero(np.diff(power_w)) + 1
    look_s = float(np.median(np.diff(times_s))) if times_s.size > 1 else duration_s
    if period_s is None:
        # Ignore changes by a single step, which show the drift and not the conversion rate.
        jumps = np.flatnonzero(np.abs(np.diff(power_w)) > 3.0 * rounded_w[1:]) + 1
        gaps_s = np.diff(times_s[jumps])
        period_s = float(np.quantile(gaps_s, 0.1)) if gaps_s.size else look_s
    hold_s = max(period_s, look_s)
    _refuse_short(duration_s, hold_s)
    _refuse_stopped(times_s, changes, end_s)
    _refuse_jumps(power_w, times_s, "W")
    edges_s = np.concatenate([[start_s], times_s[1:], [end_s]])
    energy_j = float(np.sum(power_w * np.diff(edges_s)))
    # Keep one value per conversion.
    stride = max(round(hold_s / look_s), 1)
    kept_w, kept_s = power_w[::stride], times_s[::stride]
    delta_w = float(np.sqrt(0.5 * np.mean(np.diff(kept_w) ** 2)))
    unseen_j = SURE * delta_w * float(np.sqrt(np.sum(np.diff(kept_s) ** 2)))
    ends_j = hold_s * float(np.ptp(power_w))
    half_width = unseen_j + ends_j + float(np.max(rounded_w)) * duration_s
    return Window(start_s, duration_s, Interval(energy_j, half_width), changes.size == 0)


def energy_counted(
    times_s: NDArray[np.float64],
    counters_j: NDArray[np.float64],
    ranges_j: list[float],
    bounds_s: tuple[float, float],
) -> Window:
    """Returns the energy of counters that wrap around at their range.

    Parameters
    ----------
    times_s, counters_j
        Times of the reads, shape (n,), and counter values, shape (n, zones).
    ranges_j
        Range of each counter.
    bounds_s
        Start and end of the window; the counter is read at both.
    """
    start_s, end_s = bounds_s
    duration_s = end_s - start_s
    added_j = np.diff(counters_j, axis=0)
    added_j = np.sum(np.where(added_j < 0.0, added_j + np.array(ranges_j), added_j), axis=1)
    changes = np.flatnonzero(added_j) + 1
    if changes.size == 0:
        raise SensorError("the counter stopped: its value does not change")
    look_s = float(np.median(np.diff(times_s)))
    gaps_s = np.diff(times_s[changes])
    period_s = max(float(np.median(gaps_s)) if gaps_s.size else duration_s, look_s)
    _refuse_short(duration_s, period_s)
    _refuse_stopped(times_s, changes, end_s)
    # Compute the power over ten new values, so that a late value causes no jump.
    edges = np.append(changes[:-10:10], changes[-1])
    total_j = np.concatenate([[0.0], np.cumsum(added_j)])
    power_w = np.diff(total_j[edges]) / np.diff(times_s[edges])
    _refuse_jumps(power_w, times_s[edges[:-1]], "W")
    energy_j = float(total_j[-1])
    # Add the age of the value at both ends, and the time before the first and after the last read.
    age_s = float(np.max(np.diff(np.concatenate([[start_s], times_s[changes], [end_s]]))))
    outside_s = duration_s - float(times_s[-1] - times_s[0])
    ends_j = float(np.max(power_w)) * (age_s + outside_s)
    half_width = ends_j + RAPL_UNIT_J * counters_j.shape[1]
    value_j = energy_j + float(np.mean(power_w)) * outside_s
    return Window(start_s, duration_s, Interval(value_j, half_width), is_constant=False)


def _refuse_short(duration_s: float, period_s: float) -> None:
    least_s = LEAST_PERIODS * period_s
    if duration_s < least_s:
        raise TooShortError(
            f"a window of {duration_s:.3g} s is too short: the sensor has a new value every "
            f"{period_s * 1e3:.3g} ms; {least_s:.3g} s are needed (--window-s)"
        )


def _refuse_stopped(times_s: NDArray[np.float64], changes: NDArray[np.int64], end_s: float) -> None:
    """Raises an error for a value that changed and then stays constant."""
    if changes.size < 10:
        return
    gaps_s = np.diff(np.concatenate([times_s[changes], [end_s]]))
    longest = int(np.argmax(gaps_s))
    if gaps_s[longest] > max(50.0 * float(np.median(gaps_s)), 0.25):
        after_s = times_s[changes[longest]] - times_s[0]
        raise SensorError(f"the sensor stopped {after_s:.2f} s into the window")


def _refuse_jumps(power_w: NDArray[np.float64], times_s: NDArray[np.float64], unit: str) -> None:
    usual = float(np.median(power_w))
    if usual <= 0.0:
        raise SensorError(
            f"the sensor reports {usual:.3g} {unit}: it is not connected, or its polarity is "
            f"reversed"
        )
    wrong = (power_w > MOST_FACTOR * usual) | (power_w < usual / MOST_FACTOR)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise SensorError(
            f"the sensor jumped from {usual:.3g} to {power_w[at]:.3g} {unit} "
            f"{times_s[at] - times_s[0]:.2f} s into the window"
        )
