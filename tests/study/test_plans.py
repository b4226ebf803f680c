"""Drawings and maps of one plant, over entities, units, extrusions and reference systems."""

from __future__ import annotations

import itertools
import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import site_plans as plans
from access_av.errors import InputError
from access_av.site_files import csv_file, dxf, dxf_layer, georeference
from access_av.site_files.read import Options, read
from access_av.tables import csv_text
from access_av.tables.toml import tomllib
from site_plans import HEADS, WALL, Drawing, apart_m, course

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

# Required accuracy of every import: one centimetre.
SAME_M = 0.01
# Every kind of road entity; units and extrusions are assigned in turn, so that each one is tested
# with several entities.
DRAWINGS = [
    pytest.param(road, *plans.UNITS[index % len(plans.UNITS)], down, id=f"{road.__name__}-{down}")
    for index, (road, down) in enumerate(itertools.product(plans.ROADS, (False, True)))
]


def new(access_av: Callable[..., Any], tmp_path: Path, *options: Any) -> tuple[dict[str, Any], Any]:
    """The site that `access-av file new site` writes, and what it prints."""
    file = tmp_path / "site.toml"
    done = access_av("file", "new", "site", file, "--force", *options, columns=500)
    assert done.code == 0, done.err
    return tomllib.loads(file.read_text("utf-8")), done


@pytest.mark.parametrize(("road", "unit", "unit_m", "down"), DRAWINGS)
def test_drawings_give_equal_plants_or_report_omitted_entities(
    access_av: Callable[..., Any],
    tmp_path: Path,
    road: Callable[[Drawing], plans.Points],
    unit: int,
    unit_m: float,
    down: bool,
) -> None:
    pytest.importorskip("ezdxf", reason="the extra `cad` is not installed")
    is_old = road in (plans.polyline2d_with_arc, plans.spline_fit_polyline, plans.polyline3d)
    drawing = Drawing.new(unit, unit_m, down=down, version="R12" if is_old else "R2010")
    truth = road(drawing)
    plans.add_heads_and_wall(drawing)
    file = tmp_path / "plant.dxf"
    drawing.document.saveas(file)
    # The scale is given, because the unit of $INSUNITS has to be confirmed.
    scale = ("--metres-per-unit", repr(unit_m))
    options = [f"--{it}={file}" for it in ("road", "heads-file", "walls")]
    site, done = new(access_av, tmp_path, *options, *scale)
    its = course(site["road"])
    assert apart_m(its, truth) < SAME_M
    if road is not plans.separate_lines_and_arc:
        assert np.hypot(*(its[0] - truth[0])) < SAME_M, "driven from the first point"
    found = np.array([it["position_m"] for it in site["radio_heads"]])
    assert found == pytest.approx(np.array(HEADS), abs=SAME_M)
    walls = [np.array(it["polyline_m"]) for it in site["walls"]]
    assert [len(it) for it in walls] == [2, 2]
    assert apart_m(walls[0], WALL[:2]) < SAME_M
    assert apart_m(walls[1], WALL[1:]) < SAME_M
    assert "layer 'WALLS': TEXT (no line in plan): 1" in done.out
    said = re.search(r"road of ([\d.]+) m", done.out)
    assert said is not None
    length_m = np.hypot(*np.diff(truth, axis=0).T).sum()
    assert float(said[1]) == pytest.approx(length_m, abs=0.05)


# A position in the area of use of each system.
MUNICH, NEW_YORK, SAO_PAULO = (48.137, 11.575), (40.70, -74.01), (-23.55, -46.63)
SYDNEY, AUCKLAND, BERN, LONDON = (-33.87, 151.2), (-36.85, 174.76), (46.95, 7.44), (51.5, -0.12)
MAPS = [
    (None, MUNICH),
    ("OGC:CRS84", MUNICH),
    ("EPSG:4326", AUCKLAND),
    ("EPSG:3857", MUNICH),
    ("EPSG:900913", LONDON),
    ("EPSG:3395", SYDNEY),
    ("EPSG:25832", MUNICH),
    ("EPSG:32618", NEW_YORK),
    ("EPSG:4269", NEW_YORK),
    ("EPSG:2263", NEW_YORK),  # US survey feet
    ("EPSG:4674", SAO_PAULO),
    ("EPSG:31467", (50.1, 8.7)),  # Gauss-Krüger on another ellipsoid
    ("EPSG:7844", SYDNEY),
    ("EPSG:2193", AUCKLAND),
    ("EPSG:2056", BERN),
]


