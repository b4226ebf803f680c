"""Values that outlive a run and that a user's plug-ins change."""

from __future__ import annotations

import hashlib
import itertools
import pickle
import random
import types
import warnings
from typing import TYPE_CHECKING, Any

from access_av.run.plug_ins import FUNCTIONS, unwrapped

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

# Iterators whose position is state and that show it as text.
COUNTERS = (itertools.count, itertools.cycle, itertools.repeat)


class SharedState:
    """Values that a plug-in shares between runs; a warning is issued if runs change them.

    Results of a plug-in that reads such a value depend on the number of threads. The code of a
    function does not show every way to change one: attributes of a class or a function, random
    number generators, iterators and functions that it calls.

    Parameters
    ----------
    plug_ins
        Plug-ins of the user by role: ``estimator``, ``policy``, ``localizer``; ``None`` for none.
    """

    def __init__(self, plug_ins: Mapping[str, Any]) -> None:
        given = {role: unwrapped(it) for role, it in plug_ins.items() if it is not None}
        self._plug_ins = {role: (it, _digests(it)) for role, it in given.items()}

    def warn_of_changes(self, stacklevel: int) -> None:
        """Compares the values with those at the start, and warns of each plug-in that differs."""
        for role, (plug_in, before) in self._plug_ins.items():
            after = _digests(plug_in)
            names = [name for name, it in after.items() if before.get(name) != it]
            if names:
                text = (
                    f"the {role} keeps state between runs: it has changed "
                    f"{', '.join(names)}, which all runs and threads share. If it uses this, "
                    "results depend on the number of threads; keep state in the attributes of an "
                    "object that a class or a function makes for each run (self.NAME), random "
                    "number generators included"
                )
                warnings.warn(text, UserWarning, stacklevel=stacklevel + 1)


def _digests(plug_in: Any) -> dict[str, str]:
    """Digests of the values that a class or function reads and that outlive a call, by name."""
    found: dict[str, str] = {}
    seen: set[int] = set()
    waiting: list[Any] = [plug_in if isinstance(plug_in, (type, *FUNCTIONS)) else type(plug_in)]
    while waiting:
        held = waiting.pop()
        if id(held) in seen:
            continue
        seen.add(id(held))
        for name, value in _outliving(held):
            if isinstance(value, (types.FunctionType, types.MethodType, type)):
                if _is_of_user(value, plug_in):
                    waiting.append(getattr(value, "__func__", value))
                continue
            if value is random:
                name, value = "the generator of the module random", random.getstate()
            elif isinstance(value, types.ModuleType):
                if value.__name__ != "numpy":
                    continue
                name, value = "the generator of numpy.random", value.random.get_state()
            if (digest := _digest(value)) is not None:
                found[name] = digest
    return found


def _is_of_user(value: Any, plug_in: Any) -> bool:
    """Whether a class or function is from the file of the plug-in."""
    return getattr(value, "__module__", None) == getattr(plug_in, "__module__", None)


def _outliving(held: Any) -> Iterator[tuple[str, Any]]:
    """Values that outlive a call of a function or a method of a class, by name."""
    if isinstance(held, type):
        for name, value in list(vars(held).items()):
            value = getattr(value, "__func__", value)
            if isinstance(value, property):
                value = value.fget
            if not name.startswith("__") or isinstance(value, types.FunctionType):
                yield f"{held.__name__}.{name}", value
        yield from ((it.__name__, it) for it in held.__bases__ if it is not object)
        return
    if not isinstance(held, types.FunctionType):
        return
    yield from ((f"{held.__name__}.{name}", it) for name, it in list(vars(held).items()))
    defaults = (*(held.__defaults__ or ()), *(held.__kwdefaults__ or {}).values())
    yield from ((f"a default of {held.__name__}", it) for it in defaults)
    for name, cell in zip(held.__code__.co_freevars, held.__closure__ or (), strict=True):
        try:
            yield name, cell.cell_contents
        except ValueError:  # not assigned yet
            continue
    for name in _names(held.__code__):
        if name in held.__globals__:
            yield name, held.__globals__[name]


def _names(code: types.CodeType) -> set[str]:
    """Names of the global variables that a code and the functions in it read."""
    names = set(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            names |= _names(constant)
    return names


def _digest(value: Any) -> str | None:
    """Digest of a value; ``None`` if it cannot be compared."""
    if isinstance(value, types.GeneratorType):
        frame = value.gi_frame
        return repr(None if frame is None else (frame.f_lasti, sorted(frame.f_locals.items())))
    if isinstance(value, COUNTERS):
        return repr(value)
    try:
        return hashlib.blake2b(pickle.dumps(value)).hexdigest()
    except Exception:
        return None
