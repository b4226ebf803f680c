"""A study is saved and loaded as other results are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import access_av

if TYPE_CHECKING:
    from pathlib import Path

PLANT = """
name = "short"
target = "0.2 m 90 %"
vehicle = "tugger"
[site]
name = "short"
[site.road]
polyline_m = [[0.0, 0.0], [30.0, 0.0]]
[[site.radio_heads]]
name = "mast"
position_m = [10.0, 20.0, 8.0]
pci = 1
eirp_dbm = 10.0
[[site.radio_heads]]
name = "other"
position_m = [60.0, 10.0, 8.0]
pci = 2
eirp_dbm = 10.0
[fleet]
vehicles = 6
hours_per_day = 16.0
trips_per_day = 40
years = 4.0
[prices]
currency = "EUR"
"""


def test_a_study_is_saved_and_loaded_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text(PLANT, encoding="utf-8")
    found = access_av.study_plant(str(file), runs=2)
    saved = found.save(tmp_path / "study.zip")
    loaded = access_av.Study.load(saved)
    assert loaded == found
    assert loaded.summary() == found.summary()
    assert loaded.save(tmp_path / "again.zip").read_bytes() == saved.read_bytes()
