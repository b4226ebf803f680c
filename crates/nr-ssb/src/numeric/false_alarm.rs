//! Detection thresholds from the false-alarm probability.

/// Returns the threshold that the sum of `shape` independent unit exponentials exceeds with
/// `probability`: the inverse of the gamma distribution's tail `e^{−t} Σ_{i<shape} t^i / i!`.
pub(crate) fn exponential_sum_threshold(shape: usize, probability: f64) -> f64 {
    let log_tail = |t: f64| -> f64 {
        let (mut term, mut sum) = (1.0, 1.0);
        for i in 1..shape {
            term *= t / i as f64;
            sum += term;
        }
        sum.ln() - t
    };
    let target = probability.clamp(1e-300, 1.0).ln();
    let (mut low, mut high) = (0.0, 2000.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if log_tail(middle) > target {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_exponential_is_minus_the_logarithm() {
        assert!((exponential_sum_threshold(1, 1e-6) - 1e6_f64.ln()).abs() < 1e-9);
    }

    #[test]
    fn four_exponentials_match_the_gamma_tail() {
        // P(Gamma(4) > 13.06224) = 1e-3: a χ² variable with 8 degrees of freedom at 26.12448.
        assert!((exponential_sum_threshold(4, 1e-3) - 13.06224).abs() < 1e-4);
    }
}
