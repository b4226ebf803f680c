"""Command line ``access-av``: invalid input gives one message and exit code 2."""

from __future__ import annotations

import inspect
import re
import sys
import warnings
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import typer
import typer.main
from typer import Option
from typer.core import TyperGroup

from access_av import interrupt
from access_av._core import RecordingError, SettingsError, __version__, brief
from access_av.cli import (
    balance,
    designs,
    drives,
    files,
    integrity,
    new,
    paper,
    profile,
    radio,
    recordings,
    rerun,
    run,
    study,
    survey,
)
from access_av.cli.terminal import (
    console,
    give_up_output,
    plain,
    show_error,
    write_what_can_be_written,
)
from access_av.errors import ImplausibleSettingsWarning, InputError
from access_av.tables import renamed

if TYPE_CHECKING:
    from collections.abc import Iterator

UsageError: Any = typer.BadParameter.__mro__[1]  # Typer exports only a subclass of it


@contextmanager
def _brief_usage_errors() -> Iterator[None]:
    try:
        yield
    except UsageError as error:
        option, context = getattr(error, "option_name", None), error.ctx
        if option and context and (message := renamed.option_message(option, context.command_path)):
            error.message, error.possibilities = message, []
        error.message = brief(plain(error.message))
        raise


class _Commands(TyperGroup):
    """Command group that shortens usage errors and reflows the help texts."""

    def get_command(self, context: Any, name: str) -> Any:
        command = super().get_command(context, name)
        if command and command.help:  # Join the lines of a paragraph.
            command.help = re.sub(r"(?<=\S)\n(?=\S)", " ", inspect.cleandoc(command.help))
        return command

    def resolve_command(self, context: Any, words: list[str]) -> Any:
        message = renamed.command_message(words)
        if message and self.get_command(context, words[0]) is None:
            context.fail(message)
        return super().resolve_command(context, words)

    def make_context(self, *args: Any, **settings: Any) -> Any:
        with _brief_usage_errors():
            return super().make_context(*args, **settings)

    def invoke(self, context: Any) -> Any:
        with _brief_usage_errors():
            return super().invoke(context)


app = typer.Typer(
    name="access-av",
    cls=_Commands,
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
        bool, Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


_METHOD, _DATA = "Paper and configurations", "Data"
_GROUPS = (
    ("paper", _METHOD, "Reproduce the paper, and search its open parameters.", (paper,)),
    (
        "design",
        _METHOD,
        "Plan radio heads, choose operating points, and evaluate integrity, computer and cost.",
        (radio, integrity, designs, balance, profile),
    ),
    (
        "record",
        _DATA,
        "Find SSBs in recordings, locate recorded drives, and survey sites from them.",
        (recordings, drives, survey),
    ),
    (
        "file",
        _DATA,
        "Write, check, show and export settings files; describe the columns of results.",
        (new, files),
    ),
)
for _module in (study, run, rerun):
    app.add_typer(_module.app)
for _name, _panel, _help, _modules in _GROUPS:
    _group = typer.Typer(no_args_is_help=True, help=_help)
    for _module in _modules:
        _group.add_typer(_module.app)
    app.add_typer(_group, name=_name, cls=_Commands, rich_help_panel=_panel)


@cache
def _command() -> Any:
    """Returns all commands. Their construction takes ten times as long as a short command."""
    return typer.main.get_command(app)


def main() -> None:
    """Runs the command line; reports invalid input as one message with exit code 2."""
    write_what_can_be_written()
    # The commands print these warnings themselves, once for each scenario.
    warnings.simplefilter("ignore", ImplausibleSettingsWarning)
    try:
        try:
            _command()()
        finally:
            sys.stdout.flush()
    except (SettingsError, RecordingError, InputError, OSError) as error:
        interrupt.clean()
        show_error(error)
        give_up_output()
        sys.exit(2)
