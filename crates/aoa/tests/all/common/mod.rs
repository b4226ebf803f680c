//! Simulated snapshots and a brute-force reference.

use std::f64::consts::PI;

use aoa::{Array, Complex64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub const METHODS: [aoa::Method; 5] = [
    aoa::Method::MaximumLikelihood,
    aoa::Method::Music,
    aoa::Method::RootMusic,
    aoa::Method::EspritLs,
    aoa::Method::EspritTls,
];

pub struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Returns a circularly symmetric complex Gaussian number of unit variance.
    pub fn gaussian(&mut self) -> Complex64 {
        let [re, im]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut self.0));
        Complex64::new(re, im) * 0.5_f64.sqrt()
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    /// Returns snapshots of Gaussian sources at the given angles in unit noise.
    pub fn snapshots<const N: usize>(
        &mut self,
        array: &Array<N>,
        sources: &[(f64, f64)],
        count: usize,
    ) -> Vec<[Complex64; N]> {
        (0..count)
            .map(|_| {
                let mut snapshot = [(); N].map(|()| self.gaussian());
                for &(angle_rad, snr_db) in sources {
                    let signal = self.gaussian() * 10.0_f64.powf(snr_db / 20.0);
                    let response = array.response(array.phase_from_angle(angle_rad));
                    for (sample, element) in snapshot.iter_mut().zip(response) {
                        *sample += signal * element;
                    }
                }
                snapshot
            })
            .collect()
    }
}

/// Returns the exact covariance of uncorrelated sources in unit noise.
pub fn exact<const N: usize>(array: &Array<N>, sources: &[(f64, f64)]) -> [[Complex64; N]; N] {
    let mut matrix = [[Complex64::ZERO; N]; N];
    for i in 0..N {
        matrix[i][i] += 1.0;
        for j in 0..N {
            for &(angle_rad, snr_db) in sources {
                let a = array.response(array.phase_from_angle(angle_rad));
                matrix[i][j] += a[i] * a[j].conj() * 10.0_f64.powf(snr_db / 10.0);
            }
        }
    }
    matrix
}

/// Returns the maximum of `a^H M a` on a dense grid of electrical angles.
pub fn oracle<const N: usize>(array: &Array<N>, matrix: &[[Complex64; N]; N]) -> f64 {
    let mut best = (f64::NEG_INFINITY, 0.0);
    for g in 0..20_000 {
        let phase = -PI + 2.0 * PI * f64::from(g) / 20_000.0;
        let a = array.steering_vector(phase);
        let mut value = Complex64::ZERO;
        for i in 0..N {
            for j in 0..N {
                value += a[i].conj() * matrix[i][j] * a[j];
            }
        }
        if value.re > best.0 {
            best = (value.re, phase);
        }
    }
    best.1
}
