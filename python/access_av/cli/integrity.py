"""Command ``design integrity``: protection levels under injected faults and wrong settings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Option

from access_av.cli import options as opt
from access_av.cli.side_by_side import PERCENTS, of_scenario, show_compared, write_compared
from access_av.cli.side_by_side import records as as_records
from access_av.cli.terminal import progress, say, show_rows
from access_av.errors import InputError

if TYPE_CHECKING:
    from access_av.run.integrity_campaign import Case
    from access_av.study.compare import Compared

app = typer.Typer()

# Maximum of --fault-scale: larger faults are outside the valid range of settings.
MAX_FAULT_SCALE = 100.0


def _scales(text: str) -> list[float]:
    """Returns the multiples of the standard deviations that ``--fault-scale`` contains."""
    try:
        scales = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(
            f"--fault-scale {text}: write numbers and commas, for example 1,3,10"
        ) from error
    if not all(0.0 < scale <= MAX_FAULT_SCALE for scale in scales):
        raise InputError(
            f"--fault-scale {text}: numbers must be above 0 and at most {MAX_FAULT_SCALE:g}"
        )
    return scales


@opt.command(
    app,
    "Integrity and cost",
    "design integrity yard --channel 'as set' --channel inf-sh "
    "--num-heads 2 --num-heads 4 --out results/yard-integrity",
)
def integrity(
    scenario: opt.ScenarioArgument,
    runs: opt.Runs = 20,
    seed: opt.Seed = 1,
    threads: opt.Threads = None,
    fault: Annotated[
        list[str] | None,
        Option(
            help="Fault: difference between truth and nominal model; repeatable.",
            show_default="all",
        ),
    ] = None,
    fault_scale: Annotated[
        str | None,
        Option(
            metavar="N,N,…",
            help="Also simulate the site's fault hypotheses at these multiples of their "
            "standard deviations, for example 1,3,10.",
        ),
    ] = None,
    channel: Annotated[
        list[str] | None,
        Option(help="True channel: 'as set', K=5 (Rician K of 5 dB), umi, inf-sl, …; repeatable."),
    ] = None,
    heads: Annotated[
        list[int] | None,
        Option("--num-heads", min=1, help="Number of received radio heads; repeatable."),
    ] = None,
    risk: Annotated[
        list[float] | None,
        Option(help="Target integrity risk per hour; repeatable.", show_default="the vehicle's"),
    ] = None,
    vary: opt.Vary = None,
    compare: opt.Compare = None,
    percentile: opt.Percents = None,
    executor: opt.ExecutorOption = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Inject faults and wrong settings, and evaluate the protection level.

    Cases: array rotated or badly calibrated, odometer worse than specified, radio heads moved or
    hidden; for each channel and number of radio heads. --out continues an interrupted campaign.

    Columns: share of the time with state ok; share of that time with an error above the protection
    level; maximum time above the alert limit without an alarm; integrity risk per hour; level
    divided by error. ≤ is the upper end of a 95 % interval. Narrow terminals omit the last columns.

    Writes integrity.parquet, report.html (table and Stanford diagrams), parts/ and manifest.json.
    --sweep and --against repeat every case and write compared.parquet.
    """
    import polars as pl

    from access_av.report.integrity import render_integrity
    from access_av.report.parts import compared_section
    from access_av.run import integrity_campaign
    from access_av.run.campaign import campaign
    from access_av.run.fault_injection import hypotheses as sized
    from access_av.tables.results_directory import ResultsDirectory, json_text

    scales = [] if fault_scale is None else _scales(fault_scale)
    chosen = opt.load_scenario(scenario)
    others = {name: opt.load_scenario(name) for name in compare or ()}
    variants = of_scenario(chosen, vary, others)
    directory = ResultsDirectory.create("integrity", out)
    if scales:
        fault = [*(fault or ()), *sized(chosen, scales)]
    parts = directory.path / "parts"
    with progress("Driving") as tick, campaign(parts, executor, threads) as kept:
        driven = {
            label: integrity_campaign.drive(
                kept,
                variant,
                runs=runs,
                seed=seed,
                only=fault,
                channel_names=channel or ("as set",),
                heads=heads,
                risks_per_hour=risk,
                progress=tick,
            )
            for label, variant in variants.items()
        }
    cases = []
    for label, its in driven.items():
        cases += [replace(case, variant=label) for case in its]
    comparison = _compare_variants(cases, sorted(percentile or PERCENTS))
    write_compared(comparison, directory)
    records = [case.as_record() for case in cases]
    directory.write_table("integrity.parquet", pl.DataFrame(records))
    page = render_integrity(cases, records, runs, seed, compared_section(comparison))
    directory.write_text("report.html", page)
    directory.write_manifest(scenario=scenario, runs=runs, seed=seed, warnings=chosen.warnings())
    if as_json:
        result = {
            "cases": records,
            "compared": as_records(comparison),
            "directory": str(directory.path),
        }
        print(json_text(result))
        return
    _show(records)
    show_compared(comparison)
    say(f"Report: {directory.path / 'report.html'}")


def _compare_variants(cases: Sequence[Case], percents: list[float]) -> list[Compared]:
    """Compares each case with that of the first variant; empty for a single variant."""
    from access_av.study.compare import beside_first

    if len({case.variant for case in cases}) == 1:
        return []
    # Pair the cases by their order, because number of radio heads and risk can be varied.
    seen: Counter[tuple[str, str, str]] = Counter()
    of_case: dict[tuple[str, str, int], list[Case]] = {}
    for case in cases:
        kind = (case.variant, case.mismatch, case.channel)
        of_case.setdefault((case.mismatch, case.channel, seen[kind]), []).append(case)
        seen[kind] += 1
    found = []
    for (fault, channel, _), its in of_case.items():
        where = "" if len(of_case) == 1 else f"{fault}, {channel}, {its[0].heads} radio heads: "
        found += beside_first([it.errors(f"{where}{it.variant}") for it in its], percents)
    return found


Cell = Callable[[dict[str, Any]], str]


def _power_of_ten(key: str) -> Cell:
    return lambda one: "–" if one[key] is None else f"{one[key]:.0e}"


# Settings of a case. Settings that all cases share are printed above the table.
_SETTINGS: tuple[tuple[str, Cell], ...] = (
    ("variant", lambda one: one["variant"]),
    ("channel", lambda one: one["channel"]),
    ("heads", lambda one: str(one["heads"])),
    ("target/h", _power_of_ten("asked_risk_per_hour")),
)
# Results, the most important first; "≤": upper end of the 95 % interval of the column before.
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
    """Prints a row per case, with as many columns as the terminal can show."""
    common = [
        f"{name} {cell(records[0])}"
        for name, cell in _SETTINGS
        if name != "variant" and len({cell(one) for one in records}) == 1
    ]
    columns: list[tuple[str, Cell]] = [
        ("truth", lambda one: "nominal" if one["mismatch"] == "none" else one["mismatch"]),
        *((name, cell) for name, cell in _SETTINGS if len({cell(one) for one in records}) > 1),
        *_FOUND,
    ]
    say(", ".join([f"{records[0]['runs']} runs each", *common]))
    show_rows(columns, records, least=2)
