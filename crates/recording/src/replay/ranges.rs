//! Localization of a recorded drive from ranges.

use onboard::Custom;
use onboard::localize::UpdateReason;
use onboard::radio_head::RadioHead;
use onboard::range::RangeModel;
use onboard::settings::{Check, LocalizerSettings, RangingKind, RangingSettings, Site, Vehicle};

use super::clock::range_time_offset;
use super::drive::Replay;
use super::error::ReplayError;
use super::located::{Diagnosis, LocatedDrive, LocatedRange};
use super::start::{StartChoice, starting};
use super::time_units::check_times;
use crate::odometry::OdometryLog;
use crate::range_log::RangeLog;

/// Standard deviation of delays in samples, in samples: rounding (0.29) and equal receiver noise.
const SAMPLE_SIGMA: f64 = 0.5;

/// Minimum number of ranges of a radio head whose consistency is reported.
const MIN_RANGES: usize = 20;

/// Fraction of rejected ranges of a radio head that is reported.
const MANY_REJECTED: f64 = 0.3;

/// Locates a drive from logged ranges. The start must be known; its heading may be wrong.
///
/// # Errors
/// [`ReplayError`].
pub fn locate_ranges(
    site: &Site,
    vehicle: &Vehicle,
    start: StartChoice,
    odometry: &OdometryLog,
    log: &RangeLog,
) -> Result<LocatedDrive, ReplayError> {
    let vehicle = with_ranging(vehicle, log)?;
    let (vehicle, start) = starting(site, &vehicle, start)?;
    let check = Check {
        file: &vehicle.name,
    };
    check.that(
        vehicle.start.known,
        "start.pose",
        "missing",
        "ranges do not determine the first position: give a start pose",
    )?;
    check_times(odometry, &[])?;
    let times = log.ranges.iter().map(|it| it.measured.time_s);
    let [first_s, last_s] = times.clone().fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[first, last], time_s| [first.min(time_s), last.max(time_s)],
    );
    if log.ranges.is_empty() {
        let why = log.remarks.first().map(|(_, text)| text.clone());
        return Err(ReplayError::NoRange { why });
    }
    if !times.clone().any(|time_s| odometry.covers(time_s)) {
        let odometry_s = odometry.interval_s().unwrap_or([f64::NAN; 2]);
        return Err(ReplayError::RangeClocks {
            odometry_s,
            ranges_s: [first_s, last_s],
        });
    }
    let late_s = range_time_offset(site, &vehicle, odometry, &log.ranges)?;
    let mut ranges = log.ranges.clone();
    for range in &mut ranges {
        range.measured.time_s -= late_s.unwrap_or(0.0);
    }
    let mut replay = Replay::new(site, &vehicle, start, Custom::default(), odometry)?;
    for (time_s, text) in &log.remarks {
        replay.remark(*time_s, text.clone());
    }
    if let Some(late_s) = late_s {
        let text = format!(
            "by the odometry's clock, the ranges are {:.0} ms late; this is compensated; check the \
             clocks of ranges and odometry",
            1e3 * late_s
        );
        replay.remark(first_s, text);
    }
    replay.with_ranges(&ranges);
    replay.process_remaining_odometry()?;
    let mut texts = inconsistent(site, replay.located());
    texts.extend(displaced(site, &vehicle, &replay));
    let texts = texts.into_iter().map(|text| (text, true));
    let of_scale = wrong_scale(&vehicle, &replay).map(|text| (text, false));
    for (text, is_harmless) in texts.chain(of_scale).collect::<Vec<_>>() {
        replay.diagnose(Diagnosis {
            text,
            is_of_start: false,
            is_harmless,
        });
    }
    replay.finish()
}

