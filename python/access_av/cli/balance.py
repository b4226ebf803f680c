"""The command ``balance``: cost, energy and carbon of a fleet, two ways side by side."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated

import typer

from access_av.cli.options import AsJson
from access_av.cli.terminal import console, table
from access_av.economics.carbon import Range

app = typer.Typer()

UNITS = {
    "capital": "to buy",
    "yearly": "a year, with electricity",
    "energy_day_kj": "kJ a day of work, one vehicle",
    "fleet_day_mj": "MJ a day of work, all of it",
    "embodied_kg": "kgCO2e in production",
    "use_kg_per_year": "kgCO2e a year in use",
}


@app.command(
    epilog="Example: [bold]access-av balance --example > mine.toml; access-av balance mine.toml[/]",
)
def balance(
    figures: Annotated[Path | None, typer.Argument(help="TOML file; else the example.")] = None,
    example: Annotated[bool, typer.Option("--example", help="Print the example file.")] = False,
    as_json: AsJson = False,
) -> None:
    """Add up what localizing your fleet costs, draws and emits, before and after.

    Low, central and high stand side by side; embodied and use apart; every item names its source.
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
        "Payback: not for every figure in the ranges."
        if payback is None
        else f"Payback: {_shown(payback)} years."
    )


def _shown(values: Range) -> str:
    """The three values, or the one that they are."""
    ends = dict.fromkeys((values.low, values.central, values.high))
    return " … ".join(f"{end:,.0f}" if abs(end) >= 1000.0 else f"{end:.3g}" for end in ends)
