"""Import and export of roads and radio heads."""

from __future__ import annotations

import base64
import json
import math
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from access_av import Plant, Scenario, Site
from access_av.errors import InputError
from access_av.run.error_bound import along_route
from access_av.site_files import dxf, geojson
from access_av.site_files.drawn import Drawn, Head, checked
from access_av.site_files.picture import size_px, underlay
from access_av.site_files.read import Options, of_site, read
from access_av.tables.toml import tomllib

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

# Maximum distance between two descriptions of one road (m).
SAME_M = 0.01


def course(site: dict[str, Any]) -> NDArray[np.float64]:
    """Points of a site's road, a few centimetres apart, as a vehicle drives it."""
    scenario = Scenario.load("yard").with_overrides(
        {"site": site, "motion": {"top_speed_kmh": 10.0}}
    )
    return along_route(scenario).select("x_m", "y_m").to_numpy()


def apart_m(points: NDArray[np.float64], line: NDArray[np.float64]) -> float:
    """Returns the maximum distance of points from a line."""
    start, along = line[:-1], np.diff(line, axis=0)
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    farthest = 0.0
    for point in points[::25]:
        share = np.clip(((point - start) * along).sum(axis=1) / square, 0.0, 1.0)
        nearest = np.hypot(*(start + share[:, None] * along - point).T).min()
        farthest = max(farthest, float(nearest))
    return farthest


@pytest.fixture(scope="module")
def bends() -> Site:
    """Six hundred metres with bends by radius and angle."""
    site = json.loads(Plant.load("bends").to_json())["site"]
    return Site.load("yard").with_overrides(site)


@pytest.fixture(scope="module")
def reference(bends: Site) -> NDArray[np.float64]:
    return course(json.loads(bends.to_json()))


@pytest.mark.parametrize("file", ["degrees.geojson", "metres.geojson", "plain.csv", "german.csv"])
def test_an_exported_and_imported_road_is_equal(
    access_av: Callable[..., Any],
    tmp_path: Path,
    bends: Site,
    reference: NDArray[np.float64],
    file: str,
) -> None:
    site = tmp_path / "site.toml"
    site.write_text(bends.to_toml(), "utf-8")
    written, again = tmp_path / file, tmp_path / "again.toml"
    origin = ("--origin", "48.1,11.5") if file.startswith("degrees") else ()
    decimal_comma = ("--decimal-comma",) if file.startswith("german") else ()
    assert access_av("file", "export", site, written, *origin, *decimal_comma).code == 0
    heads = written.with_name(f"{written.stem}-heads.csv") if file.endswith("csv") else written
    new = access_av("file", "new", "site", again, "--road", written, "--heads-file", heads, *origin)
    assert new.code == 0, new.err
    read_again = json.loads(Site.load(str(again)).to_json())
    assert apart_m(course(read_again), reference) < SAME_M
    assert apart_m(reference, course(read_again)) < SAME_M
    before = json.loads(bends.to_json())["radio_heads"]
    for mine, its in zip(read_again["radio_heads"], before, strict=True):
        assert (mine["name"], mine["pci"]) == (its["name"], its["pci"])
        assert mine["position_m"] == pytest.approx(its["position_m"], abs=1e-3)


