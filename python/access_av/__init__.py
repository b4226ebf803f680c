"""Localization of factory vehicles from 5G synchronization signal blocks (SSBs).

The functions and modules of the table are imported at their first use, so that the import of the
package is fast.

=====================  ============================================================================
``study_plant``        localization of a plant: accuracy, weak positions, remedies, cost
``simulate``           simulates a scenario in many runs
``sweep``              every combination of some values, in the same environments
``difference``         paired comparison of two results
``bound``              lower bound of the localization error of a scenario
``plan``               placement of additional radio heads
``synthesize``         synthetic recording of a scenario's drive
``estimate_angles``    angles of a recording, as input of ``locate``
``locate``             trajectory of a recorded drive
``Live``               the pipeline on a vehicle: samples, angles and odometry as inputs
``survey``             positions of radio heads, estimated from ordinary drives
``evaluate``           the paper's evaluation
``explore``            operating points that meet an energy and an error limit
``Site``               nominal model of the plant: load, change, write
``Vehicle``            nominal model and settings of a vehicle
``Scenario``           site, vehicle, environment, and differences of the truth
``Platform``           the onboard computer: power modes, energy per execution
``Plant``              site, vehicle, fleet, and required accuracy
``Recording``          samples on disk (SigMF, raw)
``channel``            drops of the channels of 3GPP TR 38.901
``ray_paths``          paths of a ray tracer, for the simulator
``aoa``                angle of arrival with linear arrays
``nr``                 SSBs: search in samples and recordings, generation
``recorded_angles``    angles from the annotated recording of a linear array
``service_levels``     3GPP positioning service levels
``statistics``         consistency and integrity of simulated runs, intervals
``drives``             recorded drives: errors against a truth, summary
``columns``            description of the columns of all tables
``cost``, ``carbon``   money and greenhouse gas of equipment and energy, with sources
``paper``              the paper's numbers, evaluation and claims
=====================  ============================================================================

Examples
--------
>>> import access_av
>>> result = access_av.simulate("paper", runs=2, seed=7)
>>> bool(result.steps["mean_abs_error_x_m"].max() < 1.0)
True
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from access_av._core import (
    Live,
    Plant,
    Recording,
    RecordingError,
    Scenario,
    SettingsError,
    SettingsWarning,
    Site,
    Vehicle,
    __version__,
)
from access_av.errors import ImplausibleSettingsWarning, InputError
from access_av.lazy import attach

if TYPE_CHECKING:
    from access_av import drives, paper, statistics
    from access_av.designs.query import Query, explore
    from access_av.device.platform import Platform
    from access_av.drives.angle_log import AngleLog, estimate_angles
    from access_av.drives.recorded import Drive, SynthesizedDrive, locate, synthesize
    from access_av.drives.self_survey import Survey, survey
    from access_av.economics import carbon, cost
    from access_av.paper.evaluation import Evaluation, evaluate
    from access_av.radio import channel, ray_paths
    from access_av.radio.placement import Plan, plan
    from access_av.run import service_levels
    from access_av.run.difference import Difference, difference
    from access_av.run.error_bound import ErrorBound, bound
    from access_av.run.simulation import Simulation, simulate
    from access_av.run.sweep import Sweep, sweep
    from access_av.signal import aoa, nr, recorded_angles
    from access_av.study.answer import study_plant
    from access_av.study.study_result import Study
    from access_av.tables import columns

__all__ = [
    "AngleLog", "Difference", "Drive", "ErrorBound", "Evaluation", "ImplausibleSettingsWarning",
    "InputError", "Live", "Plan", "Plant", "Platform", "Query", "Recording", "RecordingError",
    "Scenario", "SettingsError", "SettingsWarning", "Simulation", "Site", "Study", "Survey",
    "Sweep", "SynthesizedDrive", "Vehicle", "__version__", "aoa", "bound", "carbon", "channel",
    "columns", "cost", "difference", "drives", "estimate_angles", "evaluate", "explore",
    "locate", "nr", "paper", "plan", "ray_paths", "recorded_angles", "service_levels",
    "simulate", "statistics", "study_plant", "survey", "sweep", "synthesize",
]  # fmt: skip

if not TYPE_CHECKING:
    __getattr__, __dir__ = attach(__name__)
