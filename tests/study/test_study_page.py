"""Pages of a study and of other commands in a browser."""

from __future__ import annotations

import base64
import json
import os
import re
import sys
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

import layout
from access_av import Plant, drives
from access_av.tables.toml import tomllib
from browser import Browser
from short_plant import PLANT

if TYPE_CHECKING:
    from pathlib import Path

# Two grey pixels.
PICTURE = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR4nGM4cxcAAngBqtw5YnsAAAAASUVORK5CYII="
)


@pytest.fixture(scope="module")
def results(short_study: Path) -> Path:
    return short_study


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Pages of other commands, of short drives over a picture."""
    from access_av.cli.main import main

    folder = tmp_path_factory.mktemp("pages")
    (folder / "plan.png").write_bytes(PICTURE)
    site = tomllib.loads(PLANT)["site"]
    scenario = (
        Plant.from_toml(PLANT)
        .scenario()
        .with_overrides(
            {
                "site": {
                    **site,
                    "underlay": {
                        "file": str(folder / "plan.png"),
                        "metres_per_pixel": 40.0,
                        "zero_px": [0.0, 1.0],
                    },
                }
            }
        )
    )
    (folder / "short.toml").write_text(scenario.to_toml(), "utf-8")
    logged = folder / "logged"
    drives.log_angles(scenario, logged)
    located = [
        *(
            "record",
            "locate",
            "--recording",
            logged / "angles.csv",
            "--odometry",
            logged / "odometry.csv",
        ),
        *("--site", logged / "site.toml", "--vehicle", logged / "vehicle.toml"),
        *("--truth", logged / "truth.tum"),
    ]
    commands = {
        "run": ["run", folder / "short.toml", "--runs", "2"],
        "bound": ["design", "bound", folder / "short.toml"],
        "integrity": [
            "design",
            "integrity",
            folder / "short.toml",
            "--runs",
            "1",
            "--fault",
            "none",
        ],
        "locate": located,
    }
    for name, command in commands.items():
        with pytest.MonkeyPatch.context() as patch:
            arguments = ["access-av", *command, "--out", folder / name]
            patch.setattr(sys, "argv", [str(it) for it in arguments])
            with pytest.raises(SystemExit) as stopped:
                main()
            assert not stopped.value.code, name
    return {name: folder / name / "report.html" for name in commands}


def test_page_elements_do_not_overlap_and_are_not_cut(
    results: Path, pages: dict[str, Path]
) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    papers = set()
    for name, page in {"study": results / "report.html", **pages}.items():
        with Browser(program, page.as_uri()) as browser:
            for width, look in layout.VIEWS:
                found = layout.measure(browser, width, look)
                assert found["width"] == width
                assert found["found"] == [], (name, width, look)
                papers.add(found["paper"])
                if look != "print" and "ACCESS_AV_AXE" in os.environ:
                    assert layout.hindrances(browser) == [], (name, width, look)
            assert browser.errors == []
    assert len(papers) == 2  # dark, and not


def test_every_operating_point_is_numbered_without_overlap(results: Path) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to measure the page with")
    page = results / "report.html"
    found = re.search(r"const charts = (.*?);\n", page.read_text("utf-8"))
    assert found is not None
    spec = json.loads(found.group(1))["ways"]
    [rows] = [rows for rows in spec["datasets"].values() if "label" in rows[0]]
    points = pl.read_parquet(results / "points.parquet").filter(
        pl.col("target_error_m").is_finite()
    )
    energy_j = sum(points[f"{part}_value_j"] for part in ("estimates", "listening"))
    drawn = sorted((it["energy_j"], it["error_m"]) for it in rows)
    expected = sorted(zip(energy_j, points["target_error_m"], strict=True))
    assert np.allclose(drawn, expected, atol=1e-4)
    with Browser(program, page.as_uri()) as browser:
        for width in (1300, 400):
            browser.resize(width, 900)
            assert layout.label_faults(browser, "ways", spec, width) == []


def test_a_drive_is_animated_unless_reduced_motion_is_preferred(results: Path) -> None:
    if (program := layout.chromium()) is None:
        pytest.skip("no chromium to play it with")
    text, at_s = "document.querySelector('#map .role-title').textContent", "input[name=at_s]"
    with Browser(program, (results / "report.html").as_uri()) as browser:
        browser.wait_for("document.querySelector('.vega-bind button')", seconds=60.0)
        first = browser.evaluate(text)
        assert first.startswith("0.0 s: ")
        browser.evaluate("document.querySelector('.vega-bind button').click()")
        browser.wait_for(f"document.querySelector('{at_s}').value > 1")
        browser.evaluate("document.querySelector('.vega-bind button').click()")
        assert browser.evaluate("document.querySelector('.vega-bind button').textContent") == "Play"
        assert browser.evaluate(text) != first
        less = {"name": "prefers-reduced-motion", "value": "reduce"}
        browser.call("Emulation.setEmulatedMedia", features=[less])
        browser.evaluate("window.isBefore = true")
        browser.call("Page.reload")
        browser.wait_for(f"!window.isBefore && document.querySelector('{at_s}')", seconds=60.0)
        browser.evaluate("new Promise((done) => setTimeout(done, 500))")
        assert browser.evaluate("document.querySelector('.vega-bind button')") is None
        browser.evaluate(f"document.querySelector('{at_s}').focus()")
        for kind in ("keyDown", "keyUp"):
            key = {"key": "ArrowRight", "windowsVirtualKeyCode": 39}
            browser.call("Input.dispatchKeyEvent", type=kind, **key)
        browser.wait_for(f"!{text}.startsWith('0.0 s: ')")


def test_the_animated_drive_is_the_first_one(results: Path) -> None:
    text = (results / "report.html").read_text("utf-8")
    specs = json.loads(re.findall(r"const charts = (\{.*\});\n", text)[0])
    [steps] = [
        layer["data"]["values"]
        for layer in specs["map"]["layer"]
        if layer.get("data", {}).get("name") == "played"
    ]
    driven = pl.read_parquet(results / "trajectories.parquet")
    assert 100 < len(steps) <= 302
    for step in (0, len(steps) // 2):
        at_s, off_m, level_m = map(float, re.findall(r"\d+\.\d+", steps[step]["text"]))
        row = driven.row(by_predicate=(pl.col("time_s") - at_s).abs() < 1e-6, named=True)
        assert off_m == pytest.approx(np.hypot(row["error_x_m"], row["error_y_m"]), abs=0.006)
        assert level_m == pytest.approx(row["protection_level_m"], abs=0.006)
        assert steps[step]["x_m"] == pytest.approx(row["true_x_m"], abs=0.06)
    rows = pl.read_parquet(results / "errors.parquet").filter(variant="unchanged", run=0)
    mine = rows.sort("time_s")["error_m"].to_numpy()
    assert np.hypot(*driven.select("error_x_m", "error_y_m").to_numpy().T)[::5] == pytest.approx(
        mine, abs=1e-6
    )


def test_the_page_is_small_loads_nothing_and_shows_names_as_they_are(results: Path) -> None:
    text = (results / "report.html").read_text("utf-8")
    assert len(text.encode()) < 2_000_000
    shown = re.sub(r"<script>.*?</script>", "", text, flags=re.S)
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", shown)
    assert "<b>bold</b> mast" not in shown
    assert "<i>somebody" not in shown
    assert "Algorithm 1" not in shown  # no text about the paper's trip
