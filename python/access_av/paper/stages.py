"""Progress over stages whose costs are known before the first one runs."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence


@dataclass
class Stages:
    """Progress over stages; the total does not change.

    Attributes
    ----------
    costs
        Cost of each stage, in the order in which they run.
    report
        Called as ``report(done, total)`` with costs.
    completed
        Number of completed stages.
    """

    costs: Sequence[int]
    report: Callable[[int, int], None] | None = None
    completed: int = 0

    @contextmanager
    def stage(self) -> Iterator[Callable[[int, int], None]]:
        """Yields the progress function of the next stage, ``(done, total)`` in any unit.

        The stage is complete at the end of the context, also if an exception leaves it.
        """
        before, cost = sum(self.costs[: self.completed]), self.costs[self.completed]

        def tick(done: int, of: int) -> None:
            if self.report is not None:
                self.report(before + cost * min(done, of) // of, sum(self.costs))

        try:
            yield tick
        finally:
            tick(1, 1)
            self.completed += 1
