"""Code that draws the charts of a page: Vega and Vega-Lite as one JavaScript file."""

from __future__ import annotations

import contextlib
import os
from importlib.metadata import version
from pathlib import Path

import vl_convert

from access_av.tables.results_directory import write_whole


def chart_code() -> str:
    """Returns the code that draws charts.

    Its construction takes two seconds. Therefore, the user's cache directory keeps it for each
    version of vl-convert: ``$XDG_CACHE_HOME/access-av``, by default ``~/.cache/access-av``. Without
    a writable cache, each process constructs it.
    """
    file = None
    # The home directory may be unknown (RuntimeError).
    with contextlib.suppress(OSError, UnicodeDecodeError, RuntimeError):
        # The specification of this variable ignores relative paths.
        given = Path(os.environ.get("XDG_CACHE_HOME", ""))
        home = given if given.is_absolute() else Path.home() / ".cache"
        file = home / f"access-av/charts-{version('vl-convert-python')}.js"
        return file.read_text(encoding="utf-8")
    code: str = vl_convert.javascript_bundle()  # type: ignore[call-arg]  # its type stub is wrong
    if file is not None:
        with contextlib.suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_whole(file, code)
    return code