@pytest.mark.parametrize("kind", ["features", "multi", "collection"])
@pytest.mark.parametrize(("crs", "origin"), MAPS, ids=[str(crs) for crs, _ in MAPS])
def test_maps_give_the_same_plant(
    tmp_path: Path, crs: str | None, origin: tuple[float, float], kind: str
) -> None:
    pytest.importorskip("pyproj", reason="the extra `geo` is not installed")
    file = tmp_path / "plant.geojson"
    truth = plans.bend(count=60)
    plans.write_map(file, truth, crs, origin, kind=kind)
    drawn = read(file, file, Options(origin=origin), file)
    assert apart_m(np.array(drawn.road_m), truth) < SAME_M
    found = np.array([(it.x_m, it.y_m, it.z_m) for it in drawn.heads])
    assert found == pytest.approx(np.array(HEADS), abs=SAME_M)
    assert apart_m(np.array(drawn.walls_m[0]), [*WALL, WALL[0]]) < SAME_M
    assert not drawn.skipped
    # Without an origin, the road begins at zero and keeps its lengths.
    moved = read(file, None, Options())
    assert np.hypot(*moved.road_m[0]) < 1e-6
    assert moved.length_m == pytest.approx(np.hypot(*np.diff(truth, axis=0).T).sum(), abs=SAME_M)


def test_an_import_without_walls_lists_the_skipped_entities(
    access_av: Callable[..., Any], tmp_path: Path
) -> None:
    pytest.importorskip("pyproj", reason="the extra `geo` is not installed")
    file = tmp_path / "plant.geojson"
    plans.write_map(file, plans.CORNERS, None, MUNICH, kind="collection")
    held = json.loads(file.read_text("utf-8"))
    held["features"] += [
        {"type": "Feature", "properties": {}, "geometry": None},
        {"type": "Feature", "geometry": {"type": "CircularString", "coordinates": []}},
        {"type": "LineString", "coordinates": [[11.575, 48.137], [11.576, 48.138]]},
    ]
    file.write_text(json.dumps(held), "utf-8")
    _, done = new(access_av, tmp_path, "--road", file, "--heads-file", file)
    for what in ("Polygon: 1", "Feature without a geometry: 1", "CircularString: 1"):
        assert f"Not imported: {file}: {what}" in done.out
    assert f"Not imported: {file}: LineString: 1" in done.out


LINE = [[11.575, 48.137], [11.5777, 48.137]]


@pytest.mark.parametrize(
    ("crs", "line", "origin", "said"),
    [
        ("EPSG:4269", LINE, None, "outside of the area of use"),
        ("urn:ogc:def:crs:EPSG::25832", [[5334000, 691000], [5334100, 691000]], None, "exchanged"),
        ("EPSG:999999", LINE, None, "not a known reference system"),
        ("EPSG:4978", LINE, None, "neither geographic nor projected"),
        (None, LINE, (11.575, 48.137), "write --origin 48.137,11.575"),
        (None, LINE, (52.5, 13.4), "at most 20 km are allowed"),
        (None, LINE, (-48.137, 11.575), "km from the first point"),
        ("EPSG:3857", LINE, (48.137, 11.575), "km from the first point"),
    ],
)
def test_maps_of_another_place_or_system_are_rejected(
    tmp_path: Path,
    crs: str | None,
    line: list[list[float]],
    origin: tuple[float, float] | None,
    said: str,
) -> None:
    pytest.importorskip("pyproj", reason="the extra `geo` is not installed")
    file = tmp_path / "road.geojson"
    held: dict[str, Any] = {"type": "LineString", "coordinates": line}
    if crs is not None:
        held["crs"] = {"type": "name", "properties": {"name": crs}}
    file.write_text(json.dumps(held), "utf-8")
    with pytest.raises(InputError, match=re.escape(said)):
        read(file, None, Options(origin=origin))


