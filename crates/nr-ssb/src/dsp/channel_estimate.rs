//! Channel estimate of each antenna over the 240 subcarriers, from the known resource elements.
//!
//! The channel model is a sum of taps, `h(k) = Σ_τ g(τ) exp(−j2πk'τ/256)`, `k' = k − 120`, at
//! integer delays from −4 to +11 samples relative to the strongest path. The tap powers are
//! estimated from the data (common to all antennas), and the taps are the linear
//! minimum-mean-square-error estimate for these powers. A line-of-sight channel is therefore
//! averaged over the whole band, and a dispersive channel is still resolved. (Empirical Bayes;
//! MacKay, "Bayesian interpolation", Neural Computation 1992.)

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use super::base_rate::SYMBOL_FFT;
use super::cfo::SymbolPairs;
use super::channel_covariance::{ChannelCovariance, FIRST_TAP, TAPS};
use super::received_grid::ReceivedGrid;
use crate::numeric::hermitian;
use crate::numeric::sums::{complex_product, energy};
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};

/// Iterations of the tap power estimate.
const ITERATIONS: usize = 3;

/// Minimum noise relative to the strongest path: −60 dB.
const NOISE_FLOOR: f64 = 1e-6;

/// Channel estimator with its buffers. The fields contain the results.
pub(crate) struct ChannelEstimator {
    /// exp(j2πk'τ/256), `[tap][k]`.
    steering: Vec<[Complex32; SUBCARRIERS]>,
    /// Received elements times conjugated known elements, summed over the symbols, for each
    /// antenna.
    pub(crate) rows: Vec<[Complex32; SUBCARRIERS]>,
    /// Number of known elements per subcarrier.
    counts: [f32; SUBCARRIERS],
    /// Channel estimate of each antenna.
    pub(crate) channel: Vec<[Complex32; SUBCARRIERS]>,
    /// Noise variance of a resource element, for each antenna.
    pub(crate) noise_variance: Vec<f64>,
    matched: Vec<[Complex64; TAPS]>,
    taps: Vec<[Complex64; TAPS]>,
    /// Ratio of noise to power of each tap in the last estimate.
    damping: [f64; TAPS],
}

impl ChannelEstimator {
    pub(crate) fn new(antennas: usize) -> Self {
        let steering = (0..TAPS)
            .map(|tap| {
                let cycles = f64::from(tap as i32 + FIRST_TAP) / SYMBOL_FFT as f64;
                std::array::from_fn(|k| {
                    let phasor = Complex64::cis(TAU * cycles * (k as f64 - 120.0));
                    Complex32::new(phasor.re as f32, phasor.im as f32)
                })
            })
            .collect();
        Self {
            steering,
            rows: vec![[Complex32::ZERO; SUBCARRIERS]; antennas],
            counts: [0.0; SUBCARRIERS],
            channel: vec![[Complex32::ZERO; SUBCARRIERS]; antennas],
            noise_variance: vec![0.0; antennas],
            matched: vec![[Complex64::ZERO; TAPS]; antennas],
            taps: vec![[Complex64::ZERO; TAPS]; antennas],
            damping: [0.0; TAPS],
        }
    }

    /// Accumulates the known elements of `reference` (zero if unknown, otherwise with unit power)
    /// from the received grids into `rows`, with symbol `l` rotated by `phases[l]`.
    pub(crate) fn fold(
        &mut self,
        grids: &[ReceivedGrid],
        reference: &SsbGrid,
        phases: &[Complex32; SYMBOLS],
    ) {
        self.counts.fill(0.0);
        for row in &mut self.rows {
            row.fill(Complex32::ZERO);
        }
        for (l, (known, phase)) in reference.symbols().zip(phases).enumerate() {
            let mut weights = [Complex32::ZERO; SUBCARRIERS];
            for k in 0..SUBCARRIERS {
                weights[k] = known[k].conj() * phase;
                self.counts[k] += if known[k].norm_sqr() > 0.5 { 1.0 } else { 0.0 };
            }
            for (grid, row) in grids.iter().zip(&mut self.rows) {
                let received = &grid[l];
                for k in 0..SUBCARRIERS {
                    let (y, w) = (received[k], weights[k]);
                    row[k].re += y.re * w.re - y.im * w.im;
                    row[k].im += y.re * w.im + y.im * w.re;
                }
            }
        }
    }

