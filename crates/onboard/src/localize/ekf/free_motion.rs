//! Motion without odometry, during which a filter retains the constants of array, clock and site plan, and the sizes of
//! the biases.

use super::config::EkfConfig;
use super::filter::Ekf;
use super::odometer::{SampleInterval, SpeedJumps};
use super::predict::FAULTY_YAW_NOISE_RAD_PER_SQRT_S;
use super::state::{
    ACROSS, ALONG, Belief, CURVATURE, HEADING, SCALE, YAW_RATE_BIAS, YAW_RATE_SCALE,
};
use crate::localize::output::InitialPose;

/// States of the pose.
const POSE: [usize; 4] = [ALONG, ACROSS, HEADING, CURVATURE];
/// States of the odometry.
const ODOMETRY: [usize; 3] = [SCALE, YAW_RATE_BIAS, YAW_RATE_SCALE];

/// Vehicle without odometry: its start, and the noise of a motion that nothing measures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeMotion {
    /// Pose at the start.
    pub start: InitialPose,
    /// Distance of the start along the road in metres, if there is one: it selects the branch where the road crosses
    /// itself.
    pub along_m: Option<f64>,
    /// Random walk of the distance in m/√m and, except at standstill, in m/√s.
    pub distance_noise: f64,
}

/// Minimum standard deviation of the position after a motion without odometry (m).
const MIN_STD_M: f64 = 0.3;
/// Minimum standard deviation of the heading after a motion without odometry (rad).
const MIN_STD_RAD: f64 = 0.05;

impl Ekf {
    /// Returns the distance along the road in metres, if the filter has a map.
    pub(crate) fn along_m(&self) -> Option<f64> {
        self.map.as_ref().map(|_| self.belief.mean[ALONG])
    }

    /// Starts a motion without odometry. The constants are retained.
    pub(in crate::localize) fn begin_free_motion(&mut self, motion: &FreeMotion) {
        let mut pose = Self::prior(&self.config, self.map.as_deref(), &motion.start);
        if let (Some(along_m), true) = (motion.along_m, self.map.is_some()) {
            pose.mean[ALONG] = along_m;
        }
        replace(&mut self.belief, &pose, &POSE);
        self.bias.decorrelate();
        self.config.noise.odometer_m_per_sqrt_m = motion.distance_noise;
        self.config.noise.odometer_m_per_sqrt_s = motion.distance_noise;
        self.config.yaw_noise_rad_per_sqrt_s = FAULTY_YAW_NOISE_RAD_PER_SQRT_S;
        for head in &mut self.heads {
            // The distance since the last angle and range is unknown.
            head.last_update_m -= motion.start.position_std_m;
            head.last_range_m -= motion.start.position_std_m;
            head.last_residual = None;
        }
        self.forget_odometry();
    }

    /// Ends a motion without odometry: with the specified noise, and with the constants and the speed noise of the
    /// odometry from `before`. Without this noise, its first samples would be jumps of the speed, as of wheel slip.
    pub(in crate::localize) fn end_free_motion(&mut self, specified: &EkfConfig, before: &Self) {
        self.config.noise = specified.noise;
        self.config.yaw_noise_rad_per_sqrt_s = specified.yaw_noise_rad_per_sqrt_s;
        replace(&mut self.belief, &before.belief, &ODOMETRY);
        self.bias.decorrelate_states(&ODOMETRY);
        let covariance = &mut self.belief.covariance;
        let mut raise = |state: usize, std: f64| {
            covariance[state][state] = covariance[state][state].max(std * std);
        };
        raise(ALONG, MIN_STD_M);
        if self.map.is_none() {
            raise(ACROSS, MIN_STD_M);
            raise(HEADING, MIN_STD_RAD);
        }
        self.forget_odometry();
        self.speed_jumps = before.speed_jumps;
    }

    /// Forgets the samples of the odometry, because the next one is of another origin.
    fn forget_odometry(&mut self) {
        self.odometry = None;
        self.speed_jumps = SpeedJumps::default();
        self.sample_interval = SampleInterval::default();
        self.unread_m = 0.0;
        self.update_off_map();
    }
}

