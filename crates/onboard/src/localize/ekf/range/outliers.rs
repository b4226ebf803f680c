//! Ranges that are outliers: detections of noise, and faults of a receiver.

use crate::gaussian::Innovation;

/// Fraction of measurements that are outliers with a uniform distribution, unless scatter causes more.
pub(in crate::localize) const OUTLIERS: f64 = 2e-3;

/// Width of the uniform distribution of outliers of a range (m).
pub(super) const OUTLIER_SPAN_M: f64 = 100.0;

/// Returns the density (1/m) of a range that has the given density or, with probability `outliers`, is uniformly
/// distributed.
pub(in crate::localize) fn with_range_outliers(density: f64, outliers: f64) -> f64 {
    outliers / OUTLIER_SPAN_M + (1.0 - outliers) * density
}

/// Returns the density (1/m) of an outlier with the innovation of a clear path. Its magnitude is log-uniformly distributed
/// between the standard deviation of the innovation and [`OUTLIER_SPAN_M`], so that the first delay, whose clock is unknown,
/// is no outlier. The likelihoods of positions need the uniform density instead: see [`with_range_outliers`].
pub(super) fn outlier_density(innovation: &Innovation) -> f64 {
    let sigma_m = innovation.variance.sqrt();
    let log_span = (OUTLIER_SPAN_M / sigma_m).ln().max(0.0);
    0.5 / (innovation.residual.abs().max(sigma_m) * (1.0 + log_span))
}
