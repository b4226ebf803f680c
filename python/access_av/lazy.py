"""Lazy import: names of a package are imported at their first use (PEP 562)."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import ModuleType

# Folder of the package `access_av`.
ROOT = Path(__file__).parent.parent
IMPORT = re.compile(r"^    from (\S+) import (\([^)]*\)|.+)$", re.MULTILINE)


def attach(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Returns ``__getattr__`` and ``__dir__`` of a package.

    The lazily imported names are those that the package imports under ``if TYPE_CHECKING``.
    ``import`` also accepts a module by its alias in the package, such as ``access_av.cost``.

    Parameters
    ----------
    package
        The package's ``__name__``.

    Examples
    --------
    >>> find, names = attach("access_av")
    >>> find("cost").__name__, "locate" in names()
    ('access_av.economics.cost', True)
    """
    text = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
    home, modules = dict[str, str](), dict[str, str]()
    for module, imported in IMPORT.findall(text):
        for name in re.findall(r"\w+", imported):
            file = ROOT.joinpath(*module.split("."), name)
            if file.is_dir() or file.with_suffix(".py").is_file():
                modules[name] = f"{module}.{name}"
            else:
                home[name] = module
    sys.meta_path.append(_Aliases({f"{package}.{name}": it for name, it in modules.items()}))

    def find(name: str) -> Any:
        if name in modules:
            return import_module(modules[name])
        if name in home:
            return getattr(import_module(home[name]), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home, *modules})

    return find, names


class _Aliases:
    """Imports aliases of modules: ``access_av.cost`` is ``access_av.economics.cost``.

    Finder and loader without their base classes, whose import is slower than that of the package.
    """

    def __init__(self, modules: Mapping[str, str]) -> None:
        self.modules = modules

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        return ModuleSpec(name, self) if name in self.modules else None  # type: ignore[arg-type]

    def create_module(self, _: ModuleSpec) -> None:
        """Uses Python's default module, which `exec_module` replaces."""

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = import_module(self.modules[module.__name__])
