"""Commands ``new`` and ``export``: example files, import and export of sites."""

from __future__ import annotations

import os
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Argument, Option

from access_av.cli import options as opt
from access_av.cli.files import CLASSES, PANEL, Kind, kind_of
from access_av.cli.terminal import say
from access_av.errors import InputError
from access_av.site_files.drawn import Drawn
from access_av.tables.numbers import count

if TYPE_CHECKING:
    from access_av.site_files.picture import Placed

Road = Annotated[
    Path | None,
    Option(help="Road: CSV (x_m, y_m), GeoJSON (LineString) or DXF (joining curves of a layer)."),
]
Walls = Annotated[
    Path | None, Option(help="Walls: GeoJSON (LineStrings, Polygons) or DXF (curves and faces).")
]
OriginText = Annotated[
    str | None,
    Option(
        "--origin",
        metavar="LAT,LON",
        help="Map origin of a GeoJSON file: latitude,longitude in degrees.",
        show_default="first point",
    ),
]

app = typer.Typer()


class New(str, Enum):
    """Kind of a file that ``file new`` writes."""

    PLANT = "plant"
    SITE = "site"
    VEHICLE = "vehicle"
    SCENARIO = "scenario"
    NODE = "node"


WITH_SITE = (New.PLANT, New.SITE)


def _numbers(option: str, text: str, count: int) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise InputError(f"{option} {text}: write {count} numbers, separated by commas")
    return found


