//! Time offset between the clocks of angles or ranges and odometry, estimated before the drive is located.
//!
//! A plain filter predicts the measurements for each assumed time offset. The likelihood of its
//! innovations is the likelihood of the offset (Schweppe, IEEE Trans. IT 11(1), 1965). It is
//! searched on a grid and then by golden section (Kiefer, Proc. AMS 4, 1953). Start position, start
//! heading and odometer scale are estimated together with the offset, because they are confounded
//! on a straight road. Changes of speed and turns make the offset observable. On a straight drive
//! at constant speed, late angles resemble those of an earlier position.

use onboard::localize::ekf::EkfConfig;
use onboard::radio_head::RadioHead;
use onboard::settings::{LocalizerSettings, Site, Vehicle};

use super::diagnosis::{MAX_REJECTED_FRACTION, is_understood, spread};
use super::error::ReplayError;
use super::evidence::{Evidence, screened};
use super::hypotheses::Drive;
use super::innovations::plain_filter;
use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;
use crate::range_log::LoggedRange;

/// Maximum time offset of the search in either direction (s); buffers and drivers are assumed to
/// delay by at most one second.
const MAX_S: f64 = 1.5;
/// Spacing of the search grid (s), less than the time over which the speed changes.
const GRID_S: f64 = 0.5;

/// Resolution of the search (s); a drive of two minutes determines the offset to about 0.02 s.
const FINEST_S: f64 = 0.005;

/// Distance from the maximum at which the curvature of the likelihood is evaluated (s): several
/// odometry samples, because the likelihood ripples between samples.
const ASIDE_S: f64 = 0.1;

/// Minimum time offset that is corrected (s), 0.04 m at walking pace.
pub const MIN_ANGLE_TIME_OFFSET_S: f64 = 0.03;

/// Standard deviation of the start position (m), estimated together with the time offset because
/// both are confounded on a straight road.
const DOUBTED_START_STD_M: f64 = 10.0;
/// Standard deviation of the start heading (rad), estimated together with the time offset.
const DOUBTED_HEADING_STD_RAD: f64 = 0.2;
/// Standard deviation of the odometer scale as a multiple of the specified one, estimated together
/// with the time offset.
const DOUBTED_SCALE_STDS: f64 = 3.0;

/// Minimum log-likelihood ratio for a correction. Without an offset, twice the ratio is χ²
/// distributed with one degree of freedom (Wilks 1938), which exceeds 20 with a probability of
/// 8e-6. The search over ±1.5 s has about 30 independent trials, so that the false-alarm rate is
/// 2.4e-4 per drive.
const CORRECTION_LOG_ODDS: f64 = 10.0;

/// Number of parts of a drive whose log-likelihood ratios are compared. The ranges of a blocked path have one error for several
/// seconds, so that a part can favour a wrong time offset by 50. Most parts favour a true one.
const PARTS: usize = 64;

/// Minimum sum of these ratios, relative to the root of the sum of their squares: with random signs, a standard normal
/// variable. 17 of 18 drives without an offset and with blocked paths are below it, seven drives with an offset above it
/// (notes/experiments.md).
const CONSISTENT: f64 = 2.4;

/// Minimum log-likelihood ratio of a time offset per range: the variance of the innovations then decreases by 2 %. The
/// estimated noise of two filters differs by almost as much in a drive whose offset is not observable (0.008 per range).
const MIN_GAIN: f64 = 0.01;

/// Duration from the first angle that is evaluated (s); it is limited because clocks drift.
const SPAN_S: f64 = 300.0;

/// Minimum log-likelihood ratio for an uncertain offset: two standard deviations of one parameter,
/// which one of 22 drives without an offset exceeds if the errors are white (Wilks, Ann. Math.
/// Statist. 9(1), 1938).
const DOUBT_LOG_ODDS: f64 = 2.0;

/// Standard deviation of an uncertain offset that becomes a filter state (s). In drives of two
/// minutes, this is the error of the search on roads with few bends and speed changes
/// (notes/experiments.md).
const DOUBTED_STD_S: f64 = 0.1;

