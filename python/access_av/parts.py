"""Results in parts on disk, so that what was stopped goes on.

A part is named after everything that it depends on, and put in place whole: a part that is there is
right, whoever computed it and when.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray


@dataclass(frozen=True)
class Parts:
    """A directory of parts: arrays by name, one file each."""

    path: Path

    def get(
        self, depends_on: Any, compute: Callable[[], Mapping[str, NDArray[Any]]]
    ) -> dict[str, NDArray[Any]]:
        """A part from disk, or else computed and kept.

        Parameters
        ----------
        depends_on
            Everything that the part's numbers depend on, as plain values.
        compute
            Makes it.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> parts = Parts(Path(tempfile.mkdtemp()))
        >>> for _ in range(2):
        ...     part = parts.get({"seed": 1}, lambda: print("computed") or {"x": np.arange(2)})
        computed
        >>> part["x"].tolist()
        [0, 1]
        """
        text = json.dumps([version("access-av"), depends_on], sort_keys=True)
        target = self.path / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
        if not target.is_file():
            self.path.mkdir(parents=True, exist_ok=True)
            made = compute()
            partial = target.with_suffix(f".{os.getpid()}.partial")
            with partial.open("wb") as file:
                np.savez_compressed(file, **made)  # type: ignore[arg-type]
            partial.replace(target)
        with np.load(target) as held:
            return {name: held[name] for name in held.files}
