"""Verdict of a run: detection, wrong integrity, recovery, and the bounds they must keep."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from attack.node.environment import ALERT_LIMIT_M

if TYPE_CHECKING:
    from attack.node.recorder import Arrival
    from attack.node.run import Recorded

# Required maxima: `ok` beyond the level (s), time to recovery (s).
WRONG_OK_S = 1.0
RECOVERY_S = 5.0
# Maximum gap of an output that has no fault (s).
GAP_S = 1.0
# Growth of the resident memory that counts as a leak (MiB), and of open files.
LEAK_MIB = 24.0
LEAK_FILES = 4
# A pose stands until the next one, but for this long at most (s).
STANDS_S = 1.1
# A pose time that differs more from its arrival is not trusted: the error counts at arrival (s).
TRUSTED_S = 0.5
# Duration of undisturbed poses before the fault that must be `ok` (s).
BASELINE_S = 2.0
# Tolerance of scheduling and of the sampling of outputs (s).
TOLERANCE_S = 0.15
# A run counts if every message is sent and received within this time (s).
LATENESS_S = 0.25


@dataclass
class Verdict:
    """Figures of one run; times in seconds, `None` where there is none."""

    fault: str
    report_s: float | None = None
    wrong_ok_s: float = 0.0
    recovery_s: float | None = None
    # From the return of absent samples to the first received SSB.
    reception_s: float | None = None
    localized_above_limit_s: float = 0.0
    max_error_ok_m: float = 0.0
    json_gap_s: float | None = None
    mqtt_gap_s: float | None = None
    growth_mib: float | None = None
    lateness_s: float = 0.0
    reported_by: str = ""
    # Violated bounds.
    violations: list[str] = field(default_factory=list)

    @property
    def was_busy(self) -> bool:
        """Whether the computer was too busy for the run to count."""
        return self.lateness_s > LATENESS_S

    def to_json(self) -> dict[str, Any]:
        """As a JSON object."""
        return asdict(self)


@dataclass(frozen=True)
class PosePoint:
    """A pose as a client of the node receives it."""

    at_s: float
    state: str
    error_m: float
    level_m: float | None

    @property
    def is_wrong(self) -> bool:
        """Whether the state is `ok` and the error exceeds the protection level."""
        return self.state == "ok" and (self.level_m is None or self.error_m > self.level_m)

    @property
    def is_good(self) -> bool:
        """Whether the state is `ok` and the protection level holds."""
        return self.state == "ok" and not self.is_wrong


def _points(run: Recorded) -> list[PosePoint]:
    """Poses of the JSON output, or of the page where JSON is under test."""
    points = []
    for at_s, output, content in run.arrivals:
        if output == "json" and run.fault.sink != "json":
            if content.get("type") not in ("pose", "status"):
                continue
            pose = content
        elif output == "page" and run.fault.sink == "json":
            pose = content.get("pose", {})
        else:
            continue
        time_s = pose.get("time_s")
        if time_s is None or abs(time_s - at_s) > TRUSTED_S:
            time_s = at_s
        error_m = math.inf
        if pose.get("x_m") is not None and pose.get("y_m") is not None:
            truth = run.motion.pose(time_s - run.epoch_s)
            error_m = math.hypot(pose["x_m"] - truth.x_m, pose["y_m"] - truth.y_m)
        level_m = pose.get("protection_level_m")
        points.append(PosePoint(at_s, pose.get("state", ""), error_m, level_m))
    return points


def _gap_s(times_s: list[float], begin_s: float, end_s: float) -> float:
    """Longest time without an item between two times."""
    within = [begin_s, *(it for it in times_s if begin_s <= it <= end_s), end_s]
    return max(b - a for a, b in pairwise(within))


def _localized_gap_s(run: Recorded, begin_s: float, end_s: float) -> float:
    """Longest time for which the last MQTT message said `localized: true` (s).

    A vehicle that is not localized stands still, so that further messages are not needed.
    """
    messages = [(it.at_s, it.content) for it in run.arrivals if it.output == "mqtt"]
    ends_s = [at_s for at_s, _ in messages[1:]] + [end_s]
    gaps_s = [
        min(until_s, end_s) - max(at_s, begin_s)
        for (at_s, content), until_s in zip(messages, ends_s, strict=True)
        if content.get("localized")
    ]
    return max([*gaps_s, 0.0]) if messages else end_s - begin_s


def _texts(item: Arrival) -> list[tuple[str, bool]]:
    """Texts by which an item may report a fault, and whether each is an event."""
    content = item.content
    if item.output == "json" and content.get("type") == "event":
        return [(f"{content.get('source')}: {content.get('text')}", content["level"] != "info")]
    if item.output == "page":
        return [
            (f"{it.get('source')}: {it.get('text')}", it.get("level") != "info")
            for it in content.get("events", [])
        ]
    return []


def _report(run: Recorded, since_s: float) -> tuple[float | None, str]:
    """Time (s) from `since_s` to the first report, and its text."""
    fault = run.fault
    pattern = re.compile(fault.report, re.IGNORECASE)
    seen = {
        text
        for item in run.arrivals
        if item.at_s < since_s and item.output == "page"
        for text, _ in _texts(item)
    }
    for item in run.arrivals:
        if item.at_s < since_s:
            continue
        for text, is_event in _texts(item):
            is_known = item.output == "page" and text in seen
            if (is_event or fault.stops_node) and not is_known and pattern.search(text):
                return item.at_s - since_s, text
        if fault.by_event:
            continue
        content = item.content
        if item.output == "json" and content.get("type") in ("pose", "status"):
            state = content.get("state")
            if state != "ok":
                return item.at_s - since_s, f"{state}: {content.get('reason')}"
        if item.output == "mqtt" and content.get("localized") is False:
            return item.at_s - since_s, "localized: false"
    return None, ""


def _localized_above_limit_s(run: Recorded) -> float:
    """Time for which MQTT said `localized: true` above the alert limit (s).

    A message counts by its protection level; by the true error of its position it counts only
    beyond `WRONG_OK_S` in total, which is the time that a fault may stay unknown.
    """
    messages = [it for it in run.arrivals if it.output == "mqtt"]
    total_s, wrong_s = 0.0, 0.0
    for index, (at_s, _, content) in enumerate(messages):
        if not content.get("localized"):
            continue
        next_s = messages[index + 1].at_s if index + 1 < len(messages) else run.ended_s
        stands_s = min(next_s - at_s, STANDS_S)
        truth = run.motion.pose(at_s - run.epoch_s)
        if content.get("deviationRange", 0.0) > ALERT_LIMIT_M:
            total_s += stands_s
        elif math.hypot(content["x"] - truth.x_m, content["y"] - truth.y_m) > ALERT_LIMIT_M:
            wrong_s += stands_s
    return total_s + max(0.0, wrong_s - WRONG_OK_S)


def judge(run: Recorded) -> Verdict:
    """Verdict of a run."""
    fault = run.fault
    begin_s, end_s = run.epoch_s + run.window.begin_s, run.epoch_s + run.window.end_s
    verdict = Verdict(fault.name, lateness_s=run.lateness_s)
    violate = verdict.violations.append
    if verdict.was_busy:
        violate(f"computer too busy: messages were sent or received {run.lateness_s:.1f} s late")
    points = _points(run)

    before = [it for it in points if begin_s - BASELINE_S <= it.at_s < begin_s]
    if not before or not all(it.is_good for it in before):
        states = sorted({it.state for it in before})
        violate(f"baseline: not ok before the fault ({', '.join(states) or 'no pose'})")

    # Report.
    if fault.reported:
        # A stopped process reports nothing: the time counts from its continuation.
        since_s = end_s if fault.stops_node and fault.name.startswith("process") else begin_s
        verdict.report_s, verdict.reported_by = _report(run, since_s)
        if verdict.report_s is None:
            violate("not reported")
        elif verdict.report_s > fault.report_s + TOLERANCE_S:
            violate(f"reported after {verdict.report_s:.1f} s")
    elif fault.harmless and fault.change is fault.begin is None:
        seconds, text = _report(run, begin_s)
        if seconds is not None:
            violate(f"false report: {text}")

    # Wrong integrity.
    for point, after in pairwise([*points, PosePoint(run.ended_s, "", 0.0, None)]):
        if point.is_wrong and point.at_s >= begin_s - BASELINE_S:
            verdict.wrong_ok_s += min(after.at_s - point.at_s, STANDS_S)
        if point.state == "ok" and point.at_s >= begin_s and math.isfinite(point.error_m):
            verdict.max_error_ok_m = max(verdict.max_error_ok_m, point.error_m)
    if verdict.wrong_ok_s > WRONG_OK_S:
        violate(f"ok beyond the level for {verdict.wrong_ok_s:.1f} s")

    # Harmless faults leave the state as it was.
    if fault.harmless:
        bad = [it for it in points if it.at_s >= begin_s and not it.is_good]
        if bad:
            violate(f"pose affected: {bad[0].state} after {bad[0].at_s - begin_s:.1f} s")

    # Recovery.
    last_bad_s = max((it.at_s for it in points if not it.is_good), default=begin_s)
    following = [it.at_s for it in points if it.is_good and it.at_s > max(last_bad_s, end_s)]
    if following and run.ended_s - following[0] >= 1.0:
        verdict.recovery_s = following[0] - end_s
    if fault.reception_s is not None:
        verdict.reception_s = _reception_s(run, end_s)
        if verdict.reception_s is None:
            violate("no SSB received after the fault")
        elif verdict.reception_s > fault.reception_s + TOLERANCE_S:
            violate(f"first SSB received after {verdict.reception_s:.1f} s")
    if fault.sink:
        recovered = _sink_recovery_s(run, end_s)
        verdict.recovery_s = recovered
    if verdict.recovery_s is None:
        violate("not recovered")
    elif verdict.recovery_s > RECOVERY_S + TOLERANCE_S:
        violate(f"recovered after {verdict.recovery_s:.1f} s")

    # Localized.
    verdict.localized_above_limit_s = _localized_above_limit_s(run)
    if verdict.localized_above_limit_s > 0.0:
        violate(f"localized above the alert limit for {verdict.localized_above_limit_s:.1f} s")

    _judge_outputs(run, verdict, begin_s)
    _judge_process(run, verdict)
    if fault.check is not None:
        verdict.violations += fault.check(run)
    return verdict


def _reception_s(run: Recorded, end_s: float) -> float | None:
    """Time from the end of the fault to the first received SSB (s)."""
    verdicts = (it for it in run.arrivals if it.content.get("type") == "verdict")
    times_s = (it.at_s for it in verdicts if it.content["time_s"] > end_s)
    return next((it - end_s for it in times_s), None)


def _sink_recovery_s(run: Recorded, end_s: float) -> float | None:
    """Time from the end of the cause to the first item of the sink under test (s)."""
    if run.fault.sink in ("json", "mqtt"):
        times_s = [it.at_s for it in run.arrivals if it.output == run.fault.sink]
    else:
        times_s = run.sink_works_s
    return next((it - end_s for it in times_s if it > end_s), None)


def _judge_outputs(run: Recorded, verdict: Verdict, begin_s: float) -> None:
    """Gaps of the outputs that have no fault."""
    fault = run.fault
    # The pose comes with odometry: its gaps count while the node has input.
    until_s = begin_s if fault.stops_node else run.ended_s
    from_s = begin_s - BASELINE_S
    for name in ("json", "mqtt"):
        # A playback has no MQTT output.
        if fault.sink == name or (name == "mqtt" and fault.samples is not None):
            continue
        if name == "json":
            times_s = [it.at_s for it in run.arrivals if it.output == name]
            verdict.json_gap_s = gap_s = _gap_s(times_s, from_s, until_s)
        else:
            verdict.mqtt_gap_s = gap_s = _localized_gap_s(run, from_s, until_s)
        has_odometry = not re.search("absent|stuck|back|ahead|milli|closed 10|NaN", fault.name)
        limit_s = GAP_S if has_odometry else 2.0
        if gap_s > limit_s + TOLERANCE_S:
            violate = verdict.violations.append
            violate(f"gap of {gap_s:.1f} s in {name}")


def _judge_process(run: Recorded, verdict: Verdict) -> None:
    """Crash, hang and leak."""
    violate = verdict.violations.append
    if run.exits:
        last = run.errors.strip().splitlines()[-1:] or [""]
        violate(f"process ended with {run.exits[0]}: {last[0][:120]}")
    if run.is_hung:
        violate("process does not end after SIGTERM")
    if "panicked" in run.errors:
        violate("panic")
    before, after = [*run.resources, None, None][:2]
    if before is None or after is None or run.fault.stops_node:
        return
    verdict.growth_mib = after.resident_mib - before.resident_mib
    if verdict.growth_mib > LEAK_MIB:
        violate(f"memory grew by {verdict.growth_mib:.0f} MiB")
    if after.files - before.files > LEAK_FILES:
        violate(f"{after.files - before.files} more open files")
