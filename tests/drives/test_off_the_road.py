"""The textbook filter of ``benches/off_the_road.py`` is right itself."""

from __future__ import annotations

import numpy as np

import hall_drive
from hall_drive import World, simulate


def test_the_textbook_filter_is_as_wrong_as_it_says() -> None:
    nees = []
    for seed in range(1, 21):
        drive = simulate(World(seed=seed, outliers=0.0))
        poses, covariances = hall_drive.textbook(drive)
        error = (poses - drive.truth)[1:, :2]
        nees.append(np.einsum("ki,kij,kj->k", error, np.linalg.inv(covariances[1:]), error).mean())
    # Errors of a drive hang together: as good as twenty independent drives of one error each.
    assert 0.6 < np.mean(nees) / 2 < 1.5
