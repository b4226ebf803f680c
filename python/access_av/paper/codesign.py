"""Comparison of the proposed engine, tracker and policy with the paper's adaptive point.

There are two steps. In the *paper's accounting*, an estimate of the proposed method costs the same
energy as one of the paper, so that only localizer and policy differ. With the *proposed engine*, it
costs its measured cycles at the clock of the power mode. Both include the energy of the receiver,
settling time and burst, for every received SSB. The paper does not state the boundary of its
energies; ours are the energy in addition to a computer that is on. A range sets every parameter to
the same end for both methods.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from access_av.device.platform import Platform
from access_av.paper.interpretations import load
from access_av.paper.own_design import tracked
from access_av.run.simulation import Simulation, simulate
from access_av.statistics.paired import paired_mean

if TYPE_CHECKING:
    from collections.abc import Callable

    from access_av._core import Scenario

PAPERS_BOARD, OUR_BOARD = "jetson-agx-xavier", "jetson-agx-xavier-engine"
EXTENTS = ("low", "value", "high")


@dataclass(frozen=True)
class Point:
    """Result of one localization method in one power mode.

    Attributes
    ----------
    energy_j
        Energy of a trip by the end of the parameter ranges: low, value, high.
    """

    aoa_estimates: float
    bursts_received: float
    rms_error_m: float
    energy_j: tuple[float, ...]
    boundary: str


@dataclass(frozen=True)
class Compared:
    """Comparison of the paper's method and the proposed method in a power mode.

    Attributes
    ----------
    paper, policy, engine
        The paper's adaptive point; the proposed tracker and policy in the paper's accounting; and
        both with the proposed engine.
    rms_error_reduction_m
        RMS error of the paper minus that of the proposed method: mean and 95 % interval.
    """

    mode: int
    paper: Point
    policy: Point
    engine: Point
    rms_error_reduction_m: tuple[float, float, float]

    @property
    def policy_ratio(self) -> float:
        """Maximum energy ratio of proposed and paper's method, in the paper's accounting."""
        return _worst_ratio(self.policy, self.paper)

    @property
    def engine_ratio(self) -> float:
        """Maximum energy ratio of proposed and paper's method, with the proposed engine."""
        return _worst_ratio(self.engine, self.paper)

    @property
    def is_better(self) -> bool:
        """Whether error (with 95 % confidence) and energy (over the whole range) are smaller."""
        return self.rms_error_reduction_m[1] > 0.0 and self.policy_ratio < 1.0


def compare(
    interpretation: str,
    *,
    runs: int,
    seed: int,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[Compared]:
    """Compares both methods in every power mode, on the paper's trip under one interpretation."""
    scenario = load(interpretation).scenario
    papers = Platform(Platform.load(PAPERS_BOARD).core.with_overrides({"receiver.counted": True}))
    ours = Platform.load(OUR_BOARD)
    found = []
    for index, mode in enumerate(papers.modes):
        here = scenario.with_overrides({"vehicle.platform.mode": mode.number})
        there = tracked(here, mode.base_wake_up_ms["music"])
        one = simulate(here, runs=runs, seed=seed, platform=papers, threads=threads)
        other = simulate(there, runs=runs, seed=seed, platform=papers, threads=threads)
        found.append(
            Compared(
                mode=mode.number,
                paper=_point(one, here, papers),
                policy=_point(other, there, papers),
                engine=_point(other, there, ours),
                rms_error_reduction_m=paired_mean(
                    *(it.runs["rms_error_m"].to_numpy() for it in (one, other))
                ),
            )
        )
        if progress is not None:
            progress(index + 1, len(papers.modes))
    return found


def _point(drives: Simulation, scenario: Scenario, platform: Platform) -> Point:
    aoa_estimates, bursts_received = (
        float(drives.runs[name].to_numpy().mean()) for name in ("aoa_estimates", "bursts_received")
    )
    duration_s = float(drives.steps["time_s"].to_numpy().max())
    energies = [
        platform.core.energy_j(
            scenario.vehicle, round(aoa_estimates), round(bursts_received), duration_s, extent
        )
        for extent in EXTENTS
    ]
    known = [energy for energy in energies if energy is not None]
    return Point(
        aoa_estimates=aoa_estimates,
        bursts_received=bursts_received,
        rms_error_m=drives.rms_error_m,
        energy_j=tuple(sum(energy[:3]) for energy in known),
        boundary=known[0][3],
    )


def _worst_ratio(ours: Point, papers: Point) -> float:
    return max(mine / its for mine, its in zip(ours.energy_j, papers.energy_j, strict=True))
