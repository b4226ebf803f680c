"""The command ``profile``: time and energy of the computation on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from access_av.cli.options import AsJson
from access_av.cli.terminal import console, progress, show_warning, table

app = typer.Typer()


@app.command(
    epilog="Example: [bold]access-av profile --name my-board --out my-board.toml[/]",
)
def profile(
    out: Annotated[Path | None, typer.Option(help="Write the platform file here.")] = None,
    name: Annotated[str, typer.Option(help="Name of the platform.")] = "this-machine",
    mode: Annotated[list[int] | None, typer.Option(help="Only these power modes.")] = None,
    window_s: Annotated[
        float, typer.Option(min=0.05, max=3600.0, help="Time per workload, and idle before it.")
    ] = 5.0,
    cpu_mhz: Annotated[
        float | None, typer.Option(min=1.0, max=1e5, help="Clock, where the machine does not say.")
    ] = None,
    sysfs_root: Annotated[
        Path, typer.Option(help="Read sensors and modes below this folder, in the place of /.")
    ] = Path("/"),
    as_json: AsJson = False,
) -> None:
    """Measure what estimating angles takes on this machine, and write it as a platform file.

    In each power mode (nvpmodel, cpufreq, else the present one), for each method and for the SSB
    chain: wall and CPU time per execution, and the energy above idle from INA3221, INA238 or RAPL,
    as an interval. Where there is no sensor it says so. The mode that was found is put back.
    """
    from access_av.device.profile import profile as measure
    from access_av.tables.results_directory import json_text, write_whole

    with progress("Profiling") as tick:
        found = measure(sysfs_root, modes=mode, window_s=window_s, cpu_mhz=cpu_mhz, progress=tick)
    platform = found.platform(name)
    for warning in found.warnings:
        show_warning(warning)
    if out is not None:
        write_whole(out, platform.to_toml())
    if as_json:
        records = [each.record() for each in found.measured]
        report = {"machine": found.machine, "sensors": found.sensors, "measured": records}
        print(json_text(report))
        return
    head = ["mode", "workload", "median µs", "p99 µs", "CPU µs", "energy above idle µJ"]
    made = table(head, title=found.machine, text=2)
    for each in found.measured:
        timing, energy = each.timing, each.energy_j
        shown = "not measured"
        if energy is not None:
            shown = f"{energy.value * 1e6:.4g} ± {energy.half_width * 1e6:.2g}"
        times = (timing.median_s, timing.p99_s, timing.cpu_median_s)
        made.add_row(
            str(each.mode.number), each.workload, *(f"{s * 1e6:.1f}" for s in times), shown
        )
    console.print(made)
    if out is not None:
        console.print(f"Platform file: {out}", soft_wrap=True)
