//! Covariance of a whole array for an estimate from its subarrays.

use num_complex::Complex64;

use super::noise_eigenvalues::shows;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::eigen::hermitian_eigen;
use crate::linalg::matrix::{Matrix, zeros};
use crate::method::alternating_projection::Fit;
use crate::result::goodness_of_fit::{Model, Tested, Tests};

/// SNR of a source without measurable power.
pub(super) const WORST_SNR: f64 = 1e-9;

/// Calibrated covariance of all antennas, whose number is erased.
pub(super) trait WholeArray {
    fn snapshots(&self) -> usize;

    /// Returns `tr(H R H R) / L`, where `h` is the row-major `H` of the average over the subarrays
    /// of `m` antennas.
    fn variance(&self, h: &[Complex64], m: usize) -> f64;

    /// Writes the SNR of every source and returns the largest correlation coefficient of two
    /// sources. Returns `None` and writes nothing if the steering vectors are linearly dependent.
    fn source_snrs(&self, phases: &[f64], noise_variance: f64, snrs: &mut [f64]) -> Option<f64>;

    /// Whether the weakest source exceeds the noise after forward–backward averaging.
    fn shows_after_averaging(&self, sources: usize) -> bool;

    /// Tests the goodness of fit of sources at electrical angles.
    fn tests(&self, phases: &[f64]) -> (Tests, Tested);
}

impl<const N: usize> WholeArray for Covariance<N> {
    fn snapshots(&self) -> usize {
        Self::snapshots(self)
    }

    fn variance(&self, h: &[Complex64], m: usize) -> f64 {
        let mut spread = zeros::<N>();
        let scale = 1.0 / (N - m + 1) as f64;
        for first in 0..=N - m {
            for (i, row) in h.chunks_exact(m).enumerate() {
                for (j, entry) in row.iter().enumerate() {
                    spread[first + i][first + j] += entry * scale;
                }
            }
        }
        let hr = product(&spread, &self.matrix(), [N; 3]);
        let mut trace = 0.0;
        for i in 0..N {
            for j in 0..N {
                trace += (hr[i][j] * hr[j][i]).re;
            }
        }
        trace / self.snapshots() as f64
    }

    fn source_snrs(&self, phases: &[f64], noise_variance: f64, snrs: &mut [f64]) -> Option<f64> {
        let powers = source_powers(phases, self, noise_variance)?;
        let mut squared = 0.0_f64;
        for i in 0..phases.len() {
            snrs[i] = (powers[i][i].re / noise_variance).max(WORST_SNR);
            for j in 0..i {
                let power = (powers[i][i].re * powers[j][j].re).max(f64::MIN_POSITIVE);
                squared = squared.max(powers[i][j].norm_sqr() / power);
            }
        }
        Some(squared.sqrt())
    }

    fn shows_after_averaging(&self, sources: usize) -> bool {
        let eigen = hermitian_eigen(self.forward_backward().matrix(), N);
        shows(&eigen, sources, self.snapshots())
    }

    fn tests(&self, phases: &[f64]) -> (Tests, Tested) {
        let sources = phases.len();
        let tests = Model::new::<N>([sources, sources], self.snapshots(), false).tests();
        let power = self.power() * self.weight() * N as f64;
        let tested = Fit::at(self.unscaled(), phases)
            .and_then(|fit| fit.residual())
            .map_or(Tested::NOTHING, |(left, noise)| {
                tests.of(&left, noise, power)
            });
        (tests, tested)
    }
}

/// Returns `S = A^+ (R - sigma^2 I) A^+H`; `None` if the steering vectors are linearly dependent.
fn source_powers<const N: usize>(
    phases: &[f64],
    covariance: &Covariance<N>,
    noise_variance: f64,
) -> Option<Matrix<N>> {
    let sources = phases.len();
    let steering = bound::steering_matrix::<N>(phases);
    let adjoint_steering = adjoint(&steering);
    let gram = product(&adjoint_steering, &steering, [sources, N, sources]);
    let pseudo_inverse = product(
        &inverse(gram, sources)?,
        &adjoint_steering,
        [sources, sources, N],
    );
    let mut signal = covariance.matrix();
    for (n, row) in signal.iter_mut().enumerate() {
        row[n] -= noise_variance;
    }
    let half = product(&pseudo_inverse, &signal, [sources, N, N]);
    Some(product(
        &half,
        &adjoint(&pseudo_inverse),
        [sources, N, sources],
    ))
}
