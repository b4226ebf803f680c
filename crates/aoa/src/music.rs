//! MUSIC (Schmidt 1986): the directions whose steering vectors are nearest to the signal subspace.
//!
//! The grid is uniform in the electrical angle, where the array resolves equally well everywhere, and
//! has the asked-for step at broadside.

use std::f64::consts::{PI, TAU};

use crate::eigen::{HermitianEigen, principal_eigenvector};
use crate::list::List;
use crate::spectrum::Spectrum;
use crate::{Array, Complex64, Covariance};

/// Grid points that are computed side by side.
const LANES: usize = 8;

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

/// N minus the signal spectrum.
pub(crate) fn null_spectrum_of_one<const N: usize>(signal: &Spectrum<N>) -> Spectrum<N> {
    let mut null = signal.negated();
    null.lags[0] += N as f64;
    null
}

/// The electrical angle of the highest point of the grid, refined if asked.
pub(crate) fn phase<const N: usize>(
    spectrum: &Spectrum<N>,
    array: &Array<N>,
    grid_rad: f64,
    refine: bool,
) -> f64 {
    let grid = Grid::new(array, grid_rad);
    let mut highest = [(f64::NEG_INFINITY, 0_usize); LANES];
    grid.for_each_block(spectrum, |first, values| {
        for (best, value) in highest.iter_mut().zip(values) {
            if *value > best.0 {
                *best = (*value, first);
            }
        }
    });
    let (mut value, mut point) = (f64::NEG_INFINITY, 0);
    for (lane, (lane_value, first)) in highest.into_iter().enumerate() {
        if lane_value > value {
            (value, point) = (lane_value, first + lane);
        }
    }
    let phase = grid.phase(point);
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
    let grid = Grid::new(array, grid_rad);
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
    grid.for_each_block(spectrum, |first, values| {
        for (lane, value) in values.iter().enumerate().take(grid.points - first) {
            consider((first + lane).wrapping_sub(1), *value);
        }
    });
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

/// A uniform grid of electrical angles on the whole circle.
struct Grid {
    points: usize,
    step: f64,
}

impl Grid {
    fn new<const N: usize>(array: &Array<N>, grid_rad: f64) -> Self {
        // At broadside, a step of the angle is end_fire times that of the electrical angle. The
        // array's own resolution sets the coarsest useful grid.
        let points = (TAU / (array.phase_at_end_fire_rad() * grid_rad)).ceil();
        let points = points.max(8.0 * N as f64);
        Self {
            points: points as usize,
            step: TAU / points,
        }
    }

    fn phase(&self, point: usize) -> f64 {
        self.step * point as f64 - PI
    }

    /// Calls `visit` with the index of the first point and the values of each block of points.
    fn for_each_block<const N: usize>(
        &self,
        spectrum: &Spectrum<N>,
        mut visit: impl FnMut(usize, &[f64; LANES]),
    ) {
        // z = exp(-j omega), turned from block to block.
        let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            Complex64 {
                re: re[lane],
                im: im[lane],
            } = Complex64::cis(-self.phase(lane));
        }
        let turn = Complex64::cis(-self.step * LANES as f64);
        let mut first = 0;
        while first < self.points {
            let mut values = [0.0; LANES];
            for lane in 0..LANES {
                // Horner's scheme for sum_k c_k z^k.
                let (mut sum_re, mut sum_im) = (0.0, 0.0);
                for lag in spectrum.lags[1..].iter().rev() {
                    (sum_re, sum_im) = (
                        (sum_re + lag.re) * re[lane] - (sum_im + lag.im) * im[lane],
                        (sum_re + lag.re) * im[lane] + (sum_im + lag.im) * re[lane],
                    );
                }
                values[lane] = 2.0 * sum_re + spectrum.lags[0].re;
                (re[lane], im[lane]) = (
                    re[lane] * turn.re - im[lane] * turn.im,
                    re[lane] * turn.im + im[lane] * turn.re,
                );
            }
            visit(first, &values);
            first += LANES;
        }
    }
}
