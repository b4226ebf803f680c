//! Whether the angles to one radio head keep agreeing with everything else.

use crate::gaussian::Innovation;

/// Weight of the newest angle in each of the averages: a fault that leaps out is found by the
/// first, a bias below the noise of single angles by the last.
const WEIGHTS: [f64; 3] = [0.5, 0.125, 0.03125];

/// By how many standard deviations an angle may lead an average: two outliers on end are no fault.
const MOST_LEAD: f64 = 3.0;

/// Statistic, in standard deviations, from which on a radio head is at fault, and below which it agrees: an error of
/// 4e-8 and of 5e-4 in a single test of a Gaussian.
pub(super) const DETECTED: f64 = 5.5;
pub(super) const CLEARED: f64 = 3.5;

/// After this time without disagreement a source counts as sound again (s).
pub(in crate::localize) const RECOVERY_S: f64 = 5.0;

/// Exponentially weighted averages of the innovations that a radio head's angles would bring to a
/// filter that does not use them, each beside the variance it has when nothing is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct HeadTest {
    averages: [Average; WEIGHTS.len()],
}

#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct Average {
    mean: f64,
    /// Variance by the noise of the angles; that of the belief is common to all of them.
    noise: f64,
    belief: f64,
}

impl HeadTest {
    /// Takes in one innovation.
    pub fn push(&mut self, innovation: &Innovation) {
        let belief = (innovation.variance - innovation.measurement_variance).max(0.0);
        let most = MOST_LEAD * innovation.variance.sqrt();
        for (average, weight) in self.averages.iter_mut().zip(WEIGHTS) {
            // An average that has seen nothing begins with the first angle whole.
            let weight = if average.noise == 0.0 { 1.0 } else { weight };
            let kept = 1.0 - weight;
            average.mean += weight * (innovation.residual - average.mean).clamp(-most, most);
            average.noise =
                kept * kept * average.noise + weight * weight * innovation.measurement_variance;
            average.belief = kept * average.belief + weight * belief;
        }
    }

    /// The largest of the averages in units of its standard deviation.
    pub fn statistic(&self) -> f64 {
        self.averages
            .iter()
            .filter(|average| average.noise > 0.0)
            .map(|average| average.mean.abs() / (average.noise + average.belief).sqrt())
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn innovation(residual: f64) -> Innovation {
        Innovation {
            residual,
            variance: 0.011,
            measurement_variance: 0.01,
        }
    }

    #[test]
    fn a_leap_is_found_at_once_and_a_small_bias_in_time() {
        let mut leap = HeadTest::default();
        for _ in 0..100 {
            leap.push(&innovation(0.0));
        }
        let mut small = leap;
        for _ in 0..3 {
            leap.push(&innovation(1.0));
        }
        assert!(leap.statistic() > 5.5);
        let found = (0..200).position(|_| {
            small.push(&innovation(0.2));
            small.statistic() > 3.0
        });
        assert!(
            found.is_some_and(|count| (5..60).contains(&count)),
            "{found:?}"
        );
    }

    #[test]
    fn two_outliers_on_end_are_no_fault() {
        let mut test = HeadTest::default();
        for _ in 0..100 {
            test.push(&innovation(0.05));
        }
        for _ in 0..2 {
            test.push(&innovation(-1.5));
            assert!(test.statistic() < 5.5);
        }
    }
}
