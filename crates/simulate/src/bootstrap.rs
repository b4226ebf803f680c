//! Confidence interval of a statistic over runs.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of resamples. The ends of the 95 % interval are the 50th smallest and the 50th largest
/// value.
const RESAMPLES: usize = 2000;

/// Returns the 95 % bootstrap confidence interval of a statistic over independent runs (Efron
/// 1979). Whole runs are drawn with replacement, which preserves the correlation within a run.
pub fn bootstrap_interval<T>(runs: &[T], statistic: impl Fn(&[&T]) -> f64) -> [f64; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut sample: Vec<&T> = Vec::with_capacity(runs.len());
    let mut values: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            sample.clear();
            let draw = |_| runs.get(rng.random_range(0..runs.len()));
            sample.extend((0..runs.len()).filter_map(draw));
            statistic(&sample)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    [RESAMPLES / 40, RESAMPLES - 1 - RESAMPLES / 40]
        .map(|place| values.get(place).copied().unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_of_a_mean_is_two_standard_errors_wide() {
        // 0 … 99: mean 49.5, standard deviation 28.87, standard error 2.887.
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let mean = |sample: &[&f64]| sample.iter().copied().sum::<f64>() / sample.len() as f64;
        let [low, high] = bootstrap_interval(&values, mean);
        // The 2.5 % quantile of 2000 resamples has a standard deviation of about 0.06 standard
        // errors.
        assert!(
            (low - (49.5 - 1.96 * 2.887)).abs() < 4.0 * 0.06 * 2.887,
            "{low}"
        );
        assert!(
            (high - (49.5 + 1.96 * 2.887)).abs() < 4.0 * 0.06 * 2.887,
            "{high}"
        );
    }
}
