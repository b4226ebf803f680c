"""Glossary of the columns: unit and meaning of each name, equal in all tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Column:
    """Name, unit and meaning of a column."""

    name: str
    unit: str
    meaning: str


# Unit 1: a count, an index or a number without unit.
_GLOSSARY = {
    # A survey.
    "key": ("text", "Key in the site or vehicle file"),
    "before": ("any", "Given value"),
    "std_before": ("any", "Standard deviation of the given value"),
    "found": ("any", "Estimate from the drives and the given value"),
    "std": ("any", "Standard deviation of the estimate"),
    "is_learnt": (
        "true or false",
        "Whether the survey reduced the standard deviation by at least 30 %",
    ),
    # Time, run, place.
    "run": ("1", "Number of the run"),
    "runs": ("1", "Number of runs"),
    "time_s": ("s", "Time from the start of the drive, or by the recording's clock"),
    "x_m": ("m", "Position x in the map frame; of a drive: the estimate"),
    "y_m": ("m", "Position y in the map frame; of a drive: the estimate"),
    "heading_rad": ("rad", "Heading, counter-clockwise from +x; of a drive: the estimate"),
    "speed_mps": ("m/s", "Speed along the vehicle's heading"),
    "true_x_m": ("m", "True position x"),
    "true_y_m": ("m", "True position y"),
    "true_heading_rad": ("rad", "True heading"),
    "along_m": ("m", "Distance along the road from its start"),
    "distance_m": ("m", "Distance driven, by the odometer"),
    "yaw_rate_radps": ("rad/s", "Yaw rate, by the gyroscope"),
    "searching": ("true or false", "Whether the first pose is not known yet"),
    "lost": (
        "true or false",
        "Whether the angles contradict the position; the pose is not valid",
    ),
    # A study of a plant.
    "variant": ("text", "Variant: baseline, remedy, configuration, or changed key"),
    "duration_s": ("s", "Duration of a trip"),
    "median_error_m": ("m", "Median of the horizontal errors within 5 m of the position"),
    "target_error_m": ("m", "Horizontal error at the percentile of the target"),
    "within_share": ("1", "Share of the errors below the target, within 5 m of the position"),
    "passes": ("true or false", "Whether target_error_m is within the target"),
    "target_error_low_m": ("m", "Low end of the 95 % interval of target_error_m"),
    "target_error_high_m": ("m", "High end of the 95 % interval of target_error_m"),
    "target": ("text", "Name of the target"),
    "from_m": ("m", "Start of the target's section, as distance along the road"),
    "to_m": ("m", "End of the target's section, as distance along the road"),
    "required_error_m": ("m", "Horizontal error that the target requires"),
    "within_low_share": ("1", "Low end of the 95 % interval of within_share"),
    "within_high_share": ("1", "High end of the 95 % interval of within_share"),
    "judgement": (
        "text",
        "Whether the targets are met: met, probably_met, probably_missed, missed",
    ),
    "is_simulated": ("true or false", "The drives are of this power mode"),
    "is_lost": ("true or false", "The error exceeds 5 m for more than 5 s of the drive"),
    "seed": ("1", "Seed of the drive"),
    "ok_steps": ("1", "Number of SSBs in state ok"),
    "level_steps": ("1", "Number of degraded SSBs with a level above the alert limit"),
    "suspected_steps": ("1", "Number of degraded SSBs with a suspected fault"),
    "unavailable_steps": ("1", "Number of SSBs in state unavailable"),
    "level_m": (
        "m",
        "Median protection level in state ok, within 5 m of the position",
    ),
    "reliable_share": ("1", "Share of the time in state ok, within 5 m of the position"),
    "along_road_error_per_degree_m": (
        "m",
        "Position error along the road caused by an error of one degree in every angle",
    ),
    "heads_visible": ("1", "Radio heads with an expected SNR of -6 dB or more"),
    "best_snr_db": ("dB", "Expected SNR of the strongest radio head"),
    "wake_up": ("text", "Wake-up policy"),
    **{
        f"{part}_{extent}_j": ("J", f"Energy of a trip, {what}, {end}")
        for part, what in (
            ("estimates", "angle estimates"),
            ("listening", "the receiver while it is on"),
            ("idle", "the idle board, if the platform counts it"),
        )
        for extent, end in (("low", "at least"), ("value", "usual"), ("high", "at most"))
    },
    **{
        f"idle_{extent}_w": ("W", f"Power of the idle board, {end}")
        for extent, end in (("low", "at least"), ("value", "usual"), ("high", "at most"))
    },
    "recommended": ("true or false", "Whether the configuration is recommended"),
    "percent": ("1", "Percentile of the horizontal error"),
    "percentile_m": ("m", "Horizontal error at this percentile"),
    "percentile_low_m": ("m", "Lower end of the 95 % interval of percentile_m"),
    "percentile_high_m": ("m", "Upper end of the 95 % interval of percentile_m"),
    "delta_m": (
        "m",
        "Percentile of the variant minus that of the first variant, in pairs of runs",
    ),
    "delta_low_m": ("m", "Lower end of the 95 % interval of delta_m"),
    "delta_high_m": ("m", "Upper end of the 95 % interval of delta_m"),
    "lost_runs": ("1", "Runs with an error above 5 m for more than 5 s, or without any position"),
    "degraded_share": ("1", "Share of the time in state degraded"),
    # Errors of the position.
    "error_x_m": ("m", "Estimate minus truth, x"),
    "error_y_m": ("m", "Estimate minus truth, y"),
    "error_m": ("m", "Horizontal error: distance between estimate and truth"),
    "mean_abs_error_x_m": ("m", "Mean over the runs of the absolute error in x"),
    "mean_abs_error_y_m": ("m", "Mean over the runs of the absolute error in y"),
    "worst_error_x_m": ("m", "Maximum of mean_abs_error_x_m along the track"),
    "worst_error_y_m": ("m", "Maximum of mean_abs_error_y_m along the track"),
    "rms_error_m": (
        "m",
        "Root mean square of the horizontal error, over all runs and times of the row",
    ),
    "max_error_m": ("m", "Maximum horizontal error"),
    "max_error_x_m": ("m", "Maximum error in x over every SSB of the run"),
    "max_error_y_m": ("m", "Maximum error in y over every SSB of the run"),
    "resample": ("1", "Number of the bootstrap resample of the runs; 0 is the sample itself"),
    "late_to_early": ("1", "Mean error of the last quarter of the trip over that of the first"),
    **{
        f"share_below_{method}": (
            "1",
            f"Share of the track with a smaller mean error than {method} at its fixed interval in "
            "the same mode",
        )
        for method in ("music", "esprit", "root_music")
    },
    "final_error_m": ("m", "Horizontal error at the end"),
    "p50_error_m": ("m", "Median of the horizontal error, over all runs and times of the row"),
    **{
        f"p{percent.replace('.', '_')}_error_m": (
            "m",
            f"{percent}th percentile of the horizontal error, over the runs and times of the row",
        )
        for percent in ("90", "95", "99", "99.9")
    },
    **{
        f"p{percent}_error_{end}_m": (
            "m",
            f"{'Lower' if end == 'low' else 'Upper'} end of the 95 % interval of "
            f"`p{percent}_error_m`, by the bootstrap over whole runs",
        )
        for percent in ("50", "90", "95", "99", "99_9")
        for end in ("low", "high")
    },
    "rms_heading_error_rad": ("rad", "Root mean square of the heading error over the runs"),
    # Uncertainty reported by the localizer.
    "covariance_xx_m2": ("m²", "Variance of x, by the localizer"),
    "covariance_yy_m2": ("m²", "Variance of y, by the localizer"),
    "covariance_xy_m2": ("m²", "Covariance of x and y, by the localizer"),
    "covariance_heading_rad2": ("rad²", "Variance of the heading, by the localizer"),
    "covariance_x_heading_m_rad": ("m·rad", "Covariance of x and heading, by the localizer"),
    "covariance_y_heading_m_rad": ("m·rad", "Covariance of y and heading, by the localizer"),
    "protection_level_m": ("m", "Horizontal protection level"),
    "protection_level_along_m": ("m", "Protection level along the vehicle's heading"),
    "protection_level_across_m": ("m", "Protection level across the vehicle's heading"),
    "integrity": ("text", "Integrity state: ok, degraded, unavailable"),
    "nees": (
        "1",
        "Normalised estimation error squared of the position; 2 on average if consistent",
    ),
    "mean_nees": ("1", "Mean of nees over the runs"),
    "band_low": ("1", "Lower end of the 95 % band of mean_nees of a consistent localizer"),
    "band_high": ("1", "Upper end of the 95 % band of mean_nees of a consistent localizer"),
    "in_band": ("true or false", "Whether mean_nees is within the band"),
    "z_m": ("m", "Height, with the reference of the array's height"),
    "p90_bound_m": ("m", "90th percentile along the route of the bound of the RMS error"),
    # Integrity campaigns.
    "mismatch": ("text", "Difference between the truth and the nominal model"),
    "channel": ("text", "Channel of the campaign"),
    "heads": ("1", "Number of received radio heads"),
    "availability": ("1", "Share of the steps in state ok"),
    "unavailable_share": ("1", "Share of the steps in state unavailable"),
    "exceedances": ("1", "Steps in state ok with an error above the protection level"),
    "exceedance_share": (
        "1",
        "Share of the steps in state ok with an error above the protection level",
    ),
    "exceedance_share_low": (
        "1",
        "Lower end of the 95 % interval of exceedance_share, by the bootstrap over runs",
    ),
    "exceedance_share_high": (
        "1",
        "Upper end of the 95 % interval of exceedance_share, by the bootstrap over runs",
    ),
    "runs_with_exceedances": (
        "1",
        "Runs with at least one error above the protection level in state ok",
    ),
    "time_to_alert_s": ("s", "Maximum time with an error above the alert limit in state ok"),
    "level_over_error": ("1", "Median of protection level divided by horizontal error"),
    "asked_risk_per_hour": ("1", "Target integrity risk: `integrity.risk_per_hour` of the vehicle"),
    "risk_per_hour": (
        "1",
        "Errors above the protection level per hour in state ok, by peaks over a threshold",
    ),
    "risk_per_hour_low": (
        "1",
        "Lower end of the 95 % interval of risk_per_hour, by the bootstrap over runs",
    ),
    "risk_per_hour_high": (
        "1",
        "Upper end of the 95 % interval of risk_per_hour, by the bootstrap over runs",
    ),
    # Channels.
    "line_of_sight": ("true or false", "Whether a line of sight exists"),
    "path_loss_db": ("dB", "Path loss, without shadowing and fading"),
    "shadowing_db": ("dB", "Shadowing; positive is more power"),
    "rician_k_db": ("dB", "Power of the line of sight over that of the scatter"),
    "delay_spread_s": ("s", "Root-mean-square delay spread, as drawn"),
    "azimuth_spread_deg": ("°", "Root-mean-square azimuth spread of arrival, as drawn"),
    "zenith_spread_deg": ("°", "Root-mean-square zenith spread of arrival, as drawn"),
    "paths_delay_spread_s": ("s", "Root-mean-square delay spread of the generated paths"),
    "paths_azimuth_spread_deg": ("°", "Circular azimuth spread of arrival of the generated paths"),
    # SSBs, SNR, angles.
    "pci": ("1", "Physical cell identity"),
    "ssb_index": ("1", "SSB index (beam)"),
    "snr_db": ("dB", "SNR of the SSB or burst, measured by the receiver"),
    "estimator_snr_db": ("dB", "SNR per antenna and snapshot, estimated by the angle estimator"),
    "true_snr_db": ("dB", "SNR of the strongest radio head by link budget and shadowing"),
    "mean_true_snr_db": ("dB", "Mean over the runs of true_snr_db"),
    "phase_rad": ("rad", "Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas"),
    "phase_sigma_rad": (
        "rad",
        "Standard deviation of phase_rad caused by receiver noise; in a log of angles by receiver "
        "noise and the site's scatter",
    ),
    "phase_noise_sigma_rad": ("rad", "Part of phase_sigma_rad caused by receiver noise"),
    "angle_rad": ("rad", "Angle of arrival θ from the array's axis"),
    "resolved": ("true or false", "Whether the standard deviation of the angle is valid"),
    "range_m": ("m", "Measured range, or one-way delay times the speed of light"),
    "range_sigma_m": ("m", "Standard deviation of range_m"),
    "accepted": ("true or false", "Whether the localizer used the measurement"),
    "reason": (
        "text",
        "Reason for using or rejecting the measurement: consistent, outlier, unusable, unknown "
        "radio head, too late, excluded",
    ),
    "mahalanobis_squared": (
        "1",
        "Squared Mahalanobis distance between measured and predicted value",
    ),
    "threshold": ("1", "Maximum accepted mahalanobis_squared"),
    # Wake-up and energy.
    "wake_up_time_s": ("s", "Present wake-up time"),
    "base_wake_up_ms": ("ms", "Base wake-up time, or the fixed interval"),
    "design": ("1", "Number of the design"),
    "choice": ("text", "Values of the keys that differ between designs"),
    "world": (
        "text",
        "Environment of the runs; of several, the one with the largest RMS error",
    ),
    "p90_max_error_m": ("m", "90th percentile over the runs of the maximum horizontal error"),
    "on_front": (
        "true or false",
        "Whether no other design has less energy and error with 95 % confidence",
    ),
    "aoa_estimates": ("1", "Number of angle estimates per run; of several runs the mean"),
    "bursts_received": ("1", "Number of received SSB bursts"),
    "longest_gap_s": (
        "s",
        "Maximum time between two angle estimates; 0 with fewer than two",
    ),
    "energy_j": ("J", "Energy of a run; of several runs the mean"),
    "energy_aoa_estimates_j": ("J", "Energy of the angle estimates of a run"),
    "energy_listening_j": ("J", "Energy of the receiver of a run"),
    "energy_idle_j": ("J", "Energy of the idle computer of a run"),
    "energy_per_execution_j": ("J", "Energy of one angle estimate"),
    "energy_provenance": (
        "text",
        "Source of energy_per_execution_j: measured, fitted, datasheet, assumed",
    ),
    "found_s": ("s", "Time until the first pose was known"),
    "found_m": ("m", "Distance driven until the first pose was known"),
    # Vehicle parameters estimated from a drive.
    "constant": ("text", "Key of the vehicle file; the nominal value of gyroscope.scale is 1"),
    "constant_unit": ("text", "Unit of the parameter"),
    "stated_value": ("any", "Nominal value in the vehicle file"),
    "found_value": ("any", "Estimate at the end of the drive"),
    "found_value_std": ("any", "Standard deviation of found_value"),
    # Bound.
    "bound_m": ("m", "Lower bound of the root mean square of the horizontal error"),
    "along_std_m": ("m", "Bound of the error along the road"),
    "across_std_m": ("m", "Bound of the error across the road"),
    "heading_std_rad": ("rad", "Lower bound of the root mean square of the heading error"),
    "odometer_scale_std": (
        "1",
        "Lower bound of the root mean square of the odometer's scale error",
    ),
    "nearest_m": ("m", "Minimum distance from the route"),
    "farthest_m": ("m", "Maximum distance from the route"),
    "least_expected_snr_db": (
        "dB",
        "Minimum SNR along the visible part of the route, by the link budget",
    ),
    "most_expected_snr_db": (
        "dB",
        "Maximum SNR along the visible part of the route, by the link budget",
    ),
    "visible_share": (
        "1",
        "Share of the route's SSBs with an SNR of −6 dB or more (3GPP detection limit)",
    ),
    # Operating points and claims.
    "interpretation": ("text", "Name of the interpretation of the paper"),
    "campaign": (
        "text",
        "P: every SSB; Q: fixed at the computer's base wake-up time; R: adaptive; constant: in "
        "place of Algorithm 1; front: MUSIC at fixed intervals; tracker: tracker of this project; "
        "equal: both methods with equal information",
    ),
    "mode": ("1", "Power mode of the platform"),
    "mode_name": ("text", "Name of the power mode"),
    "method": ("text", "Angle-of-arrival method: music, esprit, root_music"),
    "adaptive": ("true or false", "Whether the wake-up time is adaptive"),
    "id": ("text", "Short name"),
    "statement": ("text", "Statement of the paper"),
    "paper_section": ("text", "Section of the paper"),
    "stated": ("any", "The paper's value: a number, a list or a table of numbers"),
    "obtained": ("any", "Obtained value, with the shape of stated"),
    "unit": ("text", "Unit of stated and obtained"),
    "verdict": (
        "text",
        "Claim: reproduced or not reproduced; agrees or differs, by arithmetic or by "
        "construction; not judged; not testable. Angle: resolved, or the reason why it is "
        "ambiguous (noise or geometry)",
    ),
    "doubt": (
        "text",
        "Reason why the angle is unreliable (verdict, or misfit of the plane wave); empty if it is "
        "reliable",
    ),
    "p_value": ("1", "Probability of an equal or larger misfit of a plane wave in white noise"),
    "interval": ("any", "95 % interval of obtained over the runs"),
    "deviation": ("1", "Maximum relative deviation of obtained from stated"),
    "tolerance": ("1", "Maximum deviation for a claim that is met"),
    "met_by_seed": ("any", "For each seed whether the claim is met; empty with one seed"),
    "seed_sensitive": ("true or false", "Whether other runs can give another verdict"),
    "evidence": (
        "text",
        "Kind of evidence: independent, calibrated, by construction, or "
        "arithmetic; empty if the claim is not testable",
    ),
    "note": ("text", "Remark"),
    "spread": (
        "any",
        "Deviation of single trips from a mean over the runs; empty if obtained is no mean",
    ),
    "freedom": (
        "text",
        "Additional free parameter of the energy fit, compared with the rows above",
    ),
    "free_numbers": ("1", "Number of free parameters, including the rows above"),
    "solved_numbers": ("1", "Number of free parameters that are solved from stated figures"),
    "claims_reproduced": ("1", "Number of claims reproduced under the shown interpretation"),
    "agree_by_construction": (
        "1",
        "Number of claims that agree by construction; not in claims_reproduced",
    ),
    "agree_by_arithmetic": (
        "1",
        "Number of claims that agree by arithmetic; not in claims_reproduced",
    ),
    "average_saving_percent": (
        "1",
        "Average energy saving of claim e4 in percent, under the shown interpretation",
    ),
    "keep_energy": ("text", "Interpretations that meet the energy claims"),
    "keep_both": ("text", "Interpretations that meet the energy and the accuracy claims"),
    "real_odometer": ("true or false", "Whether odometer and start have realistic errors"),
    "who": ("text", "paper, ours, one angle (ours with a single angle at the start) or bound"),
    "rms_low_m": ("m", "Lower end of the 95 % interval of rms_error_m over the runs"),
    "rms_high_m": ("m", "Upper end of the 95 % interval of rms_error_m over the runs"),
    "what": ("text", "Open choice of the paper"),
    "value": ("text", "Chosen value, or the alternative"),
    "why": ("text", "Reason for the choice"),
    "is_shipped": ("true or false", "Whether the shipped interpretation has this value"),
    "rms_std_m": ("m", "Standard deviation of rms_error_m over the runs"),
    "fixed_rms_m": ("m", "rms_error_m of MUSIC every 80 ms"),
    "every_ssb_rms_m": ("m", "rms_error_m of MUSIC at every SSB"),
    "constant_ms": ("ms", "Constant wake-up time that replaces the controller"),
    "constant_aoa_estimates": ("1", "aoa_estimates with the constant"),
    "constant_rms_m": ("m", "rms_error_m with the constant"),
    "gain_m": ("m", "constant_rms_m minus rms_error_m, on equal runs"),
    "gain_low_m": ("m", "Lower end of the paired 95 % interval of gain_m"),
    "gain_high_m": ("m", "Upper end of the paired 95 % interval of gain_m"),
    "matters": ("1", "1: the controller helps; -1: it harms; 0: no difference of 5 % of the error"),
    "map": ("true or false", "Whether the tracker knows the course of the road"),
    "worst_error_m": ("m", "The larger of worst_error_x_m and worst_error_y_m"),
    "papers_aoa_estimates": ("1", "aoa_estimates of the paper's adaptive point"),
    "papers_energy_j": ("J", "energy_j of the paper's adaptive point"),
    "papers_worst_m": ("m", "worst_error_m of the paper's adaptive point"),
    "papers_rms_m": ("m", "rms_error_m of the paper's adaptive point"),
    "rms_error_reduction_m": ("m", "papers_rms_m minus rms_error_m, on equal runs"),
    "rms_error_reduction_low_m": (
        "m",
        "Lower end of the paired 95 % interval of rms_error_reduction_m",
    ),
    "rms_error_reduction_high_m": (
        "m",
        "Upper end of the paired 95 % interval of rms_error_reduction_m",
    ),
    "estimates_saved": ("1", "papers_aoa_estimates minus angle estimates, on equal runs"),
    "estimates_saved_low": ("1", "Lower end of the paired 95 % interval of estimates_saved"),
    "estimates_saved_high": ("1", "Upper end of the paired 95 % interval of estimates_saved"),
    "claim": ("text", "Short name of the claim"),
    "dimension": ("text", "Open choice of the paper"),
    "first": ("1", "First-order Sobol index of the claim's margin"),
    "total": ("1", "Total Sobol index of the claim's margin"),
    "first_low": ("1", "Lower end of the 95 % interval of first"),
    "first_high": ("1", "Upper end of the 95 % interval of first"),
    "total_low": ("1", "Lower end of the 95 % interval of total"),
    "total_high": ("1", "Upper end of the 95 % interval of total"),
    "share_met": ("1", "Share of the drawn interpretations that meet the claim"),
    "share_met_low": ("1", "Lower end of the 95 % interval of share_met"),
    "share_met_high": ("1", "Upper end of the 95 % interval of share_met"),
    "explained_variance": (
        "1",
        "Share of the variance of the claim's margin that the polynomial expansion explains",
    ),
    "interpretation_index": ("1", "Number of the drawn interpretation, from 0"),
    "environment_index": (
        "1",
        "Number of the environment, from 0; interpretations of one environment differ in the "
        "controller only",
    ),
    "coordinate": ("1", "Position in the range of the open choice, from 0 to 1"),
    "num_choices": ("1", "Number of values of the open choice; 0 for a continuous range"),
    "drawn_value": ("text", "Value at the coordinate"),
    "margin": (
        "1",
        "Margin of the claim relative to the value of the paper; at least 0 if the claim is met",
    ),
    # Recordings.
    "name": ("text", "Name of the radio head"),
    "recording": ("text", "Path of the recording"),
    "ssb_index_is_guess": (
        "true or false",
        "Whether no PBCH was decoded, so that ssb_index is not certain",
    ),
    "half_frame": ("1", "Half of the radio frame, 0 or 1"),
    "sfn": ("1", "System frame number"),
    "cfo_hz": ("Hz", "Carrier frequency offset"),
    "sample_start": ("1", "Sample nearest to the start of the SSB or burst"),
    "sample_offset": ("1", "Start of the SSB minus sample_start, in samples"),
    "mib_bits": ("text", "The 24 bits of the message (MIB)"),
    "ssb_freq_hz": ("Hz", "Centre of the SSB"),
    "scs_khz": ("kHz", "Subcarrier spacing"),
    "lmax": ("1", "SSB candidates in a half frame"),
    "rsrp_dbfs": ("dB", "Received power per resource element and channel, relative to full scale"),
    "rsrq_db": ("dB", "Received quality per channel"),
    "sinr_db": ("dB", "Signal to interference and noise ratio per channel"),
    "angle_deg": ("°", "Angle of arrival from the array's axis"),
    "azimuth_deg": (
        "°",
        "Azimuth from broadside, counter-clockwise: 90° − angle_deg; of an array that is not "
        "linear from its x axis",
    ),
    "elevation_deg": ("°", "Elevation from the horizontal"),
    "azimuth_from_broadside_deg": ("°", "Azimuth from broadside, counter-clockwise"),
    "sigma_deg": (
        "°",
        "Standard deviation of the angle caused by noise and, if `doubt` names reflections, by "
        "them; without mounting errors of the array",
    ),
    "label": ("text", "Label of the annotation"),
    "truth_deg": ("°", "Annotated azimuth from broadside"),
}

GLOSSARY: Mapping[str, Column] = {
    name: Column(name, unit, meaning) for name, (unit, meaning) in _GLOSSARY.items()
}
