//! Diagnosis of misconfigurations: whether the files of a drive contain a systematic error.
//!
//! The localizer of the drive is run once more with the given files. If its angles deviate from the
//! predicted ones, each [configuration hypothesis](Hypothesis) is screened by a plain filter. The
//! best hypotheses are tested with the localizer itself by comparison of the likelihoods of its
//! innovations (multiple-model testing; Bar-Shalom, Li and Kirubarajan, Estimation with
//! Applications to Tracking and Navigation, 11.6). A reported hypothesis is far more likely than
//! the given files and consistent with the angles.

use std::collections::BTreeMap;

use onboard::geometry::{Point, Pose};
use onboard::radio_head::RadioHead;
use onboard::settings::{DriveKind, LocalizerSettings};

use super::direction::reversed_parts;
use super::error::ReplayError;
use super::evidence::{Count, Evidence, HeadId, head_of, screened};
use super::hypotheses::{
    Drive, Hypothesis, Subject, moved, of_drive, of_radio_heads, of_yaw_rate, robot,
};
use super::innovations::{plain_filter, replay_angles, vehicles_localizer};
use super::located::{Diagnosis, LocatedDrive};
use super::moved_head::triangulate;
use super::yaw_rate;
use crate::angle_log::LoggedAngle;
use crate::odometry::{OdometryFields, OdometryIssue};

/// Maximum number of angles used for the diagnosis, spread over the drive. Angles of one radio head
/// are at least [`MIN_SEPARATION_S`] apart.
const MAX_ANGLES: usize = 3000;
/// Minimum time between two used angles of a radio head (s).
const MIN_SEPARATION_S: f64 = 0.2;

/// Minimum log-likelihood ratio of a reported hypothesis: each has a prior probability of 1/1000,
/// and at most one of a thousand reports may be wrong.
const LOG_ODDS: f64 = 13.8;

/// Log-likelihood difference below which two hypotheses are indistinguishable, and both are
/// reported.
const AS_LIKELY: f64 = 5.0;

/// Maximum fraction of rejected angles or ranges of a correctly configured drive.
pub const MAX_REJECTED_FRACTION: f64 = 0.2;

/// Maximum fraction of a radio head's angles beyond three standard deviations from the prediction.
/// Correlated errors are estimated while driving, so that no angle is rejected because of them.
const MAX_MISFITS: f64 = 0.1;
/// Minimum number of angles of a radio head for the fraction [`MAX_MISFITS`].
const MIN_ANGLES_PER_HEAD: usize = 10;

/// Maximum number of hypotheses that are tested with the localizer itself.
const CONFIRMED: usize = 4;

/// Maximum log-likelihood difference to the best hypothesis of the filter for a test with the
/// localizer.
const CLOSE: f64 = 30.0;

/// Minimum displacement of a radio head that is reported (m).
const MIN_MOVED_M: f64 = 2.0;

/// Maximum change of the path by a harmless misconfiguration (m, RMS).
const HARMLESS_M: f64 = 0.5;

/// Minimum ratio of the speed to the vehicle's top speed that indicates another unit.
const TOO_FAST: f64 = 10.0;

/// Minimum median speed of a moving vehicle (m/s).
const CRAWLS_MPS: f64 = 0.05;

/// Returns the diagnoses of a drive.
///
/// # Errors
/// Errors of [`vehicles_localizer`].
pub fn diagnose(given: &Drive<'_>, located: &LocatedDrive) -> Result<Vec<Diagnosis>, ReplayError> {
    let is_tracker = matches!(given.vehicle.localizer, LocalizerSettings::Tracker(_));
    if !(is_tracker && given.vehicle.start.known) {
        let missing = missing_yaw_rate(given, !located.is_lost_for_long());
        return Ok(missing.into_iter().chain(too_fast(given)).collect());
    }
    let given = spread(given);
    let by_localizer = if located.is_lost_for_long() {
        None
    } else {
        confirmed(&given)?
    };
    let is_lost = by_localizer.is_none();
    // A lost localizer gives no predictions, so that those of a plain filter are used.
    let Some(as_given) = by_localizer.map_or_else(|| screened(&given), |it| Ok(Some(it)))? else {
        return Ok(Vec::new());
    };
    let is_sound = !is_lost && is_understood(&as_given);
    let mut found = Vec::new();
    if !is_sound {
        found = better_explanations(&given, hypotheses(&given)?, &as_given, is_lost)?;
    } else if located.poses.iter().any(|pose| pose.is_lost)
        && let Some(from_start) = screened(&given)?.filter(|it| !is_understood(it))
    {
        // The vehicle was found at another position. No filter could have continued from a wrong
        // start.
        let mut of_start = of_drive();
        of_start.retain(|it| it.subject == Subject::Start);
        found = better_explanations(&given, of_start, &from_start, false)?;
    }
    if found.is_empty() {
        found.extend(wrong_yaw_rate(&given, located, &as_given, is_sound)?);
    }
    if found.is_empty() {
        found.extend(too_fast(&given));
    }
    if found.is_empty() && !is_sound {
        found.extend(doubtful_odometry(&given));
    }
    found.extend(missing_yaw_rate(&given, is_sound));
    Ok(found)
}

