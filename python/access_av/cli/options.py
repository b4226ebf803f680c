"""Arguments and options that several commands have."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from access_av._core import Scenario, Site, Vehicle
from access_av.cli.terminal import show_warning
from access_av.errors import InputError
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from access_av._core import SettingsWarning

ScenarioArgument = Annotated[str, typer.Argument(help="Shipped name, or path of a TOML file.")]
ScenarioOption = Annotated[str, typer.Option(help="Shipped name, or path of a TOML file.")]
PlatformOption = Annotated[str, typer.Option(help="Shipped name, or path of a TOML file.")]
Runs = Annotated[int, typer.Option(min=1, max=1_000_000, help="Drives per setting.")]
Seed = Annotated[int, typer.Option(min=0, max=2**64 - 1, help="Same seed, same results.")]
Threads = Annotated[
    int | None, typer.Option(min=1, max=1024, help="Worker threads; all cores if not given.")
]
Out = Annotated[
    Path | None, typer.Option(help="Directory for the files; else a new one in results/.")
]
AllowLarge = Annotated[
    bool, typer.Option("--allow-large", help="Also drives that take hours and gigabytes.")
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key; may be repeated."),
]
ShardOption = Annotated[str, typer.Option(metavar="I/N", help="Only this share of the drives.")]
DaskOption = Annotated[str | None, typer.Option(help="Address of a Dask scheduler.")]
MaxRms = Annotated[
    float | None, typer.Option(min=0.0, help="Largest RMS error over track and runs.")
]
MaxError = Annotated[
    float | None,
    typer.Option(min=0.0, help="So many percent of the errors (--percentile) are to be within it."),
]
PercentileOption = Annotated[
    float | None,
    typer.Option(help="Of --max-error-m: 50, 90, 95, 99 or 99.9.", show_default="99"),
]
Vary = Annotated[
    list[str] | None,
    typer.Option("--vary", metavar="KEY=a,b,c", help="Values of a key side by side; repeatable."),
]
Compare = Annotated[
    list[str] | None, typer.Option("--compare", help="Another file, side by side; repeatable.")
]
Percents = Annotated[
    list[float] | None,
    typer.Option("--percentile", min=1.0, max=100.0, help="Compared percentiles; 50, 90 and 99."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]

# Exit code where something was found, and not what was asked for.
MISSED = 3

# What is said when a share of a campaign is done and others are not.
OTHER_SHARES = "Share {} is done; other shares are not: run them, then this again."


def overridden(given: Iterable[str] | None) -> dict[str, Any]:
    """The keys that ``--set`` names, with their values."""
    return dict(map(_override, given or ()))


def _override(text: str) -> tuple[str, Any]:
    """Split KEY=VALUE; the value is read as TOML, and as plain text where it is none."""
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
    """A shipped scenario, or a file's, for a command to run; what is doubtful of it is said.

    With ``allow_large`` as if the file said so itself; with single keys set as ``overrides`` say.
    """
    scenario = read_scenario(name, allow_large=allow_large)
    if overrides:
        scenario = scenario.with_overrides(dict(overrides))
    look_for_underlay(scenario.site)
    announce(name, scenario.warnings())
    return scenario


def load_site(name: str) -> Site:
    """A shipped site, or a file's, for a command to run; what is doubtful of it is said."""
    site = Site.load(name)
    look_for_underlay(site)
    announce(name, site.warnings())
    return site


def load_site_and_vehicle(
    site: str, vehicle: str, start: tuple[float, float, float] | None = None
) -> tuple[Site, Vehicle]:
    """The same of a site and a vehicle on it; ``start`` is its pose where not its file's."""
    plant, carrier = Site.load(site), Vehicle.load(vehicle)
    look_for_underlay(plant)
    there = carrier
    if start is not None:
        pose = dict(zip(("x_m", "y_m", "heading_rad"), start, strict=True))
        there = carrier.with_overrides({"start.known": True, "start.pose": pose})
    announce(f"{site}, {vehicle}", plant.warnings(there))
    return plant, carrier


def read_scenario(name: str, *, allow_large: bool) -> Scenario:
    """A scenario to look at; nothing is said of it."""
    if not allow_large:
        return Scenario.load(name)
    like = str(Path(name).absolute()) if Path(name).exists() else name
    return Scenario.from_toml(f"like = {json.dumps(like)}\nallow_large = true\n", name)


def look_for_underlay(site: Site) -> None:
    """Refuse a picture that is missing or broken at once, and not when the page is written."""
    from access_av.site_files.picture import underlay

    underlay(site)


def announce(name: str, warnings: Iterable[SettingsWarning]) -> None:
    """Say what is most likely not what was meant, and what to write."""
    for warning in warnings:
        show_warning(f"{name}: {warning}")
