//! Channel of each antenna over the 240 subcarriers from the known resource elements.
//!
//! The channel is a sum of few paths: `h(k) = Σ_τ g(τ) exp(−j2πk'τ/256)`, `k' = k − 120`, with taps
//! at whole samples from −4 to +11 around the strongest path. Their powers are learned from the
//! data (all antennas share them) and the taps are the linear minimum-mean-square-error estimate
//! given those powers, so that a line-of-sight channel is averaged over the whole band and a
//! dispersive one is still followed. (Empirical Bayes; MacKay, "Bayesian interpolation", Neural
//! Computation 1992.)

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use super::base_rate::SYMBOL_FFT;
use super::cfo::SymbolPairs;
use super::channel_covariance::{ChannelCovariance, FIRST_TAP, TAPS};
use super::received_grid::ReceivedGrid;
use crate::numeric::hermitian;
use crate::numeric::sums::{complex_product, energy};
use crate::standard::grid::{SUBCARRIERS, SYMBOLS, SsbGrid};

/// Times the tap powers are learned anew.
const ITERATIONS: usize = 3;

/// Noise that is assumed at the least, over the strongest path: −60 dB.
const NOISE_FLOOR: f64 = 1e-6;

/// Channel estimator with its buffers; results are read from the fields.
pub(crate) struct ChannelEstimator {
    /// exp(j2πk'τ/256), `[tap][k]`.
    steering: Vec<[Complex32; SUBCARRIERS]>,
    /// Per antenna: received times conjugated known elements, summed over the symbols.
    pub(crate) rows: Vec<[Complex32; SUBCARRIERS]>,
    /// Known elements per subcarrier.
    counts: [f32; SUBCARRIERS],
    /// Per antenna: the estimate.
    pub(crate) channel: Vec<[Complex32; SUBCARRIERS]>,
    /// Per antenna: variance of the noise on a resource element.
    pub(crate) noise_variance: Vec<f64>,
    matched: Vec<[Complex64; TAPS]>,
    taps: Vec<[Complex64; TAPS]>,
    /// Noise over power of each tap, by which it was estimated last.
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

    /// Collects the known elements of `reference` (zero where unknown, unit power elsewhere) from
    /// the received grids into `rows`, symbol `l` turned by `phases[l]`.
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

    /// Noise of each antenna from the folded rows alone, into `noise_variance`: from the second
    /// difference over the subcarriers, which a smooth channel hardly has (a path 10 samples late
    /// adds −32 dB of its power).
    pub(crate) fn estimate_noise(&mut self) {
        let inverse = self
            .counts
            .map(|count| if count > 0.0 { 1.0 / count } else { 0.0 });
        // Where one of three neighbours is unknown, the difference is left out.
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

    /// Fits the channel to the rows folded from these grids; results in `channel` and
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
        // Without noise the taps, closer than the band can tell apart, would be undetermined.
        let least = NOISE_FLOOR * received.iter().copied().fold(0.0, f64::max);
        let mean_noise = self.noise_variance.iter().sum::<f64>() / antennas;
        let mean_noise = mean_noise.max(least).max(1e-30);
        // A tap that explains less than this is noise.
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

    /// Factor of the system that the taps solve.
    fn factor(&self, gram: &Matrix) -> Option<Matrix> {
        let mut system = *gram;
        for (tap, damping) in self.damping.iter().enumerate() {
            system[tap][tap] += damping;
        }
        hermitian::cholesky(&system)
    }

    /// How the noise of the last estimate hangs together; nothing where there was none.
    pub(crate) fn covariance(&self) -> ChannelCovariance {
        let mut taps = [[Complex64::ZERO; TAPS]; TAPS];
        let gram = self.gram();
        if let Some(factor) = self.factor(&gram) {
            // W G W, W being Hermitian as G is: what W makes of the rows of G, and of the columns of that.
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

    /// Correlations between the symbols, from which the step of phase per symbol is read: known
    /// elements weighted with the conjugated channel and summed over antennas and those subcarriers
    /// that both symbols know. (On other subcarriers the channel has another
    /// phase, which an imperfect estimate would turn into a step.)
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
                // Per element, so that each pair counts by the information it holds.
                let product = sums[0].conj() * sums[1] / count.max(1.0);
                result[l][m] = Complex64::new(f64::from(product.re), f64::from(product.im));
            }
        }
        result
    }

    /// Taps to subcarriers; taps that were found empty cost nothing.
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

    /// Gram matrix of the taps on the known elements: Toeplitz, `Σ_k n(k) exp(j2πk'(τ−τ')/256)`.
    fn gram(&self) -> Matrix {
        let lags: [Complex64; TAPS] = std::array::from_fn(|lag| {
            // The steering vector of delay `lag` is in the table from tap −FIRST_TAP on.
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

/// Received energy on the known elements.
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

/// Σ|z − Σ_τ g e|² over the known elements.
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
