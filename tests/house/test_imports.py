"""Permitted imports between modules; modules and duration of `import access_av`."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter

import pytest

import access_av
from conftest import ROOT

PACKAGE = ROOT / "python"
FILES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): path
    for path in (PACKAGE / "access_av").rglob("*.py")
}
CORE = "access_av._core"
# Modules that may import the general part and the paper's part.
TOP = {"access_av", "access_av.cli.main", "access_av.cli.paper", "access_av.__main__"}
PAPERS = ("access_av.paper", "access_av.report.paper")
# Folders whose files have the name of a command or a report; elsewhere file names are unique.
NAMED_AFTER_ANOTHER = {"cli", "report"}


def imported_by(module: str) -> set[str]:
    """Returns the modules of the project that a module imports, including imports for types
    only."""
    found = set()
    for node in ast.walk(ast.parse(FILES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            assert node.level == 0, f"{module}: relative import"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner in {*FILES, CORE} else node.module)
    return found & FILES.keys()


GRAPH = {module: imported_by(module) for module in FILES}


def test_no_two_modules_import_each_other() -> None:
    try:
        tuple(TopologicalSorter(GRAPH).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_general_modules_do_not_import_the_paper() -> None:
    for module, imported in GRAPH.items():
        if module not in TOP and not module.startswith(PAPERS):
            assert not {name for name in imported if name.startswith(PAPERS)}, module


def folder(module: str) -> str:
    """Returns the folder of a module or package."""
    return module if FILES[module].name == "__init__.py" else module.rpartition(".")[0]


def test_no_two_folders_use_each_other() -> None:
    graph: dict[str, set[str]] = {}
    for module, imported in GRAPH.items():
        used = {folder(name) for name in imported} - {folder(module), "access_av"}
        if folder(module) != "access_av":
            graph.setdefault(folder(module), set()).update(used)
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_file_names_are_unique() -> None:
    paths = [path.relative_to(PACKAGE / "access_av") for path in FILES.values()]
    names = [
        path.name
        for path in paths
        if path.name != "__init__.py" and path.parts[0] not in NAMED_AFTER_ANOTHER
    ]
    assert sorted(names) == sorted(set(names))


def test_public_modules_are_imported_by_their_public_names() -> None:
    code = "import access_av, access_av.cost as it; from access_av.nr import Searcher"
    assert printed_by(f"{code}; print(it.__name__, it is access_av.cost)") == [
        "access_av.economics.cost",
        "True",
    ]


def test_modules_import_from_the_defining_module() -> None:
    packages = {module for module, path in FILES.items() if path.name == "__init__.py"}
    for module, imported in GRAPH.items():
        assert module in TOP or not imported & packages, module


def test_packages_only_re_export() -> None:
    allowed = (ast.Import, ast.ImportFrom, ast.Assign, ast.Expr, ast.If)
    for module, path in FILES.items():
        if path.name == "__init__.py":
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                assert isinstance(node, allowed), (module, ast.unparse(node))


def test_every_public_name_is_accessible_and_documented() -> None:
    for package in (access_av, access_av.paper):
        for name in package.__all__:
            found = getattr(package, name)
            assert name in dir(package)
            assert name == "__version__" or found.__doc__, name
    for name in ("simulate", "bound", "synthesize", "locate", "evaluate", "explore"):
        function = getattr(access_av, name)
        assert callable(function)
        assert "Examples\n" in function.__doc__, name
    with pytest.raises(AttributeError, match="nothing_here"):
        _ = access_av.nothing_here


def test_names_do_not_change_with_what_was_imported_before() -> None:
    modules = {name.split(".")[1] for name in FILES if name.count(".") == 1}
    functions = {name for name in access_av.__all__ if name not in modules}
    assert {"bound", "evaluate", "locate", "simulate", "explore"} <= functions


def printed_by(code: str) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_importing_it_loads_neither_charts_nor_tables() -> None:
    heavy = "{'altair', 'vl_convert', 'polars', 'numpy', 'rich', 'typer'}"
    code = f"import sys, access_av; print(*sorted({heavy} & sys.modules.keys()))"
    assert printed_by(code) == []


def test_the_command_line_starts_without_charts() -> None:
    code = "import sys, access_av.cli.main; print('altair' in sys.modules, 'polars' in sys.modules)"
    assert printed_by(code) == ["False", "False"]
