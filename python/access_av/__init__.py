"""Localization of factory vehicles from 5G synchronization signal blocks (SSBs).

Examples
--------
>>> import access_av
>>> result = access_av.simulate("paper", runs=2, seed=7)
>>> bool(result.steps["mean_abs_error_x_m"].max() < 1.0)
True
"""

from access_av._core import Recording, RecordingError, Scenario, ScenarioError, __version__
from access_av.platform import Platform
from access_av.simulation import Simulation, simulate

__all__ = [
    "Platform",
    "Recording",
    "RecordingError",
    "Scenario",
    "ScenarioError",
    "Simulation",
    "__version__",
    "simulate",
]
