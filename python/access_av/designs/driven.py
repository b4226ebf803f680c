"""Simulation of designs with common random numbers, so that differences are not random."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from access_av._core import Scenario, SettingsError
from access_av.designs.space import shown
from access_av.device.platform import Platform
from access_av.errors import InputError
from access_av.run.campaign import Campaign, Task
from access_av.run.pairs import ErrorSamples
from access_av.run.plug_in_files import checksum, load, split
from access_av.run.simulation import simulate
from access_av.settings import platform_name
from access_av.statistics.percentiles import PERCENTS, Percentile

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    # Results of the runs of a scenario, by name.
    Part: TypeAlias = Mapping[str, NDArray[Any]]

# Interval of the stored errors along the track, in SSBs.
TRACK_EVERY = 25
# Interval of the stored errors of each run, in SSBs, sufficient for percentiles.
ERROR_EVERY = 10
# Platform of all runs, because only the energies depend on the platform.
ANY_BOARD = "jetson-agx-xavier"


@dataclass(frozen=True)
class Design:
    """One combination of values.

    Attributes
    ----------
    label
        Display name: values that differ between designs.
    world
        Name of the environment; empty if there is only one.
    plug_ins
        Plug-ins by role, as ``FILE.py:NAME``.
    """

    values: Mapping[str, Any]
    label: str
    scenario: Scenario
    platform: Platform
    world: str = ""
    plug_ins: Mapping[str, str] = field(default_factory=dict)

    @property
    def driven(self) -> str:
        """Returns the scenario without its platform; designs with equal scenarios have equal runs.

        A plug-in estimator has its own energy, which depends on the platform.
        """
        if "estimator" in self.plug_ins:
            return self.scenario.to_toml()
        board = {"vehicle.platform.name": ANY_BOARD, "vehicle.platform.mode": 0}
        return self.scenario.with_overrides(board).to_toml()


@dataclass(frozen=True)
class Driven:
    """A design and the results of its runs.

    Attributes
    ----------
    square_m2, energy_j
        Mean squared horizontal error and energy of each run, shape (runs,); infinite if the
        vehicle was never found, or the platform has no energy.
    track_s, track_m2
        Times, and mean squared error over the runs at these times.
    worlds
        Results in each environment, if there are several. The other attributes are then those of
        the environment with the maximum energy or error, respectively.
    """

    design: Design
    square_m2: NDArray[np.float64]
    energy_j: NDArray[np.float64]
    worst_m: NDArray[np.float64]
    errors: ErrorSamples
    aoa_estimates: NDArray[np.float64]
    bursts_received: NDArray[np.float64]
    track_s: NDArray[np.float64]
    track_m2: NDArray[np.float64]
    worlds: tuple[Driven, ...] = ()

    @property
    def rms_m(self) -> float:
        """Returns the root mean square error over track and runs."""
        return float(np.sqrt(np.mean(self.square_m2)))

    @property
    def p90_worst_m(self) -> float:
        """Returns the 90th percentile over the runs of the maximum error."""
        return float(np.quantile(self.worst_m, 0.9))

    @property
    def mean_energy_j(self) -> float:
        """Returns the mean energy of a trip."""
        return float(np.mean(self.energy_j))

    def percentiles(
        self, percents: Sequence[float] = PERCENTS, *, of_seen: bool = False
    ) -> list[Percentile]:
        """Returns percentiles of the horizontal error, each of the environment with the maximum.

        With ``of_seen`` the intervals are those of the bootstrap, which ignores events that did not
        occur in the runs. Comparisons of designs use them.
        """
        if self.worlds:
            each = [world.percentiles(percents, of_seen=of_seen) for world in self.worlds]
            return [
                max(of_worlds, key=lambda found: found.value)
                for of_worlds in zip(*each, strict=True)
            ]
        return self.errors.percentiles(percents, of_seen=of_seen)


def in_worst(worlds: Sequence[Driven]) -> Driven:
    """Returns the results of a design in its worst environments.

    The energy is that of the environment with the maximum energy, the errors are those of the
    environment with the maximum mean square.
    """
    if len(worlds) == 1:
        return worlds[0]
    worst = max(worlds, key=lambda each: each.rms_m)
    most = max(worlds, key=lambda each: each.mean_energy_j)
    return replace(worst, energy_j=most.energy_j, worlds=tuple(worlds))


def designs_of(
    scenario: Scenario,
    choices: Sequence[Mapping[str, Any]],
    given: Mapping[str, Any] | None = None,
    world: str = "",
) -> list[Design]:
    """Returns the designs: the scenario with each choice, in one environment.

    Raises
    ------
    InputError
        Invalid choice; the message names it, the key and the allowed values.
    """
    platforms: dict[str, Platform] = {}
    found = []
    varying = [
        key for key in (choices[0] if choices else {}) if len({str(it[key]) for it in choices}) > 1
    ]
    for values in choices:
        try:
            # Tables first: `vehicle.wake_up` before `vehicle.wake_up.target_error_m`.
            settings, plug_ins = split(values)
            for role, text in plug_ins.items():
                load(role, text)
            ordered = dict(sorted({**settings, **(given or {})}.items()))
            changed = scenario.with_overrides(ordered)
            name = platform_name(changed.vehicle)
            board = platforms.setdefault(name, Platform.load(name))
            resolved = changed.resolved(board.core)
            board.core.energy_j(resolved.vehicle, 0, 0, 0.0)
        except SettingsError as error:
            raise InputError(f"design {ordered}: {error}") from error
        label = shown({key: values[key] for key in varying})
        found.append(Design(values, label, resolved, board, world, plug_ins))
    return found


def in_worlds(
    scenario: Scenario,
    choices: Sequence[Mapping[str, Any]],
    worlds: Mapping[str, Mapping[str, Any]],
) -> list[tuple[Design, ...]]:
    """Returns the designs: the scenario with each choice, in every environment."""
    by_world = [designs_of(scenario, choices, given, name) for name, given in worlds.items()]
    return list(zip(*by_world, strict=True))


def drive(
    campaign: Campaign,
    designs: Sequence[Design],
    *,
    first_run: int,
    runs: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, NDArray[Any]]]:
    """Simulates each design from run ``first_run``; designs with equal runs are simulated once."""
    tasks = [
        Task(
            depends_on={
                **{"drives": text, "seed": seed, "first_run": first_run, "runs": runs},
                "error_every": ERROR_EVERY,
                **({"plug_ins": [(*it, checksum(it[1])) for it in plug_ins]} if plug_ins else {}),
            },
            work=simulated,
            arguments=(text, seed, first_run, runs, *([plug_ins] if plug_ins else [])),
        )
        for design in designs
        for text, plug_ins in ((design.driven, tuple(design.plug_ins.items())),)
    ]
    return campaign.run(tasks, progress)


def simulated(
    scenario: str,
    seed: int,
    first_run: int,
    runs: int,
    plug_ins: Sequence[tuple[str, str]] = (),
) -> dict[str, NDArray[Any]]:
    """Simulates one part: runs of a scenario, in one thread."""
    found = simulate(
        Scenario.from_toml(scenario),
        runs=runs,
        seed=seed,
        first_run=first_run,
        threads=1,
        errors_every=ERROR_EVERY,
        **{role: load(role, text) for role, text in plug_ins},
    )
    if found.errors_m is None:  # errors_every is set
        raise RuntimeError("the simulation stored no error samples")
    error_m = np.hypot(found.errors_m[..., 0], found.errors_m[..., 1])
    columns = ["aoa_estimates", "bursts_received", "rms_error_m", "max_error_m"]
    columns += ["energy_j"] if "estimator" in dict(plug_ins) else []
    track = slice(None, None, TRACK_EVERY)
    return {
        **{name: np.asarray(found.runs[name], dtype=np.float64) for name in columns},
        "error_m": np.nan_to_num(error_m, nan=np.inf, posinf=np.inf).astype(np.float32),
        "track_s": np.asarray(found.steps["time_s"], dtype=np.float64)[track],
        "track_m2": np.asarray(found.steps["rms_error_m"], dtype=np.float64)[track] ** 2,
    }


def joined(design: Design, parts: Sequence[Part]) -> Driven:
    """Joins the parts of a design, and adds the energy of each run."""
    aoa_estimates, bursts_received, rms_m, worst_m = (
        np.concatenate([part[name] for part in parts])
        for name in ("aoa_estimates", "bursts_received", "rms_error_m", "max_error_m")
    )
    weights = np.array([part["aoa_estimates"].size for part in parts], dtype=np.float64)
    track_s = parts[0]["track_s"]
    track_m2 = np.average([part["track_m2"] for part in parts], axis=0, weights=weights)
    core, vehicle = design.platform.core, design.scenario.vehicle
    duration_s = float(track_s[-1])
    energies = [
        core.energy_j(vehicle, int(estimated), int(received), duration_s)
        for estimated, received in zip(aoa_estimates, bursts_received, strict=True)
    ]
    energy_j = np.array([np.inf if each is None else sum(each[:3]) for each in energies])
    if "estimator" in design.plug_ins:
        # Energy per estimate of the plug-in; infinite if the plug-in specifies none.
        energy_j = np.nan_to_num(np.concatenate([part["energy_j"] for part in parts]), nan=np.inf)
    return Driven(
        design=design,
        square_m2=np.nan_to_num(rms_m**2, nan=np.inf),
        energy_j=energy_j,
        worst_m=np.nan_to_num(worst_m, nan=np.inf),
        errors=ErrorSamples(
            errors_m=np.concatenate([part["error_m"] for part in parts]), duration_s=duration_s
        ),
        aoa_estimates=aoa_estimates,
        bursts_received=bursts_received,
        track_s=track_s,
        track_m2=track_m2,
    )
