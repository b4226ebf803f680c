"""Plug-ins that the command line names as ``FILE.py:NAME``."""

from __future__ import annotations

import hashlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

ROLES = ("estimator", "policy", "localizer")
_LOCK = Lock()


def load(role: str, text: str) -> Any:
    """Loads a class or function from a Python file; a file is executed once per content.

    Parameters
    ----------
    role
        ``estimator``, ``policy`` or ``localizer``, for messages.
    text
        ``FILE.py:NAME``, relative to the working directory.

    Raises
    ------
    InputError
        If the text has another form, the file cannot be executed, or the name is not defined.
    """
    file, _, name = text.rpartition(":")
    if not file.endswith(".py") or not name.isidentifier():
        raise InputError(
            f"{role} = {text}: write FILE.py:NAME of a class or function, for example mine.py:Mine"
        )
    path = Path(file)
    if not path.is_file():
        raise InputError(f"{role} = {text}: there is no file {file}")
    module_name = f"_access_av_plug_in_{checksum(text)[:16]}"
    with _LOCK:
        if module_name not in sys.modules:
            spec = spec_from_file_location(module_name, path)
            if spec is None or spec.loader is None:
                raise InputError(f"{role} = {text}: {file} cannot be imported")
            module = module_from_spec(spec)
            sys.modules[module_name] = module
            try:
                spec.loader.exec_module(module)
            except Exception as error:
                del sys.modules[module_name]
                raise InputError(
                    f"{role} = {text}: {file} fails with {type(error).__name__}: {error}"
                ) from error
    found = getattr(sys.modules[module_name], name, None)
    if not callable(found):
        raise InputError(f"{role} = {text}: {file} has no class or function {name}")
    return found


def checksum(text: str) -> str:
    """Returns the SHA-256 of the file of a plug-in."""
    return hashlib.sha256(Path(text.rpartition(":")[0]).read_bytes()).hexdigest()


def split(values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """Returns the settings, and the plug-ins by role; an empty text stands for no plug-in.

    Examples
    --------
    >>> split({"vehicle.platform.mode": 2, "policy": "mine.py:Mine", "estimator": ""})
    ({'vehicle.platform.mode': 2}, {'policy': 'mine.py:Mine'})
    """
    settings = {key: value for key, value in values.items() if key not in ROLES}
    plug_ins = {role: str(values[role]) for role in ROLES if values.get(role)}
    return settings, plug_ins
