//! MUSIC (Schmidt 1986): the directions whose steering vectors are nearest to the signal subspace.

use std::f64::consts::{PI, TAU};

use crate::Array;
use crate::eigen::HermitianEigen;
use crate::list::List;
use crate::spectrum::Spectrum;

/// The signal subspace's spectrum `a^H E_s E_s^H a`. It is N minus the null spectrum, so its largest
/// local maxima are MUSIC's peaks.
pub(crate) fn signal_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[..sources])
}

/// The null spectrum `a^H E_n E_n^H a`, from the noise subspace itself: near its zeros, N minus the
/// signal spectrum would lose all digits.
pub(crate) fn null_spectrum<const N: usize>(
    eigen: &HermitianEigen<N>,
    sources: usize,
) -> Spectrum<N> {
    Spectrum::of_subspace(&eigen.vectors[sources..])
}

/// The electrical angles of the `sources` highest peaks; fewer if the spectrum has fewer.
///
/// The grid is uniform in the electrical angle, where MUSIC resolves equally well everywhere, and
/// `grid_deg` apart at broadside.
pub(crate) fn phases<const N: usize>(
    spectrum: &Spectrum<N>,
    sources: usize,
    array: &Array<N>,
    grid_deg: f64,
    refine: bool,
) -> List<f64, N> {
    let points = (TAU / (array.phase_at_end_fire_rad() * grid_deg.to_radians()))
        .ceil()
        .max(4.0);
    let step = TAU / points;
    let points = points as usize;
    let value = |g: usize| spectrum.value(step * g as f64 - PI);
    let mut peaks = [(f64::NEG_INFINITY, 0.0); N];
    let (mut before, mut here) = (value(points - 1), value(0));
    for g in 0..points {
        let after = value((g + 1) % points);
        if here >= before && here > after && here > peaks[sources - 1].0 {
            peaks[sources - 1] = (here, step * g as f64 - PI);
            peaks[..sources].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
        (before, here) = (here, after);
    }
    let found = peaks[..sources].iter().filter(|peak| peak.0.is_finite());
    List::collect(
        0.0,
        found.map(|peak| {
            if refine {
                spectrum.refined_maximum(peak.1, step)
            } else {
                peak.1
            }
        }),
    )
}
