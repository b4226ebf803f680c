"""The command ``integrity``: protection levels under injected faults and wrong settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from access_av.cli.options import (
    OTHER_SHARES,
    AsJson,
    DaskOption,
    Out,
    Runs,
    ScenarioArgument,
    Seed,
    ShardOption,
    Threads,
    load_scenario,
)
from access_av.cli.terminal import console, progress, table, width

if TYPE_CHECKING:
    from collections.abc import Sequence

app = typer.Typer()


@app.command(
    epilog="Example: [bold]access-av integrity yard --channel 'as set' --channel inf-sh "
    "--heads 2 --heads 4 --out results/yard-integrity[/]",
)
def integrity(
    scenario: ScenarioArgument,
    runs: Runs = 20,
    seed: Seed = 1,
    threads: Threads = None,
    mismatch: Annotated[
        list[str] | None, typer.Option(help="Only this one; may be repeated. Else all.")
    ] = None,
    hypotheses: Annotated[
        bool, typer.Option("--hypotheses", help="What may be wrong at a site, at three sizes.")
    ] = False,
    channel: Annotated[
        list[str] | None,
        typer.Option(help="'as set', K=5 (a true Rician K of 5 dB), umi, inf-sl ...; repeat it."),
    ] = None,
    heads: Annotated[
        list[int] | None, typer.Option(min=1, help="Radio heads listened to; may be repeated.")
    ] = None,
    risk: Annotated[
        list[float] | None,
        typer.Option(help="Target integrity risk per hour, not the vehicle's; may be repeated."),
    ] = None,
    shard: ShardOption = "1/1",
    dask: DaskOption = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Inject faults and wrong settings, and count what the protection level still covers.

    Array turned or badly calibrated, odometer worse than stated, radio heads elsewhere or hidden:
    by channel, by number of radio heads. With --out a stopped campaign goes on where it stopped.
    Prints the share of the time that is ok, the share of that with an error beyond the level, the
    longest time beyond the alert limit without an alarm, the integrity risk per hour, and level by
    error; ≤ is the end of a 95 % interval. In a narrow terminal the last of them are left out.
    Writes integrity.parquet, report.html (table and Stanford diagrams), parts/ and manifest.json.
    """
    import polars as pl

    from access_av.report.integrity import render_integrity
    from access_av.run import integrity_campaign
    from access_av.run.campaign import Campaign, Shard, executor
    from access_av.run.fault_injection import hypotheses as sized
    from access_av.run.result_cache import Parts
    from access_av.tables.results_directory import ResultsDirectory, json_text

    chosen = load_scenario(scenario)
    directory = ResultsDirectory.create("integrity", out)
    share = Shard.parse(shard)
    if hypotheses:
        mismatch = [*(mismatch or ()), *sized(chosen)]
    with progress("Driving") as tick, executor(dask, threads) as (pool, workers):
        cases = integrity_campaign.drive(
            Campaign(Parts(directory.path / "parts"), pool, workers, share),
            chosen,
            runs=runs,
            seed=seed,
            only=mismatch,
            channel_names=channel or ("as set",),
            heads=heads,
            risks_per_hour=risk,
            progress=tick,
        )
    if cases is None:
        console.print(OTHER_SHARES.format(shard))
        return
    records = [case.as_record() for case in cases]
    directory.write_table("integrity.parquet", pl.DataFrame(records))
    directory.write_text("report.html", render_integrity(cases, records, runs, seed))
    directory.write_manifest(scenario=scenario, runs=runs, seed=seed, warnings=chosen.warnings())
    if as_json:
        print(json_text({"cases": records, "directory": str(directory.path)}))
        return
    _show(records)
    console.print(f"Report: {directory.path / 'report.html'}", soft_wrap=True)


Cell = Callable[[dict[str, Any]], str]


def _power_of_ten(key: str) -> Cell:
    return lambda one: "–" if one[key] is None else f"{one[key]:.0e}"


# Cells of a case. What all cases have in common stands above the table.
_SETTINGS: tuple[tuple[str, Cell], ...] = (
    ("channel", lambda one: one["channel"]),
    ("heads", lambda one: str(one["heads"])),
    ("asked/h", _power_of_ten("asked_risk_per_hour")),
)
# Most important first; "≤" is the end of the 95 % interval of what stands before it.
_FOUND: tuple[tuple[str, Cell], ...] = (
    ("ok %", lambda one: f"{100.0 * one['availability']:.1f}"),
    ("beyond", _power_of_ten("exceedance_share")),
    ("≤", _power_of_ten("exceedance_share_high")),
    ("alert s", lambda one: f"{one['time_to_alert_s']:.1f}"),
    ("risk/h", _power_of_ten("risk_per_hour")),
    ("≤", _power_of_ten("risk_per_hour_high")),
    ("level/error", lambda one: f"{one['level_over_error']:.1f}"),
)


def _show(records: Sequence[dict[str, Any]]) -> None:
    """Print a row for each case, in as many columns as the terminal has room for."""
    common = [
        f"{name} {cell(records[0])}"
        for name, cell in _SETTINGS
        if len({cell(one) for one in records}) == 1
    ]
    columns: list[tuple[str, Cell]] = [
        ("world", lambda one: "as stated" if one["mismatch"] == "none" else one["mismatch"]),
        *((name, cell) for name, cell in _SETTINGS if len({cell(one) for one in records}) > 1),
        *_FOUND,
    ]
    console.print(", ".join([f"{records[0]['runs']} drives each", *common]), soft_wrap=True)
    while True:
        made = table([name for name, _ in columns])
        for one in records:
            made.add_row(*(cell(one) for _, cell in columns))
        if width(made) <= console.width or len(columns) == 2:
            break
        columns.pop()
    console.print(made)
