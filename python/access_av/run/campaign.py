"""Campaigns: many tasks that do not depend on one another, with results in parts on disk.

The content of a part does not depend on the computing process: threads, shards of an array job and
Dask workers give identical bytes. A repeated campaign continues after an interruption.
"""

from __future__ import annotations

import os
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from access_av.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from access_av.run.result_cache import ResultCache

# Number of pending tasks per worker, so that no worker is idle.
AHEAD = 4


class CampaignError(InputError):
    """Lost workers; finished parts are kept."""


@dataclass(frozen=True)
class Task:
    """One part of a campaign.

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
class Shard:
    """Part of a campaign that one of several jobs computes, counted from 1."""

    number: int = 1
    of: int = 1

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Reads a text such as ``2/8``.

        Raises
        ------
        InputError
            Invalid text.

        Examples
        --------
        >>> Shard.parse("2/8")
        Shard(number=2, of=8)
        """
        number, slash, of = text.partition("/")
        if slash and number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of):
            return cls(int(number), int(of))
        raise InputError(f"--shard {text}: write I/N with I from 1 to N, for example 2/8")

    def holds(self, index: int) -> bool:
        """Returns whether a task belongs to this job, by its index."""
        return index % self.of == self.number - 1


@dataclass(frozen=True)
class Campaign:
    """Storage and workers of a campaign.

    Attributes
    ----------
    executor
        Executor as in :mod:`concurrent.futures`; sequential if ``None``.
    workers
        Number of parallel tasks.
    """

    parts: ResultCache
    executor: Executor | None = None
    workers: int = 1
    shard: Shard = field(default_factory=Shard)

    def run(
        self, tasks: Sequence[Task], progress: Callable[[int, int], None] | None = None
    ) -> list[dict[str, NDArray[Any]] | None]:
        """Computes the missing parts.

        Parameters
        ----------
        tasks
            Tasks of the campaign.
        progress
            Called as ``progress(done, total)``.

        Returns
        -------
        list
            Parts in the order of the tasks; ``None`` if a part of another shard is missing.

        Raises
        ------
        CampaignError
            Lost workers.
        """
        found = [self.parts.read(task.depends_on) for task in tasks]
        missing = [
            index for index, part in enumerate(found) if part is None and self.shard.holds(index)
        ]
        done = len(tasks) - len(missing)
        for index, made in self._computed(tasks, missing):
            found[index] = self.parts.put(tasks[index].depends_on, made)
            done += 1
            if progress is not None:
                progress(done, len(tasks))
        return found

    def _computed(
        self, tasks: Sequence[Task], missing: Sequence[int]
    ) -> Iterator[tuple[int, Mapping[str, NDArray[Any]]]]:
        if self.executor is None:
            for index in missing:
                yield index, tasks[index].work(*tasks[index].arguments)
            return
        waiting = list(reversed(missing))
        running: dict[Future[Mapping[str, NDArray[Any]]], int] = {}
        try:
            while waiting or running:
                while waiting and len(running) < AHEAD * self.workers:
                    index = waiting.pop()
                    task = tasks[index]
                    running[self.executor.submit(task.work, *task.arguments)] = index
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    yield running.pop(future), future.result()
        except (Exception, CancelledError) as error:
            if not _is_of_workers(error):
                raise
            raise CampaignError(
                f"the workers are gone ({type(error).__name__}: {error}); what was finished is "
                f"kept in {self.parts.path}, the same command goes on from there"
            ) from error
        finally:
            for future in running:
                future.cancel()


def _is_of_workers(error: BaseException) -> bool:
    """Returns whether an error comes from the workers and not from the task."""
    by_dask = type(error).__module__.startswith(("distributed", "dask"))
    return by_dask or isinstance(error, (BrokenExecutor, CancelledError, ConnectionError))


@contextmanager
def executor(dask: str | None = None, threads: int | None = None) -> Iterator[tuple[Executor, int]]:
    """Yields workers and their number: of a Dask cluster by its address, otherwise threads.

    Raises
    ------
    InputError
        Scheduler not reachable, or Dask not installed.
    """
    if dask is None:
        cores = os.cpu_count() or 1
        count = min(threads or cores, cores)
        with ThreadPoolExecutor(count) as pool:
            yield pool, count
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("--dask needs the extra: pip install 'access-av[dask]'") from error
    try:
        client = Client(dask, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--dask {dask}: no scheduler there ({error})") from error
    with client:
        count = max(sum(client.nthreads().values()), 1)
        yield client.get_executor(pure=False), count
