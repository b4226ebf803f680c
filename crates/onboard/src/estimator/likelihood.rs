//! Gaussian approximation of a likelihood on the circle.

use std::f64::consts::{PI, TAU};

/// Returns the mean direction and standard deviation (rad) of a likelihood on the circle, given as
/// its logarithm at equally spaced angles from −π: `m = Σ w e^{jω} / Σ w`, mean `arg m`, standard
/// deviation `√(−2 ln |m|)` (Mardia and Jupp, Directional Statistics, 2.3). `None` for a list
/// without a finite maximum.
pub fn circular_gaussian(log_likelihood: &[f64]) -> Option<(f64, f64)> {
    let best = (log_likelihood.iter().copied()).fold(f64::NEG_INFINITY, f64::max);
    if !best.is_finite() || log_likelihood.iter().any(|value| value.is_nan()) {
        return None;
    }
    let step_rad = TAU / log_likelihood.len() as f64;
    let (mut total, mut re, mut im) = (0.0, 0.0, 0.0);
    for (index, value) in log_likelihood.iter().enumerate() {
        let weight = (value - best).exp();
        let (sin, cos) = (index as f64 * step_rad - PI).sin_cos();
        total += weight;
        re += weight * cos;
        im += weight * sin;
    }
    let length = re.hypot(im) / total;
    // A single grid point has the variance of its cell.
    let variance = (-2.0 * length.min(1.0).ln()).max(step_rad * step_rad / 12.0);
    Some((im.atan2(re), variance.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(value: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..720)
            .map(|index| value(f64::from(index) * TAU / 720.0 - PI))
            .collect()
    }

    #[test]
    fn a_gaussian_likelihood_gives_its_parameters() {
        for (mean, sigma) in [(0.3, 0.05), (3.1, 0.1), (-2.0, 0.2)] {
            let log = grid(|angle| {
                let off = (angle - mean + PI).rem_euclid(TAU) - PI;
                -0.5 * (off / sigma) * (off / sigma)
            });
            let (found, spread) = circular_gaussian(&log).unwrap();
            assert!((found - mean).abs() < 1e-6, "{found}");
            assert!((spread / sigma - 1.0).abs() < 1e-6, "{spread}");
        }
    }

    #[test]
    fn two_peaks_are_broad_and_a_flat_likelihood_has_no_information() {
        let two = grid(|angle| {
            if (angle.abs() - 1.0).abs() < 0.01 {
                0.0
            } else {
                -99.0
            }
        });
        assert!(circular_gaussian(&two).unwrap().1 > 0.9);
        assert_eq!(circular_gaussian(&[f64::NEG_INFINITY; 8]), None);
        assert_eq!(circular_gaussian(&[0.0, f64::NAN]), None);
        assert_eq!(circular_gaussian(&[]), None);
    }
}
