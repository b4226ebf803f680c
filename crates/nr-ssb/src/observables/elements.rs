//! Known resource elements of one SSB: their matched sums, and the Fisher information of delay,
//! phase and frequency.
//!
//! Model of antenna `a`, symbol `l` and subcarrier `k' = k − 120`, with the transmitted elements
//! removed: `y = h_a exp(j(φ − 2πk'τ/256 + 2πν(m_l − m_c))) + noise`, with the delay τ in samples,
//! the frequency offset ν in cycles per sample and the centre `m_l` of the symbol's FFT window. The
//! gains `h_a` are unknown. The information about (τ, φ, ν) is
//! `2 Σ_a |h_a|²/σ_a² Σ g gᵀ`, `g = (−2πk'/256, 1, 2π(m_l − m_c))`
//! (Kay, Fundamentals of Statistical Signal Processing I, 1993, section 15.7).

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use crate::dsp::base_rate::{SYMBOL_FFT, SYMBOL_SAMPLES};
use crate::dsp::demodulate::BACK_OFF;
use crate::dsp::received_grid::{PerAntenna, ReceivedGrid};
use crate::dsp::timing;
use crate::numeric::phasors::wrap;
use crate::standard::grid::{SYMBOLS, SsbGrid, pss_indices};

/// Iterations of Newton's method for the frequency offset.
const ITERATIONS: usize = 3;

/// Amplitudes of one SSB by a matched filter over all known resource elements, with their
/// uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Elements {
    /// Amplitude of a resource element at every antenna, at the centre of the known elements.
    pub(crate) amplitudes: PerAntenna<Complex64>,
    /// Noise variance of every amplitude.
    pub(crate) variance: PerAntenna<f64>,
    /// Frequency offset in excess of the demodulator's, in cycles per sample.
    pub(crate) excess_cycles: f64,
    /// Time of the known elements' centre after the PSS, in samples.
    pub(crate) centre: f64,
    /// Sum over the antennas of the signal-to-noise ratio of a resource element.
    pub(crate) snr: f64,
    /// Covariance of delay (samples), phase (rad) and frequency (cycles per sample) due to noise.
    pub(crate) covariance: [[f64; 3]; 3],
}

/// Returns the centre of the FFT window of a symbol, in samples after the start of the PSS.
fn window_centre(symbol: usize) -> f64 {
    (symbol * SYMBOL_SAMPLES) as f64 + 0.5 * (SYMBOL_FFT - 1) as f64 - BACK_OFF as f64
}

impl Elements {
    /// Combines the despread blocks of an SSB, whose phase advances by `phase_step` per symbol due
    /// to the carrier resets.
    pub(crate) fn new(
        blocks: &[PerAntenna<Complex64>; SYMBOLS],
        noise_variance: &[f64],
        reference: &SsbGrid,
        phase_step: f64,
    ) -> Self {
        let sums = Sums::new(reference);
        let centre = sums.time / sums.count;
        let mut sum: PerAntenna<_> = noise_variance.iter().map(|_| Complex64::ZERO).collect();
        let mut excess = 0.0;
        for _ in 0..=ITERATIONS {
            let (mut slope, mut curvature) = (0.0, 0.0);
            for (antenna, sum) in sum.iter_mut().enumerate() {
                let mut moments = [Complex64::ZERO; 3];
                for (l, block) in blocks.iter().enumerate() {
                    let time = window_centre(l) - centre;
                    let turn = Complex64::cis(-phase_step * l as f64 - TAU * excess * time);
                    let value = block[antenna] * turn * sums.of_symbol[l].sqrt();
                    moments[0] += value;
                    moments[1] += value * time;
                    moments[2] += value * (time * time);
                }
                let weight = 1.0 / noise_variance[antenna].max(f64::MIN_POSITIVE);
                slope += weight * 2.0 * TAU * (moments[0].conj() * moments[1]).im;
                curvature += weight
                    * 2.0
                    * TAU
                    * TAU
                    * (moments[1].norm_sqr() - (moments[0].conj() * moments[2]).re);
                *sum = moments[0];
            }
            if curvature < 0.0 {
                excess -= slope / curvature;
            }
        }
        let amplitudes: PerAntenna<_> = sum.iter().map(|sum| sum / sums.count).collect();
        let variance: PerAntenna<_> = noise_variance.iter().map(|it| it / sums.count).collect();
        let signal = amplitudes.iter().zip(&variance);
        let energy: f64 = signal
            .map(|(h, noise)| h.norm_sqr() / noise.max(f64::MIN_POSITIVE) - 1.0)
            .sum();
        let snr = energy.max(1.0) / sums.count;
        Self {
            amplitudes,
            variance,
            excess_cycles: excess,
            centre,
            snr,
            covariance: sums.covariance(snr),
        }
    }
}

