//! Angles that their estimator does not vouch for.

use std::f64::consts::TAU;

use crate::localize::gaussian::Innovation;

/// Probability that an angle which its estimator does not vouch for is wrong: as likely as not.
pub const WRONG_IF_UNRESOLVED: f64 = 0.5;

/// An angle is Gaussian with its stated deviation or, with the probability `wrong`, anything. The
/// belief after it is a mixture of the belief updated and the belief as it was (probabilistic data
/// association, Bar-Shalom and Tse 1975). This is the Gaussian measurement, residual and variance,
/// that gives the belief the mixture's mean and variance. `None` where the mixture is wider than the
/// belief was: such an angle says nothing.
pub fn equivalent(innovation: &Innovation, wrong: f64) -> Option<(f64, f64)> {
    let (residual, total) = (innovation.residual, innovation.variance);
    let holds = (1.0 - wrong) * innovation.density();
    let holds = holds / (holds + wrong / TAU);
    // With the gain K = P Hᵀ/S the mixture has the mean p K r and the covariance
    // P − p (S − (1 − p) r²) K Kᵀ, p being the probability that the angle holds.
    let narrowing = holds * (total - (1.0 - holds) * residual * residual);
    let equivalent_total = total * total / narrowing;
    let belief = total - innovation.measurement_variance;
    (narrowing > 0.0).then(|| {
        (
            holds * residual * equivalent_total / total,
            equivalent_total - belief,
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localize::gaussian::Gaussian;

    #[test]
    fn the_belief_has_the_moments_of_the_mixture() {
        let (prior_variance, variance) = (0.8_f64, 0.3_f64);
        let normal =
            |x: f64, variance: f64| (-0.5 * x * x / variance).exp() / (TAU * variance).sqrt();
        for measured in [0.0, 0.6, 1.1, -1.4] {
            // Bayes by the sum over the state: right, or anywhere on the circle.
            let mut moments = [0.0; 3];
            for step in -60_000..60_000 {
                let x = 1e-4 * f64::from(step);
                let likelihood = normal(measured - x, variance) + TAU.recip();
                let weight = likelihood * normal(x, prior_variance);
                for (power, moment) in (0..).zip(&mut moments) {
                    *moment += weight * x.powi(power);
                }
            }
            let mean = moments[1] / moments[0];
            let spread = moments[2] / moments[0] - mean * mean;

            let mut belief = Gaussian::independent([0.0], [prior_variance.sqrt()]);
            let innovation = belief.innovation(measured, &[1.0], variance);
            let (residual, variance) = equivalent(&innovation, WRONG_IF_UNRESOLVED).unwrap();
            belief.update(residual, &[1.0], variance);
            assert!((belief.mean[0] - mean).abs() < 1e-6, "{measured}");
            assert!(
                (belief.covariance[0][0] - spread).abs() < 1e-6,
                "{measured}"
            );
        }
    }

    #[test]
    fn far_off_it_says_nothing() {
        let innovation = Innovation {
            residual: 0.9,
            variance: 0.05,
            measurement_variance: 0.01,
        };
        assert_eq!(equivalent(&innovation, WRONG_IF_UNRESOLVED), None);
    }
}
