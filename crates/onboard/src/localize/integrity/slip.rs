//! Whether the odometer slips.
//!
//! A tracker that expects slip runs beside the one that trusts the odometer. Whenever the vehicle sets
//! off its wheels may slip, and no leap of the speed tells; so they may whenever one does. From then on
//! each angle speaks for it or against it, as the one tracker or the other foretells it better. Until
//! the angles have spoken against it, the level is to hold for that tracker too. Where errors are found
//! that stay over metres, an angle speaks as the errors that either tracker has found foretell it.

use std::f64::consts::TAU;

use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateVerdict};
use crate::localize::tracker::{Look, MOST_SLIP, Tracker};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// Share of the angles that come from anywhere.
const OUTLIERS: f64 = 2e-3;

/// Largest logarithm of the likelihood ratio, for or against, as clear as a fault of a radio head is
/// found: what more evidence there is must be forgotten some time.
const SURE: f64 = 15.0;

/// That of a leap of the speed that no vehicle can do: slip, unless a reading is wild.
const LEAP: f64 = 6.0;

/// A tracker that does not trust the odometer.
#[derive(Debug)]
pub(super) struct Slip {
    tracker: Tracker,
    /// Logarithm of the likelihood ratio since it may have begun.
    evidence: f64,
    stands: bool,
}

clone_in_place!(Slip {
    tracker,
    evidence,
    stands
});

impl Slip {
    /// Slip of the odometer of a tracker.
    pub fn new(tracker: &Tracker) -> Self {
        let mut tracker = tracker.clone();
        tracker.distrust_odometer(MOST_SLIP);
        Self {
            tracker,
            evidence: -SURE,
            stands: true,
        }
    }

    /// Moves on by an odometry sample, by which the tracker `sound` has moved on.
    pub fn odometry(&mut self, sound: &Tracker, sample: &OdometrySample) {
        self.tracker.odometry(sample);
        let stood = std::mem::replace(&mut self.stands, sample.speed_mps == 0.0);
        let sets_off = stood && !self.stands;
        let leapt = self.tracker.leapt();
        if !(sets_off || leapt > 0.0) {
            return;
        }
        if self.evidence < 0.0 {
            // What spoke against slip until now says nothing of one that begins.
            self.tracker.clone_from(sound);
            self.tracker
                .distrust_odometer(if sets_off { MOST_SLIP } else { leapt });
        }
        let speaks_for_it = if leapt > 0.0 { LEAP } else { 0.0 };
        self.evidence = self.evidence.max(speaks_for_it);
    }

    /// Takes in an angle, which the tracker `sound` takes in too, of so many times the variance that is
    /// stated.
    pub fn update(
        &mut self,
        sound: &mut Tracker,
        noise_ratio: f64,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) -> UpdateVerdict {
        let if_slipping = self.tracker.look(head, measured);
        let if_sound = sound.look(head, measured);
        if measured.resolved
            && let (Ok(slips), Ok(holds)) = (&if_slipping, &if_sound)
            && !(slips.excluded || holds.excluded)
        {
            let for_slip = if let (Some(slips), Some(holds)) = (&slips.pasts, &holds.pasts) {
                // They know of each other what repeats itself.
                (or_outlier(slips.density) / or_outlier(holds.density)).ln()
            } else {
                let at_first =
                    |by: &Tracker, seen| by.first_variance(seen) + by.lasting_variance(seen);
                let ratio = density(slips, noise_ratio * at_first(&self.tracker, slips))
                    / density(holds, noise_ratio * at_first(sound, holds));
                // What is seen again and again speaks once.
                let share = at_first(sound, holds) / holds.innovation.measurement_variance;
                share * ratio.ln()
            };
            self.evidence = (self.evidence + for_slip).clamp(-SURE, SURE);
        }
        self.tracker.take(if_slipping, measured);
        sound.take(if_sound, measured)
    }

    /// Probability that the odometer slips, of one that slips with the probability `prior` whenever it
    /// sets off.
    pub fn probability(&self, prior: f64) -> f64 {
        (1.0 + (prior.recip() - 1.0) * (-self.evidence).exp()).recip()
    }