/// Returns the vehicle with settings of its ranging, and rejects contradictions to the log.
fn with_ranging(vehicle: &Vehicle, log: &RangeLog) -> Result<Vehicle, ReplayError> {
    let mut vehicle = vehicle.clone();
    let default = RangingSettings {
        kind: if log.has_delays {
            RangingKind::OneWay
        } else {
            RangingKind::TwoWay
        },
        ..RangingSettings::default()
    };
    let ranging = vehicle.ranging.get_or_insert(default);
    if ranging.sigma_m.is_none() {
        ranging.sigma_m = log.sample_m.map(|sample_m| SAMPLE_SIGMA * sample_m);
    }
    let ranging = *ranging;
    let file = vehicle.name.clone();
    let check = Check { file: &file };
    check.that(
        !(log.has_delays && ranging.kind == RangingKind::TwoWay),
        "ranging.kind",
        "two-way",
        "the log has one-way delays, which contain clocks: write kind = \"one-way\"",
    )?;
    check.that(
        log.has_sigma || ranging.sigma_m.is_some(),
        "ranging.sigma_m",
        "missing",
        "the log has no sigma_m: give the standard deviation of a range here",
    )?;
    check.that(
        matches!(vehicle.localizer, LocalizerSettings::Tracker(_)),
        "localizer.kind",
        "dead-reckoning",
        "ranges need localizer.kind = \"tracker\"",
    )?;
    Ok(vehicle)
}

/// Number of standard deviations, specified and estimated, by which an offset certainly contradicts
/// its specification.
const CERTAIN_SIGMAS: f64 = 3.0;

/// Returns a text for every radio head whose ranges have a larger offset than specified.
fn displaced(site: &Site, vehicle: &Vehicle, replay: &Replay<'_>) -> Vec<String> {
    let Some(ranging) = &vehicle.ranging else {
        return Vec::new();
    };
    let model = RangeModel::new(ranging, &vehicle.array, site.wavelength_m());
    let mut texts = Vec::new();
    for settings in &site.radio_heads {
        let head = RadioHead::from(settings);
        let Some(offset) = replay.range_offset(head.pci, head.ssb_index) else {
            continue;
        };
        let [clock_m, _] = model.head_clock(&head.clock);
        let stated_m = match head.range_offset.std_m {
            Some(surveyed_m) => surveyed_m,
            None => model.offset_std_m.hypot(clock_m),
        };
        let stated_m = stated_m.hypot(head.position_std_m);
        let surveyed_m = head.range_offset.mean_m;
        if (offset.mean - surveyed_m).abs() > CERTAIN_SIGMAS * (stated_m + offset.std) {
            texts.push(format!(
                "the ranges of pci {} ssb_index {} have an offset of {:.2} ± {:.2} m, specified as \
                 {surveyed_m:.2} ± {stated_m:.2} m; check position_m of the radio head, and ranging.offset_std_m \
                 (and clock_offset_std_ns of the radio head)",
                head.pci, head.ssb_index, offset.mean, offset.std
            ));
        }
    }
    texts
}

/// Returns a text if the scale error of the ranges is larger than specified. The position is not
/// reliable then, because the ranges before the scale was estimated have displaced it.
fn wrong_scale(vehicle: &Vehicle, replay: &Replay<'_>) -> Option<String> {
    let (scale, stated) = (replay.range_scale()?, vehicle.ranging?.scale_std());
    let is_wrong = scale.mean.abs() > CERTAIN_SIGMAS * (stated + scale.std);
    is_wrong.then(|| {
        format!(
            "the ranges are {:.2} ± {:.2} times the distances, specified as 1.00 ± {stated:.2}; check the \
             unit of the ranges, whether they are one-way distances, and ranging.scale_std",
            1.0 + scale.mean,
            scale.std
        )
    })
}

/// Returns a text for every radio head whose ranges mostly contradict the drive.
fn inconsistent(site: &Site, drive: &LocatedDrive) -> Vec<String> {
    let mut texts = Vec::new();
    for head in &site.radio_heads {
        let of_head =
            |it: &&LocatedRange| (it.range.pci, it.range.ssb_index) == (head.pci, head.ssb_index);
        let all = drive.ranges.iter().filter(of_head);
        let count = all.clone().count();
        let is_rejected = |it: &&LocatedRange| {
            let reason = it.verdict.reason;
            matches!(reason, UpdateReason::Outlier | UpdateReason::Excluded)
        };
        let rejected = all.filter(is_rejected).count();
        if count >= MIN_RANGES && rejected as f64 > MANY_REJECTED * count as f64 {
            texts.push(format!(
                "{rejected} of {count} ranges of pci {} ssb_index {} contradict the drive: \
                 its path is often blocked, or check position_m of the radio head, and \
                 ranging.offset_std_m (and clock_offset_std_ns of the radio head), which may be too small for its offset",
                head.pci, head.ssb_index
            ));
        }
    }
    texts
}
