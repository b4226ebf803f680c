"""Commands that list, show, check and describe settings files, and describe columns."""

from __future__ import annotations

import json
from enum import Enum
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from access_av._core import Plant, Platform, Scenario, SettingsError, Site, Vehicle
from access_av.cli import options as opt
from access_av.cli.terminal import console, say, show_error, show_rows
from access_av.errors import InputError
from access_av.tables import toml

if TYPE_CHECKING:
    from access_av.tables.columns import Table

app = typer.Typer()


class Kind(str, Enum):
    """Kind of a settings file that this package reads."""

    PLANT = "plant"
    SITE = "site"
    VEHICLE = "vehicle"
    SCENARIO = "scenario"
    PLATFORM = "platform"


CLASSES: dict[Kind, Any] = {
    Kind.PLANT: Plant,
    Kind.SITE: Site,
    Kind.VEHICLE: Vehicle,
    Kind.SCENARIO: Scenario,
    Kind.PLATFORM: Platform,
}
# Keys that only files of access-av-node have at the top.
NODE_KEYS = {"samples", "messages", "inputs", "output", "page"}

KindArgument = Annotated[Kind, Argument(help="Kind of file.")]
KindOption = Annotated[
    Kind | None, Option(help="Kind of file.", show_default="recognized from the keys")
]
Names = Annotated[list[str], Argument(help="Files: shipped names, or paths.")]
PANEL = "Settings files"


def kind_of(name: str) -> Kind:
    """Returns the kind of a file by its top-level keys, or of a shipped file by its name.

    Raises
    ------
    InputError
        Unknown name, unreadable file, or several kinds are possible.
    """
    path = Path(name)
    of_name = [kind for kind, of in CLASSES.items() if name in of.names()]
    kinds = _kinds_of_file(path) if path.exists() else of_name
    if len(kinds) == 1:
        return kinds[0]
    if not kinds:
        raise InputError(f"{name}: no such file, and no shipped file has this name")
    raise InputError(
        f"{name}: could be a {' or a '.join(kinds)} file: add --kind {' or --kind '.join(kinds)}"
    )


def _kinds_of_file(path: Path) -> list[Kind]:
    """Returns the kinds whose schemas have the most keys of the file, and lack the fewest."""
    keys = toml.read(path).keys()
    if keys & NODE_KEYS:
        raise InputError(
            f"{path}: this is a node file; check it with access-av-node {path} --dry-run, "
            "and --site and --vehicle if they are not installed"
        )
    scores = dict[Kind, tuple[int, int]]()
    for kind, of in CLASSES.items():
        schema = json.loads(of.schema_json())
        missing = 0 if "extends" in keys else len({*schema["required"]} - keys)
        scores[kind] = (len(keys & schema["properties"].keys()), -missing)
    best = max(scores.values())
    return [kind for kind, score in scores.items() if score == best]


@opt.command(app, PANEL, "file list site", name="list")
def list_names(
    kind: Annotated[Kind | None, Argument(help="Kind of file.", show_default="all kinds")] = None,
) -> None:
    """List the names of the shipped files."""
    for each in Kind if kind is None else [kind]:
        names = CLASSES[each].names()
        text = "\n".join(names) if kind else f"{each.value}: {', '.join(names)}"
        say(text)


@opt.command(app, PANEL, "file show --kind site yard > mine.toml")
def show(
    name: Annotated[str, Argument(help="File: shipped name, or path.")], kind: KindOption = None
) -> None:
    """Print a settings file with all default values."""
    print(CLASSES[kind or kind_of(name)].load(name).to_toml(), end="")


@opt.command(app, PANEL, "file check mine.toml")
def check(names: Names, kind: KindOption = None, allow_large: opt.AllowLarge = False) -> None:
    """Check settings files: exit code 2 for invalid ones, warnings for implausible values."""
    wrong = 0
    for name in names:
        try:
            _check(name, kind or kind_of(name), allow_large)
        except (SettingsError, InputError) as error:
            show_error(error)
            wrong += 1
    if wrong:
        raise typer.Exit(2)


def _check(name: str, kind: Kind, allow_large: bool) -> None:
    """Prints the result of the check of one file."""
    size = ""
    if kind is Kind.SCENARIO:
        read = opt.read_scenario(name, allow_large=allow_large)
        run = read.size
        size = (
            f"; a run of {run['duration_s']:.0f} s, {run['ssbs']:.0f} SSBs, "
            f"{run['bytes'] * 1e-6:.0f} MB"
        )
    else:
        read = CLASSES[kind].load(name)
    warnings = read.warnings()
    count = f", {len(warnings)} warning{'s' * (len(warnings) > 1)}" if warnings else ""
    say(f"{name}: valid{count}{size}")
    opt.announce(name, warnings)


@opt.command(app, PANEL, "file schema site > site.schema.json")
def schema(kind: KindArgument) -> None:
    """Print the JSON Schema of one kind of settings file, for editors."""
    print(CLASSES[kind].schema_json())


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
        _show_columns(one)


def _show_columns(columns: Table) -> None:
    """Prints the columns of one table."""
    where = columns.where.replace("`", "")
    console.print(columns.name, style="bold", end="")
    console.print(f"  {columns.row}. {where}.")
    keys = {"column": "name", "unit": "unit", "meaning": "meaning", "null when": "null"}
    cells = [(head, itemgetter(key)) for head, key in keys.items()]
    show_rows(cells, columns.records(), text=4)
