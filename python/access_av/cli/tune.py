"""Command ``design tune``: optimization of a wake-up policy for a scenario."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from typer import Option

from access_av.cli import options as opt
from access_av.cli.terminal import console, errors, progress, say, table

if TYPE_CHECKING:
    from access_av.designs.space import Space
    from access_av.designs.tune import Tuned

app = typer.Typer()

# Percentiles shown in the terminal.
SHOWN_PERCENTS = (50.0, 90.0, 99.0)


@opt.command(app, "Operating points", "design tune yard --max-error-m 0.5 --percentile 99")
def tune(
    scenario: opt.ScenarioArgument,
    max_error_m: opt.MaxError = None,
    percentile: opt.PercentileOption = None,
    max_rms_m: opt.MaxRms = None,
    max_worst_m: Annotated[
        float | None, opt.limit("Maximum error of a drive, kept in 90 % of the runs, in m.")
    ] = None,
    max_energy_j: Annotated[
        float | None, opt.limit("Maximum energy of a trip, in J; the error is minimized.")
    ] = None,
    platform: opt.PlatformOption = "jetson-agx-xavier-engine",
    mode: Annotated[int, Option(min=0, max=255, help="Power mode of the platform.")] = 0,
    designs: Annotated[
        int, Option(min=2, max=10_000, help="Number of points that Optuna suggests.")
    ] = 192,
    runs: opt.Runs = 20,
    seed: opt.Seed = 1,
    executor: opt.ExecutorOption = None,
    threads: opt.Threads = None,
    out: opt.Out = None,
    as_json: opt.AsJson = False,
) -> None:
    """Tune gains, weights and set points of a scenario's wake-up policy.

    Minimizes the energy under an error limit, or the error under an energy limit. The result and
    the given policy are compared in new runs; without an improvement the given policy remains.
    Writes vehicle.toml, tuned.json, scenario.toml (unchanged) and manifest.json. results/parts
    keeps the runs, so that a repeated command continues.

    Exit code 0: the limits are met in these runs. 3: a limit is missed; the message gives its
    margin.
    """
    from access_av.designs.front import row_of
    from access_av.designs.query import Query
    from access_av.designs.tune import space_of
    from access_av.designs.tune import tune as search
    from access_av.run.campaign import campaign
    from access_av.tables.results_directory import RESULTS, ResultsDirectory, json_text

    chosen = opt.load_scenario(
        scenario, overrides={"vehicle.platform": {"name": platform, "mode": mode}}
    )
    limits = Query(
        max_energy_j=max_energy_j,
        max_rms_m=max_rms_m,
        max_worst_m=max_worst_m,
        max_error_m=max_error_m,
        percentile=percentile,
    )
    with progress("Tuning") as tick, campaign(RESULTS / "parts", executor, threads) as kept:
        found = search(kept, chosen, limits, designs=designs, runs=runs, seed=seed, progress=tick)
    row = row_of(found.after)
    is_kept, verdicts = limits.keeps(row), limits.in_words(row)
    directory = ResultsDirectory.create(f"tune-{chosen.name}", out)
    directory.write_text("vehicle.toml", found.after.design.scenario.vehicle.to_toml())
    record = {
        "values": dict(found.after.design.values),
        "is_better": found.is_better,
        "is_kept": is_kept,
        "constraints": verdicts,
        "energy_j": [found.before.mean_energy_j, found.after.mean_energy_j],
        "rms_error_m": [found.before.rms_m, found.after.rms_m],
        "before": row_of(found.before),
        "after": row,
        "energy_less_j": found.less[0].tolist(),
        "square_less_m2": found.less[1].tolist(),
        "drives": found.drives,
    }
    directory.write_json("tuned.json", record)
    directory.write_text("scenario.toml", chosen.to_toml())
    asked = {
        "--max-error-m": max_error_m,
        "--percentile": percentile,
        "--max-rms-m": max_rms_m,
        "--max-worst-m": max_worst_m,
        "--max-energy-j": max_energy_j,
        "--platform": platform,
        "--mode": mode,
        "--designs": designs,
        "--runs": runs,
        "--seed": seed,
    }
    given = [text for name, value in asked.items() if value is not None for text in (name, value)]
    directory.write_manifest(
        repeat=("design", "tune", "scenario.toml", *given),
        scenario=chosen.name,
        runs=runs,
        seed=seed,
        warnings=chosen.warnings(),
    )
    if as_json:
        print(json_text({**record, "directory": str(directory.path)}))
    else:
        _show(found, space_of(chosen))
        for verdict in verdicts:
            say(f"{verdict}.")
        say(f"{directory.path / 'vehicle.toml'}")
    if not is_kept:
        errors.print(
            "Limits not met: no parameters of this policy meet the limits. More radio heads, a "
            f"better odometer or a surveyed road can help: access-av design plan {scenario}",
            style="red",
            soft_wrap=True,
        )
        raise typer.Exit(opt.MISSED)


def _show(found: Tuned, space: Space) -> None:
    values = found.after.design.values
    if found.is_better:
        made = table(["", "range", "tuned"], title="Wake-up policy", text=2)
        for dimension in space.dimensions:
            ends = f"{dimension.low:g} to {dimension.high:g}"
            key = dimension.key.removeprefix("vehicle.wake_up.")
            made.add_row(key, ends, f"{values[dimension.key]:.4g}")
        console.print(made)
    both = (found.before, found.after) if found.is_better else (found.before,)
    made = table(["in new runs", "baseline", "tuned"][: 1 + len(both)])
    made.add_row("energy of a trip / J", *(f"{it.mean_energy_j:.3f}" for it in both))
    made.add_row("RMS error / m", *(f"{it.rms_m:.3f}" for it in both))
    for each in zip(*(it.percentiles(SHOWN_PERCENTS) for it in both), strict=True):
        name = f"{each[0].percent:g}th percentile of the error / m (95 %)"
        made.add_row(name, *(f"{it.value:.3f} ({it.interval})" for it in each))
    made.add_row("angle estimates", *(f"{it.aoa_estimates.mean():.0f}" for it in both))
    console.print(made)
    if not found.is_better:
        console.print("No improvement found: the policy is unchanged.")
        return
    mean_j, low_j, high_j = found.less[0]
    if mean_j >= 0.0:
        console.print(f"Energy saved: {mean_j:.3f} J (95 %: {low_j:.3f} to {high_j:.3f})")
    else:
        console.print(f"Additional energy: {-mean_j:.3f} J (95 %: {-high_j:.3f} to {-low_j:.3f})")