/// Time offset of the angles according to the odometry's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "every name ends with its unit")]
pub struct AngleTimeOffset {
    /// Estimated time offset (s).
    pub found_s: f64,
    /// Standard deviation of the remaining offset, which the localizer's filter estimates (s).
    pub left_std_s: f64,
    /// Most probable offset (s), even if it is uncertain.
    pub candidate_s: f64,
}

/// Returns the time offset of a drive's angles if it is relevant, explains the angles, and is
/// significant. An offset that is only somewhat more likely than none is left to the filter as a
/// state. If the settings specify a standard deviation of the offset, the localizer's filter
/// estimates it.
///
/// # Errors
/// [`ReplayError::Settings`] if the road cannot be built.
pub fn angle_time_offset(given: &Drive<'_>) -> Result<Option<AngleTimeOffset>, ReplayError> {
    let vehicle = &given.vehicle;
    let is_tracker = matches!(vehicle.localizer, LocalizerSettings::Tracker(_));
    let is_stated = vehicle.receiver.angle_time_offset_std_s.is_some();
    if !is_tracker || !vehicle.start.known || is_stated {
        return Ok(None);
    }
    let mut given = spread(given);
    let first_s = given.angles.first().map_or(0.0, |it| it.measured.time_s);
    given
        .angles
        .to_mut()
        .retain(|it| it.measured.time_s - first_s < SPAN_S);
    let filter_std_s = EkfConfig::new(&given.site, vehicle).angle_time_offset_std_s;
    // The offset is searched for, so that it must not be a filter state as well.
    given.vehicle.to_mut().receiver.angle_time_offset_std_s = Some(0.0);
    let as_stated = given.clone();
    doubt(&given.site, given.vehicle.to_mut());
    let of = |late_s: f64| {
        let mut corrected = given.clone();
        corrected.vehicle.to_mut().receiver.angle_time_offset_s += late_s;
        screened(&corrected)
    };
    let log_likelihood =
        |of: Option<Evidence>| of.map_or(f64::NEG_INFINITY, |it| it.relative_log_likelihood);
    let mut likelihood = |late_s: f64| Ok(log_likelihood(of(late_s)?));
    let Some((found_s, in_time)) = most_probable(&mut likelihood)? else {
        return Ok(None);
    };
    let Some(at_best) = of(found_s)?.filter(is_understood) else {
        return Ok(None);
    };
    let at_best = at_best.relative_log_likelihood;
    let mut log_odds = at_best - in_time;
    if log_odds >= DOUBT_LOG_ODDS {
        // A drive that agrees with its specified start needs no offset. A filter with an uncertain
        // start is far from linear at first, and its likelihood without an offset can be too small.
        log_odds = log_odds.min(at_best - log_likelihood(screened(&as_stated)?));
    }
    if log_odds < DOUBT_LOG_ODDS {
        return Ok(None);
    }
    if log_odds < CORRECTION_LOG_ODDS {
        return Ok(Some(AngleTimeOffset {
            found_s: 0.0,
            left_std_s: DOUBTED_STD_S.max(filter_std_s),
            candidate_s: found_s,
        }));
    }
    let neighbours = likelihood(found_s - ASIDE_S)? + likelihood(found_s + ASIDE_S)?;
    let curvature = (2.0 * at_best - neighbours) / (ASIDE_S * ASIDE_S);
    // The standard deviation is limited to the spacing of the search grid.
    let left_std_s = curvature.max(0.0).sqrt().recip().min(GRID_S);
    Ok(Some(AngleTimeOffset {
        found_s,
        left_std_s,
        candidate_s: found_s,
    }))
}

