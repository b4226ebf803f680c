"""Picture of the README: verdict and map of a study's report, without the tables between them."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from browser import Browser  # noqa: E402

PICTURE = ROOT / "docs" / "study.png"
HIDE_TABLES = """
[...document.querySelectorAll("section")]
  .find((it) => it.textContent.trim().startsWith("Is it good enough?")).remove()
"""
DRAWN = "document.querySelectorAll('#map svg.marks').length > 0"


def main() -> None:
    """Writes the picture of the given report."""
    report = Path(sys.argv[1]).resolve()
    with Browser("chromium", report.as_uri(), height=1320) as browser:
        browser.wait_for(DRAWN, seconds=30.0)
        browser.evaluate(HIDE_TABLES)
        browser.picture(PICTURE)


if __name__ == "__main__":
    main()
