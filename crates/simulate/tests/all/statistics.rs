//! Statistics of campaigns for tests and tables.
#![allow(dead_code, reason = "each table takes what it needs")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use simulate::Campaign;

/// Standard normal quantile of a two-sided 95 % interval.
const BAND: f64 = 1.959_964;

/// Errors of a campaign compared with their predicted values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consistency {
    /// Root mean square of the horizontal error in metres.
    pub rms_m: f64,
    /// RMS horizontal error in metres according to the localizer's covariances; NaN without
    /// covariances.
    pub predicted_rms_m: f64,
    /// 90th percentile of the horizontal error in metres.
    pub p90_m: f64,
    /// Mean normalised estimation error squared (NEES) of the position; 2 for a consistent
    /// localizer.
    pub mean_nees: f64,
    /// Fraction of the steps whose mean NEES over the runs is within its 95 % interval.
    pub in_band: f64,
}

/// Statistics of a campaign that only tests and tables need.
pub trait CampaignStatistics {
    /// Compares errors with covariances. The NEES of the first `skip` steps is ignored, because an
    /// exactly known start has a singular covariance.
    fn consistency(&self, skip: usize) -> Consistency;

    /// Returns the maximum over the steps of the mean |x error| and the mean |y error| in metres
    /// (the paper's metric).
    fn worst_mean_abs_error_m(&self) -> [f64; 2];

    /// Returns the mean number of angle estimates per run.
    fn mean_aoa_estimates(&self) -> f64;
}

impl CampaignStatistics for Campaign {
    fn consistency(&self, skip: usize) -> Consistency {
        let [low, high] = nees_band(self.runs.len());
        let nees = || {
            self.steps
                .iter()
                .skip(skip)
                .filter_map(|step| step.mean_nees)
        };
        let within = nees().filter(|nees| (low..high).contains(nees));
        let squares_m2 = || self.steps.iter().map(|step| step.rms_error_m.powi(2));
        let predicted_m = || self.steps.iter().filter_map(|step| step.predicted_rms_m);
        Consistency {
            rms_m: mean(squares_m2()).sqrt(),
            predicted_rms_m: mean(predicted_m().map(|rms_m| rms_m * rms_m)).sqrt(),
            p90_m: self.errors.quantile_m(0.9).unwrap_or(f64::NAN),
            mean_nees: mean(nees()),
            in_band: within.count() as f64 / nees().count() as f64,
        }
    }

    fn worst_mean_abs_error_m(&self) -> [f64; 2] {
        self.steps
            .iter()
            .fold([0.0; 2], |[x_m, y_m]: [f64; 2], step| {
                [
                    x_m.max(step.mean_abs_error_x_m),
                    y_m.max(step.mean_abs_error_y_m),
                ]
            })
    }

    fn mean_aoa_estimates(&self) -> f64 {
        mean(self.runs.iter().map(|run| run.aoa_estimates as f64))
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Returns the 95 % interval of the mean NEES over `runs` runs. χ² with two degrees of freedom per
/// run is approximated by the cube root transformation of Wilson and Hilferty.
fn nees_band(runs: usize) -> [f64; 2] {
    let freedom = 2.0 * runs as f64;
    let spread = 2.0 / (9.0 * freedom);
    [-BAND, BAND].map(|z| 2.0 * (1.0 - spread + z * spread.sqrt()).powi(3))
}

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

#[test]
fn nees_band_equals_tabulated_chi_squared_quantiles() {
    // Tabulated quantiles of χ²(200): 162.73 and 241.06.
    let [low, high] = nees_band(100);
    assert!((low - 1.6273).abs() < 1e-3, "{low}");
    assert!((high - 2.4106).abs() < 1e-3, "{high}");
}

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
