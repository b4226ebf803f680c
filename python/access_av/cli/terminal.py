"""Terminal output: tables that fit the terminal, progress, errors."""

from __future__ import annotations

import io
import os
import sys
import time
from contextlib import contextmanager
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, Protocol

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table as RichTable

from access_av._core import brief
from access_av.report.shown import Badge, Shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence


# Printed texts can come from files, therefore markup is disabled.
console = Console(highlight=False, markup=False)
errors = Console(stderr=True, highlight=False, markup=False)

NARROW = 80
# Without a terminal: time to the first progress line, and maximum time between lines, in s.
FIRST_LINE_S, MOST_SILENT_S = 2.0, 60.0
# Maximum number of printed remarks of a result.
MAX_REMARKS = 10


def is_narrow() -> bool:
    """Returns whether the terminal is too narrow for all columns."""
    return console.width < NARROW


def write_what_can_be_written() -> None:
    """Replaces characters that the terminal cannot encode by a question mark."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def give_up_output() -> None:
    """Discards pending output of a closed standard output, which Python would write at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class Tick(Protocol):
    """Updates the progress; ``stage`` names the part of the work that the numbers are of."""

    def __call__(self, done: int, total: int, stage: str = "", /) -> None:
        """Shows the number of completed parts of the work, and the total."""


@contextmanager
def progress(title: str, *, percent: bool = False) -> Iterator[Tick]:
    """Shows progress on the error stream; yields the function that updates it.

    Without a terminal it prints a line after two seconds, then at increasing intervals. With
    ``percent`` it shows the share, for work whose unit means nothing to the user.
    """
    if not errors.is_terminal:
        with _lines(title, percent) as tick:
            yield tick
        return
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=None if not is_narrow() else 12),
        TextColumn("{task.percentage:.0f} %") if percent else MofNCompleteColumn(),
        TimeRemainingColumn(compact=True),
        console=errors,
        transient=True,
    )
    with bar:
        task = bar.add_task(title, total=None)

        def update(done: int, total: int, stage: str = "", /) -> None:
            named = f"{title}, {stage}" if stage else title
            bar.update(task, completed=done, total=total, description=named)

        yield update


@contextmanager
def _lines(title: str, percent: bool) -> Iterator[Tick]:
    """Prints progress as lines, each after 1.5 times the elapsed time."""
    # Completed and total work, stage and its first time.
    known: list[tuple[int, int, str, float]] = []
    ended, begun_s = Event(), time.monotonic()

    def update(done: int, total: int, stage: str = "", /) -> None:
        if not stage:
            since_s = begun_s
        elif known and known[-1][2] == stage:
            since_s = known[-1][3]
        else:
            since_s = time.monotonic()
        known.append((done, total, stage, since_s))

    def tell() -> None:
        wait_s = FIRST_LINE_S
        while not ended.wait(wait_s):
            passed_s = time.monotonic() - begun_s
            line = f"{title}: {passed_s:.0f} s"
            if known and known[-1][1]:
                done, total, stage, since_s = known[-1]
                left_s = (time.monotonic() - since_s) * (total - done) / done if done else 0.0
                left = f", about {left_s:.0f} s left" if done else ""
                share = f"{100 * done // total} %" if percent else f"{done:,} of {total:,}"
                named = f"{title}, {stage}" if stage else title
                line = f"{named}: {share}, {passed_s:.0f} s{left}"
            errors.print(line, soft_wrap=True)
            wait_s = min(0.5 * passed_s, MOST_SILENT_S)

    thread = Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield update
    finally:
        ended.set()
        thread.join()


def table(head: Sequence[str], *, title: str = "", text: int = 1) -> RichTable:
    """Returns an empty table; the first ``text`` columns are left-aligned."""
    made = RichTable(title=title or None, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for index, name in enumerate(head):
        made.add_column(name, justify="left" if index < text else "right", overflow="fold")
    return made


def show(content: Shown, *, title: str = "") -> None:
    """Prints a table that a report shows, too."""
    shown_columns = [
        it for it in range(len(content.head)) if not (is_narrow() and it in content.details)
    ]
    # Only long texts wrap; a narrow terminal shows units below the names of the columns.
    heads = [
        content.head[it].replace(" / ", "\n" if is_narrow() else " / ") for it in shown_columns
    ]
    made = table(heads, title=title)
    for index, column in zip(shown_columns, made.columns, strict=True):
        is_text = index in content.texts
        column.justify = "left" if is_text else "right"
        column.no_wrap = not is_text or any(isinstance(row[index], Badge) for row in content.rows)
    for row in content.rows:
        cells = (row[it] for it in shown_columns)
        made.add_row(*(it.text if isinstance(it, Badge) else it for it in cells))
    console.print(made)


def width(made: RichTable) -> int:
    """Returns the width of a table without wrapped cells, in characters."""
    unbounded = console.options.update(max_width=10_000)
    return console.measure(made, options=unbounded).maximum


def show_rows(
    columns: Sequence[tuple[str, Callable[[Any], str]]],
    rows: Iterable[Any],
    *,
    title: str = "",
    text: int = 1,
    least: int | None = None,
) -> None:
    """Prints one row per item; a column has a name and the function of its cells.

    With ``least`` columns or more, the last ones are omitted until the table fits the terminal.
    """
    every, shown_columns = list(rows), list(columns)
    while True:
        made = table([name for name, _ in shown_columns], title=title, text=text)
        for row in every:
            made.add_row(*(cell(row) for _, cell in shown_columns))
        if least is None or width(made) <= console.width or len(shown_columns) <= least:
            break
        shown_columns.pop()
    console.print(made)


def say(text: str) -> None:
    """Prints a text without line breaks of its own, so that paths can be copied."""
    console.print(text, soft_wrap=True)


def show_error(error: Exception) -> None:
    """Prints one error message."""
    if isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}"
    else:
        message = str(error)
    errors.print("error:", style="bold red", end=" ")
    errors.print(brief(plain(message)), soft_wrap=True)


def show_warning(message: str) -> None:
    """Prints one warning."""
    errors.print("warning:", style="yellow", end=" ")
    errors.print(brief(plain(message)), soft_wrap=True)


def show_remarks(remarks: Sequence[str], file: str) -> None:
    """Prints the first remarks of a result, and the number of others, which ``file`` contains."""
    for remark in remarks[:MAX_REMARKS]:
        show_warning(remark)
    if len(remarks) > MAX_REMARKS:
        show_warning(f"{len(remarks) - MAX_REMARKS} more in {file}")


def plain(text: str) -> str:
    r"""Returns text with escaped control characters, so that no file controls the terminal.

    Examples
    --------
    >>> plain("a\x1b[2Jb")
    'a\\x1b[2Jb'
    """
    return "".join(
        sign if sign.isprintable() or sign == "\n" else sign.encode("unicode_escape").decode()
        for sign in text
    )
