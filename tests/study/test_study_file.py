"""A study can be saved and loaded like other results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import access_av
from short_plant import LAST_METRES

if TYPE_CHECKING:
    from pathlib import Path


def test_a_study_is_saved_and_loaded_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text(LAST_METRES, encoding="utf-8")
    found = access_av.study_plant(str(file), runs=2)
    saved = found.save(tmp_path / "study.zip")
    loaded = access_av.Study.load(saved)
    assert loaded == found
    assert loaded.origin.version == access_av.__version__
    assert loaded.scenario == found.plant.scenario()
    assert loaded.summary() == found.summary()
    assert loaded.save(tmp_path / "again.zip").read_bytes() == saved.read_bytes()
