"""Table of the fault types."""

from __future__ import annotations

import math
import signal

from attack.node import actions, changes, resume, samples
from attack.node.fault import Fault

ODOMETRY = r"odomet|speed|distance"
TIME = r"odomet|time|clock"
CHANNEL = r"channel|antenna|array"
# Maximum time to the report of a fault of the signal: 20 SSBs of a radio head (s).
SSBS_S = 20 * 0.02

FAULTS = (
    Fault("none", "", reported=False, harmless=True, lasts_s=5.0),
    # Odometry values.
    Fault(
        "odometry frozen at zero, vehicle drives",
        ODOMETRY,
        lasts_s=6.0,
        change=changes.odometry_steps(0.0, 0.0),
    ),
    Fault(
        "odometry frozen at its speed, vehicle stops",
        ODOMETRY,
        lasts_s=6.0,
        change=changes.odometry_steps(None, None),
        stands=True,
    ),
    Fault("odometry reversed", ODOMETRY, lasts_s=5.0, change=changes.odometry_steps(-1.0, -1.0)),
    Fault(
        "distance frozen, speed right",
        ODOMETRY,
        lasts_s=5.0,
        change=changes.odometry_steps(1.0, 0.0),
    ),
    Fault(
        "distance half of the integrated speed",
        ODOMETRY,
        lasts_s=5.0,
        change=changes.odometry_steps(1.0, 0.5),
    ),
    Fault(
        "one speed of 1e6 m/s",
        ODOMETRY,
        change=changes.one("odometry", speed_mps=1e6, time_s=lambda it: it - 0.01),
        by_event=True,
    ),
    Fault(
        "NaN, null and infinite speeds", "odomet|messages", lasts_s=4.0, change=changes.nan_fields
    ),
    # A tyre was changed, or another wheel radius was configured; the filter estimates the scale.
    Fault(
        "odometry 10 % too long",
        ODOMETRY,
        lasts_s=6.0,
        change=changes.odometry_steps(1.1, 1.1),
        reported=False,
        shortfall="recovery: the scale is estimated again only slowly after the fault",
    ),
    # The fault begins at most 5 m before or after the begin of a bend. Without the further drive
    # time, the state is not `ok` there in one of ten runs without a fault.
    Fault(
        "yaw rate with the wrong sign in a bend",
        "",
        lasts_s=6.0,
        change=changes.yaw_rate(lambda it: -it),
        reported=False,
        starts_at_m=86.0,
        further_s=4.0,
    ),
    Fault(
        "yaw rate stuck at 0.3 rad/s",
        "",
        lasts_s=6.0,
        change=changes.yaw_rate(lambda _: 0.3),
        reported=False,
    ),
    Fault(
        "yaw rate stuck at 0.1 rad/s",
        "",
        lasts_s=6.0,
        change=changes.yaw_rate(lambda _: 0.1),
        reported=False,
        shortfall="recovery: not ok within 7 s in 3 of 10 runs",
    ),
    Fault(
        "yaw rate too small by 0.1 rad/s",
        "",
        lasts_s=6.0,
        change=changes.yaw_rate(lambda it: it - 0.1),
        reported=False,
        shortfall="recovery: not ok within 5 s in most runs",
    ),
    Fault(
        "two odometry sources with different counters",
        ODOMETRY,
        lasts_s=6.0,
        change=changes.second_source,
    ),
    # Angle values.
    Fault(
        "angles stuck at their values, vehicle drives",
        "angle|odomet",
        lasts_s=6.0,
        change=changes.stuck_angles,
    ),
    Fault(
        "NaN as the sigma of every second angle",
        "angle|messages|sigma",
        lasts_s=4.0,
        change=changes.angle_values(lambda it: {**it, "phase_sigma_rad": math.nan}, every=2),
        by_event=True,
        harmless=True,
    ),
    Fault(
        "SSB index of another beam in all angles",
        "head|cell|PCI|angle",
        lasts_s=6.0,
        change=changes.angle_values(lambda it: {**it, "ssb_index": it["ssb_index"] + 8}),
    ),
    # Time stamps.
    Fault(
        "clock of the angles behind by 0.2 s",
        TIME + "|angle",
        lasts_s=6.0,
        change=changes.angle_values(lambda it: {**it, "time_s": it["time_s"] - 0.2}),
        reported=False,
    ),
    Fault(
        "one odometry message repeated 5 times a second",
        TIME,
        lasts_s=5.0,
        change=changes.repeated,
        by_event=True,
        harmless=True,
    ),
    Fault("odometry stuck at one message", TIME, lasts_s=5.0, change=changes.stuck),
    Fault(
        "one odometry message 2 s in the future",
        TIME,
        change=changes.one("odometry", time_s=lambda it: it + 2.0),
        by_event=True,
        harmless=True,
    ),
    Fault(
        "one odometry message at 1e300 s",
        TIME,
        change=changes.one("odometry", time_s=1e300),
        by_event=True,
        harmless=True,
    ),
    Fault(
        "one angle at 1e300 s",
        r"angle|time",
        change=changes.one("angle", time_s=1e300),
        by_event=True,
        harmless=True,
    ),
    Fault(
        "one angle 2 s in the future",
        r"angle|time",
        change=changes.one("angle", time_s=lambda it: it + 2.0),
        by_event=True,
        harmless=True,
    ),
    Fault("odometry time in milliseconds", TIME, lasts_s=5.0, change=changes.milliseconds),
    Fault("odometry clock back by 5 s", TIME, lasts_s=6.0, change=changes.shifted_clock(-5.0)),
    Fault("odometry clock ahead by 60 s", TIME, lasts_s=6.0, change=changes.shifted_clock(60.0)),
    # Absent messages.
    Fault("odometry absent for 8 s", ODOMETRY, lasts_s=8.0, change=changes.absent("odometry")),
    Fault("angles absent for 6 s", "angle", lasts_s=6.0, change=changes.absent("angle")),
    Fault("all messages absent for 8 s", "nothing|no ", lasts_s=8.0, change=changes.absent(None)),
    # Radio heads.
    # `degraded` is correct where the other three do not keep the level below the alert limit.
    Fault(
        "three of six radio heads off",
        "",
        lasts_s=6.0,
        change=changes.heads_off(3),
        reported=False,
    ),
    Fault(
        "SIGHUP with a radio head 30 m off its position",
        "again|reload",
        lasts_s=6.0,
        begin=actions.move_head,
        end=actions.move_head_back,
        reported=False,
    ),
    Fault(
        "radio head off the site",
        "99|cell|head",
        lasts_s=5.0,
        change=changes.extra_head(changes.STRANGER, 6),
        by_event=True,
        harmless=True,
    ),
    Fault(
        "one PCI used by two radio heads",
        "PCI|head|cell",
        lasts_s=5.0,
        change=changes.extra_head(changes.DUPLICATE, 1),
    ),
    # The gate rejects these angles; only the count of rejected angles of the head shows it.
    Fault(
        "angles of one head off by 0.5 rad",
        "",
        lasts_s=5.0,
        change=changes.biased_head,
        reported=False,
        harmless=True,
    ),
    # Bytes and connections.
    Fault(
        "random bytes on the message socket",
        "messages|left out|line",
        lasts_s=4.0,
        change=changes.garbage,
        by_event=True,
    ),
    Fault(
        "random bytes on page and JSON sockets",
        "",
        begin=actions.garbage_everywhere,
        reported=False,
        harmless=True,
    ),
    Fault(
        "message of 1 MB",
        "long|bytes|ignored",
        lasts_s=2.0,
        change=changes.raw(b"x" * changes.OVERSIZE + b"\n", 1.0),
        by_event=True,
        harmless=True,
    ),
    Fault("every fifth message cut off", "messages|ignored", lasts_s=4.0, change=changes.truncated),
    Fault(
        "message connection closed 10 times",
        "ended|connect|messages",
        lasts_s=4.0,
        begin=actions.reconnect,
    ),
    # Process.
    Fault(
        "SIGKILL at a random time, restart after 1 s",
        "begin|start|resume",
        lasts_s=1.0,
        begin=actions.kill,
        end=actions.start,
        stops_node=True,
        outputs=("mcap",),
        spread_s=8.0,
        repetitions=3,
        check=resume.check,
    ),
    Fault(
        "process stopped for 3 s",
        "",
        lasts_s=3.0,
        begin=actions.stop,
        end=actions.resume,
        stops_node=True,
    ),
    Fault(
        "SIGHUP with an invalid site file",
        "site|period",
        lasts_s=3.0,
        begin=actions.break_site,
        end=actions.restore_site,
        by_event=True,
        harmless=True,
    ),
    Fault(
        "SIGHUP with valid files",
        "again|reload",
        begin=lambda run: run.node.signal(signal.SIGHUP),
        reported=False,
    ),
    # Outputs.
    Fault(
        "disk full under MCAP",
        "mcap|space|disk",
        lasts_s=4.0,
        begin=actions.fill_disk,
        end=actions.empty_disk,
        outputs=("mcap", "disk"),
        sink="mcap",
        by_event=True,
        harmless=True,
    ),
    Fault(
        "disk full under TUM",
        "tum|space|disk",
        lasts_s=4.0,
        begin=actions.fill_disk,
        end=actions.empty_disk,
        outputs=("tum", "disk"),
        sink="tum",
        by_event=True,
        harmless=True,
    ),
    Fault(
        "log folder removed",
        "mcap|log|file|folder",
        begin=actions.remove_logs,
        outputs=("mcap", "disk"),
        sink="mcap",
        by_event=True,
        harmless=True,
    ),
    Fault(
        "reader of the JSON output closed",
        "json|pipe",
        lasts_s=4.0,
        begin=actions.call("close-json"),
        end=actions.call("open-json"),
        outputs=("fifo",),
        sink="json",
        by_event=True,
        harmless=True,
    ),
    Fault(
        "MQTT broker gone for 4 s",
        "mqtt|broker",
        lasts_s=4.0,
        begin=actions.call("kill-broker"),
        end=actions.call("restart-broker"),
        sink="mqtt",
        by_event=True,
        harmless=True,
    ),
    # Samples.
    Fault(
        "samples played back unchanged",
        "",
        4.0,
        samples=lambda *_: None,
        reported=False,
        harmless=True,
    ),
    Fault(
        "one channel without signal",
        CHANNEL,
        4.0,
        samples=samples.dead_channel,
        by_event=True,
        report_s=SSBS_S,
    ),
    Fault("one channel of noise", CHANNEL, 4.0, samples=samples.noisy_channel, report_s=SSBS_S),
    Fault(
        "two channels exchanged",
        CHANNEL,
        4.0,
        samples=samples.exchanged_channels,
        by_event=True,
        report_s=SSBS_S,
    ),
    Fault(
        "one channel inverted",
        CHANNEL,
        4.0,
        samples=samples.inverted_channel,
        by_event=True,
        report_s=SSBS_S,
    ),
    Fault(
        "PCI of a second radio head in the samples",
        "PCI",
        4.0,
        samples=samples.duplicate_pci,
        by_event=True,
        report_s=SSBS_S,
    ),
    Fault(
        "samples absent for 6 s", "samples|SSB|angle", 6.0, withheld=lambda _: True, reception_s=1.0
    ),
    Fault(
        "30 ms of samples lost twice a second",
        "samples|missing",
        4.0,
        withheld=lambda since_s: since_s % 0.5 < 0.03,
    ),
)