@pytest.mark.parametrize(
    "crs", [{}, {"type": "link", "properties": {"href": "x.prj"}}, {"type": "name"}, 4326]
)
def test_a_reference_system_that_is_not_named_is_rejected(tmp_path: Path, crs: Any) -> None:
    file = tmp_path / "road.geojson"
    held = {"type": "LineString", "coordinates": LINE, "crs": crs}
    file.write_text(json.dumps(held), "utf-8")
    with pytest.raises(InputError, match="names no reference system"):
        read(file, None, Options())


def test_a_null_reference_system_is_that_of_rfc_7946(tmp_path: Path) -> None:
    """GeoJSON of 2008 permits ``null``; RFC 7946 has longitude and latitude only."""
    file = tmp_path / "road.geojson"
    held = {"type": "LineString", "coordinates": LINE}
    file.write_text(json.dumps(held), "utf-8")
    without = read(file, None, Options())
    file.write_text(json.dumps({**held, "crs": None}), "utf-8")
    assert read(file, None, Options()) == without
    grid = {"type": "LineString", "coordinates": [[691000, 5334000], [691100, 5334000]]}
    file.write_text(json.dumps({**grid, "crs": None}), "utf-8")
    with pytest.raises(InputError, match="longitude"):
        read(file, None, Options())


def test_distances_are_those_of_the_ellipsoid() -> None:
    pyproj = pytest.importorskip("pyproj", reason="the extra `geo` is not installed")
    geod = pyproj.Geod(ellps="WGS84")
    random = np.random.default_rng(3)
    for _ in range(50):
        latitude, longitude = random.uniform(-60.0, 70.0), random.uniform(-180.0, 180.0)
        azimuth, distance_m = random.uniform(0.0, 360.0), random.uniform(1.0, 3000.0)
        east, north, _ = geod.fwd(longitude, latitude, azimuth, distance_m)
        x_m, y_m = georeference.to_plane(east, north, (latitude, longitude))
        # The plane's height over the ellipsoid shortens 3 km by less than 0.2 mm.
        assert np.hypot(x_m, y_m) == pytest.approx(distance_m, abs=1e-3)
        assert np.degrees(np.arctan2(x_m, y_m)) % 360.0 == pytest.approx(azimuth, abs=1e-3)
        back = georeference.to_degrees(x_m, y_m, (latitude, longitude))
        assert georeference.to_plane(*back, (latitude, longitude)) == pytest.approx((x_m, y_m))


def test_an_export_far_from_its_zero_is_rejected(
    access_av: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "yard.geojson"
    for origin, said in (
        ("11.575,48.137", "Horn of Africa"),
        ("89,10", "no [longitude, latitude]"),
    ):
        done = access_av("file", "export", "yard", file, "--origin", origin, columns=500)
        assert done.code == 2
        assert said in done.err
        assert not file.exists()


@pytest.fixture
def empty() -> Drawing:
    pytest.importorskip("ezdxf", reason="the extra `cad` is not installed")
    return Drawing.new(6, 1.0, down=False)


def heads_of(drawing: Drawing, tmp_path: Path) -> list[tuple[float, float, float]]:
    file = tmp_path / "heads.dxf"
    drawing.document.saveas(file)
    heads = read(None, file, Options(scale_m=1.0)).heads
    assert len({it.name for it in heads if it.name}) == len([it for it in heads if it.name])
    return sorted((round(it.x_m, 6), round(it.y_m, 6), round(it.z_m, 6)) for it in heads)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ({"column_count": 3, "column_spacing": 50.0}, [(10, 5), (60, 5), (110, 5)]),
        ({"row_count": 2, "row_spacing": 20.0, "rotation": 90.0}, [(-10, 5), (10, 5)]),
        (
            {"row_count": 2, "row_spacing": 4.0, "column_count": 2, "column_spacing": 7.0},
            [(10, 5), (10, 9), (17, 5), (17, 9)],
        ),
    ],
)
def test_block_arrays_are_resolved(
    empty: Drawing, tmp_path: Path, attributes: dict[str, Any], expected: list[tuple[int, int]]
) -> None:
    empty.document.blocks.new("MAST").add_circle((0, 0), 1)
    empty.model.add_blockref("MAST", (10, 5, 6), dxfattribs={"layer": "HEADS", **attributes})
    assert heads_of(empty, tmp_path) == [(*map(float, at), 6.0) for at in expected]