/// Returns the time offset of ranges (s) if it is relevant, explains the ranges, and is significant.
///
/// # Errors
/// [`ReplayError::Settings`] if the road cannot be built.
pub fn range_time_offset(
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    ranges: &[LoggedRange],
) -> Result<Option<f64>, ReplayError> {
    let mut doubted = vehicle.clone();
    doubt(site, &mut doubted);
    let heads = RadioHead::received_by(site, vehicle);
    let first_s = ranges.first().map_or(0.0, |it| it.measured.time_s);
    // All offsets are compared by the same ranges.
    let is_compared = |it: &&LoggedRange| {
        let time_s = it.measured.time_s;
        time_s - first_s < SPAN_S
            && odometry.covers(time_s - MAX_S)
            && odometry.covers(time_s + MAX_S)
    };
    let ranges: Vec<LoggedRange> = ranges.iter().filter(is_compared).copied().collect();
    let last_s = ranges.last().map_or(first_s, |it| it.measured.time_s);
    let part_s = (last_s - first_s) / PARTS as f64;
    let of = |vehicle: &Vehicle, late_s: f64| -> Result<([f64; PARTS], bool), ReplayError> {
        let mut ekf = plain_filter(site, vehicle)?;
        let mut samples = odometry.samples.iter().peekable();
        let (mut log_likelihood, mut rejected) = ([0.0; PARTS], 0);
        for logged in &ranges {
            let mut measured = logged.measured;
            measured.time_s -= late_s;
            while let Some(sample) = samples.next_if(|it| it.time_s <= measured.time_s) {
                ekf.odometry(sample);
            }
            let sends = |head: &&RadioHead| head.sends(logged.pci, logged.ssb_index);
            if let Some(head) = heads.iter().find(sends) {
                let part = ((logged.measured.time_s - first_s) / part_s) as usize;
                if let Some(sum) = log_likelihood.get_mut(part.min(PARTS - 1)) {
                    *sum += ekf.range_log_likelihood(head, &measured);
                }
                rejected += usize::from(!ekf.update_range(head, &measured).accepted);
            }
        }
        let is_understood = (rejected as f64) < MAX_REJECTED_FRACTION * ranges.len() as f64;
        Ok((log_likelihood, is_understood))
    };
    let mut likelihood = |late_s: f64| Ok(of(&doubted, late_s)?.0.iter().sum());
    let Some((found_s, _)) = most_probable(&mut likelihood)? else {
        return Ok(None);
    };
    let least = CORRECTION_LOG_ODDS.max(MIN_GAIN * ranges.len() as f64);
    // A filter with an uncertain start is far from linear at first, and its likelihood without an offset can be too small.
    for vehicle in [&doubted, vehicle] {
        let ((at_best, is_understood), (in_time, _)) = (of(vehicle, found_s)?, of(vehicle, 0.0)?);
        let ratios = (at_best.iter().zip(in_time)).map(|(best, other)| best - other);
        let (sum, squares) = ratios.fold((0.0, 0.0_f64), |(sum, squares), it| {
            (sum + it, squares + it * it)
        });
        if !is_understood || sum <= least.max(CONSISTENT * squares.sqrt()) {
            return Ok(None);
        }
    }
    Ok(Some(found_s))
}

/// Increases the standard deviations of start and odometer scale, which are estimated together with
/// the time offset.
fn doubt(site: &Site, vehicle: &mut Vehicle) {
    let scale_std = EkfConfig::new(site, vehicle).odometer_scale_std;
    vehicle.odometer.scale_std = DOUBTED_SCALE_STDS * scale_std;
    let start = &mut vehicle.start;
    start.position_std_m = start.position_std_m.max(DOUBTED_START_STD_M);
    start.heading_std_rad = start.heading_std_rad.max(DOUBTED_HEADING_STD_RAD);
}

/// Returns the most probable time offset, and the log-likelihood without one. `None` if the offset
/// is at the end of the search range, or irrelevant.
fn most_probable(
    likelihood: &mut impl FnMut(f64) -> Result<f64, ReplayError>,
) -> Result<Option<(f64, f64)>, ReplayError> {
    let mut best = (0.0, likelihood(0.0)?);
    let in_time = best.1;
    let steps = (MAX_S / GRID_S) as i32;
    for step in (-steps..=steps).filter(|step| *step != 0) {
        let late_s = GRID_S * f64::from(step);
        let tried = (late_s, likelihood(late_s)?);
        if tried.1 > best.1 {
            best = tried;
        }
    }
    // A likelihood that rises to the end of the search range has no maximum within it: on a straight
    // road from standstill, an earlier time is a shorter distance with fewer independent angles.
    if best.0.abs() >= MAX_S {
        return Ok(None);
    }
    let found_s = highest([best.0 - GRID_S, best.0 + GRID_S], likelihood)?;
    Ok((found_s.abs() >= MIN_ANGLE_TIME_OFFSET_S).then_some((found_s, in_time)))
}

