"""Command ``file columns``: description of the columns of each table."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.terminal import show_columns

app = typer.Typer()


@opt.command(app, "Results", "file columns trajectories")
def columns(
    name: Annotated[
        str | None,
        Argument(metavar="TABLE", help="Table or file.", show_default="all"),
    ] = None,
    as_json_: opt.AsJson = False,
    as_markdown: Annotated[
        bool, Option("--markdown", help="Print all tables as Markdown (docs/columns.md).")
    ] = False,
) -> None:
    """Print name, unit and meaning of each column, and the condition of a null value."""
    from access_av.tables.columns import TABLES, as_json, markdown, table

    if as_markdown:
        print(markdown(), end="")
        return
    chosen = list(TABLES.values()) if name is None else [table(name)]
    if as_json_:
        print(json.dumps(as_json(chosen), indent=2, ensure_ascii=False))
        return
    for one in chosen:
        show_columns(one)
