//! Whether the odometer slips.
//!
//! A tracker that expects slip runs beside the one that trusts the odometer. Whenever the vehicle sets
//! off its wheels may slip, and no leap of the speed tells; so they may whenever one does. From then on
//! each angle speaks for it or against it, as the one tracker or the other foretells it better. Until
//! the angles have spoken against it, the level is to hold for that tracker too. Where errors are found
//! that stay over metres, an angle speaks as the errors that either tracker has found foretell it.

use super::evidence::Evidence;
use crate::clone_in_place::clone_in_place;
use crate::localize::measurement::{AngleMeasurement, UpdateReason};
use crate::localize::tracker::{Look, MOST_SLIP, Tracker};
use crate::observation::OdometrySample;
use crate::radio_head::RadioHead;

/// That of a leap of the speed that no vehicle can do: slip, unless a reading is wild.
const LEAP: f64 = 6.0;

/// A tracker that does not trust the odometer.
#[derive(Debug)]
pub(super) struct Slip {
    tracker: Tracker,
    /// For slip, since it may have begun.
    evidence: Evidence,
    prior: f64,
    stands: bool,
}

clone_in_place!(Slip {
    tracker,
    evidence,
    prior,
    stands
});

impl Slip {
    /// Slip of the odometer of a tracker, with the probability `prior` whenever it sets off.
    pub fn new(tracker: &Tracker, prior: f64) -> Self {
        let mut tracker = tracker.clone();
        tracker.distrust_odometer(MOST_SLIP);
        Self {
            tracker,
            evidence: Evidence::NONE,
            prior,
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
        if self.evidence.is_against() {
            // What spoke against slip until now says nothing of one that begins.
            self.tracker.clone_from(sound);
            self.tracker
                .distrust_odometer(if sets_off { MOST_SLIP } else { leapt });
        }
        let speaks_for_it = if leapt > 0.0 { LEAP } else { 0.0 };
        self.evidence.is_at_least(speaks_for_it);
    }

    /// Takes in an angle, which the tracker `sound` foretells so; angles have so many times the variance
    /// that is stated.
    pub fn update(
        &mut self,
        sound: &Tracker,
        if_sound: &Result<Look, UpdateReason>,
        noise_ratio: f64,
        head: &RadioHead,
        measured: &AngleMeasurement,
    ) {
        let if_slipping = self.tracker.look(head, measured);
        if measured.resolved {
            (self.evidence).see(
                [&self.tracker, sound],
                [&if_slipping, if_sound],
                noise_ratio,
            );
        }
        self.tracker.take(if_slipping, measured);
    }

    /// How many times as probable it is that the odometer slips as that it does not.
    pub fn odds(&self) -> f64 {
        self.evidence.odds(self.prior)
    }

    /// That before anything speaks for it or against it.
    pub const fn prior(&self) -> f64 {
        self.prior
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
        let mut slip = Slip::new(&sound, 1e-2);
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
                let if_sound = sound.look(head, &measured);
                slip.update(&sound, &if_sound, 1.0, head, &measured);
                sound.take(if_sound, &measured);
            }
        }
        let off_m =
            (slip.tracker().pose(time_s).pose.point()).distance_m(road.pose(4.0 * time_s).point());
        (1.0 / (1.0 + slip.odds().recip()), slip, off_m)
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