def test_an_array_of_a_block_with_heads_is_resolved(empty: Drawing, tmp_path: Path) -> None:
    block = empty.document.blocks.new("GATE")
    block.add_point((0, 0, 5), dxfattribs={"layer": "HEADS"})
    block.add_point((0, 8, 5), dxfattribs={"layer": "Heads"})
    block.add_text("gate", dxfattribs={"layer": "HEADS"})
    attributes = {"layer": "SITE", "column_count": 2, "column_spacing": 30.0}
    empty.model.add_blockref("GATE", (1, 0), dxfattribs=attributes)
    expected = [(1.0, 0.0, 5.0), (1.0, 8.0, 5.0), (31.0, 0.0, 5.0), (31.0, 8.0, 5.0)]
    assert heads_of(empty, tmp_path) == expected
    drawn = dxf.read(tmp_path / "heads.dxf", "heads", "heads", 1.0)
    assert list(drawn.skipped.values()) == [2], drawn.skipped


def test_block_arrays_without_end_are_rejected(
    empty: Drawing, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dxf_layer, "MAXIMUM_ENTITIES", 2000)
    inner = empty.document.blocks.new("A0")
    inner.add_line((0, 0), (1, 0), dxfattribs={"layer": "0"})
    for level in range(1, 5):
        block = empty.document.blocks.new(f"A{level}")
        many = {"column_count": 100, "column_spacing": 1.0, "layer": "0"}
        block.add_blockref(f"A{level - 1}", (0, 0), dxfattribs=many)
    empty.model.add_blockref("A4", (0, 0), dxfattribs={"layer": "WALLS"})
    file = tmp_path / "bomb.dxf"
    empty.document.saveas(file)
    with pytest.raises(InputError, match="more than 2000 entities"):
        dxf.read(file, "walls", "WALLS", 1.0)


def test_every_entity_of_a_layer_of_walls_is_imported_or_counted(
    empty: Drawing, tmp_path: Path
) -> None:
    model, wall = empty.model, {"layer": "WALLS"}
    hall = empty.document.blocks.new("HALL")
    hall.add_lwpolyline([(0, 0), (40, 0), (40, 15), (0, 15)], close=True)
    empty.document.blocks.new("SIGN").add_text("exit")
    model.add_line((0, 0), (10, 0), dxfattribs=wall)
    model.add_line((10, 0), (0, 0), dxfattribs=wall)
    model.add_spline([(0, 5, 0), (5, 8, 0), (10, 5, 0)], dxfattribs=wall)
    model.add_ellipse((30, 30), (5, 0), 0.5, dxfattribs=wall)
    model.add_circle((50, 30), 4, dxfattribs=wall)
    model.add_blockref("HALL", (100, 0), dxfattribs=wall)
    model.add_blockref("SIGN", (100, 0), dxfattribs=wall)
    model.add_solid([(0, 20), (1, 20), (0, 25), (1, 25)], dxfattribs=wall)
    # A vertical face is one line in plan.
    model.add_3dface([(0, 40, 0), (9, 40, 0), (9, 40, 3), (0, 40, 3)], dxfattribs=wall)
    model.add_mline([(60, 0), (70, 0)], dxfattribs=wall)
    model.add_hatch(dxfattribs=wall).paths.add_polyline_path([(0, 0), (1, 0), (1, 1)])
    model.add_point((0, 0), dxfattribs=wall)
    with model.add_mesh(dxfattribs=wall).edit_data() as mesh:
        mesh.vertices, mesh.faces = [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)]
    file = tmp_path / "walls.dxf"
    empty.document.saveas(file)
    drawn = dxf.read(file, "walls", "walls", 1.0)
    counted = {what.rsplit(": ", 1)[1]: count for what, count in drawn.skipped.items()}
    assert counted == {
        "LINE (drawn twice)": 1,
        "TEXT (no line in plan)": 1,
        "HATCH (no line in plan)": 1,
        "POINT (no line in plan)": 1,
        "MESH (no line in plan)": 1,
    }
    # Eight of the eleven others; the multiline has two lines.
    assert len(drawn.walls_m) == 9
    assert [(0.0, 40.0), (9.0, 40.0)] in [sorted(it) for it in drawn.walls_m]


