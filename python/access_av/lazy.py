"""Lazy import: names of a package are imported at their first use (PEP 562)."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from types import ModuleType


def attach(
    package: str, homes: Mapping[str, Sequence[str]], modules: Mapping[str, str] | None = None
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Returns ``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package
        The package's ``__name__``.
    homes
        Lazily imported names, by the module that defines them.
    modules
        Modules by their alias in the package; ``import`` also accepts the alias.

    Examples
    --------
    >>> modules = {"cost": "access_av.economics.cost"}
    >>> find, names = attach("access_av", {"access_av.signal.methods": ["label"]}, modules)
    >>> find("label")("music"), find("cost").__name__
    ('MUSIC', 'access_av.economics.cost')
    """
    home = {name: module for module, names in homes.items() for name in names}
    modules = modules or {}
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