    /// Estimates the noise variance of each antenna from `rows`: from the second difference over
    /// the subcarriers, to which a smooth channel hardly contributes (a path with a delay of 10
    /// samples adds −32 dB of its power).
    pub(crate) fn estimate_noise(&mut self) {
        let inverse = self
            .counts
            .map(|count| if count > 0.0 { 1.0 / count } else { 0.0 });
        // The difference is omitted if one of the three neighbours is unknown.
        let mut used = [0.0_f32; SUBCARRIERS];
        let mut weight = 0.0_f64;
        for k in 1..SUBCARRIERS - 1 {
            if self.counts[k - 1] * self.counts[k] * self.counts[k + 1] > 0.0 {
                used[k] = 1.0;
                weight += f64::from(inverse[k - 1] + 4.0 * inverse[k] + inverse[k + 1]);
            }
        }
        for (row, noise) in self.rows.iter().zip(&mut self.noise_variance) {
            let mut means = [Complex32::ZERO; SUBCARRIERS];
            for k in 0..SUBCARRIERS {
                means[k] = row[k] * inverse[k];
            }
            let mut differences = [Complex32::ZERO; SUBCARRIERS];
            for k in 1..SUBCARRIERS - 1 {
                differences[k] = (means[k - 1] + means[k + 1] - means[k] * 2.0) * used[k];
            }
            *noise = if weight > 0.0 {
                f64::from(energy(&differences)) / weight
            } else {
                0.0
            };
        }
    }

    /// Fits the channel to the folded rows of these grids; results in `channel` and
    /// `noise_variance`.
    pub(crate) fn fit(&mut self, grids: &[ReceivedGrid], reference: &SsbGrid) {
        let known: f64 = self.counts.iter().map(|count| f64::from(*count)).sum();
        if known < 2.0 {
            return;
        }
        let antennas = self.rows.len() as f64;
        self.estimate_noise();
        for (row, matched) in self.rows.iter().zip(&mut self.matched) {
            for (slot, steering) in matched.iter_mut().zip(&self.steering) {
                let sum = complex_product(row, steering);
                *slot = Complex64::new(f64::from(sum.re), f64::from(sum.im));
            }
        }
        let gram = self.gram();
        let received: [f64; TAPS] = std::array::from_fn(|tap| {
            let power = self.matched.iter().map(|m| m[tap].norm_sqr()).sum::<f64>() / antennas;
            power / (known * known)
        });
        // Without noise, the taps would be undetermined, because their spacing is below the
        // resolution of the band.
        let least = NOISE_FLOOR * received.iter().copied().fold(0.0, f64::max);
        let mean_noise = self.noise_variance.iter().sum::<f64>() / antennas;
        let mean_noise = mean_noise.max(least).max(1e-30);
        // A tap with less power is noise.
        let floor = 1e-3 * mean_noise / known;
        let mut powers = received.map(|power| (power - mean_noise / known).max(floor));
        for _ in 0..ITERATIONS {
            self.damping = powers.map(|power| mean_noise / power);
            let Some(factor) = self.factor(&gram) else {
                return;
            };
            for (taps, matched) in self.taps.iter_mut().zip(&self.matched) {
                *taps = hermitian::solve(&factor, matched);
            }
            for (tap, power) in powers.iter_mut().enumerate() {
                let mean = self.taps.iter().map(|g| g[tap].norm_sqr()).sum::<f64>() / antennas;
                *power = mean.max(floor);
            }
        }
        let freedom: f64 = powers.iter().map(|p| p / (p + mean_noise / known)).sum();
        for antenna in 0..self.rows.len() {
            let residual = residual_energy(
                known_energy(&grids[antenna], reference),
                &gram,
                &self.taps[antenna],
                &self.matched[antenna],
            );
            self.noise_variance[antenna] = residual / (known - freedom).max(1.0);
            self.expand(antenna);
        }
    }

    /// Returns the Cholesky factor of the taps' linear system.
    fn factor(&self, gram: &Matrix) -> Option<Matrix> {
        let mut system = *gram;
        for (tap, damping) in self.damping.iter().enumerate() {
            system[tap][tap] += damping;
        }
        hermitian::cholesky(&system)
    }

    /// Returns the covariance of the last estimate's noise; zero if there is none.
    pub(crate) fn covariance(&self) -> ChannelCovariance {
        let mut taps = [[Complex64::ZERO; TAPS]; TAPS];
        let gram = self.gram();
        if let Some(factor) = self.factor(&gram) {
            // W G W with Hermitian W and G: W times the rows of G, then times the columns of the
            // result.
            let half = gram.map(|row| hermitian::solve(&factor, &row.map(|it| it.conj())));
            for (i, row) in taps.iter_mut().enumerate() {
                *row = hermitian::solve(&factor, &half.map(|of| of[i].conj()));
            }
            for row in &mut taps {
                *row = row.map(|it| it.conj());
            }
        }
        ChannelCovariance::new(&taps)
    }