@pytest.mark.parametrize("layer", ["FUNKKÖPFE", "funkköpfe", "Funkköpfe"])
@pytest.mark.parametrize("escaped", [False, True])
def test_names_of_layers_are_compared_without_case_and_escapes(
    empty: Drawing, tmp_path: Path, layer: str, escaped: bool
) -> None:
    empty.model.add_point((1, 2, 6), dxfattribs={"layer": "Funkköpfe"})
    empty.model.add_point((3, 4, 6), dxfattribs={"layer": "FUNKKÖPFE"})
    file = tmp_path / "plant.dxf"
    empty.document.saveas(file)
    if escaped:
        text = file.read_text("utf-8").replace("ö", "\\U+00F6").replace("Ö", "\\U+00D6")
        file.write_text(text, "utf-8")
    drawn = read(None, file, Options(heads_layer=layer, scale_m=1.0))
    assert [(it.x_m, it.y_m) for it in drawn.heads] == [(1.0, 2.0), (3.0, 4.0)]


def test_damaged_entities_that_the_reader_removes_are_counted(
    empty: Drawing, tmp_path: Path
) -> None:
    empty.model.add_line((0, 0), (9, 0), dxfattribs={"layer": "WALLS"})
    empty.model.add_blockref("NOWHERE", (0, 0), dxfattribs={"layer": "WALLS"})
    empty.model.add_spline([], dxfattribs={"layer": "WALLS"})
    file = tmp_path / "walls.dxf"
    empty.document.saveas(file)
    drawn = read(None, None, Options(scale_m=1.0), file)
    assert len(drawn.skipped) == 2
    assert all(word in " ".join(drawn.skipped) for word in ("INSERT", "SPLINE"))


def test_radio_heads_without_height_cause_a_warning(
    empty: Drawing, access_av: Callable[..., Any], tmp_path: Path
) -> None:
    empty.model.add_point((5, 5), dxfattribs={"layer": "HEADS"})
    file = tmp_path / "flat.dxf"
    empty.document.saveas(file)
    table = tmp_path / "flat.csv"
    table.write_text("x_m,y_m,z_m\n5,5,0\n9,5,0\n", "utf-8")
    for heads in (file, table):
        _, done = new(access_av, tmp_path, "--heads-file", heads, "--metres-per-unit", "1")
        assert "all radio heads are at height 0 m" in done.err
    table.write_text("x_m,y_m,z_m\n5,5,0\n9,5,6\n", "utf-8")
    _, done = new(access_av, tmp_path, "--heads-file", table)
    assert "height 0 m" not in done.err.replace("at height 0 m, as", "")


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([((0, 0), (50, 0)), ((60, 0), (90, 0))], "the smallest gap at an end is 10 m"),
        ([((0, 0), (50, 0)), ((50, 0), (90, 0)), ((50, 0), (50, 40))], "more than two"),
    ],
)
def test_curves_that_do_not_form_one_road_are_rejected(
    empty: Drawing, tmp_path: Path, lines: list[Any], said: str
) -> None:
    for start, end in lines:
        empty.model.add_line(start, end, dxfattribs={"layer": "ROAD"})
    file = tmp_path / "road.dxf"
    empty.document.saveas(file)
    with pytest.raises(InputError, match=said):
        dxf.read(file, "road", "ROAD", 1.0)