def drawing(path: Path, units: int = 4) -> None:
    """The road of two bends as a polyline with arcs, and its radio heads, in millimetres."""
    ezdxf = pytest.importorskip("ezdxf", reason="the extra `cad` is not installed")
    made = ezdxf.new()
    made.header["$INSUNITS"] = units
    model = made.modelspace()
    at, heading = (0.0, 0.0), 0.0
    vertices = []
    for length_m, turn_rad in (
        (200.0, 0.0),
        (25.0 * math.pi / 3, math.pi / 3),
        (180.0, 0.0),
        (30.0 * math.pi / 3, -math.pi / 3),
        (162.4, 0.0),
    ):
        vertices.append((1e3 * at[0], 1e3 * at[1], math.tan(turn_rad / 4.0)))
        chord = length_m if turn_rad == 0.0 else length_m * math.sin(turn_rad / 2) / (turn_rad / 2)
        direction = heading + turn_rad / 2.0
        at = (at[0] + chord * math.cos(direction), at[1] + chord * math.sin(direction))
        heading += turn_rad
    vertices.append((1e3 * at[0], 1e3 * at[1], 0.0))
    model.add_lwpolyline(vertices, format="xyb", dxfattribs={"layer": "WAY"})
    block = made.blocks.new("ANTENNA")
    block.add_circle((0.0, 0.0), 100.0)
    for x_m, y_m in ((60.0, 25.0), (240.0, 100.0), (430.0, 160.0)):
        place = (1e3 * x_m, 1e3 * y_m, 8e3)
        model.add_blockref("ANTENNA", place, dxfattribs={"layer": "CELLS"})
    # A shed of two straight walls and a round one, 10 m in radius.
    model.add_lwpolyline(
        [(90e3, 10e3, 0.0), (150e3, 10e3, 0.0), (150e3, 40e3, 0.0)],
        format="xyb",
        dxfattribs={"layer": "WALLS"},
    )
    model.add_arc((90e3, 20e3), 10e3, 90.0, 270.0, dxfattribs={"layer": "WALLS"})
    made.saveas(path)


def test_a_drawing_gives_the_same_road(
    access_av: Callable[..., Any], tmp_path: Path, reference: NDArray[np.float64]
) -> None:
    drawn, site = tmp_path / "plant.dxf", tmp_path / "site.toml"
    drawing(drawn)
    layers = ("--road-layer", "WAY", "--heads-layer", "CELLS")
    files = ("--road", drawn, "--heads-file", drawn)
    # From the start to the end of the first straight: 200 m.
    scale = ("--two-points", "0,0,200000,0", "--length-m", "200")
    done = access_av("file", "new", "site", site, *files, *layers, *scale)
    assert done.code == 0, done.err
    read_again = json.loads(Site.load(str(site)).to_json())
    assert apart_m(course(read_again), reference) < SAME_M
    assert apart_m(reference, course(read_again)) < SAME_M
    assert read_again["radio_heads"][1]["position_m"] == pytest.approx([240.0, 100.0, 8.0])
    assert "walls" not in read_again
    walled = access_av(
        "file", "new", "site", site, *files, "--walls", drawn, *layers, *scale, "--force"
    )
    assert walled.code == 0, walled.err
    straight, bent = (
        np.array(it["polyline_m"]) for it in json.loads(Site.load(str(site)).to_json())["walls"]
    )
    assert straight == pytest.approx(np.array([[90.0, 10.0], [150.0, 10.0], [150.0, 40.0]]))
    assert np.hypot(*(bent - [90.0, 20.0]).T) == pytest.approx(np.full(len(bent), 10.0), abs=SAME_M)
    middle = 0.5 * (bent[1:] + bent[:-1])
    assert np.hypot(*(middle - [90.0, 20.0]).T).min() > 10.0 - 0.05
    missing = access_av(
        "file", "new", "site", site, "--walls", drawn, "--walls-layer", "X", *scale, "--force"
    )
    assert missing.code == 2
    assert "layer 'X' contains no lines" in missing.err


@pytest.mark.parametrize(
    ("units", "options", "said"),
    [
        (1, (), "inches"),
        (6, (), "often wrong"),
        (4, ("--metres-per-unit", "0.001"), "Layers:"),
        (4, ("--metres-per-unit", "0.001", "--road-layer", "CELLS"), "the road must be one"),
        (4, ("--two-points", "0,0,1,0"), "must be given together"),
        (4, ("--two-points", "0,0,0,0", "--length-m", "5"), "the two points must differ"),
        (4, ("--metres-per-unit", "1", "--road-layer", "WAY"), "check its unit"),
    ],
)
def test_a_drawing_with_uncertain_scale_or_layer_is_rejected(
    access_av: Callable[..., Any],
    tmp_path: Path,
    units: int,
    options: tuple[str, ...],
    said: str,
) -> None:
    drawn = tmp_path / "plant.dxf"
    drawing(drawn, units)
    done = access_av(
        "file", "new", "site", tmp_path / "site.toml", "--road", drawn, *options, columns=500
    )
    assert done.code == 2
    assert said in done.err
    assert not (tmp_path / "site.toml").exists()


