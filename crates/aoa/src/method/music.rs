//! MUSIC (Schmidt 1986): directions whose steering vectors are nearest to the signal subspace.

use crate::linalg::eigen::HermitianEigen;
use crate::linalg::hermitians::Vectors;
use crate::list::List;
use crate::spectrum::polynomial::Spectrum;
use crate::spectrum::side_by_side::{Places, Spectra};

/// Returns the signal spectrum `a^H E_s E_s^H a`. It equals N minus the null spectrum, so that its
/// largest local maxima are MUSIC's peaks.
pub(crate) fn signal_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[..sources])
}

/// Returns the null spectrum `a^H E_n E_n^H a` from the noise subspace. Near its zeros, N minus the
/// signal spectrum would lose digits.
pub(crate) fn null_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[sources..])
}

/// Estimates one source in each of many items: the highest peak.
#[inline(always)]
pub(crate) fn places<const FUSED: bool, const N: usize, const W: usize>(
    principal: &Vectors<N, W>,
) -> Places<W> {
    Spectra::of_vectors::<FUSED>(principal).maxima::<FUSED>()
}

/// Returns the electrical angles of the `sources` highest peaks; fewer if the spectrum has fewer
/// peaks.
pub(crate) fn phases<const N: usize>(spectrum: &Spectrum<N>, sources: usize) -> List<f64, N> {
    let mut peaks = spectrum.peaks();
    peaks.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
    List::collect(0.0, peaks.iter().take(sources).map(|peak| peak.0))
}
