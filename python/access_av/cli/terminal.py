"""Terminal output: tables that fit the terminal, progress, errors."""

from __future__ import annotations

import io
import os
import sys
import time
from contextlib import contextmanager
from operator import itemgetter
from threading import Event, Thread
from typing import TYPE_CHECKING, Any, Protocol

from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table as RichTable

from access_av._core import brief
from access_av.report import shown
from access_av.report.shown import Badge, Shown
from access_av.signal.methods import label
from access_av.tables.numbers import unsigned_zero, value_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    import polars as pl

    from access_av.drives.angle_log import AngleLog
    from access_av.radio.placement import Plan
    from access_av.radio.upgrades import NextLevel
    from access_av.run.service_levels import Verdict
    from access_av.run.simulation import Simulation
    from access_av.signal.recorded_angles import BurstAngle
    from access_av.tables.columns import Table

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


def show_points(points: pl.DataFrame, title: str = "") -> None:
    """Prints operating points as a table."""
    head = ["mode", "method", "energy J", "RMS m", "worst X m", "worst Y m", "angle estimates"]
    if is_narrow():
        head = ["mode", "method", "J", "RMS m", "X m", "Y m"]
    made = table(head, title=title, text=2)
    for point in points.iter_rows(named=True):
        cells = [
            str(point["mode"]) if is_narrow() else f"{point['mode']} {point['mode_name']}",
            label(point["method"], adaptive=point["adaptive"]),
            f"{point['energy_j']:.1f}",
            f"{point['rms_error_m']:.3f}",
            f"{point['worst_error_x_m']:.3f}",
            f"{point['worst_error_y_m']:.3f}",
            f"{point['aoa_estimates']:.0f}",
        ]
        made.add_row(*cells[: len(head)])
    console.print(made)


# Percentiles that only the report contains, so that the table fits a screen of 24 lines.
REPORT_ONLY_PERCENTS = (95.0, 99.9)


def show_simulation(result: Simulation, title: str, energy_boundary: str | None) -> None:
    """Prints errors, angle estimates and energy of a simulation as a table."""
    from access_av.run.service_levels import reached_in_words

    steps, runs = result.steps, result.runs
    made = table(["", "value", "95 % interval"], title=title)
    rows: dict[str, tuple[Any, str]] = {
        "RMS error / m": (result.rms_error_m, ""),
    }
    for each in result.percentiles or ():
        if each.percent in REPORT_ONLY_PERCENTS:
            continue
        rows[f"{each.percent:g}th percentile of the error / m"] = each.value, each.interval
    rows |= {
        "maximum mean error along the track, X / m": (steps["mean_abs_error_x_m"].max(), ""),
        "maximum mean error along the track, Y / m": (steps["mean_abs_error_y_m"].max(), ""),
        "duration / s": (steps["time_s"].max(), ""),
        "angle estimates": (runs["aoa_estimates"].mean(), ""),
        f"energy / J, {energy_boundary or 'not counted'}": (runs["energy_j"].mean(), ""),
    }
    if runs["found_s"].fill_null(1.0).max() != 0.0:
        found = runs.height - runs["found_s"].null_count()
        rows["runs with a successful search"] = found, ""
        rows["distance until found, median / m"] = runs["found_m"].median(), ""
        rows["distance until found, maximum / m"] = runs["found_m"].max(), ""
    consistency = result.consistency
    if consistency is not None and consistency.anees is not None:
        interval = consistency.anees_interval if runs.height > 1 else None
        rows["NEES per axis (expected: 1)"] = (
            consistency.anees,
            "" if interval is None else f"{interval[0]:.3g} to {interval[1]:.3g}",
        )
    integrity = result.integrity
    if integrity is not None:
        rows["protection level / error, median"] = integrity.median_level_over_error, ""
    for name, (value, interval_text) in rows.items():
        made.add_row(name, value_text(value), interval_text)
    console.print(made)
    if (operation := result.operation) is not None:
        console.print(f"{operation.in_words()} {operation.what_helps()}".strip())
    if levels := result.service_levels:
        console.print(f"3GPP positioning service: {reached_in_words(levels)} reached (see report).")


def show_plan(found: Plan) -> None:
    """Prints the selected masts, and the next best ones."""
    console.print(
        f"{found.scenario.name}: 90th percentile of the error bound along the route "
        f"{found.before_m:.3f} m; with {', '.join(found.chosen)} {found.after_m:.3f} m."
    )
    made = table(["mast", "90th percentile with this mast only, m"])
    for row in found.ranking.head(10).iter_rows(named=True):
        made.add_row(row["name"], f"{row['p90_bound_m']:.3f}")
    console.print(made)
    show(
        shown.service_levels(found.verdicts),
        title=f"3GPP positioning service levels with {', '.join(found.chosen)}",
    )


def show_next_level(found: NextLevel) -> None:
    """Prints where the site fails the next service level, and the effect of changes."""
    console.print(found.in_words())
    show(shown.next_level(found))


