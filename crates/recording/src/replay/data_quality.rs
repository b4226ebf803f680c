//! Data-quality warnings: errors of a recorded drive that are detected before it is located.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use onboard::geometry::wrap_angle;
use onboard::localize::MeasurementKind;
use onboard::settings::{Site, Vehicle};

use super::error::ReplayError;
use crate::angle_log::LoggedAngle;
use crate::odometry::{OdometryLog, number};

/// Minimum time without any angle that is reported (s).
const SILENCE_S: f64 = 20.0;

/// Maximum difference of the phase and the phase of the given angle (rad).
const CONTRADICTION_RAD: f64 = 0.2;

/// Remarks with their times in the drive (s).
pub type Warnings = Vec<(f64, String)>;

/// Returns the contradictions within and between odometry, angles, site and vehicle.
///
/// # Errors
/// [`ReplayError::Clocks`] if no angle is within the time of the odometry.
pub fn warnings(
    site: &Site,
    vehicle: &Vehicle,
    odometry: &OdometryLog,
    angles: &[LoggedAngle],
) -> Result<Warnings, ReplayError> {
    let mut warnings = Warnings::new();
    let Some(odometry_s) = odometry.interval_s() else {
        return Ok(warnings);
    };
    let [start_s, _] = odometry_s;
    let inside = |it: &&LoggedAngle| odometry.covers(it.measured.time_s);
    let received: Vec<&LoggedAngle> = angles.iter().filter(inside).collect();
    if !angles.is_empty() && received.is_empty() {
        let times_s = angles.iter().map(|it| it.measured.time_s);
        return Err(ReplayError::Clocks {
            odometry_s,
            angles_s: [
                times_s.clone().fold(f64::INFINITY, f64::min),
                times_s.fold(f64::NEG_INFINITY, f64::max),
            ],
        });
    }
    let outside = angles.len() - received.len();
    if outside > 0 {
        let text = format!("{outside} angles lie outside of the odometry's time; check the clocks");
        warnings.push((start_s, text));
    }

    let mut unknown: BTreeMap<(u16, u8), usize> = BTreeMap::new();
    for it in angles {
        let known = |head: &&_| {
            let head: &onboard::settings::RadioHeadSettings = head;
            (head.pci, head.ssb_index) == (it.ssb.pci, it.ssb.ssb_index)
        };
        if !site.radio_heads.iter().any(|head| known(&head)) {
            *unknown.entry((it.ssb.pci, it.ssb.ssb_index)).or_default() += 1;
        }
    }
    if !angles.is_empty() && unknown.values().sum::<usize>() == angles.len() {
        let angles = angles.len();
        return Err(ReplayError::UnknownRadioHeads { angles });
    }
    for ((pci, index), count) in unknown {
        let text = format!(
            "{count} angles are of pci {pci}, ssb_index {index}, which the site does not have; they \
             are not used"
        );
        warnings.push((start_s, text));
    }

    warnings.extend(without_array(site, angles).map(|text| (start_s, text)));

    let turns = |it: &&LoggedAngle| {
        let angles_rad = [it.measured.phase_rad, it.measured.angle_rad];
        angles_rad.iter().any(|angles_rad| angles_rad.abs() > TAU)
    };
    let beyond = angles.iter().filter(turns).count();
    if 10 * beyond > angles.len() {
        let text = format!(
            "{beyond} of {} angles exceed a full turn; check whether phase_rad or angle_rad, and their \
             standard deviations, are in degrees",
            angles.len()
        );
        warnings.push((start_s, text));
    }

    let measurand = vehicle.array.measurand();
    let both = angles.iter().filter(|it| it.measured.angle_rad.is_finite());
    let contradicts = |it: &&LoggedAngle| {
        let expected = match it.measured.kind {
            MeasurementKind::Angle => measurand.value_rad(it.measured.angle_rad, 1.0),
            MeasurementKind::AngleAtHead => it.measured.angle_rad,
        };
        wrap_angle(it.measured.phase_rad - expected).abs() > CONTRADICTION_RAD
    };
    let contradicting = both.clone().filter(contradicts).count();
    if 10 * contradicting > both.count() {
        let text = format!(
            "phase_rad and angle_rad contradict each other for {contradicting} of {} angles (antennas in a \
             row: phase_rad = 2π d/λ cos angle_rad; otherwise: phase_rad = angle_rad); phase_rad is \
             used; check whether the columns are exchanged, and the array's settings",
            angles.len()
        );
        warnings.push((start_s, text));
    }

    let times_s = received.iter().map(|it| it.measured.time_s);
    let mut before_s = start_s;
    for time_s in times_s.chain(odometry.samples.last().map(|it| it.time_s)) {
        if time_s - before_s > SILENCE_S {
            let text = format!(
                "no angle for {:.0} s from {before_s:.1} s on",
                time_s - before_s
            );
            warnings.push((before_s, text));
        }
        before_s = before_s.max(time_s);
    }
    warnings.extend(of_odometry(odometry));
    let samples = &odometry.samples;
    let turning = samples.iter().filter(|it| it.yaw_rate_radps.is_some());
    let (turning, all) = (turning.count(), samples.len());
    if 0 < turning && turning < all {
        let text = format!(
            "odometry: {} is empty in {} of {all} samples; the yaw change is unknown there",
            odometry.fields.yaw_rate,
            all - turning
        );
        warnings.push((start_s, text));
    }
    Ok(warnings)
}

/// Reports angles measured at radio heads whose array the site does not define; such angles are not used.
fn without_array<'a>(
    site: &'a Site,
    angles: &'a [LoggedAngle],
) -> impl Iterator<Item = String> + 'a {
    let heads = site.radio_heads.iter().enumerate();
    heads.filter(|(_, head)| head.array.is_none()).filter_map(move |(number, head)| {
        let is_of_it = |it: &&LoggedAngle| {
            it.measured.kind.is_at_head()
                && (it.ssb.pci, it.ssb.ssb_index) == (head.pci, head.ssb_index)
        };
        let count = angles.iter().filter(is_of_it).count();
        (count > 0).then(|| {
            format!(
                "{count} angles of pci {}, ssb_index {} were measured at the radio head (at_head is 1), but \
                 the site does not define the direction of its array; they are not used; add \
                 radio_heads[{number}].array.mounting_rad to the site",
                head.pci, head.ssb_index
            )
        })
    })
}

/// Detects distances that contradict the speeds.
fn of_odometry(odometry: &OdometryLog) -> Option<(f64, String)> {
    let (mut by_speed_m, mut by_distance_m) = (0.0, 0.0);
    for pair in odometry.samples.windows(2) {
        let [from, to] = pair else {
            continue;
        };
        let mean_mps = 0.5 * (from.speed_mps + to.speed_mps);
        by_speed_m += mean_mps.abs() * (to.time_s - from.time_s);
        by_distance_m += (to.distance_m - from.distance_m).abs();
    }
    let start_s = odometry.samples.first()?.time_s;
    let ratio = by_distance_m / by_speed_m;
    (by_speed_m > 1.0 && !(0.7..1.5).contains(&ratio)).then(|| {
        let text = format!(
            "odometry: distances add up to {} m, speeds to {} m; check the units of {}, {} and {}",
            number(by_distance_m),
            number(by_speed_m),
            odometry.fields.distance,
            odometry.fields.speed,
            odometry.fields.time
        );
        (start_s, text)
    })
}
