"""Command ``paper codesign``: comparison with the paper's adaptive point, receiver included."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from typer import Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, table

app = typer.Typer()


@opt.command(app, "Energy", "paper codesign --runs 20")
def codesign(
    interpretation: Annotated[str, Option(help="Name of an interpretation of the paper.")] = "gate",
    runs: opt.Runs = 100,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    as_json: opt.AsJson = False,
) -> None:
    """Compare tracker, policy and engine with the paper's adaptive point in each power mode.

    Energies of a trip include angle estimates and receiver. Ranges cover all parameter ranges of
    the platform files. Second row of each mode: with the paper's energy per estimate. Third row:
    with the energy of this project's cycles at the clock of the mode. The share is the energy
    relative to the paper's, at the worst end of the range.
    """
    from access_av.paper.codesign import compare
    from access_av.tables.results_directory import json_text

    with progress("Driving") as tick:
        found = compare(interpretation, runs=runs, seed=seed, threads=threads, progress=tick)
    if as_json:
        records = [
            {
                **asdict(each),
                "policy_ratio": each.policy_ratio,
                "engine_ratio": each.engine_ratio,
                "is_better": each.is_better,
            }
            for each in found
        ]
        print(json_text(records))
        return
    head = ["mode", "point", "RMS m", "angle estimates", "received", "energy J", "share ≤"]
    made = table(head, title=f"Interpretation {interpretation}, {runs} runs, seed {seed}", text=2)
    for each in found:
        for name, point, share in (
            ("paper", each.paper, ""),
            ("own policy", each.policy, f"{each.policy_ratio:.3f}"),
            ("own policy and engine", each.engine, f"{each.engine_ratio:.2g}"),
        ):
            low_j, value_j, high_j = point.energy_j
            made.add_row(
                str(each.mode) if name == "paper" else "",
                name,
                f"{point.rms_error_m:.3f}",
                f"{point.aoa_estimates:.0f}",
                f"{point.bursts_received:.0f}",
                f"{value_j:.3g} ({low_j:.3g}…{high_j:.3g})",
                share,
            )
    console.print(made)
    better = sum(each.is_better for each in found)
    console.print(
        f"Smaller error and energy in {better} of {len(found)} power modes. "
        f"Boundary: {found[0].paper.boundary} (paper), {found[0].engine.boundary} (own engine)."
    )
