"""Energy of a window from what a sensor said in it, as an interval.

The interval holds what the sensor cannot tell: the steps it counts in, how old its value is at
either end of the window, and what happened between two values. It does not hold the gain error of
the sensor itself (INA3221: 0.25 % and its shunt's tolerance).
"""

from __future__ import annotations

import random
import threading
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from access_av.device.counters import RAPL_UNIT_J, SensorError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from numpy.typing import NDArray

    from access_av.device.counters import Counters

# Time between two looks at a sensor; varied by half, so that no load keeps step with it.
LOOK_S = 2e-3
# A value that is old by one period at each end errs by 2 % at most in a window of as many.
LEAST_PERIODS = 100
# Two-sided 99.9 % of a normal distribution.
SURE = 3.29
# One steady load does not draw ten times its median power, nor a tenth of it.
MOST_FACTOR = 10.0


class TooShortError(SensorError):
    """A window in which the sensor has too few values."""


@dataclass(frozen=True)
class Interval:
    """A value and how far the truth may be from it, either way."""

    value: float
    half_width: float

    @property
    def low(self) -> float:
        """Lower end."""
        return self.value - self.half_width

    @property
    def high(self) -> float:
        """Upper end."""
        return self.value + self.half_width

    def scaled(self, factor: float) -> Interval:
        """Both times a factor."""
        return Interval(self.value * factor, self.half_width * factor)


@dataclass(frozen=True)
class Window:
    """Energy of a stretch of time.

    Attributes
    ----------
    start_s, duration_s
        By the clock it was read with, and how long it was.
    energy_j
        All that the sensor saw.
    is_constant
        Whether the sensor said the same all the time.
    """

    start_s: float
    duration_s: float
    energy_j: Interval
    is_constant: bool

    @property
    def power_w(self) -> Interval:
        """Mean power."""
        return self.energy_j.scaled(1.0 / self.duration_s)


def above_idle(busy: Window, idle: Window) -> Interval:
    """Energy of a busy window above what the idle board draws in the same time, in joules.

    Raises
    ------
    SensorError
        When the sensor says the same of both, all the time: it stands still.
    """
    if busy.is_constant and idle.is_constant and busy.power_w.value == idle.power_w.value:
        raise SensorError("the sensor stopped: it says the same, idle and busy")
    ratio = busy.duration_s / idle.duration_s
    idle_j = idle.energy_j.scaled(ratio)
    return Interval(
        busy.energy_j.value - idle_j.value, busy.energy_j.half_width + idle_j.half_width
    )


@dataclass
class Recording:
    """Reads sensors on a thread of its own for as long as it is open, then gives the window.

    Attributes
    ----------
    clock
        Monotonic time in seconds.
    look_s
        Mean time between two looks.
    start_s, end_s
        When it was opened and closed.
    times_s, values, rounded_w
        What each look found: when; watts of all rails, or joules of each zone; how far rounding
        may have taken the watts.
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
        """Read the sensors once."""
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
        """Energy between opening and closing.

        Raises
        ------
        SensorError
            When the sensor failed, stopped or jumped, or the window is too short for it.
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
    r"""Energy from samples of power, held from one to the next.

    Parameters
    ----------
    times_s, power_w, rounded_w
        When it was read, what it said, and how far rounding may have taken that; shape (n,).
    period_s
        Time between two conversions; ``None`` to take it from how often the value changes.
    bounds_s
        Start and end of the window.

    Notes
    -----
    Between two values the power is not known. Its unseen part is taken from what a value differs
    from the next by (von Neumann), :math:`\delta^2 = \tfrac12 \overline{(p_{k+1}-p_k)^2}`, and the
    energy errs by :math:`3.29\,\delta\sqrt{\sum h_k^2}` over steps of :math:`h_k`. A slow drift
    takes no part in it. Each end may be off by one step.
    """
    start_s, end_s = bounds_s
    duration_s = end_s - start_s
    changes = np.flatnonzero(np.diff(power_w)) + 1
    look_s = float(np.median(np.diff(times_s))) if times_s.size > 1 else duration_s
    if period_s is None:
        # Changes by a single step say how fast the power drifts, not how often it is measured.
        jumps = np.flatnonzero(np.abs(np.diff(power_w)) > 3.0 * rounded_w[1:]) + 1
        gaps_s = np.diff(times_s[jumps])
        period_s = float(np.quantile(gaps_s, 0.1)) if gaps_s.size else look_s
    hold_s = max(period_s, look_s)
    _refuse_short(duration_s, hold_s)
    _refuse_stopped(times_s, changes, end_s)
    _refuse_jumps(power_w, times_s, "W")
    edges_s = np.concatenate([[start_s], times_s[1:], [end_s]])
    energy_j = float(np.sum(power_w * np.diff(edges_s)))
    # One value per conversion.
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
    """Energy from counters that start again at their range.

    Parameters
    ----------
    times_s, counters_j
        When they were read, shape (n,), and what they said, shape (n, zones).
    ranges_j
        Where each starts again.
    bounds_s
        Start and end of the window; the counter is read at both.
    """
    start_s, end_s = bounds_s
    duration_s = end_s - start_s
    added_j = np.diff(counters_j, axis=0)
    added_j = np.sum(np.where(added_j < 0.0, added_j + np.array(ranges_j), added_j), axis=1)
    changes = np.flatnonzero(added_j) + 1
    if changes.size == 0:
        raise SensorError("the counter stopped: it counts nothing")
    look_s = float(np.median(np.diff(times_s)))
    gaps_s = np.diff(times_s[changes])
    period_s = max(float(np.median(gaps_s)) if gaps_s.size else duration_s, look_s)
    _refuse_short(duration_s, period_s)
    _refuse_stopped(times_s, changes, end_s)
    # Power from every tenth new value to the next: one that comes late makes no jump.
    edges = np.append(changes[:-10:10], changes[-1])
    total_j = np.concatenate([[0.0], np.cumsum(added_j)])
    power_w = np.diff(total_j[edges]) / np.diff(times_s[edges])
    _refuse_jumps(power_w, times_s[edges[:-1]], "W")
    energy_j = float(total_j[-1])
    # How old a value may be at either end; and the window is a little longer than its readings.
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
    """Refuse a value that used to change and then stays the same."""
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
        raise SensorError(f"the sensor says {usual:.3g} {unit}: it is not connected, or reversed")
    wrong = (power_w > MOST_FACTOR * usual) | (power_w < usual / MOST_FACTOR)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise SensorError(
            f"the sensor jumped from {usual:.3g} to {power_w[at]:.3g} {unit} "
            f"{times_s[at] - times_s[0]:.2f} s into the window"
        )
