"""Arguments and options that several commands share."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer
from typer import Argument, Option

from access_av._core import Scenario, SettingsWarning, Site, Vehicle
from access_av.cli.terminal import show_warning
from access_av.errors import InputError
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping


ScenarioArgument = Annotated[str, Argument(help="Scenario: shipped name, or path of a TOML file.")]
PlatformOption = Annotated[str, Option(help="Platform: shipped name, or path of a TOML file.")]
SiteOption = Annotated[str, Option("--site", help="Site: shipped name, or path of a TOML file.")]
VehicleOption = Annotated[
    str, Option("--vehicle", help="Vehicle: shipped name, or path of a TOML file.")
]
StartTime = Annotated[float, Option(help="Time of the first sample by the odometry's clock, in s.")]
Runs = Annotated[int, Option(min=1, max=1_000_000, help="Simulated runs per configuration.")]
Seed = Annotated[int, Option(min=0, max=2**64 - 1, help="Seed of the random numbers.")]
Threads = Annotated[
    int | None, Option(min=1, max=1024, help="Worker threads.", show_default="all cores")
]
Out = Annotated[Path | None, Option(help="Output folder.", show_default="a new one in results/")]
AllowLarge = Annotated[
    bool, Option("--allow-large", help="Permit simulations that need hours or gigabytes.")
]
Overrides = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="KEY=VALUE",
        help="Value for one key of the file, as KEY=VALUE; repeatable.",
    ),
]
ExecutorOption = Annotated[
    str | None,
    Option(
        metavar="FILE.py:NAME",
        help="Function that returns a concurrent.futures.Executor, for example of a cluster.",
        show_default="threads",
    ),
]


def _finite(value: float | None) -> float | None:
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number")
    return value


def limit(text: str) -> Any:
    """Returns the option of a limit: a finite number of at least 0."""
    return Option(min=0.0, callback=_finite, help=text)


MaxRms = Annotated[float | None, limit("Maximum RMS error over all runs, in m.")]
MaxError = Annotated[
    float | None, limit("Maximum of the error percentile (see --percentile), in m.")
]
PercentileOption = Annotated[
    float | None,
    Option(
        help="Error percentile limited by --max-error-m: 50, 90, 95, 99 or 99.9.", show_default="99"
    ),
]
Vary = Annotated[
    list[str] | None,
    Option(
        "--sweep", metavar="KEY=a,b,c", help="Compare values of a key, as KEY=a,b,c; repeatable."
    ),
]
Compare = Annotated[
    list[str] | None, Option("--against", help="File to compare with the baseline; repeatable.")
]
Percents = Annotated[
    list[float] | None,
    Option(
        "--percentile",
        min=1.0,
        max=100.0,
        help="Percentile of the error to compare; repeatable.",
        show_default="50, 90, 99",
    ),
]
AsJson = Annotated[bool, Option("--json", help="Print JSON.")]

F = TypeVar("F", bound="Callable[..., Any]")


def command(
    app: typer.Typer, panel: str, *examples: str, name: str | None = None
) -> Callable[[F], F]:
    """Returns the decorator of a command, with its help panel and its examples."""
    shown = ", ".join(f"[bold]access-av {it}[/]" for it in examples)
    plural = "s" * (len(examples) > 1)
    return app.command(name, rich_help_panel=panel, epilog=f"Example{plural}: {shown}")


# Exit code if no result meets the requirement.
MISSED = 3


def overridden(given: Iterable[str] | None) -> dict[str, Any]:
    """Returns the keys and values of ``--set``."""
    return dict(map(_override, given or ()))


def _override(text: str) -> tuple[str, Any]:
    """Splits KEY=VALUE; the value is TOML, otherwise plain text."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text}: write KEY=VALUE, for example site.rician_k_db=10")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def load_scenario(
    name: str, *, allow_large: bool = False, overrides: Mapping[str, Any] | None = None
) -> Scenario:
    """Loads a shipped scenario or a file, and prints its plausibility warnings.

    ``allow_large`` sets the key of this name; ``overrides`` sets single keys.
    """
    scenario = read_scenario(name, allow_large=allow_large)
    if overrides:
        scenario = scenario.with_overrides(dict(overrides))
    look_for_underlay(scenario.site)
    announce(name, scenario.warnings())
    return scenario


def load_site(name: str) -> Site:
    """Loads a shipped site or a file, and prints its plausibility warnings."""
    site = Site.load(name)
    look_for_underlay(site)
    announce(name, site.warnings())
    return site


def load_site_and_vehicle(
    site: str, vehicle: str, start: tuple[float, float, float] | None = None
) -> tuple[Site, Vehicle]:
    """Loads a site and a vehicle, and prints warnings; ``start`` replaces the vehicle's pose."""
    plant, carrier = Site.load(site), Vehicle.load(vehicle)
    look_for_underlay(plant)
    there = carrier
    if start is not None:
        pose = dict(zip(("x_m", "y_m", "heading_rad"), start, strict=True))
        there = carrier.with_overrides({"start.known": True, "start.pose": pose})
    announce(f"{site}, {vehicle}", plant.warnings(there))
    return plant, carrier


def read_scenario(name: str, *, allow_large: bool) -> Scenario:
    """Loads a scenario without printing warnings."""
    if not allow_large:
        return Scenario.load(name)
    base = str(Path(name).absolute()) if Path(name).exists() else name
    return Scenario.from_toml(f"extends = {json.dumps(base)}\nallow_large = true\n", name)


def look_for_underlay(site: Site) -> None:
    """Rejects a missing or invalid background image before the simulation starts."""
    from access_av.site_files.picture import underlay

    underlay(site)


def announce(name: str, warnings: Iterable[SettingsWarning]) -> None:
    """Prints plausibility warnings with the suggested values, one for each key of a list."""
    alike: dict[str, list[SettingsWarning]] = {}
    for warning in warnings:
        alike.setdefault(re.sub(r"\[\d+\]", "[]", warning.key), []).append(warning)
    for first, *others in alike.values():
        also = ", ".join(f"`{other.key}` is {other.value}" for other in others)
        show_warning(f"{name}: {first}" + (f"; also {also}" if also else ""))