/// Replaces some states by those of another estimate, without correlation with the other states.
fn replace(belief: &mut Belief, by: &Belief, states: &[usize]) {
    for &state in states {
        belief.mean[state] = by.mean[state];
        for other in 0..belief.mean.len() {
            let covariance = if states.contains(&other) {
                by.covariance[state][other]
            } else {
                0.0
            };
            belief.covariance[state][other] = covariance;
            belief.covariance[other][state] = covariance;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::state::{MOUNTING, PHASE};
    use super::*;
    use crate::localize::modes::trip::{angle, trip_with_bias};
    use crate::observation::OdometrySample;

    /// Drives 20 s past four radio heads, then 5 s with odometry that is reversed but unused, then 5 s with odometry.
    /// Returns the filter before, after the motion without odometry, and at the end, with the final error in metres.
    fn drive() -> ([Ekf; 3], f64) {
        let (heads, road, mut ekf) = trip_with_bias(0.75);
        for (state, std) in [(MOUNTING, 0.01), (PHASE, 0.03), (SCALE, 0.003)] {
            ekf.belief.covariance[state][state] = std * std;
        }
        let specified = *ekf.config();
        let mut kept = Vec::new();
        let mut before = ekf.clone();
        for step in 1..=300 {
            let time_s = 0.1 * f64::from(step);
            let truth = road.pose(4.0 * time_s);
            if step == 200 {
                before = ekf.clone();
                kept.push(ekf.clone());
                ekf.begin_free_motion(&FreeMotion {
                    start: InitialPose {
                        pose: truth.along_chord(2.0, 0.0),
                        position_std_m: 4.0,
                        heading_std_rad: 0.2,
                    },
                    along_m: Some(4.0 * time_s + 2.0),
                    distance_noise: 1.5,
                });
            } else if step == 250 {
                ekf.end_free_motion(&specified, &before);
                kept.push(ekf.clone());
            }
            let is_free = (200..250).contains(&step);
            ekf.odometry(&OdometrySample {
                time_s,
                // Without odometry, the speed is a guess.
                distance_m: if is_free { 3.0 } else { 4.0 } * time_s,
                speed_mps: if is_free { 3.0 } else { 4.0 },
                yaw_rate_radps: None,
            });
            for head in &heads {
                let bearing_rad = truth.point().bearing_rad(head.position) - truth.heading_rad;
                ekf.update(
                    head,
                    &angle(time_s, std::f64::consts::PI * bearing_rad.cos()),
                );
            }
        }
        let error_m = (ekf.pose(30.0).pose.point()).distance_m(road.pose(120.0).point());
        kept.push(ekf);
        (kept.try_into().unwrap(), error_m)
    }

    #[test]
    fn motion_without_odometry_retains_array_constants_and_recovers_the_pose() {
        let ([before, after, last], error_m) = drive();
        let std = |ekf: &Ekf, state: usize| ekf.belief.covariance[state][state].sqrt();
        // The angles of 20 s have determined the array, and the motion without odometry forgets none of it.
        assert!(std(&before, MOUNTING) < 0.009 && std(&before, PHASE) < 0.027);
        for state in [MOUNTING, PHASE] {
            assert!(std(&after, state) <= std(&before, state) + 1e-9, "{state}");
        }
        // A guessed speed contains no information about the odometer scale.
        assert_eq!(after.belief.mean[SCALE], before.belief.mean[SCALE]);
        assert_eq!(std(&after, SCALE), std(&before, SCALE));
        assert_eq!(after.config, before.config);
        let start_std_m = std(&after, ALONG);
        assert!((MIN_STD_M..2.0).contains(&start_std_m), "{start_std_m}");
        let std_m = std(&last, ALONG);
        assert!(
            std_m < start_std_m && error_m < 4.0 * std_m,
            "{std_m} {error_m}"
        );
    }
}
