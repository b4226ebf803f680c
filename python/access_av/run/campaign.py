"""Campaigns: independent tasks, computed by any executor, with results in parts on disk.

The content of a part does not depend on the executor: threads, processes and cluster workers give
identical bytes. The name of a part is a hash of everything that it depends on, and parts are
written atomically. Therefore an existing part is valid, a repeated campaign continues after an
interruption, and several campaigns may share a directory.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import warnings
import zipfile
import zlib
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    as_completed,
)
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from access_av.errors import InputError
from access_av.run.plug_in_files import load
from access_av.tables.results_directory import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray


@dataclass(frozen=True)
class ResultCache:
    """A directory of parts: arrays by name, one file each.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> parts = ResultCache(Path(tempfile.mkdtemp()))
    >>> _ = parts.put({"seed": 1}, {"x": np.arange(2)})
    >>> parts.read({"seed": 1})["x"].tolist(), parts.read({"seed": 2})
    ([0, 1], None)
    """

    path: Path

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


class CampaignError(InputError):
    """Workers of a campaign have ended; finished parts are kept."""


@dataclass(frozen=True)
class Task:
    """One independent computation of a campaign, whose results are one file.

    Attributes
    ----------
    depends_on
        Everything that its numbers depend on, as plain values.
    work, arguments
        ``work(*arguments)`` computes it; both can be pickled.
    """

    depends_on: Any
    work: Callable[..., Mapping[str, NDArray[Any]]]
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Campaign:
    """Storage and executor of a campaign; without an executor, tasks run one after the other."""

    parts: ResultCache
    executor: Executor | None = None

    def run(
        self, tasks: Sequence[Task], progress: Callable[[int, int], None] | None = None
    ) -> list[dict[str, NDArray[Any]]]:
        """Returns the parts in the order of the tasks; computes missing ones, equal ones once.

        Parameters
        ----------
        tasks
            Tasks of the campaign.
        progress
            Called as ``progress(done, total)``.

        Raises
        ------
        CampaignError
            Lost workers.
        """
        names = [self.parts.name(task.depends_on) for task in tasks]
        different = dict(zip(names, tasks, strict=True))
        found = {name: self.parts.read(it.depends_on) for name, it in different.items()}
        missing = {name: different[name] for name, part in found.items() if part is None}
        done = len(different) - len(missing)
        for name, made in self._computed(missing):
            found[name] = self.parts.put(different[name].depends_on, made)
            done += 1
            if progress is not None:
                progress(done, len(different))
        return [part for name in names if (part := found[name]) is not None]

    def _computed(
        self, missing: Mapping[str, Task]
    ) -> Iterator[tuple[str, Mapping[str, NDArray[Any]]]]:
        if self.executor is None:
            for name, task in missing.items():
                yield name, task.work(*task.arguments)
            return
        running: dict[Future[Mapping[str, NDArray[Any]]], str] = {}
        lost: BaseException | None = None
        try:
            for name, task in missing.items():
                try:
                    future = self.executor.submit(task.work, *task.arguments)
                except BrokenExecutor as error:
                    lost = error
                    break
                running[future] = name
            for future in as_completed(list(running)):
                name = running.pop(future)
                try:
                    made = future.result()
                except (Exception, CancelledError) as error:
                    if not _is_of_workers(error):
                        raise
                    # Keep what other workers have finished.
                    lost = error
                    continue
                yield name, made
        finally:
            for future in running:
                future.cancel()
        if lost is not None:
            raise CampaignError(
                f"the workers have ended ({type(lost).__name__}: {lost}); finished parts "
                f"are in {self.parts.path}; repeat the command to continue"
            ) from lost


def _is_of_workers(error: BaseException) -> bool:
    """Returns whether an error comes from the workers and not from the task."""
    by_cluster = type(error).__module__.startswith(("distributed", "dask", "executorlib"))
    return by_cluster or isinstance(error, (BrokenExecutor, CancelledError, ConnectionError))


@contextmanager
def campaign(
    path: Path, factory: str | None = None, threads: int | None = None
) -> Iterator[Campaign]:
    """Yields a campaign whose executor is shut down at the end.

    Parameters
    ----------
    path
        Folder of the parts.
    factory
        ``FILE.py:NAME`` of a function that returns a :class:`concurrent.futures.Executor`. Default:
        threads.
    threads
        Maximum number of threads. Default: one per core.

    Raises
    ------
    InputError
        The file, the function or its result is unusable, or the cluster cannot be reached.
    """
    cores = os.cpu_count() or 1
    if factory is None:
        pool: Any = ThreadPoolExecutor(min(threads or cores, cores))
    else:
        try:
            pool = load("--executor", factory)()
        except InputError:
            raise
        except Exception as error:
            raise InputError(f"--executor {factory}: {type(error).__name__}: {error}") from error
        if not isinstance(pool, Executor):
            raise InputError(
                f"--executor {factory}: returns {type(pool).__name__}; it must return a "
                "concurrent.futures.Executor"
            )
    with pool:
        yield Campaign(ResultCache(path), pool)
