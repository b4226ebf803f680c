"""Tables: meaning of a row, columns, and conditions of null values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from access_av.tables.columns.glossary import GLOSSARY

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Table:
    """Table: meaning of a row, files, ordered columns, conditions of null values."""

    name: str
    row: str
    where: str
    columns: tuple[str, ...]
    null: Mapping[str, str] = field(default_factory=dict)

    def records(self) -> list[dict[str, str]]:
        """Returns name, unit, meaning and null condition of each column."""
        return [
            {**vars(GLOSSARY[name]), "null": self.null.get(name, "never")} for name in self.columns
        ]


_NO_COVARIANCE = "the localizer has no covariance"
_NOT_GUARDED = "no integrity monitor"
_NO_ANGLE = "no angle could be estimated"
_NOT_COMPARED = "the angle was not compared with a prediction"
_NOT_FOUND = "the first pose was not found"
_NONE_KNOWS = "no run has a pose yet"
_NO_MODE = "every SSB (campaign P): no power mode"
_NO_FIGURE = "the platform has no energy of the method"
_NO_ARRAY = "one channel (the key is absent)"
_UNDECODED = "the message was not decoded"

_SETTING = (
    "interpretation", "campaign", "mode", "method", "adaptive", "base_wake_up_ms", "variant",
)  # fmt: skip
_SETTING_NULL = {
    "mode": f"{_NO_MODE}; the front; or equal information, which is in mode 0",
    "base_wake_up_ms": "the tracker, or equal information",
}

_ERRORS = (
    "mean_abs_error_x_m", "mean_abs_error_y_m", "rms_error_m", "rms_heading_error_rad",
    "mean_true_snr_db", "p50_error_m", "p90_error_m", "p99_error_m",
)  # fmt: skip
_COVARIANCES = (
    "covariance_xx_m2", "covariance_yy_m2", "covariance_heading_rad2", "covariance_xy_m2",
    "covariance_x_heading_m_rad", "covariance_y_heading_m_rad",
)  # fmt: skip
_ANGLE = ("phase_rad", "phase_sigma_rad", "angle_rad")
_RANGE = ("range_m", "range_sigma_m")
_COMPARED = ("mahalanobis_squared", "threshold")
_RISKS = (
    "asked_risk_per_hour", "risk_per_hour", "risk_per_hour_low", "risk_per_hour_high",
)  # fmt: skip
_LEVELS = ("protection_level_m", "protection_level_along_m", "protection_level_across_m")
_PERCENTILES = tuple(
    f"p{percent}_error{end}_m"
    for percent in ("50", "90", "95", "99", "99_9")
    for end in ("", "_low", "_high")
)
_IN_THE_WORST = (
    "choice", "world", "runs", "energy_j", "rms_error_m", *_PERCENTILES, "p90_max_error_m",
    "aoa_estimates", "bursts_received",
)  # fmt: skip
_PERCENTILES_NULL = {
    **dict.fromkeys(
        (name for name in _PERCENTILES if "low" not in name),
        "the position is unknown for a larger share of the time",
    ),
    **dict.fromkeys(
        (name for name in _PERCENTILES if "low" in name or "high" in name),
        "one run, or too few runs for an interval",
    ),
}
_IN_THE_WORST_NULL = {
    **dict.fromkeys(("rms_error_m", "p90_max_error_m"), "the vehicle was not found in a run"),
    **_PERCENTILES_NULL,
}
_POSE = ("x_m", "y_m", "heading_rad")
_POSES = (
    "time_s", *_POSE, "speed_mps", "covariance_xx_m2", "covariance_xy_m2", "covariance_yy_m2",
    "covariance_heading_rad2", *_LEVELS, "integrity", "searching", "lost",
)  # fmt: skip
_POSES_NULL = {
    **{name: _NO_COVARIANCE for name in _POSES if name.startswith("covariance")},
    **dict.fromkeys((*_LEVELS, "integrity"), _NOT_GUARDED),
}
_ENERGIES = ("energy_j", "energy_aoa_estimates_j", "energy_listening_j", "energy_idle_j")

TABLES: Mapping[str, Table] = {
    table.name: table
    for table in (
        Table(
            "steps",
            "An SSB, over all runs",
            "`access_av.simulate(…).steps`",
            ("time_s", *_ERRORS),
            {name: _NONE_KNOWS for name in _ERRORS if name != "mean_true_snr_db"},
        ),
        Table(
            "runs",
            "A run",
            "`access_av.simulate(…).runs`",
            (
                "run", "aoa_estimates", "bursts_received",
                "longest_gap_s", *_ENERGIES, "rms_error_m",
                "max_error_m", "final_error_m", "found_s", "found_m",
            ),
            {
                **dict.fromkeys(_ENERGIES, _NO_FIGURE),
                **dict.fromkeys(
                    ("rms_error_m", "max_error_m", "final_error_m", "found_s", "found_m"),
                    _NOT_FOUND,
                ),
            },
        ),
        Table(
            "trajectories",
            "An SSB of a run, with truth and estimate",
            "`trajectories.parquet` of `access-av run` and `study`; "
            "`access_av.simulate(…).trajectories`",
            (
                "run", "time_s", *_POSE, "true_x_m", "true_y_m", "true_heading_rad", "error_x_m",
                "error_y_m", "true_snr_db", *_COVARIANCES, *_LEVELS, "searching", "integrity",
            ),
            {
                **dict.fromkeys(_COVARIANCES, _NO_COVARIANCE),
                **dict.fromkeys((*_LEVELS, "integrity"), _NOT_GUARDED),
            },
        ),
        Table(
            "aoa_estimates",
            "An angle estimate and its use by the localizer",
            "`aoa_estimates.parquet` of `access-av run`; `access_av.simulate(…).aoa_estimates`",
            (
                "run", "time_s", "pci", "ssb_index", "snr_db", *_ANGLE, "estimator_snr_db",
                *_COMPARED, "wake_up_time_s", "resolved", "accepted", "reason",
            ),
            {
                **dict.fromkeys((*_ANGLE, "estimator_snr_db"), _NO_ANGLE),
                **dict.fromkeys(_COMPARED, _NOT_COMPARED),
            },
        ),
        Table(
            "nees",
            "An SSB of a run",
            "`access_av.statistics.nees(…)`",
            ("run", "time_s", "nees"),
            {"nees": f"{_NO_COVARIANCE} or a singular one, or the first pose is not known yet"},
        ),
        Table(
            "mean_nees",
            "An SSB, over the runs that have a NEES",
            "`access_av.statistics.mean_nees(…)`",
            ("time_s", "runs", "mean_nees", "band_low", "band_high", "in_band"),
        ),
        Table(
            "odometry",
            "An odometry sample",
            "`odometry.csv` of `access-av record synth`; `access-av record locate --odometry`",
            ("time_s", "distance_m", "speed_mps", "yaw_rate_radps"),
            {
                "distance_m": "speeds or wheel columns are given (the column is absent)",
                "speed_mps": "distances or wheel columns are given (the column is absent)",
                "yaw_rate_radps": "no gyroscope (the column is absent)",
            },
        ),
        Table(
            "poses",
            "An odometry sample with the pose of the vehicle",
            "`poses.parquet` of `access-av record locate`; `access_av.locate(…).poses`",
            _POSES,
            _POSES_NULL,
        ),
        Table(
            "smoothed",
            "An odometry sample with the smoothed pose of the vehicle",
            "`smoothed.parquet` of `access-av record locate --smooth`; "
            "`access_av.locate(…).smoothed`",
            _POSES,
            {**_POSES_NULL, **dict.fromkeys((*_LEVELS, "integrity"), "always")},
        ),
        Table(
            "angles",
            "An angle and its use by the localizer",
            "`angles.parquet` of `access-av record locate`; `access_av.locate(…).angles`. A CSV "
            "log of angles for `access-av record locate --recording` has some of the first seven: "
            "docs/locate.md",
            ("time_s", "pci", "ssb_index", "snr_db", *_ANGLE, "accepted", "reason", *_COMPARED),
            {**dict.fromkeys(_ANGLE, _NO_ANGLE), **dict.fromkeys(_COMPARED, _NOT_COMPARED)},
        ),
        Table(
            "ranges",
            "A range and its use by the localizer",
            "`ranges.parquet` of `access-av record locate`; `access_av.locate(…).ranges`",
            ("time_s", "pci", "ssb_index", *_RANGE, "accepted", "reason", *_COMPARED),
            {
                "range_sigma_m": "`ranging.sigma_m` of the vehicle applies",
                **dict.fromkeys(_COMPARED, "the range was not compared with a prediction"),
            },
        ),
        Table(
            "recorded_angles",
            "An angle estimated from a recording",
            "`angles.csv` and `angles.parquet` of `access-av record angles`; "
            "`access_av.estimate_angles(…).angles`; `access-av record locate --recording`",
            ("time_s", "pci", "ssb_index", "snr_db", *_ANGLE, "phase_noise_sigma_rad", "resolved"),
        ),
        Table(
            "findings",
            "A vehicle parameter that the localizer estimates",
            "`findings.parquet` of `access-av record locate`; `access_av.locate(…).findings`",
            ("constant", "constant_unit", "stated_value", "found_value", "found_value_std"),
        ),
        Table(
            "located_errors",
            "A pose with known truth",
            "`access_av.drives.error_m(…)`",
            ("time_s", "error_m", "error_x_m", "error_y_m"),
        ),
        Table(
            "bound_route",
            "An SSB of the drive (the bound uses every SSB)",
            "`bound.parquet` of `access-av design bound`; `access_av.bound(…).route`",
            (
                "time_s", "along_m", "x_m", "y_m", "bound_m", "along_std_m", "across_std_m",
                "heading_std_rad", "odometer_scale_std",
            ),
        ),
        Table(
            "bound_map",
            "A square of the site, at its centre",
            "`map.parquet` of `access-av design bound`; `access_av.bound(…).site`",
            ("x_m", "y_m", "bound_m"),
            {"bound_m": "the radio heads do not determine the position"},
        ),
        Table(
            "channel_drops",
            "A randomly drawn link",
            "`access_av.channel.drops(…)`",
            (
                "line_of_sight", "path_loss_db", "shadowing_db", "rician_k_db", "delay_spread_s",
                "azimuth_spread_deg", "zenith_spread_deg", "paths_delay_spread_s",
                "paths_azimuth_spread_deg",
            ),
            {"rician_k_db": "no line of sight"},
        ),
        Table(
            "integrity_cases",
            "A case of an integrity campaign",
            "`integrity.parquet` of `access-av design integrity`; `Case.as_record()`",
            (
                "variant", "mismatch", "channel", "heads", "runs", "availability",
                "unavailable_share", "exceedances", "exceedance_share", "exceedance_share_low",
                "exceedance_share_high", "runs_with_exceedances", "time_to_alert_s",
                "level_over_error", *_RISKS, "p90_error_m", "max_error_m",
            ),
            dict.fromkeys(_RISKS[1:], "the runs are too short for a tail estimate"),
        ),
        Table(
            "masts",
            "A candidate mast, added alone",
            "`masts.parquet` of `access-av design plan`; `access_av.plan(…).ranking`",
            ("name", "x_m", "y_m", "z_m", "p90_bound_m"),
        ),
        Table(
            "survey",
            "A surveyed parameter of site or vehicle",
            "`survey.parquet` of `access-av record survey`; `access_av.survey(…).table()`",
            ("key", "unit", "before", "std_before", "found", "std", "is_learnt"),
        ),
        Table(
            "bound_heads",
            "A radio head",
            "`access-av design bound --json`; `access_av.bound(…).heads`",
            (
                "name", "pci", "ssb_index", "x_m", "y_m", "nearest_m", "farthest_m",
                "least_expected_snr_db", "most_expected_snr_db", "visible_share",
            ),
            dict.fromkeys(
                ("least_expected_snr_db", "most_expected_snr_db"),
                "walls hide the radio head along the whole route",
            ),
        ),
        Table(
            "sweep",
            "A combination of values of a sweep",
            "`access_av.sweep(…).table`",
            (
                "variant", "runs", "rms_error_m", *_PERCENTILES, "delta_m", "delta_low_m",
                "delta_high_m", "aoa_estimates", "bursts_received", "energy_j",
            ),
            {
                **_PERCENTILES_NULL,
                **dict.fromkeys(
                    ("delta_m", "delta_low_m", "delta_high_m"),
                    "one run has no interval; or the position is unknown for more of the time",
                ),
                "energy_j": _NO_FIGURE,
            },
        ),
        Table(
            "operating_points",
            "An operating point of an interpretation of the paper",
            "`operating_points.parquet` of `access-av paper evaluate`; `access-av paper explore "
            "--json`; all but `interpretation`: `access_av.evaluate(…).points`",
            (
                "interpretation", "campaign", "mode", "mode_name", "method", "adaptive",
                "base_wake_up_ms",
                "aoa_estimates", "worst_error_x_m", "worst_error_y_m", "rms_error_m",
                "energy_per_execution_j", "energy_j", "energy_provenance", *_PERCENTILES,
            ),
            {
                **dict.fromkeys(("mode", "mode_name"), _NO_MODE),
                **dict.fromkeys(
                    ("energy_per_execution_j", "energy_j", "energy_provenance"),
                    f"{_NO_MODE}; or {_NO_FIGURE}",
                ),
                **_PERCENTILES_NULL,
            },
        ),
        Table(
            "study_errors",
            "An epoch of a run of a study (10 Hz)",
            "`errors.parquet` of `access-av study`",
            ("variant", "run", "time_s", "error_m", "protection_level_m"),
            {"protection_level_m": "the state is not ok"},
        ),
        Table(
            "study_drives",
            "A run of a study",
            "`drives.parquet` of `access-av study`",
            (
                "variant", "run", "seed", "aoa_estimates", "bursts_received", "duration_s",
                "is_lost",
                "ok_steps", "level_steps", "suspected_steps", "unavailable_steps", "exceedances",
            ),
            dict.fromkeys(
                (
                    "ok_steps", "level_steps", "suspected_steps", "unavailable_steps",
                    "exceedances",
                ),
                "no integrity monitor",
            ),
        ),
        Table(
            "study_targets",
            "A target of a plant, on its stretch of the road",
            "`targets.parquet` of `access-av study`",
            (
                "variant", "target", "from_m", "to_m", "required_error_m", "percent",
                "target_error_m", "target_error_low_m", "target_error_high_m", "within_share",
                "within_low_share", "within_high_share", "judgement",
            ),
        ),
        Table(
            "places",
            "A metre of a plant's road",
            "`places.parquet` and `places.csv` of `access-av study`",
            (
                "along_m", "x_m", "y_m", "median_error_m", "target_error_m", "within_share",
                "passes", "level_m", "reliable_share", "bound_m", "along_road_error_per_degree_m",
                "heads_visible", "best_snr_db",
            ),
            {
                "level_m": "the state is never ok there",
                "along_road_error_per_degree_m": "no visible radio head determines the position "
                "along the "
                "road",
                "best_snr_db": "walls hide every radio head",
            },
        ),
        Table(
            "study_points",
            "A configuration of the vehicle in a power mode",
            "`points.parquet` of `access-av study`",
            (
                "variant", "runs", "method", "wake_up", "mode", "mode_name", "is_simulated",
                "target_error_m", "judgement",
                *(
                    f"{part}_{extent}_j"
                    for part in ("estimates", "listening", "idle")
                    for extent in ("low", "value", "high")
                ),
                "idle_low_w", "idle_value_w", "idle_high_w", "on_front", "recommended",
            ),
            dict.fromkeys(
                ("idle_low_w", "idle_value_w", "idle_high_w"), "the platform has no such figure"
            ),
        ),
        Table(
            "compared",
            "A percentile of the error of a variant",
            "`compared.parquet` of `access-av run`, `study`, `record locate` and `design "
            "integrity` with --sweep or --against",
            (
                "variant", "runs", "percent", "percentile_m", "percentile_low_m",
                "percentile_high_m", "delta_m", "delta_low_m", "delta_high_m", "lost_runs",
                "availability", "degraded_share", "unavailable_share", "exceedances", "energy_j",
            ),
            {
                "energy_j": _NO_FIGURE,
                **dict.fromkeys(("delta_m", "delta_low_m", "delta_high_m"), "the first variant"),
                **dict.fromkeys(
                    ("availability", "degraded_share", "unavailable_share", "exceedances"),
                    "no integrity monitor",
                ),
                **dict.fromkeys(
                    ("percentile_low_m", "percentile_high_m"), "one run has no interval"
                ),
            },
        ),
        Table(
            "designs",
            "A design of a scenario in its worst environment, over runs common to all designs",
            "`designs.parquet` of `access-av design sweep`; `kept` of `access-av design select "
            "--json`",
            ("design", *_IN_THE_WORST, "on_front"),
            {"energy_j": _NO_FIGURE, **_IN_THE_WORST_NULL},
        ),
        Table(
            "design_worlds",
            "A design of a scenario in one of several environments",
            "`worlds.parquet` of `access-av design sweep`",
            ("design", *_IN_THE_WORST),
            {"energy_j": _NO_FIGURE, **_IN_THE_WORST_NULL},
        ),
        Table(
            "errors",
            "A setting of an interpretation and an SSB",
            "`errors.parquet` of `access-av paper evaluate`; all but `interpretation`: "
            "`access_av.evaluate(…).errors`",
            (
                "interpretation", "method", "adaptive", "base_wake_up_ms", "time_s",
                "mean_abs_error_x_m",
                "mean_abs_error_y_m",
            ),
        ),
        Table(
            "snr",
            "An SSB, over all runs",
            "`snr.parquet` of `access-av paper evaluate`; `access_av.evaluate(…).snr`",
            ("time_s", "mean_true_snr_db"),
        ),
        Table(
            "claims",
            "A claim of the paper under an interpretation",
            "`claims.json` of `access-av paper evaluate`",
            (
                "interpretation", "id", "statement", "paper_section", "stated", "obtained",
                "interval", "unit",
                "verdict", "seed_sensitive", "evidence", "note", "spread", "met_by_seed",
                "deviation", "tolerance",
            ),
            {
                "obtained": "the claim is not judged or not testable, or no point is within the "
                "budget",
                "interval": "obtained is not random, or is a set of modes",
                **dict.fromkeys(
                    ("deviation", "tolerance"), "no tolerance in the rule, or claim not judged"
                ),
            },
        ),
        Table(
            "evaluation_runs",
            "A run of a setting of the evaluation",
            "`evaluation_runs.parquet` of `access-av paper evaluate`",
            (
                *_SETTING, "run", "aoa_estimates", "rms_error_m", "max_error_x_m", "max_error_y_m",
                "longest_gap_s", "energy_j",
            ),
            {
                **_SETTING_NULL,
                "energy_j": f"{_NO_MODE}; a constant, the front or equal information; "
                f"or {_NO_FIGURE}",
            },
        ),
        Table(
            "resamples",
            "A bootstrap resample of the runs of an operating point",
            "`resamples.parquet` of `access-av paper evaluate`",
            (
                *_SETTING, "resample", "aoa_estimates", "worst_error_x_m", "worst_error_y_m",
                "rms_error_m", "late_to_early", "share_below_music", "share_below_esprit",
                "share_below_root_music",
            ),
            {
                **_SETTING_NULL,
                **dict.fromkeys(
                    (f"share_below_{method}" for method in ("music", "esprit", "root_music")),
                    "the wake-up time is fixed",
                ),
            },
        ),
        Table(
            "ablations",
            "An interpretation and a power mode, with a constant in place of the controller",
            "`ablations.parquet` of `access-av paper evaluate`",
            (
                "interpretation", "mode", "constant_ms", "aoa_estimates", "constant_aoa_estimates",
                "rms_error_m", "constant_rms_m", "gain_m", "gain_low_m", "gain_high_m", "matters",
            ),
        ),
        Table(
            "fixed_front",
            "MUSIC at a fixed interval",
            "`fixed_front.parquet` of `access-av paper evaluate`",
            (
                "base_wake_up_ms", "aoa_estimates", "worst_error_x_m", "worst_error_y_m",
                "rms_error_m",
            ),
        ),
        Table(
            "proposed_vs_paper",
            "A power mode: localizer and wake-up of this project, and the paper's adaptive point",
            "`proposed_vs_paper.parquet` of `access-av paper evaluate`",
            (
                "mode", "map", "aoa_estimates", "papers_aoa_estimates", "energy_j",
                "papers_energy_j",
                "worst_error_m", "papers_worst_m", "rms_error_m", "papers_rms_m",
                "rms_error_reduction_m",
                "rms_error_reduction_low_m", "rms_error_reduction_high_m", "estimates_saved",
                "estimates_saved_low",
                "estimates_saved_high",
            ),
            dict.fromkeys(("energy_j", "papers_energy_j"), _NO_FIGURE),
        ),
        Table(
            "equal_information",
            "A localization method in mode 0, with its information",
            "`equal_information.parquet` of `access-av paper evaluate`",
            (
                "real_odometer", "map", "who", "aoa_estimates", "rms_error_m", "rms_low_m",
                "rms_high_m", "worst_error_m",
            ),
            {"worst_error_m": "the row is the bound"},
        ),
        Table(
            "fit_degrees_of_freedom",
            "A free parameter of the energy fit, in addition to the rows above",
            "`fit_degrees_of_freedom.parquet` of `access-av paper evaluate`",
            (
                "freedom", "free_numbers", "solved_numbers", "claims_reproduced",
                "agree_by_construction", "agree_by_arithmetic", "average_saving_percent",
                "keep_energy", "keep_both",
            ),
            {"average_saving_percent": "the claim is not judged"},
        ),
        Table(
            "assumptions",
            "A value of an open choice of the paper: the shipped value or an alternative",
            "`assumptions.parquet` of `access-av paper evaluate --sensitivity`; "
            "`access-av paper assumptions --json`",
            (
                "what", "value", "why", "is_shipped", "aoa_estimates", "worst_error_m",
                "rms_error_m", "rms_std_m", "fixed_rms_m", "every_ssb_rms_m",
            ),
        ),
        Table(
            "sensitivity",
            "A claim and an open choice of the paper",
            "`sensitivity.parquet` of `access-av paper evaluate --sensitivity`",
            (
                "claim", "dimension", "first", "total", "first_low", "first_high", "total_low",
                "total_high",
            ),
        ),
        Table(
            "sensitivity_claims",
            "A claim",
            "`sensitivity_claims.parquet` of `access-av paper evaluate --sensitivity`",
            ("claim", "share_met", "share_met_low", "share_met_high", "explained_variance"),
            {"explained_variance": "the margin is equal in all drawn interpretations"},
        ),
        Table(
            "sensitivity_sample",
            "A drawn interpretation and an open choice of the paper",
            "`sensitivity_sample.parquet` of `access-av paper evaluate --sensitivity`",
            (
                "interpretation_index", "environment_index", "dimension", "coordinate",
                "num_choices", "drawn_value",
            ),
        ),
        Table(
            "sensitivity_margins",
            "A drawn interpretation and a claim",
            "`sensitivity_margins.parquet` of `access-av paper evaluate --sensitivity`",
            ("interpretation_index", "claim", "margin"),
        ),
        Table(
            "cells",
            "An SSB found in a recording",
            "`access-av record scan --json`; all but `recording`: `access_av.nr.record(cell)`",
            (
                "recording", "pci", "ssb_index", "ssb_index_is_guess", "half_frame", "sfn",
                "cfo_hz", "snr_db", "sample_start", "sample_offset", "mib_bits", "ssb_freq_hz",
                "scs_khz", "lmax", "rsrp_dbfs", "rsrq_db", "sinr_db", "angle_deg", "azimuth_deg",
                "elevation_deg", "sigma_deg", "verdict", "doubt", "p_value",
            ),
            {
                **dict.fromkeys(("half_frame", "sfn", "mib_bits"), _UNDECODED),
                "lmax": "neither band nor PBCH determines it",
                **dict.fromkeys(
                    ("azimuth_deg", "sigma_deg", "verdict", "doubt", "p_value"), _NO_ARRAY
                ),
                "angle_deg": f"{_NO_ARRAY}, or an array that is not linear",
                "elevation_deg": "linear array (the key is absent)",
            },
        ),
        Table(
            "bursts",
            "An annotated burst of an array's recording",
            "`access-av record aoa --json`",
            (
                "sample_start", "azimuth_from_broadside_deg", "sigma_deg", "snr_db", "label",
                "verdict", "doubt", "p_value", "truth_deg",
            ),
            {"truth_deg": "not annotated (the key is absent)"},
        ),
    )
}  # fmt: skip
