"""Variants side by side: what ``--vary`` and ``--compare`` drive, and how it is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av import _core
from access_av.cli.terminal import console, progress, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.study.compare import Compared

PERCENTS = (50.0, 90.0, 99.0)


def variants(
    scenario: _core.Scenario,
    vary: Sequence[str] | None,
    others: Mapping[str, _core.Scenario],
) -> dict[str, _core.Scenario]:
    """A scenario, other values of its keys, and other scenarios, by their labels."""
    from access_av.study.compare import AS_IT_IS, varied

    of_keys = {label: scenario.with_overrides(it) for label, it in varied(vary or ())}
    return {AS_IT_IS: scenario, **of_keys, **others}


def side_by_side(
    scenarios: Mapping[str, _core.Scenario],
    percents: Sequence[float],
    runs: int,
    seed: int,
    threads: int | None,
) -> list[Compared]:
    """Drive variants in the same worlds; nothing where there is but one."""
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
        )


def show_compared(found: Sequence[Compared]) -> None:
    """Show variants in the terminal; nothing without any."""
    if len(found) < 2:
        return
    percents = found[0].percents
    head = ["variant", *(f"{it:g} % within / m" for it in percents), "energy / J", "difference"]
    made = table(head, text=1, title=f"Side by side, {found[0].driven.runs} drives each")
    for it in found:
        made.add_row(
            it.driven.name,
            *(f"{it.driven.percentile(percent).value:.3f}" for percent in percents),
            "–" if it.energy_j is None else f"{it.energy_j:.2f}",
            it.in_words(),
        )
    console.print(made)
