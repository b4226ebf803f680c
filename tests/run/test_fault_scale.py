"""Multiples of the standard deviations in fault hypotheses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from access_av import Scenario
from access_av.run.fault_injection import hypotheses

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Finished


def test_the_fault_grows_with_its_scale() -> None:
    scenario = Scenario.load("yard")
    key = "truth.vehicle.array.mounting_rad"
    nominal_rad = 0.0
    one, two = (
        hypotheses(scenario, [scale])[f"array mounting x {scale:g}"][key] for scale in (1.5, 3.0)
    )
    assert two - nominal_rad == pytest.approx(2.0 * (one - nominal_rad))
    assert not any(name.endswith("x 1") for name in hypotheses(scenario, [1.5]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,x", "write numbers and commas, for example 1,3,10"),
        ("", "write numbers and commas"),
        ("0", "must be above 0 and at most 100"),
        ("1,1000", "must be above 0 and at most 100"),
        ("nan", "must be above 0 and at most 100"),
    ],
)
def test_invalid_scales_are_rejected(
    access_av: Callable[..., Finished], text: str, message: str
) -> None:
    done = access_av("design", "integrity", "yard", "--fault-scale", text)
    assert done.code == 2
    assert message in " ".join(done.err.split()), done.err
