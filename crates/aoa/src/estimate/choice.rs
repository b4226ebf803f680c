//! Which method is to be used.

/// How to find the directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The maximum of `a^H R a`: optimal for one source, and the cheapest. Of several sources, coherent
    /// ones too, the minimum of `tr(P R)`, `P` projecting on what none of them sends: of all methods the
    /// most exact, and the slowest.
    MaximumLikelihood,
    /// The peaks of the MUSIC spectrum, each found to rounding: there is no grid to choose.
    Music,
    /// The roots of the MUSIC polynomial.
    RootMusic,
    /// ESPRIT, least squares.
    EspritLs,
    /// ESPRIT, total least squares.
    EspritTls,
}

impl Method {
    /// How many sources the method can tell apart with `N` antennas.
    pub const fn maximum_sources<const N: usize>(self) -> usize {
        N - 1
    }
}