def _origin(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    latitude, longitude = _numbers("--origin", text, 2)
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        raise InputError(f"--origin {text}: write latitude, then longitude, in degrees")
    return latitude, longitude


def _scale_m(
    two_points: str | None,
    length_m: float | None,
    metres_per_unit: float | None,
    options: tuple[str, str, str] = ("--two-points", "--length-m", "--metres-per-unit"),
) -> float | None:
    from access_av.site_files import dxf

    of_points, of_length, of_unit = options
    if (two_points is None) != (length_m is None):
        raise InputError(f"{of_points} and {of_length} must be given together")
    if two_points is None or length_m is None:
        return metres_per_unit
    if metres_per_unit is not None:
        raise InputError(f"{of_unit}: omit it, because {of_points} determines the scale")
    x1, y1, x2, y2 = _numbers(of_points, two_points, 4)
    return dxf.metres_per_unit((x1, y1, x2, y2), length_m)


def _placed(
    file: Path,
    picture: Path | None,
    points: str | None,
    length_m: float | None,
    metres_per_pixel: float | None,
    zero: str | None,
) -> Placed | None:
    """Returns the placement of a background image; its path is relative to ``file``."""
    from access_av.site_files.picture import Placed, size_px

    options = ("--underlay-points", "--underlay-length-m", "--underlay-metres-per-pixel")
    scale_m = _scale_m(points, length_m, metres_per_pixel, options)
    if picture is None:
        if scale_m is not None or zero is not None:
            raise InputError("--underlay is missing: add the path of the background image")
        return None
    if scale_m is None:
        raise InputError(
            f"{picture}: the scale is missing: add --underlay-points X1,Y1,X2,Y2 with "
            "--underlay-length-m, or --underlay-metres-per-pixel"
        )
    _, height_px = size_px(picture)
    x_px, y_px = (0.0, float(height_px)) if zero is None else _numbers("--underlay-zero", zero, 2)
    return Placed(os.path.relpath(picture, file.parent), scale_m, (x_px, y_px))


def _write(
    kind: str, file: Path, force: bool, drawn: Drawn | None = None, placed: Placed | None = None
) -> None:
    from access_av._core import SettingsWarning
    from access_av.cli.options import announce
    from access_av.site_files.templates import missing
    from access_av.site_files.templates import new as written
    from access_av.tables.results_directory import write_whole

    if file.is_dir():
        raise InputError(f"{file}: is a folder; give the path of a file")
    if file.exists() and not force:
        raise InputError(f"{file}: exists already; --force overwrites it")
    name = "".join(it if it.isalnum() or it in "-_" else "-" for it in file.stem) or kind
    text = written(kind, name, str(file), drawn, placed)
    to_fill = missing(kind, drawn)
    # access-av-node checks a node file.
    warnings: list[SettingsWarning] = []
    if kind != New.NODE:
        whole = written(kind, name, str(file), drawn, placed, filled=True) if to_fill else text
        found = CLASSES[Kind(kind)].from_toml(whole, str(file)).warnings()
        warnings = [] if drawn is not None and not drawn.heads else found
    write_whole(file, text)
    if drawn is not None:
        _report(drawn)
    if to_fill:
        after = f"fill in {', '.join(to_fill)} (examples are in its comments), then "
    say(f"Written: {file}. Next: {after if to_fill else ''}{_next(kind, file)}")
    announce(str(file), warnings)


def _report(drawn: Drawn) -> None:
    """Prints imported and omitted items, and warnings."""
    from access_av.cli.terminal import plain, show_warning
    from access_av.site_files.curves import length_m

    road = "no road"
    if drawn.length_m:
        x0, y0 = drawn.road_m[0] if drawn.road_m else drawn.start[:2]
        road = (
            f"road of {drawn.length_m:.2f} m with {count(drawn.bends or 'no', 'bend')}, from "
            f"({x0:.2f}, {y0:.2f}) m"
        )
    walls_m = sum(length_m(it) for it in drawn.walls_m)
    walls = count(len(drawn.walls_m) or "no", "wall")
    if drawn.walls_m:
        walls += f" of {walls_m:.2f} m in total"
    heads = count(len(drawn.heads) or "no", "radio head")
    say(f"Imported: {road}; {heads}; {walls}.")
    for what, number in drawn.skipped.items():
        say(f"Not imported: {plain(what)}: {number}")
    if not drawn.skipped:
        say("Not imported: nothing.")
    for note in drawn.notes:
        show_warning(note)


def _next(kind: str, file: Path) -> str:
    commands = {
        "plant": f"access-av study {file}",
        "scenario": f"access-av run {file}",
        "node": f"access-av-node --site yard --vehicle tugger {file} --dry-run",
    }
    return commands.get(kind, f"access-av file check {file}")


@opt.command(app, PANEL, "file new plant mine.toml --road road.geojson")
def new(
    context: typer.Context,
    kind: Annotated[New, Argument(help="Kind of file.")],
    file: Annotated[Path, Argument(help="File to write, for example mine.toml.")],
    force: Annotated[bool, Option("--force", help="Overwrite an existing file.")] = False,
    road: Road = None,
    heads: Annotated[
        Path | None,
        Option(
            "--heads-file",
            help="Radio heads: CSV (x_m, y_m, z_m, name, pci), GeoJSON or DXF (points, blocks).",
        ),
    ] = None,
    walls: Walls = None,
    origin: OriginText = None,
    road_layer: Annotated[str, Option(help="DXF layer of the road.")] = "ROAD",
    heads_layer: Annotated[str, Option(help="DXF layer of the radio heads.")] = "HEADS",
    walls_layer: Annotated[str, Option(help="DXF layer of the walls.")] = "WALLS",
    two_points: Annotated[
        str | None,
        Option(
            metavar="X1,Y1,X2,Y2", help="Two points X1,Y1,X2,Y2 of a DXF drawing, --length-m apart."
        ),
    ] = None,
    length_m: Annotated[
        float | None, Option("--length-m", min=0.0, help="Distance between --two-points, in m.")
    ] = None,
    metres_per_unit: Annotated[
        float | None, Option(min=0.0, help="Unit of a DXF drawing, for example 0.001 for mm.")
    ] = None,
    underlay: Annotated[
        Path | None, Option("--underlay", help="PNG or JPEG as background of the site's maps.")
    ] = None,
    underlay_points: Annotated[
        str | None,
        Option(
            "--underlay-points",
            metavar="X1,Y1,X2,Y2",
            help="Two pixels X1,Y1,X2,Y2 of the background, counted from its upper left corner.",
        ),
    ] = None,
    underlay_length_m: Annotated[
        float | None,
        Option("--underlay-length-m", min=0.0, help="Distance between the two pixels, in m."),
    ] = None,
    underlay_metres_per_pixel: Annotated[
        float | None,
        Option(
            "--underlay-metres-per-pixel",
            min=0.0,
            help="Scale of the background, in metres per pixel.",
        ),
    ] = None,
    underlay_zero: Annotated[
        str | None,
        Option(
            "--underlay-zero",
            metavar="X,Y",
            help="Pixel X,Y of the map origin.",
            show_default="lower left",
        ),
    ] = None,
) -> None:
    """Write an example file, or a plant or site file from a drawing or map.

    plant: site, vehicle, fleet, prices and required accuracy. site: road, radio heads and walls.
    vehicle: antennas, odometer, wake-up and platform. scenario: site, vehicle and environment.
    node: inputs and outputs of access-av-node on a vehicle. All options except --force are for
    plant and site files.
    """
    if kind not in WITH_SITE:
        _without_site(context, kind)
        _write(kind.value, file, force)
        return
    from access_av.site_files.read import Options, read

    options = Options(
        _origin(origin),
        road_layer,
        heads_layer,
        walls_layer,
        _scale_m(two_points, length_m, metres_per_unit),
    )
    drawn = read(road, heads, options, walls) if road or heads or walls else None
    placed = _placed(
        file, underlay, underlay_points, underlay_length_m, underlay_metres_per_pixel, underlay_zero
    )
    _write(kind.value, file, force, drawn, placed)


def _without_site(context: typer.Context, kind: New) -> None:
    """Rejects options of sites for a file without a site."""
    for parameter in context.command.params:
        name = parameter.name or ""
        source = context.get_parameter_source(name)
        if name in ("kind", "file", "force") or source is None or source.name == "DEFAULT":
            continue
        raise InputError(
            f"{parameter.opts[0]}: only for plant and site files, not for {kind.value}"
        )


@opt.command(app, PANEL, "file export yard yard.geojson")
def export(
    site: Annotated[str, Argument(help="Site or plant: shipped name, or path of a TOML file.")],
    file: Annotated[Path, Argument(help="File to write: .geojson or .csv.")],
    origin: OriginText = None,
    decimal_comma: Annotated[
        bool, Option("--decimal-comma", help="Write CSV with semicolons and decimal commas.")
    ] = False,
) -> None:
    """Export a site's road, radio heads and walls.

    GeoJSON contains all of them, in degrees with --origin, otherwise in metres. CSV contains the
    road; a second file, NAME-heads.csv, contains the radio heads.
    """
    from access_av import _core
    from access_av.site_files import csv_file, geojson
    from access_av.site_files.read import of_site
    from access_av.tables.results_directory import write_whole

    kind = kind_of(site) if Path(site).exists() else None
    is_plant = kind is Kind.PLANT or (kind is None and site not in _core.Site.names())
    of = _core.Plant.load(site).scenario().site if is_plant else opt.load_site(site)
    drawn = of_site(of)
    if file.suffix.lower() in (".geojson", ".json"):
        write_whole(file, geojson.text(drawn, _origin(origin)))
        say(f"Written: {file}")
    elif file.suffix.lower() == ".csv":
        heads_file = file.with_name(f"{file.stem}-heads.csv")
        write_whole(file, csv_file.road_text(drawn.road_m, decimal_comma=decimal_comma))
        write_whole(heads_file, csv_file.heads_text(drawn.heads, decimal_comma=decimal_comma))
        say(f"Written: {file}, {heads_file}")
    else:
        raise InputError(f"{file}: its name must end in .geojson, .json or .csv")
