"""Variants of ``--sweep`` and ``--against``: simulation and output."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from access_av.cli import options as opt
from access_av.cli.terminal import progress, show
from access_av.report.shown import compared

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from access_av import _core
    from access_av.run.pairs import ErrorSamples
    from access_av.study.compare import Compared
    from access_av.tables.results_directory import ResultsDirectory

PERCENTS = (50.0, 90.0, 99.0)
T = TypeVar("T")


def variants(
    as_it_is: T,
    vary: Sequence[str] | None,
    others: Mapping[str, T],
    changed: Callable[[T, dict[str, Any]], T],
) -> dict[str, T]:
    """Returns baseline, variants with other key values, and other files, by their labels."""
    from access_av.run.pairs import UNCHANGED
    from access_av.study.compare import varied

    of_keys = {label: changed(as_it_is, it) for label, it in varied(vary or ())}
    return {UNCHANGED: as_it_is, **of_keys, **others}


def of_scenario(
    scenario: _core.Scenario, vary: Sequence[str] | None, others: Mapping[str, _core.Scenario]
) -> dict[str, _core.Scenario]:
    """Returns the variants of a scenario."""

    def changed(it: _core.Scenario, keys: dict[str, Any]) -> _core.Scenario:
        made = it.with_overrides(keys)
        # Warnings of the baseline are known.
        known = {str(warning) for warning in it.warnings()}
        name = ", ".join(f"{key} = {value}" for key, value in keys.items())
        opt.announce(name, [new for new in made.warnings() if str(new) not in known])
        return made

    return variants(scenario, vary, others, changed)


def plug_ins_of(compare: Sequence[str] | None) -> dict[str, dict[str, Any]]:
    """Returns the plug-ins of ``--against ROLE=FILE.py:NAME`` by role, by their labels."""
    from access_av.run.plug_in_files import ROLES, load

    found = {}
    for text in compare or ():
        role, equals, place = text.partition("=")
        if equals and role in ROLES:
            found[text] = {role: load(role, place)}
    return found


def side_by_side(
    scenarios: Mapping[str, _core.Scenario],
    percents: Sequence[float],
    runs: int,
    seed: int,
    threads: int | None,
    plug_ins: Mapping[str, Mapping[str, Any]] | None = None,
    baseline: ErrorSamples | None = None,
) -> list[Compared]:
    """Simulates the variants in equal environments; empty for a single variant.

    ``baseline``: drives of the first variant, if it was simulated before.
    """
    from access_av.study.compare import compare

    if len(scenarios) == 1:
        return []
    with progress("Comparing") as tick:
        return compare(
            scenarios,
            sorted(percents),
            runs=runs,
            seed=seed,
            threads=threads,
            progress=tick,
            plug_ins=plug_ins,
            baseline=baseline,
        )


def write_compared(found: Sequence[Compared], directory: ResultsDirectory) -> None:
    """Writes ``compared.parquet`` if there are variants."""
    from access_av.study.compare import table as rows_of

    if found:
        directory.write_table("compared.parquet", rows_of(found))


def records(found: Sequence[Compared]) -> list[dict[str, Any]]:
    """Returns the rows of ``compared.parquet``."""
    from access_av.study.compare import table as rows_of

    return rows_of(found).to_dicts() if found else []


def show_compared(found: Sequence[Compared]) -> None:
    """Prints the comparison of variants, if any."""
    if not found:
        return
    driven = found[0].driven
    show(compared(found), title=f"Comparison, {driven.runs} {driven.rows} each")