ROAD = {"type": "LineString", "coordinates": [[11.5, 48.1], [11.503, 48.101]]}


def head_at(*place: float) -> dict[str, Any]:
    geometry = {"type": "Point", "coordinates": list(place)}
    return {"type": "Feature", "geometry": geometry, "properties": {"height_m": 8.0}}


@pytest.mark.parametrize(
    ("road", "heads", "said"),
    [
        ({"type": "LineString", "coordinates": [[48.1, 11.5], [48.2, 11.6]]}, None, "exchanged"),
        ({"type": "LineString", "coordinates": [[500.0, 4.0], [700.0, 9.0]]}, None, "EPSG"),
        ({"type": "LineString", "coordinates": [[11.5, None], [1, 2]]}, None, "finite numbers"),
        ({"type": "Polygon", "coordinates": []}, None, "LineString"),
        (ROAD, head_at(11.9, 48.5), "km from the road"),
        (ROAD, {"type": "Point", "coordinates": [11.5, 48.1]}, "is not a height"),
        ("x_m,y_m\n0,0\n100,0\n", head_at(11.5, 48.1), "--origin"),
        ("x_m,y\n0,0\n", None, "y_m"),
        ("x_m,y_m\n0,0\n", None, "at least two"),
        ("x_m,y_m\n0,0\n0.1,0\n", None, "check its unit"),
    ],
)
def test_files_other_than_plants_are_rejected(
    access_av: Callable[..., Any],
    tmp_path: Path,
    road: dict[str, Any] | str,
    heads: dict[str, Any] | None,
    said: str,
) -> None:
    file = tmp_path / ("road.csv" if isinstance(road, str) else "road.geojson")
    file.write_text(road if isinstance(road, str) else json.dumps(road), "utf-8")
    more: tuple[Any, ...] = ()
    if heads is not None:
        its = tmp_path / "heads.geojson"
        its.write_text(json.dumps(heads), "utf-8")
        more = ("--heads-file", its)
    done = access_av(
        "file", "new", "plant", tmp_path / "new.toml", "--road", file, *more, columns=500
    )
    assert done.code == 2
    assert said in done.err
    assert str(tmp_path) in done.err


def test_markup_in_names_is_not_interpreted(access_av: Callable[..., Any], tmp_path: Path) -> None:
    name = 'a "mast" <script>alert(1)</script> [red]'
    heads = tmp_path / "heads.geojson"
    heads.write_text(geojson.text(Drawn(heads=[Head(name, 60.0, 25.0, 8.0, 5)]), None), "utf-8")
    file = tmp_path / "new.toml"
    assert access_av("file", "new", "site", file, "--heads-file", heads).code == 0
    assert json.loads(Site.load(str(file)).to_json())["radio_heads"][0]["name"] == name