/// Returns the angles with earlier time stamps, by `late_s` seconds.
pub fn earlier(angles: &[LoggedAngle], late_s: f64) -> Vec<LoggedAngle> {
    let mut angles = angles.to_vec();
    for angle in &mut angles {
        angle.ssb.time_s -= late_s;
        angle.measured.time_s -= late_s;
    }
    angles
}

/// Returns the position of the maximum of a unimodal function (golden section search).
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
    use std::borrow::Cow;

    use onboard::geometry::wrap_angle;
    use onboard::localize::{AngleMeasurement, MeasurementKind};
    use onboard::observation::{OdometrySample, SsbDetection};
    use onboard::radio_head::RadioHead;
    use onboard::settings::{Shipped, Site, TomlFile as _, Vehicle};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::odometry::OdometryLog;
    use crate::replay::innovations::plain_filter;
    use crate::replay::stated::as_stated;

    /// Standard deviation of the angles (rad).
    const SIGMA_RAD: f64 = 0.1;

    /// Interval of odometry and angles (s).
    const PERIOD_S: f64 = 0.02;

    /// Estimates the time offset of a drive that begins at standstill on a straight road, with
    /// angles of the same clock (s).
    fn estimated(seed: u64, duration_s: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let site = Site::from_library("yard", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("tugger", &Shipped).unwrap();
        let (site, mut vehicle) = as_stated(&site, &vehicle);
        vehicle.start.pose = Some(site.build_road().unwrap().unwrap().pose(0.0));
        let heads = RadioHead::received_by(&site, &vehicle);
        // Predicts exact angles.
        let mut exact = plain_filter(&site, &vehicle).unwrap();
        let (mut odometry, mut angles) = (OdometryLog::default(), vec![]);
        let mut distance_m = 0.0;
        for step in 0..(duration_s / PERIOD_S) as u32 {
            let time_s = PERIOD_S * f64::from(step);
            let speed_mps = (0.5 * time_s).min(4.0);
            distance_m += PERIOD_S * speed_mps;
            let sample = OdometrySample {
                time_s,
                distance_m,
                speed_mps,
                yaw_rate_radps: None,
            };
            exact.odometry(&sample);
            odometry.samples.push(sample);
            for head in &heads {
                let mut measured = AngleMeasurement {
                    kind: MeasurementKind::Angle,
                    time_s,
                    phase_rad: 0.0,
                    phase_sigma_rad: SIGMA_RAD,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                let evidence = exact.angle_evidence(head, &measured).unwrap();
                let predicted_rad = -evidence.innovation.residual;
                let noise: f64 = random.sample(StandardNormal);
                measured.phase_rad = wrap_angle(predicted_rad + SIGMA_RAD * noise);
                let ssb = SsbDetection {
                    pci: head.pci,
                    ssb_index: head.ssb_index,
                    time_s,
                    snr_db: 20.0,
                };
                angles.push(LoggedAngle { ssb, measured });
            }
        }
        let drive = Drive {
            site: Cow::Owned(site),
            vehicle: Cow::Owned(vehicle),
            odometry: Cow::Owned(odometry),
            angles: Cow::Owned(angles),
        };
        angle_time_offset(&drive)
            .unwrap()
            .map_or(0.0, |it| it.found_s)
    }

    #[test]
    fn angles_of_the_clock_of_the_odometry_are_not_shifted() {
        for (seed, duration_s) in [(1, 15.0), (2, 20.0), (3, 30.0)] {
            let found_s = estimated(seed, duration_s);
            assert!(found_s == 0.0, "{duration_s} s: {found_s} s");
        }
    }

    #[test]
    fn the_maximum_of_the_likelihood_is_found() {
        let mut of = |x: f64| Ok(-(x - 0.123).powi(2));
        let found = highest([-0.5, 0.5], &mut of).unwrap();
        assert!((found - 0.123).abs() < FINEST_S);
    }
}