/// Returns the drive with as many angles as the diagnosis needs, in order of time.
pub fn spread<'a>(given: &Drive<'a>) -> Drive<'a> {
    let heads = RadioHead::received_by(&given.site, &given.vehicle);
    let mut given = given.clone();
    let angles = given.angles.to_mut();
    let sends = |it: &LoggedAngle| {
        let (pci, ssb_index) = head_of(it);
        heads.iter().any(|head| head.sends(pci, ssb_index))
    };
    angles.retain(|it| sends(it));
    angles.sort_by(|a, b| a.measured.time_s.total_cmp(&b.measured.time_s));
    let mut apart_s = MIN_SEPARATION_S;
    loop {
        let mut last_s: BTreeMap<HeadId, f64> = BTreeMap::new();
        let mut kept = angles.clone();
        kept.retain(|it| {
            let time_s = it.measured.time_s;
            // The times of a regular log are rounded.
            let is_apart = |last_s: f64| time_s - last_s > 0.99 * apart_s;
            let is_kept = last_s
                .get(&head_of(it))
                .is_none_or(|last_s| is_apart(*last_s));
            if is_kept {
                last_s.insert(head_of(it), time_s);
            }
            is_kept
        });
        if kept.len() <= MAX_ANGLES {
            *angles = kept;
            return given;
        }
        apart_s *= 1.5;
    }
}

/// Whether the angles agree with the predictions, overall and for each radio head.
pub fn is_understood(evidence: &Evidence) -> bool {
    let is_off = |it: &Count| it.angles >= MIN_ANGLES_PER_HEAD && it.misfit_share() > MAX_MISFITS;
    evidence.all.refused_share() < MAX_REJECTED_FRACTION && !evidence.heads.values().any(is_off)
}

/// Evaluates a drive with the vehicle's own localizer; `None` if it is lost.
fn confirmed(drive: &Drive<'_>) -> Result<Option<Evidence>, ReplayError> {
    Evidence::by(
        &mut *vehicles_localizer(&drive.site, &drive.vehicle)?,
        drive,
    )
}

/// Returns the hypotheses that explain the drive's angles if the given files do not.
fn better_explanations(
    given: &Drive<'_>,
    hypotheses: Vec<Hypothesis>,
    as_given: &Evidence,
    is_lost: bool,
) -> Result<Vec<Diagnosis>, ReplayError> {
    let mut likely = Vec::new();
    for hypothesis in hypotheses {
        let corrected = hypothesis.correct(given);
        if !is_plausible(&corrected) {
            continue;
        }
        let Some(evidence) = screened(&corrected)? else {
            continue;
        };
        if evidence.log_likelihood.is_finite() {
            likely.push((evidence.log_likelihood - hypothesis.penalty, hypothesis));
        }
    }
    likely.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = likely
        .first()
        .map_or(0.0, |(log_likelihood, _)| *log_likelihood);
    let close = |it: &(f64, Hypothesis)| best - it.0 < CLOSE;
    let mut confirmed_hypotheses = Vec::new();
    for (_, hypothesis) in likely.into_iter().take_while(close).take(CONFIRMED) {
        let corrected = hypothesis.correct(given);
        let Some(evidence) = confirmed(&corrected)? else {
            continue;
        };
        let log_odds = evidence.log_likelihood - as_given.log_likelihood - hypothesis.penalty;
        let fits = evidence.all.refused_share() < MAX_REJECTED_FRACTION
            && 2 * evidence.all.misfits < as_given.all.misfits;
        if log_odds > LOG_ODDS && fits {
            confirmed_hypotheses.push((log_odds, hypothesis, evidence));
        }
    }
    confirmed_hypotheses.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = confirmed_hypotheses
        .first()
        .map_or(0.0, |(log_odds, ..)| *log_odds);
    confirmed_hypotheses.retain(|(log_odds, ..)| best - log_odds < LOG_ODDS);
    // A hypothesis with a free parameter explains everything that one without explains, so that the
    // latter is preferred.
    if confirmed_hypotheses
        .iter()
        .any(|(_, it, _)| it.penalty == 0.0)
    {
        confirmed_hypotheses.retain(|(_, it, _)| it.penalty == 0.0);
    } else {
        confirmed_hypotheses.truncate(1);
    }
    let best = confirmed_hypotheses
        .first()
        .map_or(0.0, |(log_odds, ..)| *log_odds);
    confirmed_hypotheses.retain(|(log_odds, ..)| best - log_odds < AS_LIKELY);
    let diagnosis = |(_, hypothesis, evidence): (f64, Hypothesis, Evidence)| Diagnosis {
        is_of_start: hypothesis.subject == Subject::Start,
        is_harmless: !is_lost && apart_m(&as_given.path, &evidence.path) < HARMLESS_M,
        text: format!(
            "{:.0} % of the angles contradict the configuration, but only {:.0} % if {}; check {}",
            100.0 * as_given.all.misfit_share(),
            100.0 * evidence.all.misfit_share(),
            hypothesis.text,
            hypothesis.check
        ),
    };
    Ok(confirmed_hypotheses.into_iter().map(diagnosis).collect())
}

