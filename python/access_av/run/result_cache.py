"""Results in parts on disk, so that what was stopped goes on.

A part is named after everything that it depends on, and put in place whole: a part that is there is
right, whoever computed it and when. Several campaigns may share a directory.
"""

from __future__ import annotations

import hashlib
import io
import json
import warnings
import zipfile
import zlib
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.tables.results_directory import write_whole

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
        held = self.read(depends_on)
        return self.put(depends_on, compute()) if held is None else held

    def read(self, depends_on: Any) -> dict[str, NDArray[Any]] | None:
        """A part from disk; ``None`` where there is none, or it is damaged, which is said."""
        file = self._file(depends_on)
        if not file.is_file():
            return None
        try:
            # A file checks itself: its arrays carry their CRC-32.
            with file.open("rb") as opened, np.load(opened) as held:
                return {name: held[name] for name in held.files}
        except (ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error) as error:
            warnings.warn(f"{file}: damaged ({error}); it is computed again", stacklevel=2)
            return None

    def put(self, depends_on: Any, made: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Keep a part, whole or not at all.

        Raises
        ------
        OSError
            When it cannot be written; names the part, and leaves nothing of it.
        """
        target = self._file(depends_on)
        held = io.BytesIO()
        np.savez_compressed(held, **made)  # type: ignore[arg-type]
        self.path.mkdir(parents=True, exist_ok=True)
        write_whole(target, held.getbuffer(), durable=True)
        return dict(made)

    def _file(self, depends_on: Any) -> Path:
        text = json.dumps([version("access-av"), depends_on], sort_keys=True)
        return self.path / f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
