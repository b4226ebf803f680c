"""Variants side by side: what ``--vary`` and ``--compare`` drive, and how it is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av import _core
from access_av.cli.terminal import console, progress, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from access_av.study.compare import Compared

PERCENTS = (50.0, 90.0, 99.0)


def side_by_side(
    scenario: _core.Scenario,
    vary: Sequence[str] | None,
    others: Mapping[str, _core.Scenario],
    percents: Sequence[float] | None,
    runs: int,
    seed: int,
    threads: int | None,
) -> list[Compared]:
    """Drive a scenario, and beside it other values of its keys and other scenarios."""
    from access_av.study.compare import AS_IT_IS, compare, varied

    variants = {AS_IT_IS: scenario}
    for label, overrides in varied(vary or ()):
        variants[label] = scenario.with_overrides(overrides)
    variants |= others
    if len(variants) == 1:
        return []
    with progress("Comparing") as tick:
        return compare(
            variants,
            sorted(percents or PERCENTS),
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
