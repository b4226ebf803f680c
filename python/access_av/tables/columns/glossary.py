"""What a column's name means, in whatever table it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Column:
    """What a column's name means, in whatever table it stands."""

    name: str
    unit: str
    meaning: str


# A unit of 1 is a count, a number without a unit or an index; text and truth values say so.
_GLOSSARY = {
    # A survey.
    "key": ("text", "Key in the site or vehicle file"),
    "before": ("any", "What was believed"),
    "std_before": ("any", "Standard deviation of that"),
    "found": ("any", "What the drives say, together with that"),
    "std": ("any", "Standard deviation of that"),
    "is_learnt": ("true or false", "The standard deviation has fallen by 30 % or more"),
    # Time, run, place.
    "run": ("1", "Number of the run"),
    "runs": ("1", "How many runs the row is of"),
    "time_s": ("s", "Time from the start of the drive, or by the recording's clock"),
    "x_m": ("m", "Place, x in the map's frame; of a drive, as estimated"),
    "y_m": ("m", "Place, y in the map's frame; of a drive, as estimated"),
    "heading_rad": ("rad", "Heading, counter-clockwise from +x; of a drive, as estimated"),
    "speed_mps": ("m/s", "Speed along the vehicle's heading"),
    "true_x_m": ("m", "True place, x"),
    "true_y_m": ("m", "True place, y"),
    "true_heading_rad": ("rad", "True heading"),
    "along_m": ("m", "Distance along the road from its start"),
    "distance_m": ("m", "Distance driven, by the odometer"),
    "yaw_rate_radps": ("rad/s", "Yaw rate, by the gyroscope"),
    "searching": ("true or false", "The first pose is not known yet"),
    "lost": (
        "true or false",
        "The angles come from elsewhere than expected; do not rely on the pose",
    ),
    # A study of a plant.
    "variant": ("text", "What was driven: as it is, a remedy, a way to operate, or a changed key"),
    "duration_s": ("s", "Duration of a trip"),
    "median_error_m": ("m", "Half of the horizontal errors within 5 m of the place are no larger"),
    "target_error_m": ("m", "So many of the horizontal errors as the target asks are no larger"),
    "within_share": ("1", "Share of the errors within 5 m of the place that are within the target"),
    "passes": ("true or false", "target_error_m is within the target"),
    "level_m": (
        "m",
        "Half of the protection levels within 5 m of the place, while ok, are lower",
    ),
    "reliable_share": ("1", "Share of the time within 5 m of the place that the state is ok"),
    "dilution_of_degree_m": (
        "m",
        "By how much an error of one degree in every angle shows along the road",
    ),
    "heads_visible": ("1", "Radio heads with an expected SNR of -6 dB or more"),
    "best_snr_db": ("dB", "Expected SNR of the strongest radio head"),
    "wake_up": ("text", "When the vehicle wakes up"),
    **{
        f"{part}_{extent}_j": ("J", f"Energy of a trip, {what}, {end}")
        for part, what in (
            ("estimates", "angle estimates"),
            ("listening", "the receiver while it listens"),
            ("idle", "the board that would idle, where the platform counts it"),
        )
        for extent, end in (("low", "at least"), ("value", "usual"), ("high", "at most"))
    },
    **{
        f"idle_{extent}_w": ("W", f"Drawn whether or not anything is estimated, {end}")
        for extent, end in (("low", "at least"), ("value", "usual"), ("high", "at most"))
    },
    "recommended": ("true or false", "The way to operate that is recommended"),
    "percent": ("1", "Which percentile of the horizontal error"),
    "percentile_m": ("m", "That percentile"),
    "percentile_low_m": ("m", "Low end of its 95 % interval"),
    "percentile_high_m": ("m", "High end of its 95 % interval"),
    "delta_m": (
        "m",
        "Percentile of the variant minus that of the first variant, in pairs of drives",
    ),
    "delta_low_m": ("m", "Low end of the 95 % interval of delta_m"),
    "delta_high_m": ("m", "High end of the 95 % interval of delta_m"),
    "lost_runs": ("1", "Drives with an error above 5 m for more than 5 s, or never a position"),
    "degraded_share": ("1", "Share of the time in state degraded"),
    # Errors of the position.
    "error_x_m": ("m", "Estimate minus truth, x"),
    "error_y_m": ("m", "Estimate minus truth, y"),
    "error_m": ("m", "Horizontal error: distance between estimate and truth"),
    "mean_abs_error_x_m": ("m", "Mean over the runs of the absolute error in x"),
    "mean_abs_error_y_m": ("m", "Mean over the runs of the absolute error in y"),
    "worst_error_x_m": ("m", "Largest mean_abs_error_x_m along the track"),
    "worst_error_y_m": ("m", "Largest mean_abs_error_y_m along the track"),
    "rms_error_m": (
        "m",
        "Root mean square of the horizontal error, over all runs and times of the row",
    ),
    "max_error_m": ("m", "Largest horizontal error"),
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
        f"p{percent.replace('.', '_')}_error_m": ("m", f"{percent}th percentile of the same")
        for percent in ("90", "95", "99", "99.9")
    },
    **{
        f"p{percent}_error_{end}_m": (
            "m",
            f"{end.capitalize()} end of the 95 % interval of `p{percent}_error_m`, by the "
            "bootstrap over whole runs",
        )
        for percent in ("50", "90", "95", "99", "99_9")
        for end in ("low", "high")
    },
    "rms_heading_error_rad": ("rad", "Root mean square of the heading error over the runs"),
    # What the localizer says of its own error.
    "covariance_xx_m2": ("m²", "Variance of x, by the localizer"),
    "covariance_yy_m2": ("m²", "Variance of y, by the localizer"),
    "covariance_xy_m2": ("m²", "Covariance of x and y, by the localizer"),
    "covariance_heading_rad2": ("rad²", "Variance of the heading, by the localizer"),
    "covariance_x_heading_m_rad": ("m·rad", "Covariance of x and heading, by the localizer"),
    "covariance_y_heading_m_rad": ("m·rad", "Covariance of y and heading, by the localizer"),
    "protection_level_m": ("m", "Horizontal protection level"),
    "protection_level_along_m": ("m", "Protection level along the vehicle's heading"),
    "protection_level_across_m": ("m", "Protection level across it"),
    "integrity": ("text", "State of integrity: ok, degraded, unavailable"),
    "nees": (
        "1",
        "Normalised estimation error squared of the position; 2 on average if consistent",
    ),
    "mean_nees": ("1", "Mean of nees over the runs"),
    "band_low": ("1", "Low end of the 95 % band of mean_nees of a consistent localizer"),
    "band_high": ("1", "High end of it"),
    "in_band": ("true or false", "mean_nees is within the band"),
    "z_m": ("m", "Height, counted as the array's is"),
    "p90_bound_m": ("m", "90th percentile along the route of the least RMS error"),
    # Integrity campaigns.
    "mismatch": ("text", "How the world departs from what is believed"),
    "channel": ("text", "The channel, as the campaign was told"),
    "heads": ("1", "Radio heads listened to"),
    "availability": ("1", "Share of the steps in state ok"),
    "unavailable_share": ("1", "Share of the steps in state unavailable"),
    "exceedances": ("1", "Steps in state ok whose error lay beyond the protection level"),
    "exceedance_share": ("1", "The same by the steps in state ok"),
    "exceedance_share_low": ("1", "Low end of its 95 % interval, by the bootstrap over runs"),
    "exceedance_share_high": ("1", "High end of it"),
    "runs_with_exceedances": ("1", "Runs with at least one of them"),
    "time_to_alert_s": ("s", "Longest time beyond the alert limit in state ok"),
    "level_over_error": ("1", "Median of protection level by horizontal error"),
    "asked_risk_per_hour": ("1", "Target integrity risk: `integrity.risk_per_hour` of the vehicle"),
    "risk_per_hour": (
        "1",
        "How often an hour in state ok brings an error beyond the level, by peaks over a threshold",
    ),
    "risk_per_hour_low": ("1", "Low end of its 95 % interval, by the bootstrap over runs"),
    "risk_per_hour_high": ("1", "High end of it"),
    # Channels.
    "line_of_sight": ("true or false", "There is a line of sight"),
    "path_loss_db": ("dB", "Path loss, without shadowing and fading"),
    "shadowing_db": ("dB", "Shadowing; positive is more power"),
    "rician_k_db": ("dB", "Power of the line of sight over that of the scatter"),
    "delay_spread_s": ("s", "Root-mean-square delay spread, as drawn"),
    "azimuth_spread_deg": ("°", "Root-mean-square azimuth spread of arrival, as drawn"),
    "zenith_spread_deg": ("°", "Root-mean-square zenith spread of arrival, as drawn"),
    "paths_delay_spread_s": ("s", "Root-mean-square delay spread of the paths that came of it"),
    "paths_azimuth_spread_deg": ("°", "Circular azimuth spread of arrival of these paths"),
    # SSBs, SNR, angles.
    "pci": ("1", "Physical cell identity"),
    "ssb_index": ("1", "Index of the SSB: the beam"),
    "snr_db": ("dB", "SNR that the receiver measured of the SSB or burst"),
    "estimator_snr_db": ("dB", "SNR per antenna and snapshot that the angle estimator found"),
    "true_snr_db": ("dB", "SNR of the strongest radio head by link budget and shadowing"),
    "mean_true_snr_db": ("dB", "Mean over the runs of true_snr_db"),
    "phase_rad": ("rad", "Electrical angle ω = 2π(d/λ)·cos θ between neighbouring antennas"),
    "phase_sigma_rad": (
        "rad",
        "Standard deviation of phase_rad by the receiver's noise alone; in a log of angles all of "
        "the error, noise and the site's scatter",
    ),
    "phase_noise_sigma_rad": ("rad", "The part of phase_sigma_rad by the receiver's noise alone"),
    "angle_rad": ("rad", "Angle of arrival θ from the array's axis"),
    "resolved": ("true or false", "The estimator vouches for the angle's standard deviation"),
    "accepted": ("true or false", "The localizer used the angle"),
    "reason": (
        "text",
        "Why the angle was taken or left: consistent, outlier, unusable, unknown radio head, "
        "too late, excluded",
    ),
    "mahalanobis_squared": ("1", "Squared Mahalanobis distance of the angle from the expected one"),
    "threshold": ("1", "The largest mahalanobis_squared that is accepted"),
    # Wake-up and energy.
    "wake_up_time_s": ("s", "Wake-up time in force"),
    "base_wake_up_ms": ("ms", "Base wake-up time, or the fixed interval"),
    "design": ("1", "Number of the design"),
    "choice": ("text", "What was chosen for it, of the keys that differ between designs"),
    "world": (
        "text",
        "World in which it was driven; of several, the one in which its RMS error is largest",
    ),
    "p90_max_error_m": ("m", "Largest horizontal error of a run, 90th percentile of the runs"),
    "on_front": ("true or false", "No other design is better in energy and error with 95 %"),
    "executions": ("1", "Angle estimates in a run; of several runs their mean"),
    "listened": ("1", "SSB bursts listened to"),
    "longest_gap_s": (
        "s",
        "Longest time between two angle estimates; 0 with fewer",
    ),
    "energy_j": ("J", "Energy of a run; of several runs their mean"),
    "energy_executions_j": ("J", "Of it, for angle estimates"),
    "energy_listening_j": ("J", "Of it, for listening"),
    "energy_idle_j": ("J", "Of it, while idle"),
    "energy_per_execution_j": ("J", "Energy of one angle estimate"),
    "energy_provenance": (
        "text",
        "Where energy_per_execution_j is from: measured, fitted, datasheet, assumed",
    ),
    "found_s": ("s", "Time until the first pose was known"),
    "found_m": ("m", "Distance driven until the first pose was known"),
    # What a drive showed of its vehicle.
    "constant": ("text", "Key of the vehicle's file; gyroscope.scale is 1 there"),
    "constant_unit": ("text", "Its unit"),
    "stated_value": ("any", "What the file states"),
    "found_value": ("any", "What was found on the way, by the end of the drive"),
    "found_value_std": ("any", "Standard deviation of found_value"),
    # Bound.
    "bound_m": ("m", "Least root mean square of the horizontal error of any localizer"),
    "along_std_m": ("m", "Its part along the road"),
    "across_std_m": ("m", "Its part across the road"),
    "heading_std_rad": ("rad", "Least root mean square of the heading's error"),
    "odometer_scale_std": ("1", "Least root mean square of the error of the odometer's scale"),
    "nearest_m": ("m", "Least distance from the route"),
    "farthest_m": ("m", "Largest distance from the route"),
    "least_expected_snr_db": (
        "dB",
        "Least SNR on the route, where it is in sight, by the link budget alone",
    ),
    "most_expected_snr_db": (
        "dB",
        "Largest SNR on the route, where it is in sight, by the link budget alone",
    ),
    "visible_share": ("1", "Share of the route's SSBs that 3GPP wants detected (−6 dB or more)"),
    # Operating points and claims.
    "reading": ("text", "Name of the reading of the paper"),
    "campaign": (
        "text",
        "P: every SSB; Q: fixed at what the computer manages; R: adaptive; constant: in place of "
        "Algorithm 1; front: MUSIC at fixed intervals; tracker: that of this project; equal: both "
        "with equal information",
    ),
    "mode": ("1", "Power mode of the platform"),
    "mode_name": ("text", "Its name"),
    "method": ("text", "Angle-of-arrival method: music, esprit, root_music"),
    "adaptive": ("true or false", "The wake-up time adapts"),
    "id": ("text", "Short name"),
    "says": ("text", "What the paper says"),
    "where": ("text", "Section of the paper"),
    "stated": ("any", "The paper's value: a number, a list or a table of numbers"),
    "obtained": ("any", "Ours, in the same shape"),
    "unit": ("text", "Unit of stated and obtained"),
    "verdict": (
        "text",
        "Of a claim: reproduced or not reproduced; agrees or differs, by arithmetic or by "
        "construction; not judged; not testable. Of an angle: resolved, or why noise and geometry "
        "leave it in doubt",
    ),
    "doubt": (
        "text",
        "Why the angle may not be relied on: of the verdict, or a plane wave that does not fit; "
        "empty where it may",
    ),
    "p_value": ("1", "Probability that a plane wave in white noise fits as badly or worse"),
    "interval": ("any", "95 % interval of obtained over the runs, in its shape"),
    "deviation": ("1", "Maximum relative deviation of obtained from stated"),
    "tolerance": ("1", "Maximum deviation with which the claim is met"),
    "met_by_seed": ("any", "With each seed whether it is met; empty where it was judged with one"),
    "turns_with_seed": ("true or false", "Other runs may give another verdict"),
    "evidence": (
        "text",
        "What the verdict is worth: independent, calibrated, by construction, or "
        "arithmetic; empty where it is not testable",
    ),
    "note": ("text", "What else there is to say"),
    "spread": (
        "any",
        "How far single trips depart from a mean over the runs; empty where it is none",
    ),
    "freedom": ("text", "What the energy fit is free in, beside what the rows above are"),
    "free_numbers": ("1", "Numbers that are free, all rows above included"),
    "solved_numbers": ("1", "How many of them are solved for from stated figures"),
    "claims_reproduced": ("1", "Number of claims reproduced under the shown reading"),
    "agree_by_construction": (
        "1",
        "Number of claims that agree by construction; not in claims_reproduced",
    ),
    "agree_by_arithmetic": (
        "1",
        "Number of claims that agree by arithmetic; not in claims_reproduced",
    ),
    "average_saving_percent": ("1", "Per cent, what e4 is about, under the shown reading"),
    "keep_energy": ("text", "Readings that keep the energy half"),
    "keep_both": ("text", "Readings that keep both halves"),
    "real_odometer": ("true or false", "Odometer and start have the errors of real ones"),
    "who": ("text", "paper, ours, one angle (ours with one, at the start) or bound"),
    "rms_low_m": ("m", "Low end of the 95 % interval of rms_error_m over the runs"),
    "rms_high_m": ("m", "High end of it"),
    "what": ("text", "What the paper leaves open"),
    "value": ("text", "What was chosen, or what instead"),
    "why": ("text", "Why"),
    "is_shipped": ("true or false", "It is what the shipped reading has"),
    "rms_std_m": ("m", "Standard deviation of rms_error_m by the runs"),
    "fixed_rms_m": ("m", "rms_error_m of MUSIC every 80 ms"),
    "every_ssb_rms_m": ("m", "rms_error_m of MUSIC at every SSB"),
    "constant_ms": ("ms", "Constant wake-up time in the place of the controller's"),
    "constant_executions": ("1", "executions with the constant"),
    "constant_rms_m": ("m", "rms_error_m with the constant"),
    "gain_m": ("m", "By how much rms_error_m is less with the controller, on the same runs"),
    "gain_low_m": ("m", "Low end of its paired 95 % interval"),
    "gain_high_m": ("m", "High end of it"),
    "matters": ("1", "1: the controller helps; -1: it harms; 0: no difference of 5 % of the error"),
    "map": ("true or false", "Our tracker knows the road's course"),
    "worst_error_m": ("m", "The larger of worst_error_x_m and worst_error_y_m"),
    "papers_executions": ("1", "executions of the paper's adaptive point"),
    "papers_energy_j": ("J", "energy_j of the paper's adaptive point"),
    "papers_worst_m": ("m", "worst_error_m of the paper's adaptive point"),
    "papers_rms_m": ("m", "rms_error_m of the paper's adaptive point"),
    "error_less_m": ("m", "By how much our rms_error_m is less, on the same runs"),
    "error_less_low_m": ("m", "Low end of its paired 95 % interval"),
    "error_less_high_m": ("m", "High end of it"),
    "executions_less": ("1", "By how much our executions are less, on the same runs"),
    "executions_less_low": ("1", "Low end of its paired 95 % interval"),
    "executions_less_high": ("1", "High end of it"),
    "claim": ("text", "Id of the claim"),
    "dimension": ("text", "What the paper leaves open"),
    "first": ("1", "First-order Sobol index of the claim's margin"),
    "total": ("1", "Total Sobol index of it"),
    "first_low": ("1", "Low end of the 95 % interval of first"),
    "first_high": ("1", "High end of it"),
    "total_low": ("1", "Low end of the 95 % interval of total"),
    "total_high": ("1", "High end of it"),
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
    "sample_start": ("1", "Sample nearest to the beginning"),
    "sample_offset": ("1", "What is left from sample_start to the beginning, in samples"),
    "mib_bits": ("text", "The 24 bits of the message (MIB)"),
    "ssb_freq_hz": ("Hz", "Centre of the SSB"),
    "scs_khz": ("kHz", "Subcarrier spacing"),
    "lmax": ("1", "SSB candidates in a half frame"),
    "rsrp_dbfs": ("dB", "Received power of a resource element, a value per channel, to full scale"),
    "rsrq_db": ("dB", "Received quality, a value per channel"),
    "sinr_db": ("dB", "Signal to interference and noise, a value per channel"),
    "angle_deg": ("°", "Angle of arrival from the array's axis"),
    "azimuth_deg": (
        "°",
        "Azimuth from broadside, counter-clockwise: 90° − angle_deg; of antennas not in a row from "
        "their x axis",
    ),
    "elevation_deg": ("°", "Elevation from the horizontal"),
    "azimuth_from_broadside_deg": ("°", "Azimuth from broadside, counter-clockwise"),
    "sigma_deg": (
        "°",
        "Standard deviation of the angle: by noise and, where `doubt` names reflections, by what "
        "they displace; an array mounted askew is not in it",
    ),
    "label": ("text", "The annotation's label"),
    "truth_deg": ("°", "Annotated azimuth from broadside"),
}

GLOSSARY: Mapping[str, Column] = {
    name: Column(name, unit, meaning) for name, (unit, meaning) in _GLOSSARY.items()
}
