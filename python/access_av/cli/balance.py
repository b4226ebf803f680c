"""Command ``design balance``: cost, energy and carbon of a fleet with two localization systems."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, table
from access_av.economics.carbon import Range
from access_av.report.study_parts import low_to_high

app = typer.Typer()

UNITS = {
    "capital": "purchase",
    "yearly": "per year, including electricity",
    "energy_day_kj": "kJ per working day and vehicle",
    "fleet_day_mj": "MJ per working day, whole fleet",
    "embodied_kg": "kgCO2e in production",
    "use_kg_per_year": "kgCO2e per year of use",
}


@opt.command(
    app,
    "Integrity and cost",
    "design balance --example > mine.toml; access-av design balance mine.toml",
)
def balance(
    figures: Annotated[Path | None, Argument(help="TOML file.", show_default="the example")] = None,
    example: Annotated[bool, Option("--example", help="Print the example file.")] = False,
    as_json: opt.AsJson = False,
) -> None:
    """Compute cost, energy and carbon of a fleet's localization, before and after a change.

    Each figure has a low, central and high value. Carbon of production and of use are separate.
    Every item has its source.
    """
    from access_av.economics import balance as balances
    from access_av.tables.results_directory import json_text

    if example:
        print(balances.text(), end="")
        return
    found = balances.balance(balances.read(figures))
    if as_json:
        print(json_text(asdict(found)))
        return
    made = table(["", "before", "after"], title=f"Low … central … high, in {found.currency}")
    for field in fields(found.before):
        ways = (getattr(found.before, field.name), getattr(found.after, field.name))
        made.add_row(UNITS[field.name], *map(_shown, ways))
    console.print(made)
    console.print(
        f"Saved in {found.years:g} years: {_shown(found.saved)} {found.currency}, "
        f"{_shown(found.saved_kg)} kgCO2e."
    )
    payback = found.payback_years
    console.print(
        "Payback: not reached for all values of the ranges."
        if payback is None
        else f"Payback: {_shown(payback)} years."
    )


def _shown(values: Range) -> str:
    return low_to_high(f"{end:,.0f}" if abs(end) >= 1000.0 else f"{end:.3g}" for end in values.ends)
