//! Plausibility of the odometry's yaw rate.

use onboard::geometry::wrap_angle;
use onboard::observation::OdometrySample;

use super::located::LocatedPose;

/// Maximum difference of equal yaw rates (rad/s).
const CONSTANT_RADPS: f64 = 1e-9;

/// Time over which turns are compared (s).
const WINDOW_S: f64 = 2.0;

/// Minimum change of heading for a comparison (rad).
const MIN_TURNED_RAD: f64 = 0.5;

/// Maximum relative deviation of a ratio from an expected factor.
const ABOUT: f64 = 0.25;

/// Returns the yaw rate of a log in which it is constant; `None` otherwise.
pub fn constant_radps(samples: &[OdometrySample]) -> Option<f64> {
    let mut rates = samples.iter().map(|it| it.yaw_rate_radps);
    let first_radps = rates.next()??;
    let is_same =
        |rate: Option<f64>| rate.is_some_and(|it| (it - first_radps).abs() < CONSTANT_RADPS);
    rates.all(is_same).then_some(first_radps)
}

/// Returns the turn according to the yaw rate divided by the turn of the located vehicle. Returns
/// `None` if the vehicle hardly turned or the two are uncorrelated.
pub fn measured_per_true(poses: &[LocatedPose]) -> Option<f64> {
    let (mut cross_sum, mut true_square) = (0.0, 0.0);
    // Turn since the first pose, and its minimum and maximum.
    let (mut heading_rad, mut min_rad, mut max_rad) = (0.0, 0.0_f64, 0.0_f64);
    let mut measured_square = 0.0;
    let mut window = (poses.first()?, 0.0);
    for pair in poses.windows(2) {
        let [from, to] = pair else { continue };
        let step_s = to.estimate.time_s - from.estimate.time_s;
        window.1 += to.yaw_rate_radps? * step_s;
        let (since, measured) = window;
        if to.estimate.time_s - since.estimate.time_s < WINDOW_S {
            continue;
        }
        let (now, before) = (
            to.estimate.pose.heading_rad,
            since.estimate.pose.heading_rad,
        );
        let driven = wrap_angle(now - before);
        cross_sum += measured * driven;
        true_square += driven * driven;
        measured_square += measured * measured;
        heading_rad += driven;
        (min_rad, max_rad) = (min_rad.min(heading_rad), max_rad.max(heading_rad));
        window = (to, 0.0);
    }
    let correlation2 = cross_sum * cross_sum / (measured_square * true_square);
    let is_determined =
        max_rad - min_rad > MIN_TURNED_RAD && (measured_square == 0.0 || correlation2 > 0.5);
    is_determined.then_some(cross_sum / true_square)
}

/// Whether the ratio is close to a factor.
pub fn is_about(measured_per_true: f64, factor: f64) -> bool {
    (measured_per_true - factor).abs() < ABOUT * factor.abs()
}
