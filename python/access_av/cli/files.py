"""Commands that show, check and describe site, vehicle, scenario and platform files."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from access_av._core import Plant, Platform, Scenario, SettingsError, Site, Vehicle
from access_av.cli.options import AllowLarge, announce, read_scenario
from access_av.cli.terminal import console, show_error, table

if TYPE_CHECKING:
    from collections.abc import Callable


Names = Annotated[list[str], typer.Argument(help="Shipped names, or paths.")]


def _check(names: list[str], load: Callable[[str], Any]) -> None:
    """Prints the result of the check of each file; exit code 2 if one is invalid."""
    wrong = 0
    for name in names:
        try:
            read = load(name)
            warnings = read.warnings()
            verdict = (
                f"valid, {len(warnings)} warning{'s' * (len(warnings) > 1)}"
                if warnings
                else "valid"
            )
            size = _size(read) if isinstance(read, Scenario) else ""
            console.print(f"{name}: {verdict}{size}", soft_wrap=True)
            announce(name, warnings)
        except SettingsError as error:
            show_error(error)
            wrong += 1
    if wrong:
        raise typer.Exit(2)


def _size(scenario: Scenario) -> str:
    """Returns the duration and size of a run."""
    size = scenario.size
    return (
        f"; a run of {size['duration_s']:.0f} s, {size['ssbs']:.0f} SSBs, "
        f"{size['bytes'] * 1e-6:.0f} MB"
    )


def files_app(what: str) -> typer.Typer:
    """Returns the commands that list, show and check the files of one kind."""
    kinds = {
        "site": Site,
        "vehicle": Vehicle,
        "scenario": Scenario,
        "platform": Platform,
        "plant": Plant,
    }
    kind: Any = kinds[what]
    files = typer.Typer(no_args_is_help=True, help=f"Show, check and describe {what} files.")
    example = kind.names()[0]

    @files.command(
        "list",
        help=f"Names of the shipped {what}s.",
        epilog=f"Example: [bold]access-av {what} list[/]",
    )
    def list_names() -> None:
        for name in kind.names():
            console.print(name)

    @files.command(
        help=f"Print a {what} file with all default values.",
        epilog=f"Example: [bold]access-av {what} show {example} > mine.toml[/]",
    )
    def show(name: Annotated[str, typer.Argument(help="Shipped name, or path.")]) -> None:
        print(kind.load(name).to_toml(), end="")

    command = files.command(
        name="check",
        help=f"Check {what} files: exit code 2 for invalid ones, warnings for implausible ones.",
        epilog=f"Example: [bold]access-av {what} check mine.toml[/]",
    )
    if what == "scenario":

        @command
        def check_scenarios(names: Names, allow_large: AllowLarge = False) -> None:
            _check(names, lambda name: read_scenario(name, allow_large=allow_large))
    else:

        @command
        def check(names: Names) -> None:
            _check(names, kind.load)

    @files.command(
        help=f"Print the JSON Schema of {what} files, for editors.",
        epilog=f"Example: [bold]access-av {what} schema > {what}.schema.json[/]",
    )
    def schema() -> None:
        print(kind.schema_json())

    if what == "platform":
        files.command(epilog="Example: [bold]access-av platform power jetson-agx-xavier-engine[/]")(
            power
        )
    return files


def power(name: Annotated[str, typer.Argument(help="Shipped name, or path.")]) -> None:
    """Compare the modelled and the measured power of a board with all cores busy.

    One row per power mode of the platform file; a dash marks a missing value.
    """
    platform = Platform.load(name)
    made = table(
        ["mode", "name", "cores", "MHz", "modelled W", "measured W", "difference %"], text=2
    )
    for index, mode in enumerate(json.loads(platform.to_json())["modes"]):
        modelled_w = platform.busy_power_w(index, mode["cores"])
        measured_w = mode.get("full_load_power_w", {}).get("value")
        made.add_row(
            str(mode["mode"]),
            mode["name"],
            str(mode["cores"]),
            f"{mode['cpu_mhz']:.1f}",
            "–" if modelled_w is None else f"{modelled_w:.2f}",
            "–" if measured_w is None else f"{measured_w:.2f}",
            "–"
            if modelled_w is None or measured_w is None
            else f"{100.0 * (modelled_w / measured_w - 1.0):+.1f}",
        )
    console.print(made)
