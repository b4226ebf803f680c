"""Short fault campaign: one run of each fault."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from attack.node import campaign
from attack.node.faults import FAULTS
from attack.node.node import PROGRAM, has_small_disk

if TYPE_CHECKING:
    from pathlib import Path

# Seed of the short campaign, so that its runs are reproducible.
SEED = 1
# Number of simultaneous nodes; a run waits most of the time.
AT_ONCE = 12
# Further runs of a fault that violated a bound; none may violate it again.
REPEATED = 2

pytestmark = pytest.mark.skipif(
    not PROGRAM.exists(), reason=f"no {PROGRAM}: `cargo build -p access-av-node` makes it"
)


def test_every_fault_is_reported_and_recovered_from_within_its_bounds(tmp_path: Path) -> None:
    small_disk = has_small_disk()
    # Faults of recordings are part of the full campaign only, because synthesis takes longer than
    # all runs. Faults with a known shortfall (docs/node.md) are left out, too.
    chosen = [
        replace(it, repetitions=1)
        for it in FAULTS
        if not (it.uses_samples or it.shortfall) and (small_disk or "disk" not in it.outputs)
    ]
    verdicts = campaign.run_all(chosen, SEED, 1, AT_ONCE, tmp_path / "first")
    # The computer may pause the node and not the test: a violation counts if it occurs again
    # when fewer nodes run.
    violated = {it.fault for it in verdicts if it.violations and not it.was_busy}
    if violated:
        again = [it for it in chosen if it.name in violated]
        verdicts = [it for it in verdicts if it.fault not in violated]
        verdicts += campaign.run_all(again, SEED, REPEATED, AT_ONCE // 4, tmp_path / "again")
    too_busy = [it.fault for it in verdicts if it.was_busy]
    wrong = {it.fault: it.violations for it in verdicts if it.violations and not it.was_busy}
    assert not wrong
    # Single runs may be invalid on a loaded computer.
    assert len(too_busy) <= len(chosen) // 4, too_busy