def test_a_digitized_circle_keeps_its_shape(empty: Drawing, tmp_path: Path) -> None:
    """A digitized circle: each kink is below that of a smooth road, their sum is 90 degrees."""
    angles = np.linspace(0.0, 0.5 * np.pi, 1000)
    points = 300.0 * np.column_stack([np.sin(angles), 1.0 - np.cos(angles)])
    empty.model.add_lwpolyline(points, dxfattribs={"layer": "ROAD"})
    file = tmp_path / "road.dxf"
    empty.document.saveas(file)
    drawn = dxf.read(file, "road", "ROAD", 1.0)
    assert apart_m(np.array(drawn.road_m), points) < SAME_M
    assert drawn.bends == 1


@pytest.mark.parametrize("kind", ["plant", "site"])
@pytest.mark.parametrize("parts", [("road",), ("heads",), ("road", "heads"), ("walls",)])
def test_an_imported_plant_contains_no_example_values(
    access_av: Callable[..., Any], tmp_path: Path, kind: str, parts: tuple[str, ...]
) -> None:
    pytest.importorskip("pyproj", reason="the extra `geo` is not installed")
    source, file = tmp_path / "plant.geojson", tmp_path / "new.toml"
    plans.write_map(source, plans.CORNERS, None, MUNICH, kind="features")
    options = [f"--{it.replace('heads', 'heads-file')}={source}" for it in parts]
    done = access_av("file", "new", kind, file, *options, "--origin", "48.137,11.575", columns=500)
    assert done.code == 0, done.err
    text = file.read_text("utf-8")
    held = tomllib.loads(text)
    site = held["site"] if kind == "plant" else held
    names = [it["name"] for it in site.get("radio_heads", [])]
    assert names == (["head 1", "head 2", "head 3"] if "heads" in parts else [])
    assert ("polyline_m" in site.get("road", {})) == ("road" in parts)
    assert "segments" not in site.get("road", {})
    if kind == "plant":
        assert held["motion"]["stops"] == []
        assert "trips_per_day" not in held["fleet"]
        assert "fleet.trips_per_day" in done.out
        filled = text.replace("# trips_per_day = 40", "trips_per_day = 12")
        file.write_text(filled, "utf-8")
    if "heads" not in parts:
        assert "radio_heads]] (examples" in done.out or "radio_heads]]," in done.out
    complete = "heads" in parts and ("road" in parts or kind == "site")
    checked = access_av("file", "check", file)
    assert checked.code == (0 if complete else 2), checked.err


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("x_m, y_m\n0, 0\n100, 0\n", 2),
        ("# survey\n\nx_m,y_m\n# first\n0,0\n\n100,0\n", 2),
        ("\ufeffx_m;y_m\r\n0,5;0\r\n100,5;0\r\n", 2),
        ("sep=;\r\nx_m;y_m\r\n0,0;0\r\n100;0\r\n", 2),
        ('"x_m"\t"y_m"\n"0"\t"0"\n"100"\t"0"\n', 2),
        ("x_m;y_m;\n0;0;\n100;0;\n", 2),
        ('name,x_m,y_m\n"gate, south",0,0\n"a ""b""",100,0\n', 2),
    ],
)
def test_tables_of_points_have_the_csv_format_of_logs(
    tmp_path: Path, text: str, points: int
) -> None:
    file = tmp_path / "road.csv"
    file.write_bytes(text.encode())
    assert len(csv_file.read_road(file).road_m) == points


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"x_m,y_m\n0,0\n\n100,\n", "y_m is empty in line 4"),
        (b"x_m,y_m\n0,0\n# note\n100,nan\n", "y_m is 'nan' in line 4"),
        (b"x_m,y_m\n0,0\n100,inf\n", "y_m is 'inf' in line 3"),
        (b"x_m,y_m,x_m\n0,0,1\n100,0,1\n", "column x_m occurs twice"),
        (b"x_m,y_m\n0,0\n1,5,0\n", "line 3 has 3 cells instead of 2; with decimal commas"),
        (b'x_m,y_m\n"1,000.0",0\n"1,200.0",0\n', "'1,000.0' in line 2; a number without thousands"),
        (b"x_m;y_m\n1.000,5;0\n1.200,5;0\n", "without thousands separators"),
        (b"X_M,Y_M\n0,0\n100,0\n", "write x_m instead of X_M"),
        ("name,x_m,y_m\nTür,0,0\n".encode("latin-1"), "byte 0xFC in line 2 is not UTF-8"),
        ("x_m,y_m\n0,0\n".encode("utf-16-le"), "UTF-16 without a byte order mark"),
        ("x_m,y_m\n0,0\n".encode("utf-32"), "UTF-32"),
        (b"PAR1\0\0", "the file is Parquet, not CSV"),
        (b"\x1f\x8b\0\0", "compressed"),
        (b"#x_m,y_m\n0,0\n100,0\n", "must name the columns, without #"),
        (b"x_m [m],y_m\n0,0\n100,0\n", "write x_m instead of x_m [m]"),
        (b"x_m|y_m\n0|0\n100|0\n", "separate the columns by commas"),
        (b'x_m,y_m\n"0,0\n100",0\n', "line 2 has a quote that is not closed"),
        (b"", "the file is empty"),
        (b"x_m,y_m\n" + b'"' + 200_000 * b"9" + b'",0\n', "line 2: field larger"),
        ("sep=\u00e4\nx_m\u00e4y_m\n0\u00e40\n".encode(), "column x_m is missing"),
    ],
)
def test_tables_that_cannot_be_read_are_named_with_the_line(
    tmp_path: Path, data: bytes, said: str
) -> None:
    file = tmp_path / "road.csv"
    file.write_bytes(data)
    with pytest.raises(InputError, match=re.escape(said)):
        csv_file.read_road(file)


