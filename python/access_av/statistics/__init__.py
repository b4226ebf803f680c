"""Statistics of simulated runs: consistency, integrity, percentiles, confidence intervals.

Examples
--------
>>> import access_av
>>> from access_av import statistics
>>> drives = access_av.simulate("paper-real-odometry-4", runs=5, keep_trajectories=True)
>>> consistency = statistics.Consistency.of(drives.trajectories, skip=50)
>>> bool(0.3 < consistency.anees < 3.0)
True
"""

from access_av.statistics.alarms import Alarms
from access_av.statistics.bootstrap import bootstrap_interval
from access_av.statistics.consistency import (
    Consistency,
    horizontal_error_m,
    mean_nees,
    nees,
    nees_band,
)
from access_av.statistics.extremes import ObtainedRisk, exceedance
from access_av.statistics.integrity import Integrity
from access_av.statistics.paired import paired_difference
from access_av.statistics.percentiles import Percentile, percentiles
from access_av.statistics.proportions import clopper_pearson

__all__ = [
    "Alarms", "Consistency", "Integrity", "ObtainedRisk", "Percentile", "bootstrap_interval",
    "clopper_pearson", "exceedance", "horizontal_error_m", "mean_nees", "nees", "nees_band",
    "paired_difference", "percentiles",
]  # fmt: skip