def show_bound(summary: dict[str, Any], verdicts: Sequence[Verdict]) -> None:
    """Prints the bound along the route, and the SNR of each radio head."""
    made = table(["lower bound of the RMS error", "m"], title=summary["scenario"])
    for name, key in (("median along the route", "median_m"), ("90th percentile", "p90_m")):
        made.add_row(name, f"{summary[key]:.3f}")
    made.add_row("worst position", f"{summary['max_m']:.3f}")
    console.print(made)
    show(shown.radio_heads(summary["heads"]))
    show(shown.service_levels(verdicts), title="3GPP positioning service levels")


def show_kinds(bounds: pl.DataFrame) -> None:
    """Prints the bound by radio heads, kind of measurement and clocks."""
    columns: list[tuple[str, Callable[[Any], str]]] = [
        ("radio heads", lambda row: str(row["num_heads"])),
        ("measurements", lambda row: row["kinds"]),
        ("clocks", lambda row: row["clocks"]),
        ("without road m", lambda row: f"{row['bound_without_road_m']:.3f}"),
        ("with road m", lambda row: f"{row['bound_with_road_m']:.3f}"),
    ]
    show_rows(columns, bounds.to_dicts(), title="Lower bound by measurement", text=3)


def show_columns(columns: Table) -> None:
    """Prints the columns of one table."""
    where = columns.where.replace("`", "")
    console.print(columns.name, style="bold", end="")
    console.print(f"  {columns.row}. {where}.")
    keys = {"column": "name", "unit": "unit", "meaning": "meaning", "null when": "null"}
    cells = [(head, itemgetter(key)) for head, key in keys.items()]
    show_rows(cells, columns.records(), text=4)


def show_angles(log: AngleLog) -> None:
    """Prints the angles of a recording: counts and medians per SSB."""
    made = table(["PCI", "SSB", "angles", "resolved", "SNR dB", "σ rad", "σ noise rad"], text=0)
    for row in log.by_ssb().iter_rows():
        *counts, snr_db, sigma_rad, noise_rad = row
        made.add_row(*map(str, counts), f"{snr_db:.1f}", f"{sigma_rad:.4f}", f"{noise_rad:.4f}")
    console.print(made)


def show_bursts(bursts: Sequence[BurstAngle]) -> None:
    """Prints the angles of bursts, with errors if the truth is known."""
    made = table(["sample", "azimuth °", "σ °", "SNR dB", "truth °", "error °", "doubt"], text=0)
    for burst in bursts:
        azimuth_deg, truth_deg = burst.azimuth_deg, burst.truth_deg
        made.add_row(
            str(burst.sample_start),
            unsigned_zero(f"{azimuth_deg:.2f}"),
            f"{burst.sigma_deg:.3f}",
            f"{burst.snr_db:.1f}",
            "" if truth_deg is None else f"{truth_deg:.2f}",
            "" if truth_deg is None else unsigned_zero(f"{azimuth_deg - truth_deg:+.2f}"),
            burst.doubt or "–",
        )
    console.print(made)
    # Imported here, because it imports NumPy.
    from access_av.signal.recorded_angles import mean_absolute_error_deg

    error_deg = mean_absolute_error_deg(bursts)
    if error_deg is not None:
        console.print(f"Mean absolute error {error_deg:.2f}° over {len(bursts)} bursts.")


def show_cells(title: str, cells: Sequence[dict[str, Any]]) -> None:
    """Prints the SSBs of one recording; a narrow terminal omits their time and frequency."""
    with_angles = any("azimuth_deg" in cell for cell in cells)
    columns = ["PCI", "SSB", "SFN", "SNR dB", "CFO Hz"]
    if with_angles:
        columns += ["azimuth °", "σ °"]
    if not is_narrow():
        columns += ["sample", "MHz", "kHz"] + ["doubt"] * with_angles
    made = table(columns, title=title, text=0)
    for cell in cells:
        texts = {
            "PCI": str(cell["pci"]),
            "SSB": str(cell["ssb_index"]),
            "SFN": "–" if cell["sfn"] is None else str(cell["sfn"]),
            "SNR dB": f"{cell['snr_db']:.1f}",
            "CFO Hz": unsigned_zero(f"{cell['cfo_hz']:.1f}"),
            "azimuth °": unsigned_zero(f"{cell['azimuth_deg']:.2f}")
            if "azimuth_deg" in cell
            else "–",
            "σ °": f"{cell['sigma_deg']:.3f}" if "sigma_deg" in cell else "–",
            "doubt": cell.get("doubt") or "–",
            "sample": str(cell["sample_start"]),
            "MHz": f"{cell['ssb_freq_hz'] / 1e6:.3f}",
            "kHz": str(cell["scs_khz"]),
        }
        made.add_row(*(texts[column] for column in columns))
    console.print(made)