    /// Returns the correlations between symbols, from which the phase step per symbol is computed.
    /// Known elements are multiplied by the conjugated channel, and summed over the antennas and
    /// the subcarriers that are known in both symbols. (Other subcarriers have a different channel
    /// phase, which an inaccurate estimate would convert to a phase step.)
    pub(crate) fn symbol_pairs(&self, grids: &[ReceivedGrid], reference: &SsbGrid) -> SymbolPairs {
        let mut combined = [[Complex32::ZERO; SUBCARRIERS]; SYMBOLS];
        for ((grid, channel), noise) in grids.iter().zip(&self.channel).zip(&self.noise_variance) {
            let weight = (1.0 / noise.max(1e-30)) as f32;
            for ((received, known), sums) in grid.iter().zip(reference.symbols()).zip(&mut combined)
            {
                for (((sum, y), s), h) in sums.iter_mut().zip(received).zip(known).zip(channel) {
                    *sum += y * (s * h).conj() * weight;
                }
            }
        }
        let mut result = [[Complex64::ZERO; SYMBOLS]; SYMBOLS];
        for (l, (early, early_known)) in combined.iter().zip(reference.symbols()).enumerate() {
            let later = combined
                .iter()
                .zip(reference.symbols())
                .enumerate()
                .skip(l + 1);
            for (m, (late, late_known)) in later {
                let (mut sums, mut count) = ([Complex32::ZERO; 2], 0.0_f32);
                for k in 0..SUBCARRIERS {
                    let both = early_known[k].norm_sqr() * late_known[k].norm_sqr();
                    sums[0] += early[k] * both;
                    sums[1] += late[k] * both;
                    count += both;
                }
                // Normalised by the number of elements, so that each pair is weighted by its
                // information.
                let product = sums[0].conj() * sums[1] / count.max(1.0);
                result[l][m] = Complex64::new(f64::from(product.re), f64::from(product.im));
            }
        }
        result
    }

    /// Computes the channel on the subcarriers from the taps; taps without power are skipped.
    fn expand(&mut self, antenna: usize) {
        let channel = &mut self.channel[antenna];
        channel.fill(Complex32::ZERO);
        let strongest = self.taps[antenna]
            .iter()
            .map(Complex64::norm_sqr)
            .fold(0.0, f64::max);
        for (tap, steering) in self.taps[antenna].iter().zip(&self.steering) {
            if tap.norm_sqr() < 1e-9 * strongest {
                continue;
            }
            let tap = Complex32::new(tap.re as f32, tap.im as f32);
            for (slot, phasor) in channel.iter_mut().zip(steering) {
                *slot += tap * phasor.conj();
            }
        }
    }

    /// Returns the Gram matrix of the taps on the known elements: Toeplitz,
    /// `Σ_k n(k) exp(j2πk'(τ−τ')/256)`.
    fn gram(&self) -> Matrix {
        let lags: [Complex64; TAPS] = std::array::from_fn(|lag| {
            // The table contains the steering vector of delay `lag` at tap −FIRST_TAP + lag.
            let cycles = lag as f64 / SYMBOL_FFT as f64;
            let step = Complex64::cis(TAU * cycles);
            let mut phasor = Complex64::cis(-TAU * cycles * 120.0);
            let mut sum = Complex64::ZERO;
            for count in &self.counts {
                sum += phasor * f64::from(*count);
                phasor *= step;
            }
            sum
        });
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if i >= j {
                    lags[i - j]
                } else {
                    lags[j - i].conj()
                }
            })
        })
    }
}

type Matrix = hermitian::Matrix<TAPS>;

/// Returns the received energy of the known elements.
fn known_energy(grid: &ReceivedGrid, reference: &SsbGrid) -> f64 {
    let symbols = grid.iter().zip(reference.symbols());
    symbols
        .map(|(received, known)| {
            let pairs = received.iter().zip(known);
            let energy: f32 = pairs.map(|(y, s)| y.norm_sqr() * s.norm_sqr()).sum();
            f64::from(energy)
        })
        .sum()
}

/// Returns Σ|z − Σ_τ g e|² over the known elements.
fn residual_energy(
    energy: f64,
    gram: &Matrix,
    taps: &[Complex64; TAPS],
    matched: &[Complex64; TAPS],
) -> f64 {
    let mut result = energy;
    for ((row, g), b) in gram.iter().zip(taps).zip(matched) {
        let fitted: Complex64 = row.iter().zip(taps).map(|(x, g)| x * g).sum();
        result += (g.conj() * (fitted - 2.0 * b)).re;
    }
    result.max(1e-12 * energy)
}
