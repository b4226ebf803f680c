//! Plausibility of a vehicle file.

use std::f64::consts::TAU;

use super::usual::{
    Usual, as_centimetres, as_degrees, as_millimetres, as_milliseconds, as_percent, rounded,
    unusual,
};
use super::warning::Warning;
use crate::link_budget::NOISE_TEMPERATURE_K;
use crate::settings::Vehicle;

const TYRES: &str = "no tyre grips better than 1 g";
const KNOWN_NO_BETTER: &str = "with this uncertainty, the direction is unknown";

/// Usual ranges of numbers. They are wide, so that they contain the values of every real vehicle.
const ROWS: &[Usual] = &[
    Usual {
        key: "top_speed_kmh",
        within: [0.1, 100.0],
        why: "above the speed of any vehicle in a plant",
        write: |it| format!("write km/h: {it} m/min are {:.1}", it * 0.06),
    },
    Usual {
        key: "acceleration_mps2",
        within: [0.02, 9.81],
        why: TYRES,
        write: |it| format!("write m/s²: {it} km/h in a second are {:.2}", it / 3.6),
    },
    Usual {
        key: "lane_keeping.rms_m",
        within: [0.0, 3.0],
        why: "larger than the width of a lane",
        write: as_millimetres,
    },
    Usual {
        key: "array.rx_gain_dbi",
        within: [-20.0, 30.0],
        why: "an omnidirectional antenna has 0 to 8 dBi, a panel up to 25 dBi",
        write: |_| "write the gain of one antenna in dBi, without its amplifier's".to_owned(),
    },
    Usual {
        key: "array.position_m[0]",
        within: [-20.0, 20.0],
        why: "longer than any vehicle",
        write: |it| {
            format!(
                "write metres forward of the odometer's point: {it} cm are {}",
                rounded(it / 100.0)
            )
        },
    },
    Usual {
        key: "array.position_m[1]",
        within: [-5.0, 5.0],
        why: "wider than any vehicle",
        write: |it| {
            format!(
                "write metres to the left of the odometer's point: {it} cm are {}",
                rounded(it / 100.0)
            )
        },
    },
    Usual {
        key: "array.position_m[2]",
        within: [0.0, 15.0],
        why: "an array is above the ground, and not above the highest vehicle",
        write: |it| {
            let height = if it < 0.0 { -it } else { rounded(it / 100.0) };
            format!("write metres above the ground, upwards: {height}")
        },
    },
    Usual {
        key: "array.position_std_m",
        within: [0.0, 0.5],
        why: "larger than the error of a tape measure",
        write: as_centimetres,
    },
    Usual {
        key: "array.mounting_std_rad",
        within: [0.0, 0.35],
        why: "the mounting error of an array is below 20 degrees",
        write: as_degrees,
    },
    Usual {
        key: "array.mounting_drift_rad_per_sqrt_m",
        within: [0.0, 0.05],
        why: "the array would turn by more than 90 degrees per kilometre",
        write: as_degrees,
    },
    Usual {
        key: "array.phase_std_rad",
        within: [0.0, 1.0],
        why: "angles cannot be estimated with channels of this phase uncertainty",
        write: as_degrees,
    },
    Usual {
        key: "array.phase_drift_rad_per_sqrt_m",
        within: [0.0, 0.1],
        why: "the phases would be unknown after a hundred metres",
        write: as_degrees,
    },
    Usual {
        key: "receiver.noise_figure_db",
        within: [0.0, 20.0],
        why: "the noise figure of a receiver is 2 to 12 dB",
        write: |it| {
            let db = 10.0 * (1.0 + it / NOISE_TEMPERATURE_K).log10();
            format!("write the noise figure in dB: a noise temperature of {it} K is {db:.1}")
        },
    },
    Usual {
        key: "odometer.scale",
        within: [0.8, 1.25],
        why: "wear and load change the wheel radius by a few percent",
        write: |_| "write measured metres per metre driven: about 1".to_owned(),
    },
    Usual {
        key: "odometer.scale_std",
        within: [0.0, 0.1],
        why: "wear and load cause a scale error of a few percent at most",
        write: as_percent,
    },
    Usual {
        key: "odometer.noise_m_per_sqrt_m",
        within: [0.0, 0.5],
        why: "the error of wheel odometry is below half a metre per metre",
        write: as_percent,
    },
    Usual {
        key: "odometer.noise_m_per_sqrt_s",
        within: [0.0, 0.5],
        why: "larger than the apparent motion of a vehicle at standstill per second",
        write: as_millimetres,
    },
    Usual {
        key: "odometer.speed_noise_mps",
        within: [0.0, 1.0],
        why: "the speed error of wheel odometry is below walking speed",
        write: |it| format!("write m/s: {it} mm/s are {}", rounded(it / 1000.0)),
    },
    Usual {
        key: "odometer.track_width_m",
        within: [0.05, 6.0],
        why: "wider than any vehicle's track",
        write: |it| format!("write metres: {it} feet are {:.2}", it * 0.3048),
    },
    Usual {
        key: "odometer.track_width_std_m",
        within: [0.0, 0.2],
        why: "larger than the error of a tape measure",
        write: as_millimetres,
    },
    Usual {
        key: "odometer.dropout_probability",
        within: [0.0, 0.5],
        why: "more samples would be lost than received",
        write: as_percent,
    },
    Usual {
        key: "gyroscope.noise_rad_per_sqrt_s",
        within: [0.0, 0.1],
        why: "gyroscopes have 1e-5 to 1e-3 rad/√s, pairs of wheels up to 0.05 rad/√s",
        write: |it| format!("write rad/√s: {it} °/√h are {:.1e}", it.to_radians() / 60.0),
    },
    Usual {
        key: "gyroscope.bias_radps",
        within: [-0.2, 0.2],
        why: "the bias of any gyroscope is below 0.1 rad/s",
        write: |it| format!("write rad/s: {it} °/h are {:.1e}", it.to_radians() / 3600.0),
    },
    Usual {
        key: "gyroscope.bias_std_radps",
        within: [0.0, 0.2],
        why: "the bias of any gyroscope is below 0.1 rad/s",
        write: |it| format!("write rad/s: {it} °/h are {:.1e}", it.to_radians() / 3600.0),
    },
    Usual {
        key: "gyroscope.bias_walk_radps_per_sqrt_s",
        within: [0.0, 0.02],
        why: "the bias would be unknown after minutes",
        write: |it| {
            format!(
                "write rad/s per √s: {it} degrees are {:.1e}",
                it.to_radians()
            )
        },
    },
    Usual {
        key: "start.position_std_m",
        within: [0.0, 200.0],
        why: "a start with this uncertainty is an unknown start",
        write: |it| format!("{}, or start.known = false", as_millimetres(it)),
    },
    Usual {
        // A uniformly distributed heading has a standard deviation of π/√3.
        key: "start.heading_std_rad",
        within: [0.0, 1.82],
        why: KNOWN_NO_BETTER,
        write: as_degrees,
    },
    Usual {
        key: "start.pose.heading_rad",
        within: [-TAU, TAU],
        why: "more than a full turn",
        write: as_degrees,
    },
    Usual {
        key: "integrity.alert_limit_m",
        within: [0.01, 100.0],
        why: "no plant can use a position with this uncertainty",
        write: as_millimetres,
    },
    Usual {
        key: "wake_up.interval_ms",
        within: [1.0, 3.6e6],
        why: "the minimum SSB period is 5 ms",
        write: as_milliseconds,
    },
    Usual {
        key: "wake_up.t_max_ms",
        within: [1.0, 3.6e6],
        why: "the minimum SSB period is 5 ms",
        write: as_milliseconds,
    },
    Usual {
        key: "wake_up.target_error_m",
        within: [0.005, 50.0],
        why: "not a plausible target for the position error",
        write: as_millimetres,
    },
];

