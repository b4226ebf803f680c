"""The command line, ``access-av``. Bad input ends with exit code 2 and one message."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from access_av import RecordingError, ScenarioError, __version__
from access_av.cli_bound import app as bound_commands
from access_av.cli_nr import app as nr_commands
from access_av.errors import InputError
from access_av.terminal import console, errors, progress

app = typer.Typer(
    name="access-av",
    help="Localization of factory vehicles from 5G synchronization signal blocks: "
    "accuracy and energy side by side.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _finite(value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number")
    return value


ScenarioArgument = Annotated[str, typer.Argument(help="Shipped name, or path of a TOML file.")]
ScenarioOption = Annotated[str, typer.Option(help="Shipped name, or path of a TOML file.")]
PlatformOption = Annotated[str, typer.Option(help="Shipped name, or path of a TOML file.")]
Runs = Annotated[int, typer.Option(min=1, help="Drives per setting.")]
Seed = Annotated[int, typer.Option(min=0, help="Same seed, same results.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Worker threads; all cores if not given.")]


def _bound(text: str) -> Any:
    return typer.Option(min=0.0, callback=_finite, help=text)


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


@app.command(
    epilog="Example: [bold]access-av evaluate --runs 20 --out results/quick[/]",
)
def evaluate(
    scenario: ScenarioOption = "paper",
    platform: PlatformOption = "jetson-agx-xavier",
    runs: Runs = 100,
    seed: Seed = 1,
    threads: Threads = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; else a new one in results/.")
    ] = None,
) -> None:
    """Run the paper's whole evaluation and write the report.

    Three campaigns: every method at every SSB, every method at what the computer manages, and
    adaptive MUSIC, each over all power modes. results/latest points to the files.
    """
    from access_av import study
    from access_av.terminal import show_claims, show_evaluation

    with progress("Driving") as tick:
        finished = study.run(
            scenario, platform, runs=runs, seed=seed, threads=threads, out=out, progress=tick
        )
    show_evaluation(finished.evaluation)
    show_claims(finished.claims)
    console.print(
        f"{runs} runs per setting in {finished.evaluation.duration_s:.1f} s. "
        f"Report: {finished.directory.path / 'report.html'}",
        soft_wrap=True,
    )


@app.command(
    epilog="Example: [bold]access-av run paper --runs 10 --set channel.rician_k_db=10[/]",
)
def run(
    scenario: ScenarioArgument,
    runs: Runs = 1,
    seed: Seed = 1,
    threads: Threads = None,
    out: Annotated[
        Path | None, typer.Option(help="Directory for the files; else a new one in results/.")
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change one key; may be repeated."),
    ] = None,
) -> None:
    """Drive one scenario and write its trajectories.

    Writes trajectories.parquet, executions.parquet, trajectory.tum and truth.tum (the first run),
    report.html, scenario.toml with every default, and manifest.json.
    """
    import polars as pl

    from access_av import Scenario, simulate
    from access_av.files import ResultsDirectory, tum_trajectory
    from access_av.report.drive import render_drive
    from access_av.terminal import show_simulation

    chosen = Scenario.load(scenario)
    if overrides:
        chosen = chosen.with_overrides(dict(map(_override, overrides)))
    directory = ResultsDirectory.create(f"run-{chosen.name}", out)
    with progress("Driving") as tick:
        result = simulate(
            chosen, runs=runs, seed=seed, threads=threads, keep_trajectories=True, progress=tick
        )
    if result.trajectories is None or result.executions is None:  # they were asked for
        raise RuntimeError("the simulation kept no trajectories")
    directory.write_table("trajectories.parquet", result.trajectories)
    directory.write_table("executions.parquet", result.executions)
    first = result.trajectories.filter(run=0)
    known = first.filter(~pl.col("searching"))
    for name, poses, prefix in (("trajectory.tum", known, ""), ("truth.tum", first, "true_")):
        columns = ("time_s", f"{prefix}x_m", f"{prefix}y_m", f"{prefix}heading_rad")
        directory.write_text(name, tum_trajectory(*(poses[column] for column in columns)))
    directory.write_text("report.html", render_drive(chosen, result, seed))
    directory.write_text("scenario.toml", chosen.resolved().to_toml())
    directory.write_manifest(scenario=chosen.name, runs=runs, seed=seed)
    directory.link_latest()

    show_simulation(result, title=f"{chosen.name}: {runs} runs, seed {seed}")
    console.print(f"Report: {directory.path / 'report.html'}", soft_wrap=True)


def _override(text: str) -> tuple[str, Any]:
    """Split KEY=VALUE; the value is read as TOML, and as plain text where it is none."""
    from access_av.facts import tomllib

    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: write KEY=VALUE, for example channel.rician_k_db=10")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


@app.command(
    epilog="Example: [bold]access-av explore --max-energy-j 260 --max-rms-m 0.15[/]",
)
def explore(
    max_energy_j: Annotated[float | None, _bound("Energy of a trip.")] = None,
    max_rms_m: Annotated[float | None, _bound("RMS error over track and runs.")] = None,
    max_worst_m: Annotated[float | None, _bound("Worst mean error, X and Y.")] = None,
    max_executions: Annotated[float | None, _bound("Angle estimates in a trip.")] = None,
    mode: Annotated[list[int] | None, typer.Option(help="Only these power modes.")] = None,
    fixed: Annotated[bool, typer.Option("--fixed", help="Also the fixed wake-up times.")] = False,
    results: Annotated[
        Path | None, typer.Option(help="Results of an evaluation; else results/latest.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Find operating points within an energy budget and an error bound.

    Asks the last evaluation; where there is none, runs it first.
    """
    from access_av import study
    from access_av.explore import Query, answer
    from access_av.terminal import show_points

    with progress("No evaluation yet, driving") as tick:
        points = study.operating_points(results, progress=tick)
    if not fixed:
        points = points.filter(adaptive=True)
    query = Query(max_energy_j, max_rms_m, max_worst_m, max_executions, mode)
    found = answer(points, query)
    if as_json:
        print(json.dumps(found.to_dicts(), indent=2))
        return
    if found.is_empty():
        console.print(f"No operating point has {query}.")
        nearest = points.sort("energy_j").head(1)
        show_points(nearest, title="The one with the least energy")
        return
    show_points(found, title=f"Operating points with {query}")
    best = found.row(0, named=True)
    console.print(
        f"Least energy: mode {best['mode']}, {best['energy_j']:.1f} J "
        f"(energy per execution: {best['energy_provenance']})."
    )


