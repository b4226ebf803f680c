"""Architecture: permitted dependencies between crates, and no cyclic imports between files."""

from __future__ import annotations

import json
import re
import subprocess
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

import pytest

from conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path

# Each crate, and the crates that it may use.
CRATES = {
    "aoa-array": set(),
    "nr-ssb": set(),
    "onboard": {"aoa-array", "nr-ssb"},
    "recording": {"onboard", "aoa-array", "nr-ssb"},
    "simulate": {"recording", "onboard", "aoa-array", "nr-ssb"},
    "access-av-node": {"recording", "onboard", "nr-ssb"},
    "access-av-python": {"simulate", "recording", "onboard", "aoa-array", "nr-ssb"},
}
# Crates that on-vehicle code must not use: random numbers, threads, MCAP.
NOT_ON_BOARD = {"rand", "rand_chacha", "rand_distr", "rayon", "mcap", "polars", "pyo3", "sha2"}


def cargo(*arguments: str) -> str:
    done = subprocess.run(["cargo", *arguments], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_crates_use_only_what_is_below_them() -> None:
    metadata = json.loads(cargo("metadata", "--format-version=1", "--no-deps"))
    for package in metadata["packages"]:
        used = {it["name"] for it in package["dependencies"] if it["kind"] is None}
        assert used & CRATES.keys() <= CRATES[package["name"]], package["name"]


def test_on_vehicle_code_has_no_random_numbers_threads_or_files() -> None:
    tree = cargo("tree", "-p", "onboard", "-e", "normal", "--prefix", "none")
    found = {line.split()[0] for line in tree.splitlines() if line.strip()}
    assert {"onboard", "aoa-array", "nr-ssb"} <= found
    assert not found & NOT_ON_BOARD


def modules(crate: Path) -> dict[str, Path]:
    """Module paths of a crate, `a::b`, and their files."""
    found = {}
    for file in (crate / "src").rglob("*.rs"):
        parts = list(file.relative_to(crate / "src").with_suffix("").parts)
        if parts[-1] in ("mod", "lib"):
            parts.pop()
        found["::".join(parts)] = file
    return found


def product_code(file: Path) -> str:
    """Returns a source file without comments and tests."""
    text = re.sub(r"//[^\n]*", "", file.read_text(encoding="utf-8"))
    return text.split("#[cfg(test)]")[0]


def used_paths(tree: str, prefix: str = "") -> list[str]:
    """Returns the paths of a use tree: `a::{b, c::d}` as `a::b`, `a::c::d`."""
    head, brace, rest = tree.partition("{")
    if not brace:
        return [prefix + tree.split(" as ")[0].strip()]
    depth, start, parts = 0, 0, []
    inner = rest[: rest.rindex("}")]
    for place, sign in enumerate(inner):
        depth += (sign == "{") - (sign == "}")
        if sign == "," and depth == 0:
            parts.append(inner[start:place])
            start = place + 1
    parts.append(inner[start:])
    paths = []
    for part in filter(str.strip, parts):
        paths += used_paths(part.strip(), prefix + head.strip())
    return paths


def imports(module: str, text: str, known: dict[str, Path]) -> set[str]:
    """Returns the modules of the crate that a module imports from, without re-exports of its
    children."""
    found = set()
    for public, tree in re.findall(r"^\s*(pub(?:\([^)]*\))? )?use ([^;]+);", text, re.M):
        for path in used_paths(" ".join(tree.split())):
            steps = path.split("::")
            here = module.split("::") if module else []
            if steps[0] == "crate":
                steps = steps[1:]
            elif steps[0] in ("self", "super"):
                while steps and steps[0] in ("self", "super"):
                    here = here[:-1] if steps[0] == "super" else here
                    steps = steps[1:]
                steps = here + steps
            elif public and "::".join([*here, steps[0]]) in known:
                continue  # a re-export of the children
            else:
                continue
            while steps and "::".join(steps) not in known:
                steps = steps[:-1]
            found.add("::".join(steps))
    return found - {module}


@pytest.mark.parametrize(
    "crate", sorted(path.name for path in (ROOT / "crates").iterdir() if path.is_dir())
)
def test_no_two_files_of_a_crate_import_each_other(crate: str) -> None:
    known = modules(ROOT / "crates" / crate)
    texts = {module: product_code(file) for module, file in known.items()}
    graph = {module: imports(module, text, known) for module, text in texts.items()}
    for module, file in known.items():
        if module and file.name == "mod.rs":
            defined = re.findall(r"^(?:pub(?:\([^)]*\))? )?(?:const )?fn \w+", texts[module], re.M)
            assert not defined, f"{crate}: {module} is a face, and has code"
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"{crate}: " + " -> ".join(error.args[1]))


def test_the_architecture_page_names_existing_files() -> None:
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    for row in re.findall(r"^\| (?:a|an) .*\|.*\|.*\|.*\|$", page, re.M):
        named = [path for path in re.findall(r"`([\w/.-]+\.(?:rs|toml))`", row) if "=" not in path]
        assert named or row.startswith("| array") or row.startswith("| an odometer"), row
        for path in named:
            found = [
                *ROOT.glob(path),
                *ROOT.glob(f"python/access_av/{path}"),
                *ROOT.glob(f"crates/*/src/{path}"),
                *ROOT.glob(f"crates/{path}"),
            ]
            assert found, f"{path} in: {row}"


def test_the_source_table_names_existing_files() -> None:
    page = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    section = page.split("### Source files by topic")[1].split("\n## ")[0]
    answers = re.findall(r"^\| .+ \| `([\w/.-]+)` \|$", section, re.M)
    assert len(answers) >= 20
    for path in answers:
        assert (ROOT / "crates/onboard/src" / path).is_file(), path
    stack = page.split("## The localizer")[1].split("### Fault modes")[0]
    for path in re.findall(r"localize/[\w/.]+", stack):
        assert (ROOT / "crates/onboard/src" / path).exists(), path