/// Returns all hypotheses of a drive.
fn hypotheses(given: &Drive<'_>) -> Result<Vec<Hypothesis>, ReplayError> {
    let site = &given.site;
    let mut hypotheses = of_drive();
    hypotheses.extend(of_radio_heads(site));
    hypotheses.extend(yaw_rate_hypotheses(given).into_iter().map(|(_, it)| it));
    hypotheses.extend(reversed_parts(given)?);
    if given.vehicle.drive == DriveKind::Road {
        hypotheses.push(robot());
    }
    for (number, settings) in site.radio_heads.iter().enumerate() {
        let head = RadioHead::from(settings);
        let mut filter = plain_filter(site, &given.vehicle)?;
        filter.set_excluded(&head, true);
        let (odometry, angles) = (&given.odometry, &given.angles);
        let steps = replay_angles(&mut filter, site, &given.vehicle, odometry, angles, None)?;
        let path: Vec<Option<Pose>> = steps.iter().map(|step| step.pose).collect();
        let id = (settings.pci, settings.ssb_index);
        let place = triangulate(given, id, &path);
        let is_elsewhere = |place: &Point| place.distance_m(head.position) > MIN_MOVED_M;
        let place = place.filter(is_elsewhere);
        hypotheses.extend(place.and_then(|place| moved(site, number, place)));
    }
    Ok(hypotheses)
}

