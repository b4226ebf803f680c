"""Factories of a user's estimator, policy and localizer: one object per run."""

from __future__ import annotations

import dis
import functools
import inspect
import types
import weakref
from collections import deque
from threading import Lock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# Attributes of an estimator with the energy or the time of one estimate.
COSTS = ("energy_per_execution_j", "time_per_execution_s")
FUNCTIONS = (types.FunctionType, types.BuiltinFunctionType)
CONTAINERS = (list, dict, set, bytearray, deque)
# Methods that change a container.
MUTATORS = frozenset(
    (
        *("append", "appendleft", "extend", "extendleft", "insert", "pop", "popleft", "popitem"),
        *("remove", "clear", "update", "add", "discard", "setdefault", "sort", "reverse"),
    )
)
# Maximum distance, in byte-code instructions, between the load of a container and a write to it.
NEARBY = 3


class Factory:
    """Creates the plug-in of each run; the core calls it as ``factory(site, vehicle, start)``.

    Parameters
    ----------
    role
        ``estimator``, ``policy`` or ``localizer``, for messages.
    make
        Function of site, vehicle and start.
    stating
        Object with the attributes :data:`COSTS`: energy or time of an estimate.
    """

    def __init__(self, role: str, make: Callable[..., Any], stating: Any) -> None:
        self._role, self._make = role, make
        self._made: dict[int, weakref.ref[Any]] = {}
        self._lock = Lock()
        for name in COSTS:
            setattr(self, name, getattr(stating, name, None))

    def __call__(self, *arguments: Any) -> Any:
        """Creates an object; a factory that returns the same object twice is rejected."""
        made = self._make(*arguments)
        if not isinstance(made, FUNCTIONS):
            self._remember(made)
        return made

    def _remember(self, made: Any) -> None:
        key = id(made)
        with self._lock:
            if (known := self._made.get(key)) is not None and known() is made:
                raise ValueError(
                    f"the factory of the {self._role} returned the same {type(made).__name__} for "
                    "two runs, which would share its state; let it make a new one at each call"
                )
            try:
                self._made[key] = weakref.ref(made, lambda _: self._made.pop(key, None))
            except TypeError:
                return  # an object without weak references, such as a tuple


def factory(plug_in: Any, role: str) -> Factory | None:
    """Returns the factory of a plug-in.

    A class, or a function of no argument or of three, makes one object per run. An estimator or a
    policy may also be a function of one argument; it serves all runs, and must keep no state.

    Parameters
    ----------
    plug_in
        Plug-in of the user; ``None`` for none.
    role
        ``estimator``, ``policy`` or ``localizer``.

    Raises
    ------
    TypeError
        For an object that all runs would share, and a function that keeps state.
    """
    if plug_in is None:
        return None
    function = unwrapped(plug_in)
    is_class = isinstance(function, type)
    if not is_class and not isinstance(function, FUNCTIONS):
        raise TypeError(_shared(plug_in, role))
    count, takes_more = _arguments(plug_in)
    if role != "localizer" and not is_class and (count == 1 or takes_more):
        if reason := _state(function):
            raise TypeError(
                f"the {role} is a function that keeps state: it {reason}, which all runs and "
                f"threads would share; {_allowed(role, function.__name__)}"
            )
        return Factory(role, lambda *_: plug_in, plug_in)
    if takes_more or count == 3:
        return Factory(role, plug_in, function)
    if count == 0:
        stating = plug_in() if role == "estimator" else plug_in
        return Factory(role, lambda *_: plug_in(), stating)
    raise TypeError(
        f"the {role}'s factory takes {count} arguments; allowed are no arguments, or three: "
        f"site, vehicle and start"
    )


def unwrapped(plug_in: Any) -> Any:
    """Returns the class or function inside ``functools.partial`` objects."""
    while isinstance(plug_in, functools.partial):
        plug_in = plug_in.func
    if isinstance(plug_in, types.MethodType) and isinstance(plug_in.__self__, type):
        return plug_in.__func__
    return plug_in


def _arguments(plug_in: Any) -> tuple[int, bool]:
    """Returns the number of required positional arguments, and whether ``*args`` exists."""
    try:
        parameters = inspect.signature(plug_in).parameters.values()
    except ValueError:  # a built-in function without signature
        return 1, False
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    required = [
        it for it in parameters if it.kind in positional and it.default is inspect.Parameter.empty
    ]
    return len(required), any(it.kind is inspect.Parameter.VAR_POSITIONAL for it in parameters)


def _shared(plug_in: Any, role: str) -> str:
    is_method = isinstance(plug_in, types.MethodType)
    name = type(plug_in.__self__ if is_method else plug_in).__name__
    what = "a method of an object" if is_method else "an object"
    return (
        f"the {role} is {what} of class {name}, which all runs and threads would share; "
        f"{_allowed(role, name)}"
    )


def _allowed(role: str, name: str) -> str:
    return (
        f"give a class or a function that makes one object per run: {role}={name} or "
        f"{role}=lambda: {name}(...)"
    )


def _state(function: Any) -> str | None:
    """Returns the way in which a function keeps state between calls; ``None`` if none is found."""
    code = getattr(function, "__code__", None)
    if code is None:
        return None
    instructions = [it for it in dis.get_instructions(code) if it.opname != "CACHE"]
    for it in instructions:
        if it.opname in ("STORE_GLOBAL", "DELETE_GLOBAL"):
            return f"writes the global variable {it.argval!r}"
        if it.opname in ("STORE_DEREF", "DELETE_DEREF") and it.argval in code.co_freevars:
            return f"writes the variable {it.argval!r} of the function around it"
    containers = dict(_containers(function))
    for index, it in enumerate(instructions):
        if not it.opname.startswith("LOAD_") or it.argval not in containers:
            continue
        after = instructions[index + 1 : index + 1 + NEARBY]
        is_called = after and after[0].opname in ("LOAD_ATTR", "LOAD_METHOD")
        if is_called and after[0].argval in MUTATORS:
            return f"changes the {type(containers[it.argval]).__name__} {it.argval!r}"
        if any(each.opname in ("STORE_SUBSCR", "DELETE_SUBSCR") for each in after):
            return f"changes the {type(containers[it.argval]).__name__} {it.argval!r}"
    return None


def _containers(function: Any) -> Iterator[tuple[str, Any]]:
    """Returns the containers of a function that persist between calls, by name."""
    outer = inspect.getclosurevars(function)
    defaults = inspect.signature(function).parameters.values()
    for name, value in (
        *outer.nonlocals.items(),
        *outer.globals.items(),
        *((it.name, it.default) for it in defaults),
    ):
        if isinstance(value, CONTAINERS):
            yield name, value
