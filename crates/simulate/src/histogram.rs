//! Quantiles of an error from a histogram.

/// Bins per decade. Adjacent bins differ by 5.9 %, and quantiles are interpolated within a bin.
const BINS_PER_DECADE: f64 = 40.0;
/// Lower limit of the first bin in metres; smaller values are counted in the first bin.
const SMALLEST_M: f64 = 1e-4;
/// Number of bins, up to 1 km.
const BINS: usize = 7 * BINS_PER_DECADE as usize + 1;

/// Histogram of lengths with logarithmic bins from 0.1 mm to 1 km.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ErrorHistogram {
    counts: Box<[u32; BINS]>,
    total: u32,
}

impl Default for ErrorHistogram {
    fn default() -> Self {
        Self {
            counts: Box::new([0; BINS]),
            total: 0,
        }
    }
}

impl ErrorHistogram {
    /// Adds one error.
    pub fn add(&mut self, error_m: f64) {
        let position = (error_m.abs() / SMALLEST_M).max(1.0).log10() * BINS_PER_DECADE;
        if let Some(count) = self.counts.get_mut((position as usize).min(BINS - 1)) {
            *count += 1;
            self.total += 1;
        }
    }

    /// Adds the counts of another histogram.
    pub fn merge(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(other.counts.iter()) {
            *count += more;
        }
        self.total += other.total;
    }

    /// Returns the quantile in metres for `probability`; `None` for an empty histogram.
    pub fn quantile_m(&self, probability: f64) -> Option<f64> {
        let wanted = probability * f64::from(self.total);
        let mut below = 0.0;
        for (bin, &count) in self.counts.iter().enumerate() {
            let here = f64::from(count);
            if here > 0.0 && below + here >= wanted {
                let position = bin as f64 + ((wanted - below) / here).clamp(0.0, 1.0);
                return Some(SMALLEST_M * 10f64.powf(position / BINS_PER_DECADE));
            }
            below += here;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_uniform_errors_are_correct() {
        let mut histogram = ErrorHistogram::default();
        assert_eq!(histogram.quantile_m(0.5), None);
        for k in 1..=10_000 {
            histogram.add(f64::from(k) * 1e-4);
        }
        for probability in [0.1, 0.5, 0.9] {
            let quantile_m = histogram.quantile_m(probability).unwrap();
            assert!(
                (quantile_m / probability - 1.0).abs() < 0.01,
                "{probability}: {quantile_m}"
            );
        }
    }
}
