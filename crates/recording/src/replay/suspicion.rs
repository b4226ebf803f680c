//! Whether a drive was meant in another way than it was given.
//!
//! It is tracked as given and under each of the usual [mistakes](MISTAKES), and the likelihoods of
//! the innovations are compared: multiple-model testing (Bar-Shalom, Li and Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 11.6). A mistake is named where the
//! angles are far more likely with it, and agree with it.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use onboard::radio_head::RadioHead;
use onboard::settings::{LocalizerSettings, Vehicle};

use super::error::ReplayError;
use super::innovations::{Met, innovations};
use super::mistakes::{Drive, MISTAKES, Mistake};
use super::stated::with_phase;
use crate::angle_log::LoggedAngle;
use crate::odometry::OdometryLog;

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

/// A speed of so many times the vehicle's is in another unit.
const WILD: f64 = 10.0;

/// A mistake that explains a drive.
pub struct Suspicion {
    /// What speaks for it, and what to check.
    pub text: String,
    /// Whether it is one of the start alone.
    pub is_of_start: bool,
}

/// How well a way of reading a drive foretells its angles.
struct Foretold {
    log_likelihood: f64,
    refused: f64,
}

impl Foretold {
    fn by(drive: &Drive<'_>) -> Result<Self, ReplayError> {
        let met = innovations(
            &drive.site,
            &drive.vehicle,
            &drive.odometry,
            &drive.angles,
            None,
        )?;
        let measurand = drive.vehicle.array.measurand();
        // Per standard deviation of the measurement: so it does not matter in what it is told.
        let log_likelihood = |(met, logged): (&Option<Met>, &LoggedAngle)| {
            let gaussian = met.map_or(0.0, |met| {
                (-0.5 * met.residual_rad.powi(2) / met.variance).exp() / (TAU * met.variance).sqrt()
            });
            let sigma_rad = with_phase(logged, &measurand).measured.phase_sigma_rad;
            (sigma_rad * ((1.0 - FROM_ANYWHERE) * gaussian + FROM_ANYWHERE / TAU)).ln()
        };
        let refused = met.iter().filter(|met| met.is_none_or(|met| !met.used));
        Ok(Self {
            log_likelihood: met
                .iter()
                .zip(drive.angles.iter())
                .map(log_likelihood)
                .sum(),
            refused: refused.count() as f64 / met.len().max(1) as f64,
        })
    }
}

/// Speeds that no such vehicle has. Angles refuse nothing where an odometer says so much.
pub fn too_fast(vehicle: &Vehicle, odometry: &OdometryLog) -> Option<Suspicion> {
    let speeds_mps = odometry.samples.iter().map(|it| it.speed_mps.abs());
    let mut moving_mps: Vec<f64> = speeds_mps.filter(|it| *it > 0.0).collect();
    moving_mps.sort_by(f64::total_cmp);
    let median_mps = *moving_mps.get(moving_mps.len() / 2)?;
    (median_mps > WILD * vehicle.top_speed_mps()).then(|| Suspicion {
        is_of_start: false,
        text: format!(
            "the odometry says {median_mps:.1} m/s in the median while it moves, where \
             top_speed_kmh is {}; check the units of distances, speeds and time_s",
            vehicle.top_speed_kmh
        ),
    })
}

/// The usual mistakes that explain the drive's angles where it, as given, does not: one remark each.
///
/// # Errors
/// As [`innovations`].
pub fn suspicions(given: &Drive<'_>) -> Result<Vec<Suspicion>, ReplayError> {
    let tracks = matches!(given.vehicle.localizer, LocalizerSettings::Tracker(_));
    if !tracks || !given.vehicle.start.known {
        return Ok(Vec::new()); // there is no expectation to begin with
    }
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

    let as_given = Foretold::by(&given)?;
    if as_given.refused < MOST_REFUSED {
        return Ok(Vec::new());
    }
    let mut judged: Vec<(f64, &Mistake, Foretold)> = Vec::new();
    for mistake in &MISTAKES {
        let found = Foretold::by(&mistake.correct(&given))?;
        let odds = independent * (found.log_likelihood - as_given.log_likelihood);
        if odds > LOG_ODDS && found.refused < MOST_REFUSED {
            judged.push((odds, mistake, found));
        }
    }
    judged.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = judged.first().map_or(0.0, |(odds, ..)| *odds);
    let suspicion = |(_, mistake, found): (f64, &Mistake, Foretold)| Suspicion {
        is_of_start: mistake.is_of_start(),
        text: format!(
            "{:.0} % of the angles are refused, but {:.0} % if {}; check {}",
            100.0 * as_given.refused,
            100.0 * found.refused,
            mistake.meant,
            mistake.check
        ),
    };
    let named = judged
        .into_iter()
        .take_while(|(odds, ..)| best - odds < LOG_ODDS);
    Ok(named.map(suspicion).collect())
}
