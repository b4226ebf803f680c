//! Step of the vehicle's clock, found with one-way delays.
//!
//! A step shifts the delays of all radio heads by one amount at once. Blocked paths begin one by one, and each has its own
//! additional distance. The test starts with an outlier. It compares two hypotheses with the next delay of each other radio
//! head: the clock has stepped by the amount of the outlier, or not. The first delay of each radio head counts only, because
//! the additional distance of a blocked path repeats (sequential probability ratio test, Wald 1945).

use super::late_path::LatePath;
use super::noise::RangeNoise;
use super::outliers::{OUTLIER_SPAN_M, OUTLIERS, with_range_outliers};
use super::pseudorange::PredictedRange;
use super::update::path_changed;
use crate::gaussian::Innovation;
use crate::localize::bias::CLOCK;
use crate::localize::ekf::filter::Ekf;
use crate::localize::output::UpdateReason;
use crate::radio_head::RadioHead;
use crate::range::{RangeMeasurement, RangeQuantity};

/// Logarithm of the prior probability of a step before an outlier. An assumption: one step in an hour of 25 delays per second.
const PRIOR: f64 = -11.5;

/// Log odds above which the clock has stepped: 10 to 1. An assumption.
const STEPPED: f64 = 2.3;

/// Maximum duration of a test (s): several periods of SSBs.
const MAX_DURATION_S: f64 = 1.0;

/// Test whether the clock has stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize::ekf) struct ClockStepTest {
    step: ClockStep,
    log_odds: f64,
    begun_s: f64,
    /// Noise of ranges and clocks before the test.
    noise: [RangeNoise; 2],
}

/// Step of the vehicle's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::localize) struct ClockStep {
    mean_m: f64,
    variance: f64,
}

impl ClockStepTest {
    /// Starts with an outlier, and with the path of its radio head.
    fn new(innovation: &Innovation, path: LatePath, now_s: f64, noise: [RangeNoise; 2]) -> Self {
        Self {
            step: ClockStep {
                mean_m: innovation.residual,
                variance: innovation.variance,
            },
            // A step has the uniform density of an outlier.
            log_odds: PRIOR - (OUTLIER_SPAN_M * density(innovation, path)).ln(),
            begun_s: now_s,
            noise,
        }
    }

    /// Updates with the delay of a radio head that was not in the test yet, and with its path.
    fn update(&mut self, innovation: &Innovation, path: LatePath) {
        let after_step = Innovation {
            residual: innovation.residual - self.step.mean_m,
            variance: innovation.variance + self.step.variance,
            ..*innovation
        };
        let stepped = density(&after_step, path);
        self.log_odds += (stepped / density(innovation, path)).ln();
        if !path.after(&after_step).is_blocked() {
            let gain = self.step.variance / after_step.variance;
            self.step.mean_m += gain * after_step.residual;
            self.step.variance *= 1.0 - gain;
        }
    }
}

/// Returns the probability density of a delay (1/m): clear, blocked, or an outlier.
fn density(innovation: &Innovation, path: LatePath) -> f64 {
    with_range_outliers(path.density(innovation), OUTLIERS)
}

impl Ekf {
    /// Predicts a range, range rate or carrier phase. If it shows that the vehicle's clock has stepped, the clock is changed
    /// before, and the step is returned for other filters of the vehicle.
    pub(in crate::localize) fn predict_with_clock_step(
        &mut self,
        head: &RadioHead,
        measured: &RangeMeasurement,
    ) -> (Result<PredictedRange, UpdateReason>, Option<ClockStep>) {
        let predicted = self.predict_range(head, measured);
        let step = self.clock_step(&predicted);
        let Some(known) = step else {
            return (predicted, None);
        };
        self.step_clock(known);
        (self.predict_range(head, measured), step)
    }

    /// Tests with a predicted delay whether the vehicle's clock has stepped. Returns the step once it is certain.
    fn clock_step(
        &mut self,
        predicted: &Result<PredictedRange, UpdateReason>,
    ) -> Option<ClockStep> {
        let predicted = predicted.as_ref().ok()?;
        if !self.has_one_way_delays()
            || predicted.excluded
            || predicted.quantity != RangeQuantity::Range
        {
            return None;
        }
        let (now_s, innovation) = (predicted.time_s, &predicted.clear_innovation());
        let noise = [self.range_noise, self.clock_noise];
        let head = self.heads.get_mut(predicted.index)?;
        let before = head.late;
        let path = before.before(path_changed(head, predicted));
        let running = self.clock_test.take();
        self.clock_test = running.filter(|it| now_s - it.begun_s <= MAX_DURATION_S);
        if let Some(test) = &mut self.clock_test
            && head.clock_test_s < test.begun_s
        {
            test.update(innovation, path);
            (head.clock_test_s, head.late_before_step) = (now_s, before);
        }
        let is_outlier = innovation.mahalanobis2() > self.config.gate;
        let begins = !path.is_blocked() && path.after(innovation).is_blocked();
        if is_outlier || begins {
            let other = ClockStepTest::new(innovation, path, now_s, noise);
            if (self.clock_test).is_none_or(|it| other.log_odds > it.log_odds) {
                self.clock_test = Some(other);
                (head.clock_test_s, head.late_before_step) = (now_s, before);
            }
        }
        let test = self.clock_test.filter(|it| it.log_odds > STEPPED)?;
        self.clock_test = None;
        [self.range_noise, self.clock_noise] = test.noise;
        for head in &mut self.heads {
            head.rejected_ranges = 0;
            if head.clock_test_s >= test.begun_s {
                head.late = head.late_before_step;
            }
        }
        Some(test.step)
    }

    /// Changes the estimated clock of the vehicle by a step.
    pub(in crate::localize) fn step_clock(&mut self, step: ClockStep) {
        self.bias.add_jump(CLOCK, step.mean_m, step.variance);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Exp1, StandardNormal};

    use super::*;

    /// Returns the log odds of a step after one delay of each of six radio heads, with a standard deviation of 1 m. The
    /// first delay is late by 20 m. The others are late by `step_m`, and those of blocked paths also by 5 m or more.
    fn log_odds(random: &mut ChaCha8Rng, step_m: f64, blocked: f64) -> f64 {
        let innovation = |residual: f64| Innovation {
            residual,
            variance: 1.0,
            measurement_variance: 1.0,
        };
        let noise = [RangeNoise::STATED; 2];
        let mut test = ClockStepTest::new(&innovation(20.0), LatePath::PRIOR, 0.0, noise);
        for _ in 0..5 {
            let noise_m: f64 = random.sample(StandardNormal);
            let late_m: f64 = 5.0 + 10.0 * random.sample::<f64, _>(Exp1);
            let late_m = if random.random::<f64>() < blocked {
                late_m
            } else {
                0.0
            };
            test.update(&innovation(step_m + late_m + noise_m), LatePath::PRIOR);
        }
        test.log_odds
    }

    #[test]
    fn a_step_of_all_delays_is_found_and_blocked_paths_are_none() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..1000 {
            assert!(log_odds(&mut random, 20.0, 0.0) > STEPPED);
            assert!(log_odds(&mut random, 0.0, 0.0) < PRIOR);
        }
        // Two of five new blocked paths with nearly the same distance as the first one are necessary.
        let draws = (0..10_000).map(|_| log_odds(&mut random, 0.0, 0.2));
        let wrong = draws.filter(|it| *it > STEPPED).count();
        assert!(wrong < 10, "{wrong} of 10,000");
    }
}
