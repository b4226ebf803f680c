//! Number of sources by information criteria on the eigenvalues (Wax and Kailath 1985).

use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::eigen::hermitian_eigen;

/// Penalty of the number of sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Akaike information criterion: sensitive, but may overestimate even with many snapshots.
    Aic,
    /// Minimum description length: consistent, but misses weak sources with few snapshots.
    Mdl,
}

/// Returns the number of sources, 0 to N - 1.
///
/// Minimises `-L (N - k) ln(geometric / arithmetic mean of the N - k smallest eigenvalues)` plus `k
/// (2 N - k)` (AIC) or `k (2 N - k) ln(L) / 2` (MDL).
///
/// # Errors
/// An error if the covariance is empty, zero or not finite; [`Error::TooFewSnapshots`] unless there
/// are more snapshots than antennas. Otherwise the smallest eigenvalues are zero, and noise is
/// counted as sources.
pub fn source_count<const N: usize>(
    criterion: Criterion,
    covariance: &Covariance<N>,
) -> Result<usize, Error> {
    let covariance = covariance.validated()?;
    if covariance.snapshots() <= N {
        let (snapshots, needed) = (covariance.snapshots(), N + 1);
        return Err(Error::TooFewSnapshots { snapshots, needed });
    }
    let snapshots = covariance.snapshots() as f64;
    let values = hermitian_eigen(covariance.matrix(), N).values;
    // The floor avoids the logarithm of zero eigenvalues (signals without noise).
    let floor = values[0] * f64::EPSILON;
    let penalty = match criterion {
        Criterion::Aic => 1.0,
        Criterion::Mdl => 0.5 * snapshots.ln(),
    };
    let mut best = (f64::INFINITY, 0);
    for sources in 0..N {
        let noise = values[sources..].iter().map(|value| value.max(floor));
        let count = (N - sources) as f64;
        let mean = noise.clone().sum::<f64>() / count;
        let log_ratio = noise.map(|value| (value / mean).ln()).sum::<f64>();
        let parameters = (sources * (2 * N - sources)) as f64;
        let cost = -snapshots * log_ratio + penalty * parameters;
        if cost < best.0 {
            best = (cost, sources);
        }
    }
    Ok(best.1)
}
