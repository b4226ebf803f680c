"""Builds the documentation site: `make docs`.

The pages in `docs/` also link to files outside that folder, as a repository's pages do. A site
needs all its pages in one folder. This script copies them, adapts their links, generates the
reference pages, and runs zensical in strict mode.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import commands_page
import python_page
import rust_page
import settings_page

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "target" / "docs"
# Pages outside `docs/`, and their names in the site.
OUTSIDE = {
    "README.md": "start.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "notes/experiments.md": "experiments.md",
}
# Generated pages, and their names in the site. In the repository, a link leads to the generator.
GENERATED = {
    "docs/site/settings_page.py": ("settings.md", settings_page.page),
    "docs/site/commands_page.py": ("commands.md", commands_page.page),
    "docs/site/python_page.py": ("python-api.md", python_page.page),
    "docs/site/rust_page.py": ("rust-api.md", rust_page.page),
}
LINK = re.compile(r"(!?)\[([^]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")


def site_name(file: Path) -> str | None:
    """Returns the name of a project file in the site, or None if the site does not contain it."""
    inside = file.relative_to(ROOT).as_posix()
    if file.parent == ROOT / "docs":
        return "index.md" if file.name == "README.md" else file.name
    if inside in GENERATED:
        return GENERATED[inside][0]
    return OUTSIDE.get(inside)


def adapted(page: Path) -> str:
    """Returns the text of a page with the links of the site.

    A link to a file that the site does not contain, such as source code, is replaced by its label.
    """

    def adapt(link: re.Match[str]) -> str:
        image, label, target, anchor = link[1], link[2], link[3], link[4] or ""
        if not target or re.match(r"[a-z]+:", target):
            return link[0]
        file = (page.parent / target).resolve()
        if not file.exists():
            sys.exit(f"{page.relative_to(ROOT)}: the target of the link {target} does not exist")
        name = site_name(file)
        return f"{image}[{label}]({name}{anchor})" if name else label

    return LINK.sub(adapt, page.read_text(encoding="utf-8"))


def main() -> None:
    """Copies the pages and builds the site into `target/docs/site`."""
    pages = BUILD / "pages"
    shutil.rmtree(BUILD, ignore_errors=True)
    pages.mkdir(parents=True)
    for page in [*sorted((ROOT / "docs").glob("*.md")), *(ROOT / name for name in OUTSIDE)]:
        name = site_name(page)
        assert name is not None
        (pages / name).write_text(adapted(page), encoding="utf-8")
    for name, text in GENERATED.values():
        (pages / name).write_text(text() + "\n", encoding="utf-8")
    for picture in (ROOT / "docs").glob("*.[ps][nv]g"):
        shutil.copy(picture, pages)
    shutil.copy(Path(__file__).parent / "site.css", pages)
    shutil.copy(Path(__file__).parent / "zensical.toml", BUILD)
    command = [Path(sys.executable).parent / "zensical", "build", "--strict", "--clean"]
    sys.exit(subprocess.run(command, cwd=BUILD, check=False).returncode)


if __name__ == "__main__":
    main()
