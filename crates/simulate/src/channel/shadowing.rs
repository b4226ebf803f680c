//! Log-normal shadowing along the road.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::random::{Purpose, Streams};
use crate::scenario::ChannelSettings;

/// Shadowing of one radio head in one run. The value in dB is Gaussian with an exponential
/// autocorrelation over distance (Gudmundson 1991).
#[derive(Debug, Clone)]
pub struct Shadowing {
    rng: ChaCha8Rng,
    std_db: f64,
    correlation_m: f64,
    last: Option<(f64, f64)>,
}

impl Shadowing {
    /// Creates the shadowing of the radio head with index `head`.
    pub fn new(settings: &ChannelSettings, streams: Streams, head: usize) -> Self {
        Self {
            rng: streams.generator(Purpose::Shadowing, head),
            std_db: settings.shadowing_std_db,
            correlation_m: settings.shadowing_correlation_m,
            last: None,
        }
    }

    /// Returns the next value in dB at the distance `along_m`. Called for every SSB, received or
    /// not, so that the channel does not depend on the vehicle's receptions.
    pub fn next_db(&mut self, along_m: f64) -> f64 {
        let fresh: f64 = self.rng.sample(StandardNormal);
        let normalised = match self.last {
            Some((last_m, last)) if self.correlation_m > 0.0 => {
                let kept = (-(along_m - last_m).abs() / self.correlation_m).exp();
                kept * last + (1.0 - kept * kept).sqrt() * fresh
            }
            _ => fresh,
        };
        self.last = Some((along_m, normalised));
        self.std_db * normalised
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(correlation_m: f64, step_m: f64) -> Vec<f64> {
        let settings = ChannelSettings {
            shadowing_correlation_m: correlation_m,
            ..Default::default()
        };
        let mut shadowing = Shadowing::new(&settings, Streams::new(3, 0), 0);
        (0..100_000)
            .map(|k| shadowing.next_db(f64::from(k) * step_m))
            .collect()
    }

    fn correlation(series: &[f64], lag: usize) -> f64 {
        let power: f64 = series.iter().map(|x| x * x).sum();
        series
            .iter()
            .zip(series.iter().skip(lag))
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / power
    }

    #[test]
    fn values_are_independent_without_a_correlation_length() {
        let series = series(0.0, 0.08);
        let std_db = (series.iter().map(|x| x * x).sum::<f64>() / 1e5).sqrt();
        assert!((std_db - 3.0).abs() < 0.03, "{std_db}");
        assert!(correlation(&series, 1).abs() < 0.02);
    }

    #[test]
    fn values_are_correlated_over_distance() {
        let series = series(5.0, 1.0);
        for lag in [1, 5, 10] {
            let expected = (-(lag as f64) / 5.0).exp();
            assert!(
                (correlation(&series, lag) - expected).abs() < 0.04,
                "lag {lag}"
            );
        }
    }
}
