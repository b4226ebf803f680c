"""A fault: what changes, when, and how its report and recovery are recognised."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np

    from attack.node.environment import Motion
    from attack.node.message import Message
    from attack.node.run import Recorded, Run
    from attack.node.samples import SampleChange


class Window(NamedTuple):
    """Begin and end of a fault in drive time (s)."""

    begin_s: float
    end_s: float

    def __contains__(self, time_s: object) -> bool:
        """Whether a time is within the window."""
        return isinstance(time_s, float) and self.begin_s <= time_s < self.end_s


class Context(NamedTuple):
    """Everything that a change of messages may depend on."""

    window: Window
    motion: Motion
    duration_s: float
    random: np.random.Generator


Change = Callable[["list[Message]", Context], "list[Message]"]
Action = Callable[["Run"], None]


@dataclass(frozen=True)
class Fault:
    """A fault type of the campaign."""

    name: str
    # Pattern of the event text or state reason that reports this fault; any state other than `ok`
    # is a report too, unless `by_event` is set.
    report: str
    lasts_s: float = 0.0
    # Change of the messages.
    change: Change | None = None
    # Actions at the begin and at the end of the fault.
    begin: Action | None = None
    end: Action | None = None
    # Whether the vehicle stands during the fault.
    stands: bool = False
    # Distance along the road at drive time 0 (m); drawn if `None`.
    starts_at_m: float | None = None
    # Whether only an event counts as a report: the pose is not affected.
    by_event: bool = False
    # Outputs other than JSON over TCP, MQTT and the page: `mcap`, `tum`, `fifo`, `disk`.
    outputs: tuple[str, ...] = ()
    # Whether the process is gone or stopped during the fault.
    stops_node: bool = False
    # Whether the pose must stay `ok` all the time.
    harmless: bool = False
    # Output that is interrupted: its recovery counts, and gaps of the others do.
    sink: str = ""
    # Whether a report is required, and the maximum time until then (s).
    reported: bool = True
    report_s: float = 2.0
    # Drive time before the fault beyond that of the campaign (s).
    further_s: float = 0.0
    # Width of the interval from which the begin is drawn (s).
    spread_s: float = 1.0
    # Minimum number of repetitions, as a multiple of the campaign's.
    repetitions: int = 1
    # Further violations that are found after the run.
    check: Callable[[Recorded], list[str]] | None = None
    # Change of the samples; such a fault is played back.
    samples: SampleChange | None = None
    # Pattern of withheld samples: whether they are, by the time since the begin of the fault (s).
    withheld: Callable[[float], bool] | None = None

    # Bound that the node is known to violate; the short campaign leaves such a fault out.
    shortfall: str = ""

    # Maximum time to the first SSB after withheld samples are back (s).
    reception_s: float | None = None

    @property
    def uses_samples(self) -> bool:
        """Whether the node processes samples, not angle messages."""
        return self.samples is not None or self.withheld is not None
