"""Results in parts on disk, so that an interrupted campaign continues.

The name of a part is a hash of everything that it depends on, and parts are written atomically.
An existing part is therefore valid. Several campaigns may share a directory.
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
class ResultCache:
    """A directory of parts: arrays by name, one file each."""

    path: Path

    def get(
        self, depends_on: Any, compute: Callable[[], Mapping[str, NDArray[Any]]]
    ) -> dict[str, NDArray[Any]]:
        """Reads a part, or computes and stores it.

        Parameters
        ----------
        depends_on
            Everything that the part's numbers depend on, as plain values.
        compute
            Computes the part.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> parts = ResultCache(Path(tempfile.mkdtemp()))
        >>> for _ in range(2):
        ...     part = parts.get({"seed": 1}, lambda: print("computed") or {"x": np.arange(2)})
        computed
        >>> part["x"].tolist()
        [0, 1]
        """
        held = self.read(depends_on)
        return self.put(depends_on, compute()) if held is None else held

    def read(self, depends_on: Any) -> dict[str, NDArray[Any]] | None:
        """Reads a part; ``None`` if it is missing or damaged (with a warning)."""
        file = self.path / self.name(depends_on)
        if not file.is_file():
            return None
        try:
            # The arrays of a file contain a CRC-32.
            with file.open("rb") as opened, np.load(opened) as held:
                return {name: held[name] for name in held.files}
        except (ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error) as error:
            warnings.warn(f"{file}: damaged ({error}); it is computed again", stacklevel=2)
            return None

    def put(self, depends_on: Any, made: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Stores a part atomically.

        Raises
        ------
        OSError
            Write error; the message names the part, and no file remains.
        """
        target = self.path / self.name(depends_on)
        held = io.BytesIO()
        np.savez_compressed(held, **made)  # type: ignore[arg-type]
        self.path.mkdir(parents=True, exist_ok=True)
        write_whole(target, held.getbuffer(), durable=True)
        return dict(made)

    @staticmethod
    def name(depends_on: Any) -> str:
        """Returns the file name of a part."""
        text = json.dumps([version("access-av"), depends_on], sort_keys=True)
        return f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
