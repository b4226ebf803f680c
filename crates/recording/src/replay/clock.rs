//! Whether angles and odometry are of one clock: how much later angles come than they say, before any is located.
//!
//! A plain filter predicts the angles, each set back by so many seconds; what it says of them all together is the
//! likelihood of the lateness (Schweppe, IEEE Trans. IT 11(1), 1965), searched on a grid and then by golden section
//! (Kiefer, Proc. AMS 4, 1953). Start position, start heading and odometer scale are estimated together with it, because a
//! lateness is confounded with them on a straight road. Speed that changes and turns tell it: while a vehicle drives straight on, late angles are
//! those of a place further back.

use onboard::localize::ekf::EkfConfig;
use onboard::settings::LocalizerSettings;

use super::diagnosis::{is_understood, spread};
use super::error::ReplayError;
use super::evidence::{Evidence, screened};
use super::hypotheses::Drive;
use crate::angle_log::LoggedAngle;

/// Largest lateness that is looked for, either way (s; assumed: buffers and drivers take up to a second), and the grid's
/// spacing: less than over which speed changes.
const MOST_S: f64 = 1.5;
const GRID_S: f64 = 0.5;

/// How closely it is found (s): a drive of two minutes tells it to some 0.02 s.
const FINEST_S: f64 = 0.005;

/// From the best to where the curvature of the likelihood is taken (s): several odometry samples, between which it ripples.
const ASIDE_S: f64 = 0.1;

/// Smallest lateness that anybody minds (s): at walking pace 0.04 m.
pub const LEAST_LATENESS_S: f64 = 0.03;

/// Standard deviations of what a lateness is confounded with on a straight road, estimated together with it: start
/// position (m), start heading (rad), and odometer scale as a multiple of its specified deviation.
const DOUBTED_START_STD_M: f64 = 10.0;
const DOUBTED_HEADING_STD_RAD: f64 = 0.2;
const DOUBTED_SCALE_STDS: f64 = 3.0;

/// Minimum log-likelihood ratio for a correction. Twice the ratio is χ² with one degree of freedom without lateness (Wilks
/// 1938), which exceeds 20 with a probability of 8e-6. The search over ±1.5 s has about 30 independent trials: the
/// false-alarm rate is 2.4e-4 per drive.
const CORRECTION_LOG_ODDS: f64 = 10.0;

/// Time from the first angle on by which it is judged (s): two clocks run apart.
const SPAN_S: f64 = 300.0;

/// Log-odds from which two clocks are in doubt: two deviations of the one that is free, as one drive in 22 has in time
/// (Wilks, Ann. Math. Statist. 9(1), 1938), were its errors white.
const DOUBT_LOG_ODDS: f64 = 2.0;

/// Lateness that is left to the filter where it is in doubt (s): by drives of two minutes, what a road hides, whose bends
/// and changes of speed alone tell it (notes/experiments.md).
const DOUBTED_STD_S: f64 = 0.1;

/// How much later angles come than they say, by the odometry's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "every name ends with its unit")]
pub struct Lateness {
    /// The lateness (s).
    pub found_s: f64,
    /// Standard deviation of what is left of it to the localizer's filter (s).
    pub left_std_s: f64,
    /// Most probable offset (s), also if it is in doubt.
    pub candidate_s: f64,
}

