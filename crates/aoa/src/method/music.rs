//! MUSIC (Schmidt 1986): the directions whose steering vectors are nearest to the signal subspace.

use crate::array::linear::Array;
use crate::covariance::sample::Covariance;
use crate::linalg::eigen::{HermitianEigen, principal_eigenvector};
use crate::list::List;
use crate::spectrum::grid::Grid;
use crate::spectrum::polynomial::Spectrum;

/// The signal subspace's spectrum `a^H E_s E_s^H a`. It is N minus the null spectrum, so its largest
/// local maxima are MUSIC's peaks.
pub(crate) fn signal_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[..sources])
}

/// The null spectrum `a^H E_n E_n^H a`, from the noise subspace itself: near its zeros, N minus the
/// signal spectrum would lose digits.
pub(crate) fn null_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[sources..])
}

/// The signal spectrum of one source, from the principal eigenvector alone.
pub(crate) fn signal_spectrum_of_one<const N: usize>(covariance: &Covariance<N>) -> Spectrum<N> {
    Spectrum::of_subspace(&[principal_eigenvector(covariance.unscaled()).1])
}

/// The electrical angle of the highest point of the grid, refined if asked.
pub(crate) fn phase<const N: usize>(
    spectrum: &Spectrum<N>,
    array: &Array<N>,
    grid_rad: f64,
    refine: bool,
) -> f64 {
    let grid = Grid::new::<N>(array.phase_at_end_fire_rad(), grid_rad);
    let phase = grid.phase(grid.highest_point(spectrum));
    if refine {
        spectrum.refined_maximum(phase, grid.step)
    } else {
        phase
    }
}

/// The electrical angles of the `sources` highest peaks; fewer if the spectrum has fewer.
pub(crate) fn phases<const N: usize>(
    spectrum: &Spectrum<N>,
    sources: usize,
    array: &Array<N>,
    grid_rad: f64,
    refine: bool,
) -> List<f64, N> {
    let grid = Grid::new::<N>(array.phase_at_end_fire_rad(), grid_rad);
    let mut peaks = [(f64::NEG_INFINITY, 0.0); N];
    let mut before = spectrum.value(grid.phase(grid.points - 1));
    let mut here = f64::NEG_INFINITY;
    let mut consider = |point: usize, after: f64| {
        if here >= before && here > after && here > peaks[sources - 1].0 {
            peaks[sources - 1] = (here, grid.phase(point));
            peaks[..sources].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
        (before, here) = (here, after);
    };
    let mut blocks = grid.blocks();
    while let Some(first) = blocks.first {
        let values = blocks.next_values::<false, N>(spectrum);
        for (lane, value) in values.iter().enumerate().take(grid.points - first) {
            consider((first + lane).wrapping_sub(1), *value);
        }
    }
    consider(grid.points - 1, spectrum.value(grid.phase(0)));
    let found = peaks[..sources].iter().filter(|peak| peak.0.is_finite());
    let settle = |phase| {
        if refine {
            spectrum.refined_maximum(phase, grid.step)
        } else {
            phase
        }
    };
    List::collect(0.0, found.map(|peak| settle(peak.1)))
}
