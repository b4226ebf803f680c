//! Choice of the estimation method.

/// Estimation method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Maximum likelihood. One source: maximum of `a^H R a`, the optimal and fastest method.
    /// Several sources, including coherent ones: minimum of `tr(P R)`, where `P` projects onto the
    /// complement of the steering vectors; the most accurate and slowest method.
    MaximumLikelihood,
    /// Peaks of the MUSIC spectrum, refined to machine precision, without a grid setting.
    Music,
    /// Roots of the MUSIC polynomial.
    RootMusic,
    /// ESPRIT with least squares.
    EspritLs,
    /// ESPRIT with total least squares.
    EspritTls,
}

impl Method {
    /// Returns the maximum number of sources that the method resolves with `N` antennas.
    pub const fn maximum_sources<const N: usize>(self) -> usize {
        N - 1
    }
}
