"""Sweeps: a scenario with every combination of some values, in the same environments."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from access_av._core import Scenario
from access_av.errors import InputError
from access_av.run.difference import Difference, difference
from access_av.run.simulation import Simulation, simulate
from access_av.tables.result import Result

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

# Keys of a sweep whose values are plug-ins instead of settings.
PLUG_INS = ("estimator", "policy", "localizer")
# Number of SSBs between stored errors: at 20 ms, a vehicle moves 0.8 m in this time.
ERRORS_EVERY = 10
MAX_COMBINATIONS = 1000


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Result):
    """Results of a sweep.

    Attributes
    ----------
    table
        One row per combination; columns ``compared`` of :mod:`access_av.columns`. Differences are
        to the first combination, in pairs of runs.
    values
        Swept values of each combination, by key. A plug-in has its name.
    results
        The simulation of each combination.
    scenario, seed, runs
        Swept keys, seed of all combinations, and number of runs of each.
    percent
        Percentile of the table and of :meth:`plot`.
    """

    table: pl.DataFrame
    values: list[dict[str, Any]]
    results: list[Simulation]
    scenario: Scenario
    seed: int
    runs: int
    percent: float

    def __repr__(self) -> str:
        keys = ", ".join(self.values[0])
        return f"Sweep({self.scenario.name}, {len(self.values)} combinations of {keys})"

    def _repr_html_(self) -> str:
        return str(self.table._repr_html_())

    def difference(self, index: int, baseline: int = 0, *, percent: float = 99.0) -> Difference:
        """Compares two combinations run by run.

        Parameters
        ----------
        index, baseline
            Rows of :attr:`table`.
        percent
            Percentile of the horizontal error.
        """
        return difference(self.results[index], self.results[baseline], percent=percent)

    def plot(self) -> Any:
        """Draws the error percentile of each combination with its 95 % interval, with Altair."""
        from access_av.plots.of_results import intervals

        columns = ("percentile_m", "percentile_low_m", "percentile_high_m")
        title = f"{self.percent:g}th percentile of the horizontal error / m"
        return intervals(self.table, "variant", columns, title=title)


def sweep(
    scenario: Scenario | str | Path,
    vary: Mapping[str, Sequence[Any]],
    *,
    runs: int = 10,
    seed: int = 1,
    percent: float = 99.0,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Simulates every combination of some values, in the same environments.

    Parameters
    ----------
    scenario
        A scenario, or the name or path of one.
    vary
        Values by key of the scenario, for example ``{"site.rician_k_db": [0.0, 10.0]}``. The keys
        ``estimator``, ``policy`` and ``localizer`` take plug-ins as ``simulate`` does; ``None`` is
        the scenario's own.
    runs
        Number of runs of each combination.
    seed
        Seed of all combinations.
    percent
        Percentile of the differences: 50, 90, 95, 99 or 99.9.
    threads
        Worker threads; results do not depend on their number.
    progress
        Called as ``progress(done, total)`` with numbers of runs.

    Raises
    ------
    InputError
        If nothing is varied, or there are more than :data:`MAX_COMBINATIONS` combinations.
    SettingsError
        If a combination is invalid; the message contains the key and the allowed values.

    Examples
    --------
    >>> found = sweep("paper", {"site.rician_k_db": [10.0, 40.0]}, runs=2)
    >>> found.table["variant"].to_list()
    ['rician_k_db = 10.0', 'rician_k_db = 40.0']
    """
    if not isinstance(scenario, Scenario):
        scenario = Scenario.load(str(scenario))
    if not vary or not all(len(values) for values in vary.values()):
        raise InputError("vary: add at least one key with at least one value")
    combined = [
        dict(zip(vary, values, strict=True)) for values in itertools.product(*vary.values())
    ]
    if len(combined) > MAX_COMBINATIONS:
        raise InputError(
            f"vary: {len(combined)} combinations; at most {MAX_COMBINATIONS} are allowed"
        )
    keys = [{key: it for key, it in each.items() if key not in PLUG_INS} for each in combined]
    scenarios = [scenario.with_overrides(it) for it in keys]
    results: list[Simulation] = []

    def tell(done: int, _: int) -> None:
        if progress is not None:
            progress(runs * len(results) + done, runs * len(combined))

    for changed, its in zip(scenarios, combined, strict=True):
        results.append(
            simulate(
                changed,
                runs=runs,
                seed=seed,
                threads=threads,
                errors_every=ERRORS_EVERY,
                progress=tell,
                **{key: its[key] for key in PLUG_INS if key in its},
            )
        )
    values = [{key: _shown(value) for key, value in chosen.items()} for chosen in combined]
    rows = [
        _row(each, result, difference(result, results[0], percent=percent))
        for each, result in zip(values, results, strict=True)
    ]
    table = pl.DataFrame(rows, infer_schema_length=None)
    return Sweep(table, values, results, scenario, seed, runs, percent)


def _row(values: Mapping[str, Any], found: Simulation, to_first: Difference) -> dict[str, Any]:
    name = ", ".join(f"{key.rpartition('.')[2]} = {it}" for key, it in values.items())
    ends = (to_first.delta_m, to_first.low_m, to_first.high_m)
    errors = found.errors(name)
    assert errors is not None  # errors_every is set
    row = errors.record(to_first.percent, ends)
    return {**row, **found.means, "rms_error_m": found.rms_error_m}


def _shown(value: Any) -> Any:
    """Returns a value of a setting as text, or the name of a plug-in."""
    if value is None:
        return "own of the scenario"
    return getattr(value, "__name__", type(value).__name__) if callable(value) else value
