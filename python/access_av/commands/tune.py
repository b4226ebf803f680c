"""The command ``tune``: a wake-up policy for one's own road and objective."""

from __future__ import annotations

from typing import Annotated

import typer

from access_av.commands.options import (
    AsJson,
    DaskOption,
    Out,
    Runs,
    ScenarioArgument,
    Seed,
    Threads,
    load_scenario,
)
from access_av.terminal import console, progress, table

app = typer.Typer()


@app.command(
    epilog="Example: [bold]access-av tune yard --max-rms-m 0.15[/]",
)
def tune(
    scenario: ScenarioArgument,
    max_rms_m: Annotated[
        float | None, typer.Option(min=0.0, help="RMS error over track and runs.")
    ] = None,
    max_worst_m: Annotated[
        float | None, typer.Option(min=0.0, help="Largest error, in nine of ten runs.")
    ] = None,
    max_energy_j: Annotated[
        float | None, typer.Option(min=0.0, help="Mean energy of a trip; then least error.")
    ] = None,
    platform: Annotated[
        str, typer.Option(help="Computer whose energy counts: shipped name, or TOML file.")
    ] = "jetson-agx-xavier-engine",
    mode: Annotated[int, typer.Option(min=0, max=255, help="Its power mode.")] = 0,
    designs: Annotated[
        int, typer.Option(min=2, max=10_000, help="Points tried in each of three rounds.")
    ] = 64,
    runs: Runs = 20,
    seed: Seed = 1,
    dask: DaskOption = None,
    threads: Threads = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Tune gains, weights and set points of a scenario's wake-up policy.

    Least energy that keeps the error, or least error that keeps the energy. What is found is driven
    again in runs that the search has not seen, beside what was there before. Writes vehicle.toml,
    tuned.json and manifest.json; drives are kept in results/parts, so that a command that was
    stopped goes on.
    """
    from access_av.campaign import Campaign, executor
    from access_av.designs.table import Constraints
    from access_av.designs.tune import space_of
    from access_av.designs.tune import tune as search
    from access_av.files import RESULTS, ResultsDirectory, json_text
    from access_av.parts import Parts

    chosen = load_scenario(
        scenario, overrides={"vehicle.platform": {"name": platform, "mode": mode}}
    )
    constraints = Constraints(max_energy_j, max_rms_m, max_worst_m)
    with progress("Tuning") as tick, executor(dask, threads) as (pool, workers):
        found = search(
            Campaign(Parts(RESULTS / "parts"), pool, workers),
            chosen,
            constraints,
            designs=designs,
            runs=runs,
            seed=seed,
            progress=tick,
        )
    tuned = found.after.design
    directory = ResultsDirectory.create(f"tune-{chosen.name}", out)
    directory.write_text("vehicle.toml", tuned.scenario.vehicle.to_toml())
    record = {
        "values": dict(tuned.values),
        "energy_j": [found.before.mean_energy_j, found.after.mean_energy_j],
        "rms_error_m": [found.before.rms_m, found.after.rms_m],
        "energy_less_j": found.less[0].tolist(),
        "square_less_m2": found.less[1].tolist(),
        "drives": found.drives,
    }
    directory.write_json("tuned.json", record)
    directory.write_manifest(scenario=chosen.name, runs=runs, seed=seed, warnings=chosen.warnings())
    if as_json:
        print(json_text({**record, "directory": str(directory.path)}))
        return
    made = table(["", "range", "tuned"], title="Wake-up policy", text=2)
    for dimension in space_of(chosen).dimensions:
        ends = f"{dimension.low:g} to {dimension.high:g}"
        made.add_row(
            dimension.key.removeprefix("vehicle.wake_up."),
            ends,
            f"{tuned.values[dimension.key]:.4g}",
        )
    console.print(made)
    made = table(["in runs not seen before", "energy J", "RMS m", "executions"])
    for name, driven in (("as it was", found.before), ("tuned", found.after)):
        made.add_row(
            name,
            f"{driven.mean_energy_j:.3f}",
            f"{driven.rms_m:.3f}",
            f"{driven.executions.mean():.0f}",
        )
    console.print(made)
    for name, factor in constraints.excess(
        {
            "energy_j": found.after.mean_energy_j,
            "rms_error_m": found.after.rms_m,
            "p90_max_error_m": found.after.p90_worst_m,
        }
    ).items():
        if factor > 1.0:
            console.print(f"[red]{name} is {factor:.2f} times what is allowed[/]")
    mean_j, low_j, high_j = found.less[0]
    console.print(f"Energy less by {mean_j:.3f} J (95 %: {low_j:.3f} to {high_j:.3f})")
    console.print(f"{directory.path / 'vehicle.toml'}", soft_wrap=True)