/// Returns the warnings of a vehicle.
pub fn of_vehicle(vehicle: &Vehicle) -> Vec<Warning> {
    let mut found = unusual(vehicle, ROWS);
    found.extend(speed_in_mps("top_speed_kmh", vehicle.top_speed_kmh));
    found
}

/// Returns a warning if a speed in km/h is probably in m/s: it is not a round number of km/h or
/// m/s, but 3.6 times the value is. 1.08 km/h is a robot's 0.3 m/s, whereas 3.33 corresponds to 12
/// km/h.
pub fn speed_in_mps(key: &str, speed_kmh: f64) -> Option<Warning> {
    let is_round = |value: f64, step: f64| (value / step - (value / step).round()).abs() < 1e-6;
    let intended_kmh = (speed_kmh * 3.6).round();
    // The value equals the speed in m/s to two decimal places.
    let fits = intended_kmh >= 1.0 && (intended_kmh / 3.6 - speed_kmh).abs() <= 0.005;
    let doubtful = fits && !is_round(speed_kmh, 0.1) && !is_round(speed_kmh / 3.6, 0.05);
    doubtful.then(|| Warning {
        key: key.to_owned(),
        value: speed_kmh.to_string(),
        why: format!("{intended_kmh} km/h are {speed_kmh} m/s"),
        write: format!("write km/h: {intended_kmh}, or {speed_kmh:.1} if it is so slow"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_in_mps_is_distinguished_from_a_slow_vehicle() {
        for (written, intended) in [(3.33, 12), (2.78, 10), (4.17, 15), (1.39, 5), (0.83, 3)] {
            let suggestion = speed_in_mps("top_speed_kmh", written).map(|it| it.write);
            let wanted = format!("write km/h: {intended},");
            assert!(
                suggestion.is_some_and(|it| it.starts_with(&wanted)),
                "{written}"
            );
        }
        // Tenths of m/s up to 4 m/s, and whole and half km/h.
        let robots = (1..40).map(|tenths| f64::from(tenths) * 0.36);
        let round = (1..80).map(|halves| f64::from(halves) * 0.5);
        for speed_kmh in robots.chain(round) {
            assert_eq!(
                speed_in_mps("top_speed_kmh", speed_kmh),
                None,
                "{speed_kmh}"
            );
        }
    }
}