/// Returns the RMS distance of two paths (m).
fn apart_m(one: &[Option<Pose>], other: &[Option<Pose>]) -> f64 {
    let pairs = one
        .iter()
        .zip(other)
        .filter_map(|(one, other)| one.zip(*other));
    let squares: Vec<f64> = pairs
        .map(|(one, other)| one.point().distance_m(other.point()).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

fn yaw_rate_hypotheses(given: &Drive<'_>) -> Vec<(f64, Hypothesis)> {
    of_yaw_rate(yaw_rate::constant_radps(&given.odometry.samples))
}

fn is_on_road(given: &Drive<'_>) -> bool {
    given.site.road.is_some() && given.vehicle.follows_road()
}

/// Detects a yaw rate that contradicts the road, or that is constant while the angles do not fit.
fn wrong_yaw_rate(
    given: &Drive<'_>,
    located: &LocatedDrive,
    as_given: &Evidence,
    is_sound: bool,
) -> Result<Option<Diagnosis>, ReplayError> {
    let is_constant = yaw_rate::constant_radps(&given.odometry.samples).is_some();
    // Off the road, the heading is the integrated yaw rate, unless the yaw rate is constant.
    let gives_heading = is_on_road(given) || is_constant;
    let measured_per_true = if gives_heading && !located.is_lost_for_long() {
        yaw_rate::measured_per_true(&located.poses)
    } else {
        None
    };
    let is_it = |factor: f64| match measured_per_true {
        Some(ratio) => is_constant || yaw_rate::is_about(ratio, factor),
        None => is_constant && !is_sound,
    };
    let mut hypotheses = yaw_rate_hypotheses(given).into_iter();
    let Some((_, hypothesis)) = hypotheses.find(|(factor, _)| is_it(*factor)) else {
        return Ok(None);
    };
    let corrected = hypothesis.correct(given);
    let evidence = confirmed(&corrected)?;
    let is_worse = |it: &Evidence| as_given.log_likelihood - it.log_likelihood > LOG_ODDS;
    // Without any yaw rate, the localizer may be lost as well.
    if evidence.as_ref().map_or(!is_constant, is_worse) {
        return Ok(None);
    }
    let is_near = |it: &Evidence| apart_m(&as_given.path, &it.path) < HARMLESS_M;
    let turned = measured_per_true.map_or(
        String::from("the angles contradict the configuration"),
        |ratio| format!("yaw_rate_radps is {ratio:.2} times the yaw rate of the vehicle"),
    );
    Ok(Some(Diagnosis {
        is_of_start: false,
        is_harmless: is_sound && evidence.as_ref().is_some_and(is_near),
        text: format!("{turned}: {}; check {}", hypothesis.text, hypothesis.check),
    }))
}

/// Detects an odometry without a yaw rate that needs one.
fn missing_yaw_rate(given: &Drive<'_>, is_sound: bool) -> Option<Diagnosis> {
    let vehicle = &given.vehicle;
    let mut samples = given.odometry.samples.iter();
    if samples.any(|it| it.yaw_rate_radps.is_some()) {
        return None;
    }
    let turns = match vehicle.drive {
        DriveKind::Differential => "a differential drive has no source of the yaw rate",
        DriveKind::Road if !is_on_road(given) => "the angles are the only source of the yaw rate",
        DriveKind::Road if vehicle.gyroscope.is_some() => {
            "the vehicle has a gyroscope, but the road is the only source of the yaw rate"
        }
        DriveKind::Road => return None,
    };
    Some(Diagnosis {
        is_of_start: false,
        is_harmless: is_sound,
        text: format!("{turns}: {}", add_yaw_rate(&given.odometry.fields)),
    })
}

/// Returns the advice on the fields of the yaw rate.
fn add_yaw_rate(fields: &OdometryFields) -> &'static str {
    if *fields == OdometryFields::ROS {
        "the odometry has no yaw rate; fill twist.twist.angular.z or pose.pose.orientation, or record a \
         sensor_msgs/msg/Imu"
    } else {
        "the odometry has no yaw_rate_radps; add it, or left and right wheel"
    }
}

/// Returns the reported defects of the odometry that affected the result.
fn doubtful_odometry(given: &Drive<'_>) -> impl Iterator<Item = Diagnosis> {
    let warnings = given
        .odometry
        .remarks
        .iter()
        .filter_map(|remark| match &remark.issue {
            OdometryIssue::Doubtful(text) => Some(text),
            _ => None,
        });
    warnings.map(|text| Diagnosis {
        text: format!("the angles contradict the configuration, and {text}"),
        is_of_start: false,
        is_harmless: false,
    })
}

/// Whether the speed is plausible for the vehicle.
fn is_plausible(drive: &Drive<'_>) -> bool {
    let fastest_mps = TOO_FAST * drive.vehicle.top_speed_mps();
    median_speed_mps(drive).is_none_or(|it| (CRAWLS_MPS..fastest_mps).contains(&it))
}

/// Returns the median speed while the vehicle moves (m/s).
fn median_speed_mps(drive: &Drive<'_>) -> Option<f64> {
    let speeds_mps = drive.odometry.samples.iter().map(|it| it.speed_mps.abs());
    let mut moving_mps: Vec<f64> = speeds_mps.filter(|it| *it > 0.0).collect();
    moving_mps.sort_by(f64::total_cmp);
    moving_mps.get(moving_mps.len() / 2).copied()
}

/// Detects speeds above those of the vehicle. With such odometry, the filter rejects no angle.
fn too_fast(given: &Drive<'_>) -> Option<Diagnosis> {
    let vehicle = &given.vehicle;
    let median_mps = median_speed_mps(given)?;
    (median_mps > TOO_FAST * vehicle.top_speed_mps()).then(|| Diagnosis {
        is_of_start: false,
        is_harmless: false,
        text: format!(
            "the median speed of the odometry in motion is {median_mps:.1} m/s, and top_speed_kmh \
             is {}; check the units of distances, speeds and {}",
            vehicle.top_speed_kmh, given.odometry.fields.time
        ),
    })
}