@pytest.mark.parametrize(
    ("pci", "found"), [("21", 21), ("21.0", 21), ("", None), ("21.7", "21.7"), ("nan", "nan")]
)
def test_a_pci_is_an_integer_or_omitted(tmp_path: Path, pci: str, found: Any) -> None:
    file = tmp_path / "heads.csv"
    file.write_text(f"name,x_m,y_m,z_m,pci\nA,0,0,6,{pci}\nB,9,0,6,22\n", "utf-8")
    if isinstance(found, str):
        with pytest.raises(InputError, match=f"pci is {found}"):
            csv_file.read_heads(file)
    else:
        assert csv_file.read_heads(file).heads[0].pci == found


def test_radio_heads_with_one_pci_are_warned_of(
    access_av: Callable[..., Any], tmp_path: Path
) -> None:
    heads = tmp_path / "heads.csv"
    rows = ["name,x_m,y_m,z_m,pci", "A,0,0,6,21", "B,9,0,6,22", "C,30,0,6,21", "D,40,0,6,"]
    heads.write_text("\n".join(rows), "utf-8")
    _, done = new(access_av, tmp_path, "--heads-file", heads)
    said = " ".join(done.err.split())
    assert f"{heads}: 2 radio heads have PCI 21: 'A', 'C'; correct the PCI" in said
    assert "PCI 22" not in said
    heads.write_text("\n".join(rows[:3]), "utf-8")
    _, done = new(access_av, tmp_path, "--heads-file", heads)
    assert "radio heads have PCI" not in done.err


@pytest.mark.parametrize("data", [b"", b"  0\nSECTION\n", b"0\n", bytes(range(256)) * 8, b"AC1032"])
def test_files_other_than_drawings_are_rejected(tmp_path: Path, data: bytes) -> None:
    pytest.importorskip("ezdxf", reason="the extra `cad` is not installed")
    file = tmp_path / "plant.dxf"
    file.write_bytes(data)
    with pytest.raises(InputError, match=r"plant\.dxf: "):
        dxf.read(file, "road", "ROAD", 1.0)


def test_integers_beyond_the_float_range_are_rejected(tmp_path: Path) -> None:
    file = tmp_path / "road.geojson"
    file.write_text(f'{{"type": "LineString", "coordinates": [[{10**400}, 1], [2, 3]]}}', "utf-8")
    with pytest.raises(InputError, match="must be two or three finite numbers"):
        read(file, None, Options())


def test_lines_are_counted_as_an_editor_does(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("# a\nx\n\n1\n# b\n2\n", "utf-8")
    assert csv_text.read(file)["x"].to_list() == [1, 2]
    assert [csv_text.line_of(file, row) for row in (0, 1)] == [4, 6]
