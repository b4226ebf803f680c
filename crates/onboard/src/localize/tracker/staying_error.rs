//! The error of a radio head's angles that stays over metres, found as the vehicle drives.
//!
//! Where paths are few, what reflections add to an angle is nearly the same a wavelength on, and how
//! large it is differs from radio head to radio head and along the way: a jump Markov process, whose
//! deviation is one of a few levels and may change from one stretch of way to the next. Which one it is,
//! the mean innovation of each stretch tells (Bayes). By way and not by time: who stands learns nothing.

use std::f64::consts::TAU;

use crate::localize::gaussian::Innovation;

/// How many levels there are, and their deviations (rad): from what calibration leaves of the best
/// arrays to what leaves hardly more than a side.
const LEVELS: usize = 4;
const LEVELS_RAD: [f64; LEVELS] = [0.01, 0.03, 0.1, 0.3];

/// Probability of each level before anything is heard: any is as likely as another.
const FIRST: f64 = 1.0 / LEVELS as f64;

/// The largest variance there is (rad²).
pub const MOST_VARIANCE: f64 = LEVELS_RAD[LEVELS - 1] * LEVELS_RAD[LEVELS - 1];

/// Way of one stretch (m).
const STRETCH_M: f64 = 2.0;

/// Probability that a stretch on the level is drawn anew.
const CHANGES: f64 = 0.1;

/// The least way between two looks, in stretches: who stands learns nothing, but a variance must stay a
/// number.
const LEAST_STEP: f64 = 1e-5;

/// One radio head's error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StayingError {
    /// Probability of each level.
    probabilities: [f64; LEVELS],
    /// Of the present stretch, weighed by way in stretches: way, innovations, and the variances of the
    /// belief and of the angles' own noise.
    way: f64,
    innovations: f64,
    belief: f64,
    own: f64,
}

impl Default for StayingError {
    fn default() -> Self {
        Self {
            probabilities: [FIRST; LEVELS],
            way: 0.0,
            innovations: 0.0,
            belief: 0.0,
            own: 0.0,
        }
    }
}

impl StayingError {
    /// Expected variance of the error in one look (rad²).
    pub fn variance(&self) -> f64 {
        let levels = self.probabilities.iter().zip(LEVELS_RAD);
        levels.map(|(share, level)| share * level * level).sum()
    }

    /// Whether it is probably so large that the radio head says next to nothing.
    pub fn is_large(&self) -> bool {
        self.probabilities[LEVELS - 1] > 0.5
    }

    /// Share of a stretch that a look tells of, `travelled_m` after the last one.
    pub fn share(travelled_m: f64) -> f64 {
        (travelled_m / STRETCH_M).clamp(LEAST_STEP, 1.0)
    }

    /// By how much a look counts less than a stretch does, `travelled_m` after the last one.
    pub fn repetition(travelled_m: f64) -> f64 {
        Self::share(travelled_m).recip()
    }

    /// Probability density of a look whose innovation without this error is `seen` (1/rad).
    pub fn density(&self, seen: &Innovation) -> f64 {
        let levels = self.foretold().into_iter().zip(LEVELS_RAD);
        let density = |(probability, level): (f64, f64)| {
            let mut seen = *seen;
            seen.variance += level * level;
            probability * seen.density()
        };
        levels.map(density).sum()
    }

    /// The Gaussian measurement, residual and variance, that gives a belief the mean and variance of
    /// the mixture over the levels; `None` where the mixture is wider than the belief was. `seen` is
    /// an innovation without this error.
    pub fn equivalent(&self, seen: &Innovation, repetition: f64) -> Option<(f64, f64)> {
        let square = seen.residual * seen.residual;
        let (mut total, mut mean, mut mean_square) = (0.0, 0.0, 0.0);
        for (probability, level) in self.foretold().into_iter().zip(LEVELS_RAD) {
            let error = level * level;
            let once = seen.variance + error;
            let weight = probability * (-0.5 * square / once).exp() / once.sqrt();
            let inverse = (seen.variance + error * repetition).recip();
            total += weight;
            mean += weight * inverse;
            mean_square += weight * inverse * inverse;
        }
        if total <= 0.0 {
            return None;
        }
        (mean, mean_square) = (mean / total, mean_square / total);
        // With gains K = P Hᵀ/S the mixture has the mean P Hᵀ E[1/S] r and the covariance
        // P − P Hᵀ (E[1/S] − r² Var[1/S]) H P.
        let narrowing = mean - square * (mean_square - mean * mean);
        let belief = seen.variance - seen.measurement_variance;
        (narrowing > 0.0).then(|| {
            let variance = narrowing.recip();
            (seen.residual * mean * variance, variance - belief)
        })
    }

    /// The probabilities a stretch on.
    fn foretold(&self) -> [f64; LEVELS] {
        let mut foretold = self.probabilities;
        for share in &mut foretold {
            *share += CHANGES * (FIRST - *share);
        }
        foretold
    }

    /// Learns from an innovation without this error, `travelled_m` after the one before; `own` is the
    /// variance of the angle's noise.
    pub fn learn(&mut self, travelled_m: f64, seen: &Innovation, own: f64) {
        let weight = (travelled_m / STRETCH_M).clamp(0.0, 1.0);
        self.way += weight;
        self.innovations += weight * seen.residual;
        self.belief += weight * (seen.variance - seen.measurement_variance).max(0.0);
        self.own += weight * weight * own;
        if self.way < 1.0 {
            return;
        }
        let mean = self.innovations / self.way;
        let other = self.belief / self.way + self.own / (self.way * self.way);
        let mut likely = self.foretold();
        for (probability, level) in likely.iter_mut().zip(LEVELS_RAD) {
            let variance = level * level + other;
            *probability *= (-0.5 * mean * mean / variance).exp() / (TAU * variance).sqrt();
        }
        let total: f64 = likely.iter().sum();
        if total > 0.0 {
            self.probabilities = likely.map(|probability| probability / total);
        }
        (self.way, self.innovations, self.belief, self.own) = (0.0, 0.0, 0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn innovation(residual: f64) -> Innovation {
        Innovation {
            residual,
            variance: 5e-4,
            measurement_variance: 1e-4,
        }
    }

    /// Looks every 0.1 m with an error of so many radians.
    fn after(looks: u32, error_rad: f64) -> StayingError {
        let mut error = StayingError::default();
        for _ in 0..looks {
            error.learn(0.1, &innovation(error_rad), 1e-4);
        }
        error
    }

    #[test]
    fn its_size_is_found_within_metres_and_found_anew_where_it_changes() {
        let mut error = after(100, 0.0);
        let small = error.variance();
        assert!(small < 0.05 * 0.05, "{small}");
        for _ in 0..60 {
            error.learn(0.1, &innovation(0.4), 1e-4);
        }
        assert!(error.is_large());
        assert!(error.variance() > 0.25 * 0.25);
        // The measurement that is made of such an angle hardly moves the belief.
        let (_, variance) = error.equivalent(&innovation(0.4), 20.0).unwrap();
        assert!(variance > 0.3 * 0.3, "{variance}");
    }

    #[test]
    fn who_stands_learns_nothing() {
        let (moving, mut standing) = (after(100, 0.02), after(100, 0.02));
        for _ in 0..10_000 {
            standing.learn(0.0, &innovation(0.4), 1e-4);
        }
        assert_eq!(standing.variance(), moving.variance());
    }
}