@app.command(
    epilog="Example: [bold]access-av fit --runs 100 --out fitted.toml[/]",
)
def fit(
    scenario: ScenarioOption = "paper",
    platform: PlatformOption = "jetson-agx-xavier",
    runs: Runs = 100,
    seed: Seed = 1,
    threads: Threads = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the platform file with the fitted values.")
    ] = None,
) -> None:
    """Fit the energy per execution of each mode and method to the paper's figures.

    Simulates how often each setting executes, then solves for the energies that agree with the
    sums the paper states. This is where the shipped platform's "fitted" values come from.
    """
    from access_av import study
    from access_av.methods import METHODS, label
    from access_av.terminal import table

    with progress("Counting executions") as tick:
        fitted = study.fit_platform(
            scenario, platform, runs=runs, seed=seed, threads=threads, progress=tick
        )
    made = table(["mode", *map(label, METHODS)], title="Energy per execution in J, fitted")
    for mode in fitted.modes:
        energies = (mode.energy_per_execution_j[method] for method in METHODS)
        made.add_row(str(mode.number), *(f"{energy.value:.4f}" for energy in energies))
    console.print(made)
    if out is not None:
        out.write_text(fitted.to_toml(), encoding="utf-8")
        console.print(f"Platform file: {out}", soft_wrap=True)


@app.command(epilog="Example: [bold]access-av aoa captures/array1.sigmf-meta --json[/]")
def aoa(
    recording: Annotated[Path, typer.Argument(help="SigMF recording of a linear array.")],
    spacing: Annotated[
        float | None,
        typer.Option(min=0.01, max=10.0, help="Antenna spacing in wavelengths; else as recorded."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Estimate angles of arrival from a multi-antenna recording.

    Reference bursts calibrate the channels, every other annotated burst is estimated. Azimuths
    are counter-clockwise from the array's broadside.
    """
    from access_av.recorded_angles import estimate_bursts
    from access_av.terminal import show_bursts

    bursts = estimate_bursts(recording, spacing_wavelengths=spacing)
    if as_json:
        print(json.dumps([burst.as_record() for burst in bursts], indent=2))
    else:
        show_bursts(bursts)


def _files_app(what: str) -> typer.Typer:
    """Commands that show, check and describe the files of one kind."""
    from access_av import Platform, Scenario

    kind: Any = {"scenario": Scenario, "platform": Platform}[what]
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
            except ScenarioError as error:
                _report_error(error)
                wrong += 1
        if wrong:
            raise typer.Exit(2)

    @files.command(help=f"Print the JSON Schema of {what} files, for editors.")
    def schema() -> None:
        print(kind.schema_json())

    return files


app.add_typer(bound_commands)
app.add_typer(nr_commands)

for _what in ("scenario", "platform"):
    app.add_typer(_files_app(_what), name=_what)


def _report_error(error: Exception) -> None:
    if isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}"
    else:
        message = str(error)
    errors.print("[bold red]error:[/]", end=" ")
    errors.print(message, markup=False, soft_wrap=True)


def main() -> None:
    """Entry point: turns every bad input into one message and exit code 2."""
    try:
        app()
    except (ScenarioError, RecordingError, InputError, OSError) as error:
        _report_error(error)
        sys.exit(2)
