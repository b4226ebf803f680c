"""The code that draws charts is constructed once for each version of vl-convert."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from access_av.report import chart_code

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """List of the chart codes generated so far; the cache is in a temporary directory."""
    codes = list[str]()

    def javascript_bundle() -> str:
        codes.append(f"const σ = {len(codes)};")
        return codes[-1]

    monkeypatch.setattr(chart_code.vl_convert, "javascript_bundle", javascript_bundle)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return codes


def test_the_code_is_kept_for_each_version(
    built: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert [chart_code.chart_code() for _ in range(3)] == ["const σ = 0;"] * 3
    monkeypatch.setattr(chart_code, "version", lambda _: "9.9")
    assert [chart_code.chart_code() for _ in range(2)] == ["const σ = 1;"] * 2
    assert len(built) == 2
    files = [it.name for it in (tmp_path / "cache/access-av").iterdir()]
    assert sorted(files)[-1] == "charts-9.9.js"
    assert len(files) == 2  # no temporary file remains


def test_the_cache_is_in_the_home_directory_by_default(
    built: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for given in ("", "relative/path"):
        monkeypatch.setenv("XDG_CACHE_HOME", given)
        assert chart_code.chart_code() == "const σ = 0;"
    assert len(built) == 1
    assert [it.parent.name for it in tmp_path.rglob("*.js")] == ["access-av"]


def test_without_a_writable_cache_each_process_constructs_the_code(
    built: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "cache").write_text("a file, not a directory")
    assert [chart_code.chart_code() for _ in range(2)] == ["const σ = 0;", "const σ = 1;"]
    monkeypatch.setenv("XDG_CACHE_HOME", "")

    def home() -> Path:
        raise RuntimeError("no home directory")

    monkeypatch.setattr(chart_code.Path, "home", home)
    assert chart_code.chart_code() == "const σ = 2;"
    assert len(built) == 3