/// The lateness of a drive's angles, where it is more than anybody minds, explains them, and is as much likelier than none
/// as anything that is free must be; where it is somewhat likelier all of it is left. Where its deviation is stated the
/// localizer's filter finds it within that.
///
/// # Errors
/// [`ReplayError::Settings`] for a road that cannot be built.
pub fn lateness(given: &Drive<'_>) -> Result<Option<Lateness>, ReplayError> {
    let vehicle = &given.vehicle;
    let is_tracker = matches!(vehicle.localizer, LocalizerSettings::Tracker(_));
    let is_stated = vehicle.receiver.lateness_std_s.is_some();
    if !is_tracker || !vehicle.start.known || is_stated {
        return Ok(None);
    }
    let mut given = spread(given);
    let first_s = given.angles.first().map_or(0.0, |it| it.measured.time_s);
    given
        .angles
        .to_mut()
        .retain(|it| it.measured.time_s - first_s < SPAN_S);
    let config = EkfConfig::new(&given.site, vehicle);
    let filter_std_s = config.lateness_std_s;
    let scale_std = config.odometer_scale_std;
    // What is searched for is no state of the filter as well.
    given.vehicle.to_mut().receiver.lateness_std_s = Some(0.0);
    let start = &mut given.vehicle.to_mut().start;
    start.position_std_m = start.position_std_m.max(DOUBTED_START_STD_M);
    start.heading_std_rad = start.heading_std_rad.max(DOUBTED_HEADING_STD_RAD);
    let odometer = &mut given.vehicle.to_mut().odometer;
    odometer.scale_std = DOUBTED_SCALE_STDS * scale_std;
    let of = |late_s: f64| {
        let mut meant = given.clone();
        meant.vehicle.to_mut().receiver.lateness_s += late_s;
        screened(&meant)
    };
    let log_likelihood =
        |of: Option<Evidence>| of.map_or(f64::NEG_INFINITY, |it| it.relative_log_likelihood);
    let mut likelihood = |late_s: f64| Ok(log_likelihood(of(late_s)?));
    let mut best = (0.0, likelihood(0.0)?);
    let in_time = best.1;
    let steps = (MOST_S / GRID_S) as i32;
    for step in (-steps..=steps).filter(|step| *step != 0) {
        let late_s = GRID_S * f64::from(step);
        let tried = (late_s, likelihood(late_s)?);
        if tried.1 > best.1 {
            best = tried;
        }
    }
    let around_s = [best.0 - GRID_S, best.0 + GRID_S];
    let found_s = highest(around_s, &mut likelihood)?;
    if found_s.abs() < LEAST_LATENESS_S {
        return Ok(None);
    }
    let Some(at_best) = of(found_s)?.filter(is_understood) else {
        return Ok(None);
    };
    let at_best = at_best.relative_log_likelihood;
    let log_odds = at_best - in_time;
    if log_odds < DOUBT_LOG_ODDS {
        return Ok(None);
    }
    if log_odds < CORRECTION_LOG_ODDS {
        return Ok(Some(Lateness {
            found_s: 0.0,
            left_std_s: DOUBTED_STD_S.max(filter_std_s),
            candidate_s: found_s,
        }));
    }
    let beside = likelihood(found_s - ASIDE_S)? + likelihood(found_s + ASIDE_S)?;
    let curvature = (2.0 * at_best - beside) / (ASIDE_S * ASIDE_S);
    // Never wider than where it was looked for by then.
    let left_std_s = curvature.max(0.0).sqrt().recip().min(GRID_S);
    Ok(Some(Lateness {
        found_s,
        left_std_s,
        candidate_s: found_s,
    }))
}

/// Angles that were taken so much earlier (s).
pub fn earlier(angles: &[LoggedAngle], late_s: f64) -> Vec<LoggedAngle> {
    let mut angles = angles.to_vec();
    for angle in &mut angles {
        angle.ssb.time_s -= late_s;
        angle.measured.time_s -= late_s;
    }
    angles
}

/// Where a function with one maximum in between has it.
fn highest(
    [mut low, mut high]: [f64; 2],
    of: &mut impl FnMut(f64) -> Result<f64, ReplayError>,
) -> Result<f64, ReplayError> {
    let share = 0.5 * (3.0 - 5f64.sqrt());
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut left, mut right) = (at(low, high, share), at(low, high, 1.0 - share));
    let (mut of_left, mut of_right) = (of(left)?, of(right)?);
    while high - low > FINEST_S {
        if of_left > of_right {
            (high, right, of_right) = (right, left, of_left);
            left = at(low, high, share);
            of_left = of(left)?;
        } else {
            (low, left, of_left) = (left, right, of_right);
            right = at(low, high, 1.0 - share);
            of_right = of(right)?;
        }
    }
    Ok(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_place_is_found() {
        let mut of = |x: f64| Ok(-(x - 0.123).powi(2));
        let found = highest([-0.5, 0.5], &mut of).unwrap();
        assert!((found - 0.123).abs() < FINEST_S);
    }
}
