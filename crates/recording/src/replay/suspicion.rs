//! Whether a drive was meant in another way than it was given.
//!
//! It is tracked as given and under each of the usual [mistakes](MISTAKES), and the likelihoods of
//! the innovations are compared: multiple-model testing (Bar-Shalom, Li and Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 11.6). A mistake is named where the
//! angles are far more likely with it, and agree with it.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use onboard::localize::Tracker;
use onboard::localize::tracker::{InitialPose, TrackerConfig};
use onboard::radio_head::RadioHead;
use onboard::road::Road;
use onboard::settings::{LocalizerSettings, SettingsError};

use super::mistakes::{Drive, MISTAKES, Mistake};
use super::stated::with_phase;
use crate::angle_log::LoggedAngle;

/// Angles by which it is judged: the first of the drive.
const FIRST_ANGLES: usize = 3000;

/// Log-odds a mistake must have: each is made in one drive of a thousand, and one of a thousand
/// that are named may be wrong.
const LOG_ODDS: f64 = 13.8;

/// Share of angles that come from anywhere, by a reflection say; the others are Gaussian.
const FROM_ANYWHERE: f64 = 0.1;

/// Largest share of angles that may be refused where a drive is understood.
const MOST_REFUSED: f64 = 0.2;

/// Looks at one radio head within this time count as one (s).
const LOOK_S: f64 = 1.0;

/// How well a way of reading a drive foretells its angles.
struct Foretold {
    log_likelihood: f64,
    refused: f64,
}

/// The usual mistakes that explain the drive's angles where it, as given, does not: one remark each.
///
/// # Errors
/// [`SettingsError`] when the site's road cannot be built.
pub fn suspicions(given: &Drive<'_>) -> Result<Vec<String>, SettingsError> {
    let tracks = matches!(given.vehicle.localizer, LocalizerSettings::Tracker(_));
    if !tracks || !given.vehicle.start.known {
        return Ok(Vec::new()); // there is no expectation to begin with
    }
    let road = given.site.build_road()?;
    let road = road.filter(|_| given.vehicle.follows_road()).map(Arc::new);
    let mut given = given.clone();
    let heads = RadioHead::heard(&given.site, &given.vehicle);
    let angles = given.angles.to_mut();
    angles.retain(|it| {
        heads
            .iter()
            .any(|head| head.sends(it.ssb.pci, it.ssb.ssb_index))
    });
    angles.sort_by(|a, b| a.measured.time_s.total_cmp(&b.measured.time_s));
    angles.truncate(FIRST_ANGLES);
    let look = |it: &LoggedAngle| {
        let time = (it.measured.time_s / LOOK_S).floor() as i64;
        (it.ssb.pci, it.ssb.ssb_index, time)
    };
    let looks: BTreeSet<_> = angles.iter().map(look).collect();
    let independent = looks.len() as f64 / angles.len().max(1) as f64;

    let as_given = foretell(&given, road.as_ref());
    if as_given.refused < MOST_REFUSED {
        return Ok(Vec::new());
    }
    let judged = MISTAKES.iter().filter_map(|mistake| {
        let found = foretell(&mistake.correct(&given), road.as_ref());
        let odds = independent * (found.log_likelihood - as_given.log_likelihood);
        (odds > LOG_ODDS && found.refused < MOST_REFUSED).then_some((odds, mistake, found))
    });
    let mut judged: Vec<(f64, &Mistake, Foretold)> = judged.collect();
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = judged.first().map_or(0.0, |(odds, ..)| *odds);
    let remark = |(_, mistake, found): (f64, &Mistake, Foretold)| {
        format!(
            "{:.0} % of the angles are refused, but {:.0} % if {}; check {}",
            100.0 * as_given.refused,
            100.0 * found.refused,
            mistake.meant,
            mistake.check
        )
    };
    let named = judged
        .into_iter()
        .take_while(|(odds, ..)| best - odds < LOG_ODDS);
    Ok(named.map(remark).collect())
}

/// Tracks a drive, and sums up the log-likelihoods of its angles.
fn foretell(drive: &Drive<'_>, road: Option<&Arc<Road>>) -> Foretold {
    let start = InitialPose {
        pose: drive.start,
        position_std_m: drive.vehicle.start.position_std_m,
        heading_std_rad: drive.vehicle.start.heading_std_rad,
    };
    let heads = RadioHead::heard(&drive.site, &drive.vehicle);
    let config = TrackerConfig::new(&drive.site, &drive.vehicle);
    let mut tracker = Tracker::new(config, road.cloned(), &heads, &start);
    let mut odometry = drive.odometry.iter().peekable();
    let (mut log_likelihood, mut refused) = (0.0, 0.0);
    for logged in drive.angles.iter() {
        let mut measured = with_phase(logged, drive.vehicle.array.spacing_wavelengths).measured;
        measured.time_s -= drive.vehicle.receiver.lateness_s;
        while let Some(sample) = odometry.next_if(|it| it.time_s <= measured.time_s) {
            tracker.odometry(sample);
        }
        let sends = |head: &&RadioHead| head.sends(logged.ssb.pci, logged.ssb.ssb_index);
        let Some(head) = heads.iter().find(sends) else {
            continue;
        };
        let gaussian = tracker.innovation(head, &measured).map_or(0.0, |it| {
            (-0.5 * it.mahalanobis2()).exp() / (TAU * it.variance).sqrt()
        });
        let likelihood = (1.0 - FROM_ANYWHERE) * gaussian + FROM_ANYWHERE / TAU;
        log_likelihood += likelihood.ln();
        let verdict = tracker.update(head, &measured);
        refused += f64::from(u8::from(!verdict.accepted));
    }
    Foretold {
        log_likelihood,
        refused: refused / drive.angles.len().max(1) as f64,
    }
}
