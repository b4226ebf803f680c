"""Commands that show, check and describe site, vehicle, scenario and platform files."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from access_av._core import Platform, Scenario, SettingsError, Site, Vehicle
from access_av.terminal import console, show_error


def files_app(what: str) -> typer.Typer:
    """Commands that show, check and describe the files of one kind."""
    kinds = {"site": Site, "vehicle": Vehicle, "scenario": Scenario, "platform": Platform}
    kind: Any = kinds[what]
    files = typer.Typer(no_args_is_help=True, help=f"Show, check and describe {what} files.")
    example = kind.names()[0]

    @files.command("list", help=f"Names of the shipped {what}s.")
    def list_names() -> None:
        for name in kind.names():
            console.print(name)

    @files.command(
        help=f"Print a {what} with every default written out.",
        epilog=f"Example: [bold]access-av {what} show {example} > mine.toml[/]",
    )
    def show(name: Annotated[str, typer.Argument(help="Shipped name, or path.")]) -> None:
        print(kind.load(name).to_toml(), end="")

    @files.command(
        help=f"Check {what} files; exit code 2 where one is wrong.",
        epilog=f"Example: [bold]access-av {what} check mine.toml[/]",
    )
    def check(names: Annotated[list[str], typer.Argument(help="Shipped names, or paths.")]) -> None:
        wrong = 0
        for name in names:
            try:
                kind.load(name)
                console.print(f"{name}: fine", soft_wrap=True)
            except SettingsError as error:
                show_error(error)
                wrong += 1
        if wrong:
            raise typer.Exit(2)

    @files.command(help=f"Print the JSON Schema of {what} files, for editors.")
    def schema() -> None:
        print(kind.schema_json())

    return files
