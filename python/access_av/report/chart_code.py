"""Code that draws the charts of a page: Vega and Vega-Lite as one JavaScript file."""

from __future__ import annotations

import contextlib
import os
import tempfile
from importlib.metadata import version
from pathlib import Path

import vl_convert


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
            _write(file, code)
    return code


def _write(file: Path, code: str) -> None:
    """Writes the file at once: another process reads the whole code or no file."""
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=file.parent, suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as part:
            part.write(code)
        Path(name).replace(file)
    except OSError:
        Path(name).unlink(missing_ok=True)
        raise
