//! Noise variance and detection of sources from the eigenvalues of a covariance.

use crate::bound;
use crate::linalg::eigen::HermitianEigen;

/// Returns the mean of the noise eigenvalues.
pub(super) fn noise_variance<const N: usize>(eigen: &HermitianEigen<N>, sources: usize) -> f64 {
    let mean = eigen.values[sources..].iter().sum::<f64>() / (N - sources) as f64;
    mean.max(eigen.values[0] * 1e-15)
}

/// Whether the weakest source exceeds the noise.
pub(super) fn shows<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
    snapshots: usize,
) -> bool {
    let ratio = eigen.values[sources - 1] / noise_variance(eigen, sources);
    (ratio - 1.0) / N as f64 >= bound::resolvable_snr::<N>(snapshots)
}
