//! Sequential test of the odometry by the angles.

use std::collections::VecDeque;

use super::likelihood::{LikelihoodRatio, conditional_fraction};
use crate::localize::ekf::Ekf;
use crate::localize::out_of_sequence::AngleUpdate;
use crate::observation::OdometrySample;

/// Noise of the free filter's distance in m/√m. At 2 m/s it permits a deviation of 0.17 m between
/// two bursts. A vehicle that stops without the odometry's notice deviates by 0.08 m. Half of this
/// noise delays the detection by 0.1 s.
const FREE_M_PER_SQRT_M: f64 = 0.6;
/// Threshold of the cumulative log-likelihood ratio: false-alarm rate 1e-3 for each excursion from
/// zero (Wald). The test starts only after a suspicion with a false-alarm rate of at most 1e-3, so
/// that the combined rate is at most 1e-6.
const EVIDENCE: f64 = 6.9;
/// Minimum distance between the positions of both filters in metres. Angle errors that the filters
/// do not model, such as strong multipath, cause smaller distances.
const MIN_M: f64 = 0.5;
/// Maximum number of odometry samples that are stored until the next burst.
const MAX_STORED_SAMPLES: usize = 256;

/// Two filters with a common start: one is predicted by the odometry; the other one has process
/// noise that permits any motion. Both model the correlated errors of the angles. A cumulative sum
/// (Page 1954) compares the likelihoods of the angles.
#[derive(Debug, Clone)]
pub struct OdometryTest {
    driven: Ekf,
    free: Ekf,
    ratio: LikelihoodRatio,
    /// Odometry since the last burst.
    waiting: VecDeque<OdometrySample>,
}

impl OdometryTest {
    /// Starts the test at the state of the localizer's filter.
    pub fn new(ekf: &Ekf) -> Self {
        let (driven, mut free) = (ekf.clone(), ekf.clone());
        free.expect_free_motion(FREE_M_PER_SQRT_M);
        Self {
            driven,
            free,
            ratio: LikelihoodRatio::NONE,
            waiting: VecDeque::with_capacity(MAX_STORED_SAMPLES),
        }
    }

    /// Processes odometry. It is used with the next burst, which may be older.
    pub fn odometry(&mut self, sample: &OdometrySample) {
        if self.waiting.len() == MAX_STORED_SAMPLES {
            self.advance_to(f64::INFINITY);
        }
        self.waiting.push_back(*sample);
    }

    /// Processes the angles of a burst.
    pub fn angles(&mut self, updates: &[AngleUpdate]) {
        for AngleUpdate { head, measured, .. } in updates {
            self.advance_to(measured.time_s);
            let [driven, free] =
                [&self.driven, &self.free].map(|ekf| ekf.predict_measurement(head, measured));
            let (free_by, driven_by) = ((&self.free, &free), (&self.driven, &driven));
            (self.ratio).update(free_by, driven_by, conditional_fraction);
            self.driven.update_predicted(driven, measured);
            self.free.update_predicted(free, measured);
        }
        self.ratio.raise_to(0.0);
    }

    /// Predicts both filters with the odometry up to a time (s).
    fn advance_to(&mut self, time_s: f64) {
        while let Some(sample) = self.waiting.front().filter(|it| it.time_s <= time_s) {
            self.driven.odometry(sample);
            self.free.odometry(sample);
            self.waiting.pop_front();
        }
    }

    /// Whether the angles show another motion than the odometry.
    pub fn is_fault(&self) -> bool {
        let [driven, free] = [&self.driven, &self.free].map(|ekf| ekf.pose(ekf.time_s()).pose);
        self.ratio.value() > EVIDENCE && driven.point().distance_m(free.point()) >= MIN_M
    }

    /// Returns the filter that does not depend on the odometry.
    pub const fn free(&self) -> &Ekf {
        &self.free
    }
}