def test_new_files_are_not_written_over_others(
    access_av: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    for kind in ("plant", "site", "vehicle", "scenario"):
        assert access_av("file", "new", kind, file, "--force").code == 0
        checked_again = access_av("file", "check", file)
        assert checked_again.code == 0
        assert "valid" in checked_again.out, checked_again.out
        assert "already" in access_av("file", "new", kind, file).err
    said = access_av("file", "new", "node", file, "--force", columns=500).out
    assert f"access-av-node --site yard --vehicle tugger {file} --dry-run" in said
    assert tomllib.loads(file.read_text("utf-8"))["name"] == "mine"
    assert "folder" in access_av("file", "new", "plant", tmp_path).err


def test_two_points_determine_the_scale() -> None:
    assert dxf.metres_per_unit((0.0, 0.0, 3.0, 4.0), 10.0) == pytest.approx(2.0)
    with pytest.raises(InputError, match="the two points must differ"):
        dxf.metres_per_unit((1.0, 1.0, 1.0, 1.0), 10.0)


def test_radio_heads_far_from_the_road_are_rejected() -> None:
    drawn = Drawn(road_m=[(0.0, 0.0), (100.0, 0.0)], heads=[Head("far", 0.0, 9000.0, 8.0)])
    with pytest.raises(InputError, match="9 km from the road"):
        checked(drawn, "road.csv", "heads.csv", "walls.dxf")
    drawn = Drawn(road_m=[(0.0, 0.0), (100.0, 0.0)], walls_m=[[(0.0, 9000.0), (1.0, 9000.0)]])
    with pytest.raises(InputError, match=r"walls.dxf: a wall .* 9 km from the road"):
        checked(drawn, "road.csv", "heads.csv", "walls.dxf")


@pytest.mark.parametrize("origin", [(), ("--origin", "48.1,11.5")], ids=["metres", "degrees"])
def test_exported_and_imported_walls_are_equal(
    access_av: Callable[..., Any], tmp_path: Path, bends: Site, origin: tuple[str, ...]
) -> None:
    corners = [[float(x_m), 12.0] for x_m in range(90, 240)]  # more than a table may have
    walled = bends.with_overrides(
        {"walls": [{"polyline_m": corners[:100]}, {"polyline_m": corners[99:]}]}
    )
    file, again = tmp_path / "site.geojson", tmp_path / "again.toml"
    (tmp_path / "site.toml").write_text(walled.to_toml(), "utf-8")
    assert access_av("file", "export", tmp_path / "site.toml", file, *origin).code == 0
    done = access_av(
        "file",
        "new",
        "site",
        again,
        *(f"--{it}={file}" for it in ("road", "heads-file", "walls")),
        *origin,
    )
    assert done.code == 0, done.err
    walls = json.loads(Site.load(str(again)).to_json())["walls"]
    found = np.concatenate([walls[0]["polyline_m"], walls[1]["polyline_m"][1:]])
    assert found == pytest.approx(np.array(corners), abs=1e-3)
    only_a_road = tmp_path / "road.geojson"
    only_a_road.write_text(json.dumps(ROAD), "utf-8")
    imported = ("--road", only_a_road, "--walls", only_a_road)
    done = access_av("file", "new", "site", again, *imported, "--force")
    assert done.code == 2
    assert "a wall" in done.err


def test_sites_without_a_road_are_written_too(tmp_path: Path) -> None:
    settings = json.loads(Site.load("yard").to_json())
    del settings["road"]
    site = Site.from_toml(
        'name = "open"\n[[radio_heads]]\nname = "a"\nposition_m = [1.0, 2.0, 8.0]\n'
    )
    drawn = of_site(site)
    assert not drawn.road_m
    file = tmp_path / "open.geojson"
    file.write_text(geojson.text(drawn, None), "utf-8")
    assert read(None, file, Options()).heads[0].x_m == 1.0


def picture(width: int, height: int) -> bytes:
    """A PNG of grey pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        sum_ = zlib.crc32(kind + data).to_bytes(4, "big")
        return len(data).to_bytes(4, "big") + kind + data + sum_

    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes([8, 0, 0, 0, 0])
    rows = zlib.compress((b"\0" + b"\xcc" * width) * height)
    chunks = chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


# The head of a JPEG of 300 by 200 pixels: application data, a fill byte, a frame.
JPEG = bytes.fromhex("ffd8ffe000104a46494600010100000100010000ffffc0000b0800c8012c01011100")


def test_a_background_image_is_placed_by_two_points_and_a_length(
    access_av: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "drawings").mkdir()
    name = "<b>hall & yard</b>.png"
    (tmp_path / "drawings" / name.replace("/", "")).write_bytes(picture(300, 200))
    monkeypatch.chdir(tmp_path)
    shown = f"drawings/{name.replace('/', '')}"
    of_picture = ("--underlay", shown, "--underlay-points", "50,100,250,100")
    done = access_av("file", "new", "site", "site.toml", *of_picture, "--underlay-length-m", "400")
    assert done.code == 0, done.err
    assert tomllib.loads((tmp_path / "site.toml").read_text("utf-8"))["underlay"] == {
        "file": shown,
        "metres_per_pixel": 2.0,
        "zero_px": [0.0, 200.0],
    }
    site = Site.load("site.toml")
    placed = underlay(site)
    assert placed is not None
    # The lower left corner is the origin of the map; y points upwards.
    assert (placed.left_m, placed.right_m) == (0.0, 600.0)
    assert (placed.low_m, placed.high_m) == (0.0, 400.0)
    assert base64.b64decode(placed.url.removeprefix("data:image/png;base64,")) == picture(300, 200)
    # The path of a resolved site is absolute, so that the file can be moved.
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "again.toml").write_text(site.to_toml(), "utf-8")
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert underlay(Site.load("again.toml")) == placed
    short = {"site": json.loads(site.to_json()), "motion": {"start_at_m": 580.0}}
    (tmp_path / "short.toml").write_text(
        Scenario.load("yard").with_overrides(short).to_toml(), "utf-8"
    )
    assert access_av("run", tmp_path / "short.toml", "--out", "out").code == 0
    page = (tmp_path / "elsewhere" / "out" / "report.html").read_text("utf-8")
    assert placed.url in page
    assert "<b>hall" not in page
    (tmp_path / shown).unlink()
    gone = access_av("run", tmp_path / "short.toml", "--out", "never")
    assert gone.code == 2
    assert "No such file" in gone.err
    assert not (tmp_path / "elsewhere" / "never").exists()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--underlay", "plan.png"), "the scale is missing"),
        (("--underlay-metres-per-pixel", "1"), "--underlay is missing"),
        (("--underlay", "plan.png", "--underlay-points", "0,0,9,0"), "must be given together"),
        (("--underlay", "none.png", "--underlay-metres-per-pixel", "1"), "No such file"),
        (("--underlay", ".", "--underlay-metres-per-pixel", "1"), "not a regular file"),
        (("--underlay", "plan.svg", "--underlay-metres-per-pixel", "1"), "not a PNG or JPEG"),
        (("--underlay", "cut.png", "--underlay-metres-per-pixel", "1"), "not a PNG or JPEG"),
        (("--underlay", "cut.jpg", "--underlay-metres-per-pixel", "1"), "not a PNG or JPEG"),
        (("--underlay", "large.png", "--underlay-metres-per-pixel", "1"), "at most 393216"),
        (("--underlay", "plan.png", "--underlay-metres-per-pixel", "1e6"), "metres_per_pixel"),
        (
            ("--underlay", "plan.png", "--underlay-metres-per-pixel", "1", "--underlay-zero", "1"),
            "2 numbers",
        ),
    ],
)
def test_unusable_pictures_are_rejected(
    access_av: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    given: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plan.png").write_bytes(picture(30, 20))
    (tmp_path / "cut.png").write_bytes(picture(30, 20)[:20])
    (tmp_path / "cut.jpg").write_bytes(JPEG[:26])
    (tmp_path / "large.png").write_bytes(picture(30, 20) + bytes(400_000))
    (tmp_path / "plan.svg").write_text("<svg onload='alert(1)'/>", "utf-8")
    done = access_av("file", "new", "site", "site.toml", *given)
    assert done.code == 2
    assert said in done.err
    assert not (tmp_path / "site.toml").exists()


def test_the_size_of_a_jpeg_is_read_from_its_frame_header(tmp_path: Path) -> None:
    (tmp_path / "plan.jpg").write_bytes(JPEG)
    assert size_px(tmp_path / "plan.jpg") == (300, 200)
