//! Whether the odometer slips.
//!
//! A tracker that expects slip runs beside the one that trusts the odometer. Whenever the vehicle sets
//! off its wheels may slip, and no leap of the speed tells; so they may whenever one does. From then on
//! each angle speaks for it or against it, as the one tracker or the other foretells it better. Until
//! the angles have spoken against it, the level is to hold for that tracker too. Where errors are found
//! that stay over metres, an angle speaks as the errors that either tracker has found foretell it.

use super::alternative::Alternative;
use crate::clone_in_place::clone_in_place;
use crate::localize::tracker::{MOST_SLIP, Tracker};
use crate::observation::OdometrySample;

/// That of a leap of the speed that no vehicle can do: slip, unless a reading is wild.
const LEAP: f64 = 6.0;

/// A tracker that does not trust the odometer. What speaks for slip counts since it may have begun.
#[derive(Debug)]
pub(super) struct Slip {
    pub alternative: Alternative,
    stands: bool,
}

clone_in_place!(Slip {
    alternative,
    stands
});

impl Slip {
    /// Slip of the odometer of a tracker, with the probability `prior` whenever it sets off.
    pub fn new(tracker: &Tracker, prior: f64) -> Self {
        let mut tracker = tracker.clone();
        tracker.distrust_odometer(MOST_SLIP);
        Self {
            alternative: Alternative::fault(tracker, prior),
            stands: true,
        }
    }

    /// Watches an odometry sample, by which its tracker and the tracker `sound` have moved on.
    pub fn watch(&mut self, sound: &Tracker, sample: &OdometrySample) {
        let Alternative {
            tracker, evidence, ..
        } = &mut self.alternative;
        let stood = std::mem::replace(&mut self.stands, sample.speed_mps == 0.0);
        let sets_off = stood && !self.stands;
        let leapt = tracker.leapt();
        if !(sets_off || leapt > 0.0) {
            return;
        }
        if evidence.is_against() {
            // What spoke against slip until now says nothing of one that begins.
            tracker.clone_from(sound);
            tracker.distrust_odometer(if sets_off { MOST_SLIP } else { leapt });
        }
        evidence.is_at_least(if leapt > 0.0 { LEAP } else { 0.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::integrity::trip::{angle, trip};

    /// Half a minute at 4 m/s, of which the odometer reads so many times the way from a time on. Angles
    /// are exact, and heard until a time. Probability of slip, of 0.01 before, the tracker that expects
    /// it, and how far off that is at the end.
    fn drive(ratio: f64, slips_from_s: f64, heard_until_s: f64) -> (f64, Slip, f64) {
        let (heads, road, mut sound) = trip();
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
            slip.alternative.tracker.odometry(&odometry);
            slip.watch(&sound, &odometry);
            if time_s > heard_until_s {
                continue;
            }
            let pose = road.pose(4.0 * time_s);
            for head in &heads {
                let bearing_rad = pose.point().bearing_rad(head.position) - pose.heading_rad;
                let measured = angle(time_s, std::f64::consts::PI * bearing_rad.cos());
                let if_sound = sound.look(head, &measured);
                (slip.alternative).update(&sound, &if_sound, head, &measured);
                sound.take(if_sound, &measured);
            }
        }
        let off_m = (slip.alternative.tracker.pose(time_s).pose.point())
            .distance_m(road.pose(4.0 * time_s).point());
        (1.0 / (1.0 + slip.alternative.odds().recip()), slip, off_m)
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
            let covariance = slip.alternative.tracker.pose(29.9).covariance.unwrap();
            let std_m = (covariance[0][0] + covariance[1][1]).sqrt();
            // Slip by the leap is one deviation of what is expected.
            assert!((off_m / std_m - 1.0).abs() < 0.3, "{off_m} of {std_m}");
        }
    }
}