    /// The tracker.
    pub const fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// Leaves the angles of a radio head unused, or uses them again.
    pub fn set_excluded(&mut self, head: &RadioHead, excluded: bool) {
        self.tracker.set_excluded(head, excluded);
    }
}

/// Probability density of an angle (1/rad), were its variance by all but the belief this one.
fn density(looked: &Look, measurement_variance: f64) -> f64 {
    let mut seen = looked.innovation;
    seen.variance += measurement_variance - seen.measurement_variance;
    or_outlier(seen.density())
}

/// The same of an angle that may be an outlier.
fn or_outlier(density: f64) -> f64 {
    OUTLIERS / TAU + (1.0 - OUTLIERS) * density
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::localize::tracker::{InitialPose, TrackerConfig};
    use crate::settings::{Shipped, Site, TomlFile, Vehicle};

    /// Half a minute at 4 m/s, of which the odometer reads so many times the way from a time on. Angles
    /// are exact, and heard until a time. Probability of slip, of 0.01 before, the tracker that expects
    /// it, and how far off that is at the end.
    fn drive(ratio: f64, slips_from_s: f64, heard_until_s: f64) -> (f64, Slip, f64) {
        let site = Site::from_library("trip-4", &Shipped).unwrap();
        let vehicle = Vehicle::from_library("carrier", &Shipped).unwrap();
        let heads = RadioHead::heard(&site, &vehicle);
        let road = site.build_road().unwrap().unwrap();
        let start = InitialPose {
            pose: road.pose(0.0),
            position_std_m: 0.1,
            heading_std_rad: 0.01,
        };
        let map = Some(Arc::new(road.clone()));
        let config = TrackerConfig::new(&site, &vehicle);
        let mut sound = Tracker::new(config, map, &heads, &start);
        let mut slip = Slip::new(&sound);
        let mut distance_m = 0.0;
        let mut time_s = 0.0;
        for step in 1..300 {
            time_s = f64::from(step) * 0.1;
            let reads = if time_s > slips_from_s { ratio } else { 1.0 };
            distance_m += 0.4 * reads;
            let odometry = OdometrySample {
                time_s,
                distance_m,
                speed_mps: 4.0 * reads,
                yaw_rate_radps: None,
            };
            sound.odometry(&odometry);
            slip.odometry(&sound, &odometry);
            if time_s > heard_until_s {
                continue;
            }
            let pose = road.pose(4.0 * time_s);
            for head in &heads {
                let bearing_rad = pose.point().bearing_rad(head.position) - pose.heading_rad;
                let measured = AngleMeasurement {
                    time_s,
                    phase_rad: std::f64::consts::PI * bearing_rad.cos(),
                    phase_sigma_rad: 0.05,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                slip.update(&mut sound, 1.0, head, &measured);
            }
        }
        let off_m =
            (slip.tracker().pose(time_s).pose.point()).distance_m(road.pose(4.0 * time_s).point());
        (slip.probability(1e-2), slip, off_m)
    }

    #[test]
    fn slip_since_the_start_is_suspected_and_a_sound_odometer_is_not() {
        let probability = |ratio| drive(ratio, 0.0, f64::INFINITY).0;
        assert!(probability(1.0) < 1e-3);
        assert!(probability(1.2) > 0.99);
        assert!(probability(0.8) > 0.99);
    }

    #[test]
    fn a_leap_of_the_speed_counts_as_slip_before_any_angle_tells() {
        for ratio in [0.9, 1.1] {
            let (probability, slip, off_m) = drive(ratio, 20.0, 20.0);
            assert!(probability > 0.5);
            let covariance = slip.tracker().pose(29.9).covariance.unwrap();
            let std_m = (covariance[0][0] + covariance[1][1]).sqrt();
            // Slip by the leap is one deviation of what is expected.
            assert!((off_m / std_m - 1.0).abs() < 0.3, "{off_m} of {std_m}");
        }
    }
}
