//! A start from scratch: the vehicle knows the road and hears radio heads, but not where it is.
//!
//! One tracker for each stretch of the road, each weighed by how well it foretells the angles;
//! those that fall far behind, or meet a better one, are given up until one is left.

use std::sync::Arc;

use super::tracker::{InitialPose, Tracker, TrackerConfig};
use super::{AngleMeasurement, UpdateReason};
use crate::geometry::Pose;
use crate::observation::OdometrySample;
use crate::world::{RadioHead, Track};

/// Distance between the first hypotheses (m): within it an angle is linear enough to be followed.
const SPACING_M: f64 = 5.0;

/// Log-likelihood by which a hypothesis may fall behind the best; e^−25 is one in 10¹¹.
const BEHIND: f64 = 25.0;

/// The most that one angle may cost a hypothesis: an outlier must not end the right one.
const WORST_ANGLE: f64 = 8.0;

/// A hypothesis of where the vehicle is.
#[derive(Clone, Debug)]
struct Hypothesis {
    tracker: Tracker,
    log_likelihood: f64,
}

/// The search for the first pose.
#[derive(Clone, Debug)]
pub struct Initialiser {
    gate: f64,
    hypotheses: Vec<Hypothesis>,
}

impl Initialiser {
    /// The vehicle may be anywhere on the road, driving along it.
    pub fn new(config: TrackerConfig, map: &Arc<Track>, heads: &[RadioHead]) -> Self {
        // Hypotheses judge every angle; the gate is for the one that is left.
        let open = TrackerConfig {
            gate: f64::INFINITY,
            ..config
        };
        let count = (map.length_m() / SPACING_M).ceil().max(1.0) as usize;
        let spacing_m = map.length_m() / count as f64;
        let hypothesis = |index: usize| {
            let start = InitialPose {
                pose: map.pose((index as f64 + 0.5) * spacing_m),
                position_std_m: 0.5 * spacing_m,
                heading_std_rad: 1.0,
            };
            Hypothesis {
                tracker: Tracker::new(open, Some(map.clone()), heads, &start),
                log_likelihood: 0.0,
            }
        };
        Self {
            gate: config.gate,
            hypotheses: (0..count).map(hypothesis).collect(),
        }
    }

    /// Moves every hypothesis.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.tracker.odometry(sample);
        }
    }

    /// Judges every hypothesis by an angle.
    pub fn update(&mut self, head: &RadioHead, measured: &AngleMeasurement) {
        for hypothesis in &mut self.hypotheses {
            let Some(innovation) = hypothesis.tracker.innovation(head, measured) else {
                continue;
            };
            let verdict = hypothesis.tracker.update(head, measured);
            if verdict.reason == UpdateReason::Consistent {
                let cost = 0.5 * (innovation.mahalanobis2() + innovation.variance.ln());
                // Looks that are not independent have a variance that says so, and cost alike.
                hypothesis.log_likelihood -= cost.min(WORST_ANGLE);
            }
        }
        self.prune();
    }

    fn prune(&mut self) {
        self.hypotheses
            .sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
        let best = self
            .hypotheses
            .first()
            .map_or(0.0, |best| best.log_likelihood);
        let mut kept: Vec<Pose> = Vec::with_capacity(self.hypotheses.len());
        self.hypotheses.retain(|hypothesis| {
            let estimate = hypothesis.tracker.pose(hypothesis.tracker.time_s());
            let radius_m = estimate.principal_variances()[0].sqrt();
            let place = estimate.pose.point();
            // Two that have come together are one; the better of them was kept before.
            let apart = kept
                .iter()
                .all(|other| other.point().distance_m(place) > radius_m);
            let keeps_up = hypothesis.log_likelihood > best - BEHIND;
            if apart && keeps_up {
                kept.push(estimate.pose);
            }
            apart && keeps_up
        });
    }

    /// Number of hypotheses left.
    pub fn left(&self) -> usize {
        self.hypotheses.len()
    }

    /// The tracker of the one hypothesis that is left, once it knows the position to `std_m`.
    pub fn found(&self, std_m: f64) -> Option<Tracker> {
        let [only] = self.hypotheses.as_slice() else {
            return None;
        };
        let mut tracker = only.tracker.clone();
        let estimate = tracker.pose(tracker.time_s());
        tracker.set_gate(self.gate);
        (estimate.principal_variances()[0] < std_m * std_m).then_some(tracker)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;
    use crate::geometry::wrap_angle;
    use crate::scenario::{Scenario, TrackerSettings};

    /// Drives from `start_m` until found; the error then, in metres and in standard deviations.
    fn search(seed: u64) -> Option<(f64, f64)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let scenario = Scenario::load("paper-real-odometry-2").unwrap();
        let config = TrackerConfig::new(&scenario, &TrackerSettings::default());
        let heads: Vec<RadioHead> = scenario.radio_heads.iter().map(RadioHead::from).collect();
        let map = Arc::new(scenario.build_track().unwrap());
        let start_m = rng.random::<f64>() * 200.0;
        let mut initialiser = Initialiser::new(config, &map, &heads);
        for step in 0..1000 {
            let time_s = f64::from(step) * 0.02;
            let distance_m = 4.0 * time_s;
            initialiser.odometry(&OdometrySample {
                time_s,
                distance_m,
                speed_mps: 4.0,
                yaw_rate_radps: None,
            });
            let truth = map.pose(start_m + distance_m);
            for head in &heads {
                let bearing_rad = truth.point().bearing_rad(head.position);
                let noise: f64 = rng.sample(StandardNormal);
                let phase_rad =
                    std::f64::consts::PI * (bearing_rad - truth.heading_rad).cos() + 0.1 * noise;
                let measured = AngleMeasurement {
                    time_s,
                    phase_rad: wrap_angle(phase_rad),
                    phase_sigma_rad: 0.001,
                    angle_rad: f64::NAN,
                    snr_db: 20.0,
                    resolved: true,
                };
                initialiser.update(head, &measured);
            }
            if let Some(tracker) = initialiser.found(2.0) {
                let estimate = tracker.pose(time_s);
                let error_m = estimate.pose.point().distance_m(truth.point());
                return Some((error_m, error_m / estimate.principal_variances()[0].sqrt()));
            }
        }
        None
    }

    #[test]
    fn two_heads_and_the_road_are_enough() {
        let right = (0..100)
            .filter_map(search)
            .filter(|(error_m, sigmas)| *error_m < 8.0 && *sigmas < 4.5)
            .count();
        assert!(right >= 99, "{right} of 100");
    }
}
