"""Commands ``design profile`` and ``design power``: time, energy and power of onboard computers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from access_av._core import Platform
from access_av.cli import options as opt
from access_av.cli.terminal import console, progress, say, show_warning, table
from access_av.settings import as_dict

app = typer.Typer()


@opt.command(app, "Onboard computer", "design profile --name my-board --out my-board.toml")
def profile(
    out: Annotated[Path | None, Option(help="Platform file to write.")] = None,
    name: Annotated[str, Option(help="Name of the platform.")] = "this-machine",
    mode: Annotated[
        list[int] | None, Option(help="Power mode; repeatable.", show_default="all")
    ] = None,
    window_s: Annotated[
        float,
        Option(
            min=0.05, max=3600.0, help="Duration of each workload, and of the idle phase before it."
        ),
    ] = 5.0,
    cpu_mhz: Annotated[
        float | None,
        Option(min=1.0, max=1e5, help="CPU clock in MHz, if the computer does not report it."),
    ] = None,
    sysfs_root: Annotated[
        Path, Option(help="Folder that contains sys/ with sensors and modes.")
    ] = Path("/"),
    as_json: opt.AsJson = False,
) -> None:
    """Measure time and energy of angle estimation on this computer, and write a platform file.

    For each power mode (nvpmodel, cpufreq, otherwise the present one), each method and the SSB
    chain: wall and CPU time per estimate, and the energy above idle with its interval (INA3221,
    INA238 or RAPL). Without a sensor, the energy is reported as not measured. The original power
    mode is restored.
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
        say(f"Platform file: {out}")


@opt.command(app, "Onboard computer", "design power jetson-agx-xavier-engine")
def power(
    platform: Annotated[str, Argument(help="Platform: shipped name, or path of a TOML file.")],
) -> None:
    """Compare the modelled and the measured power of a board with all cores busy.

    One row per power mode of the platform file; a dash marks a missing value.
    """
    board = Platform.load(platform)
    made = table(
        ["mode", "name", "cores", "MHz", "modelled W", "measured W", "difference %"], text=2
    )
    for index, mode in enumerate(as_dict(board)["modes"]):
        modelled_w = board.busy_power_w(index, mode["cores"])
        measured_w = mode.get("full_load_power_w", {}).get("value")
        made.add_row(
            str(mode["mode"]),
            mode["name"],
            str(mode["cores"]),
            f"{mode['cpu_mhz']:.1f}",
            "–" if modelled_w is None else f"{modelled_w:.2f}",
            "–" if measured_w is None else f"{measured_w:.2f}",
            "–"
            if modelled_w is None or measured_w is None
            else f"{100.0 * (modelled_w / measured_w - 1.0):+.1f}",
        )
    console.print(made)
