"""The command line, ``access-av``. Bad input ends with exit code 2 and one message."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from access_av import interrupt
from access_av._core import RecordingError, SettingsError, __version__
from access_av.commands import (
    balance,
    bound,
    columns,
    designs,
    drives,
    files,
    integrity,
    profile,
    radio,
    recordings,
    run,
    survey,
    tune,
)
from access_av.errors import InputError
from access_av.paper import codesign_command as codesign
from access_av.paper import commands as paper
from access_av.terminal import console, give_up_output, show_error, write_what_can_be_written

app = typer.Typer(
    name="access-av",
    help="Localization of factory vehicles from 5G synchronization signal blocks: "
    "accuracy and energy side by side.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        console.print(f"access-av {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show it.")
    ] = False,
) -> None:
    pass


for _room in (
    *(paper, codesign, run, bound, radio, integrity, designs, tune),
    *(recordings, drives, survey, profile, balance, columns),
):
    app.add_typer(_room.app)
for _what in ("site", "vehicle", "scenario", "platform"):
    app.add_typer(files.files_app(_what), name=_what)


def main() -> None:
    """Entry point: turns every bad input into one message and exit code 2."""
    write_what_can_be_written()
    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except (SettingsError, RecordingError, InputError, OSError) as error:
        interrupt.clean()
        show_error(error)
        give_up_output()
        sys.exit(2)