/// Returns the frequency offset in excess of the demodulator's in cycles per sample, and its variance
/// due to noise, from PSS and SSS alone. They have the same subcarriers, so that a channel that varies
/// over the subcarriers changes their phases equally. `delay` is the residual delay in samples, `snr`
/// the sum over the antennas of the signal-to-noise ratio of a resource element.
pub(crate) fn offset_by_sync(
    grids: &[ReceivedGrid],
    reference: &SsbGrid,
    noise_variance: &[f64],
    delay: f64,
    phase_step: f64,
    snr: f64,
) -> (f64, f64) {
    let ramp = timing::ramp(delay);
    let sync = pss_indices();
    let despread = |grid: &ReceivedGrid, symbol: usize| -> Complex64 {
        let row = reference.symbols().nth(symbol);
        let known = row.and_then(|row| row.get(sync.clone()));
        let received = grid[symbol].iter().zip(&ramp).skip(sync.start);
        let sum: Complex32 = (known.into_iter().flatten().zip(received))
            .map(|(s, (y, turn))| y * s.conj() * turn)
            .sum();
        Complex64::new(f64::from(sum.re), f64::from(sum.im))
    };
    let turn: Complex64 = (grids.iter().zip(noise_variance))
        .map(|(grid, noise)| {
            let product = despread(grid, 0).conj() * despread(grid, 2);
            product / noise.max(f64::MIN_POSITIVE)
        })
        .sum();
    let time = TAU * (2 * SYMBOL_SAMPLES) as f64;
    let excess = wrap(turn.arg() - 2.0 * phase_step) / time;
    (excess, 1.0 / (sync.len() as f64 * snr * time * time))
}

/// Sums over the known elements.
struct Sums {
    of_symbol: [f64; SYMBOLS],
    count: f64,
    time: f64,
    subcarrier: f64,
    subcarrier_squared: f64,
    time_squared: f64,
    product: f64,
}

impl Sums {
    fn new(reference: &SsbGrid) -> Self {
        let mut sums = Self {
            of_symbol: [0.0; SYMBOLS],
            count: 0.0,
            time: 0.0,
            subcarrier: 0.0,
            subcarrier_squared: 0.0,
            time_squared: 0.0,
            product: 0.0,
        };
        for (l, (known, of_symbol)) in reference.symbols().zip(&mut sums.of_symbol).enumerate() {
            let time = window_centre(l);
            let (mut count, mut first, mut second) = (0.0, 0.0, 0.0);
            for (k, element) in known.iter().enumerate() {
                if element.norm_sqr() > 0.5 {
                    let k = k as f64 - 120.0;
                    count += 1.0;
                    first += k;
                    second += k * k;
                }
            }
            *of_symbol = count;
            sums.count += count;
            sums.subcarrier += first;
            sums.subcarrier_squared += second;
            sums.time += count * time;
            sums.time_squared += count * time * time;
            sums.product += first * time;
        }
        sums.count = sums.count.max(1.0);
        sums
    }

    /// Returns the inverse of the Fisher information.
    fn covariance(&self, snr: f64) -> [[f64; 3]; 3] {
        let centre = self.time / self.count;
        let per_sample = -TAU / SYMBOL_FFT as f64;
        let delay_phase = per_sample * self.subcarrier;
        let delay_frequency = per_sample * TAU * (self.product - centre * self.subcarrier);
        let delay = per_sample * per_sample * self.subcarrier_squared;
        let frequency = TAU * TAU * (self.time_squared - centre * self.time);
        let scale = 2.0 * snr;
        inverse([
            [scale * delay, scale * delay_phase, scale * delay_frequency],
            [scale * delay_phase, scale * self.count, 0.0],
            [scale * delay_frequency, 0.0, scale * frequency],
        ])
    }
}

/// Returns the inverse of a symmetric positive definite matrix, scaled to a unit diagonal first.
fn inverse(matrix: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let scale: [f64; 3] = std::array::from_fn(|i| 1.0 / matrix[i][i].max(f64::MIN_POSITIVE).sqrt());
    let m = |i: usize, j: usize| matrix[i % 3][j % 3] * scale[i % 3] * scale[j % 3];
    let cofactor =
        |i: usize, j: usize| m(i + 1, j + 1) * m(i + 2, j + 2) - m(i + 1, j + 2) * m(i + 2, j + 1);
    let determinant: f64 = (0..3).map(|j| m(0, j) * cofactor(0, j)).sum();
    let determinant = determinant.max(f64::MIN_POSITIVE);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| cofactor(j, i) / determinant * scale[i] * scale[j])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_times_its_matrix_is_the_identity() {
        let matrix = [[4.0, 1.0, -2e3], [1.0, 3.0, 0.0], [-2e3, 0.0, 9e6]];
        let inverse = inverse(matrix);
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|m| matrix[i][m] * inverse[m][j]).sum();
                let expected = f64::from(u8::from(i == j));
                assert!((product - expected).abs() < 1e-9, "{i} {j}: {product}");
            }
        }
    }
}
