//! PSS matched filter: overlap-save correlation of all antennas with the three PSS at several
//! carrier frequency offsets, normalised by the energy under the window.
//!
//! For antenna `a` and start sample `n` the statistic is
//! `T_a = 240 |Σ p*(i) x_a(n+i)|² / Σ |x_a(n+i)|²` with `‖p‖ = 1`. In noise over the SSB's 240
//! subcarriers it is exponentially distributed with mean one, whatever the noise power (exactly: a
//! beta distribution, with a thinner tail). At the PSS it is about 127 × SNR. The sum over `A`
//! antennas is non-coherent and follows a gamma distribution of shape `A` in noise. Antennas with
//! common interference are whitened first, block by block.
//!
//! The PSS occupies 127 of 256 bins, so that its correlation is computed at half the base rate. The
//! lags in between are the sums of their neighbours, `(c(n−1) + c(n+1))/√2`, with the same noise
//! variance. The loss at a peak is at most 0.9 dB, as with sampling at the base rate.
//!
//! A frequency offset shifts the spectrum, so that a hypothesis is a selection of bins, with a
//! resolution of a sixteenth of a subcarrier, before the inverse transform.

use std::sync::Arc;

use num_complex::Complex32;

use super::base_rate::SYMBOL_FFT;
use super::pss_symbol::pss_symbol;
use super::received_grid::MAX_ANTENNAS;
use super::whitening::whitening;
use crate::numeric::fft::{self, Fft};

/// Length of an overlap-save transform.
const BLOCK: usize = 4096;
/// Length of the inverse transform: the half of the spectrum that contains the PSS.
const HALF_BLOCK: usize = BLOCK / 2;
/// Bins on each side of a hypothesis.
const QUARTER: usize = HALF_BLOCK / 2;
/// Bins of a block's spectrum per subcarrier.
const BINS_PER_SUBCARRIER: usize = BLOCK / SYMBOL_FFT;
/// Number of correlation lags per block.
const HOP: usize = BLOCK - SYMBOL_FFT;
/// Minimum distance of two candidates of one PSS, in samples.
const CANDIDATE_SPACING: usize = 12;
/// Fraction of a block's energy that leaks into other windows due to the band limitation: 5e-8 of
/// the energy, times 240, with a margin that keeps the statistic of a silent window below that of
/// noise.
const RINGING: f64 = 1.2e-5;
/// Number of resource elements that share the energy of a window if the whole SSB band is occupied.
const OCCUPIED: f32 = 240.0;

/// Maximum of the matched filter above the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PssCandidate {
    /// N_ID^(2), 0..=2.
    pub n_id_2: u8,
    /// First sample of the PSS without its cyclic prefix.
    pub sample: usize,
    /// Carrier frequency offset of the hypothesis, in Hz.
    pub cfo_hz: f64,
    /// Σ_a T_a, defined in the module documentation.
    pub statistic: f32,
}

/// Correlator with its FFT plans, replicas and buffers.
pub struct MatchedFilter {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    bin_hz: f64,
    /// Hypotheses of the frequency offset, in bins relative to `centre`.
    hypotheses: Vec<isize>,
    /// Central frequency offset of the hypotheses, in bins.
    centre: isize,
    /// Conjugated spectrum of each PSS.
    replicas: [Vec<Complex32>; 3],
    block: Vec<Complex32>,
    /// Spectrum of the block per antenna, lowest frequency first.
    spectra: Vec<Vec<Complex32>>,
    /// 240 divided by the energy under the window, for each antenna and pair of lags.
    inverse_energy: Vec<Vec<f32>>,
    product: Vec<Complex32>,
    scratch: Vec<Complex32>,
    /// Statistics of one frequency hypothesis, by lag. All even lags precede the odd ones.
    sum: Vec<f32>,
    /// Maximum of the statistics over the hypotheses, in the same order.
    best: Vec<f32>,
    /// Index of the hypothesis with the maximum, in the same order.
    best_hypothesis: Vec<u32>,
}

impl MatchedFilter {
    /// Creates a correlator for `antennas` channels at 256 samples per symbol. Offsets are in Hz at
    /// subcarrier spacing `scs_hz`, at most 64 subcarriers, rounded to the nearest bin.
    pub fn new(scs_hz: f64, cfo_hypotheses_hz: &[f64], antennas: usize) -> Self {
        let forward = fft::forward(BLOCK);
        let inverse = fft::inverse(HALF_BLOCK);
        let replicas = [0, 1, 2].map(|n_id_2| {
            let mut replica = pss_symbol(n_id_2);
            replica.resize(BLOCK, Complex32::ZERO);
            forward.process(&mut replica);
            let (positive, negative) = (&replica[..QUARTER], &replica[BLOCK - QUARTER..]);
            let bins = positive.iter().chain(negative);
            // The forward transform has a gain of BLOCK, which is removed here.
            bins.map(|bin| bin.conj() / BLOCK as f32).collect()
        });
        let bin_hz = scs_hz / BINS_PER_SUBCARRIER as f64;
        let reach = QUARTER as isize;
        let nearest_bin = |hz: &f64| ((hz / bin_hz).round() as isize).clamp(-reach, reach);
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        Self {
            forward,
            inverse,
            bin_hz,
            hypotheses: cfo_hypotheses_hz.iter().map(nearest_bin).collect(),
            centre: 0,
            replicas,
            block: vec![Complex32::ZERO; BLOCK],
            spectra: vec![vec![Complex32::ZERO; BLOCK]; antennas],
            inverse_energy: vec![vec![0.0; HOP / 2]; antennas],
            product: vec![Complex32::ZERO; HALF_BLOCK],
            scratch: vec![Complex32::ZERO; scratch],
            sum: vec![0.0; HOP],
            best: vec![0.0; HOP],
            best_hypothesis: vec![0; HOP],
        }
    }

    /// Sets the central frequency offset of the hypotheses; all must remain within 64 subcarriers.
    pub fn centre(&mut self, cfo_hz: f64) {
        let widest = self.hypotheses.iter().map(|it| it.abs()).max().unwrap_or(0);
        let reach = QUARTER as isize - widest;
        self.centre = ((cfo_hz / self.bin_hz).round() as isize).clamp(-reach, reach);
    }

    /// Appends to `candidates` the maxima above `threshold` of PSS that start in `first..end`; the
    /// PSS must be within the samples.
    pub fn run<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        first: usize,
        end: usize,
        threshold: f32,
        candidates: &mut Vec<PssCandidate>,
    ) {
        let length = antennas
            .iter()
            .map(|samples| samples.as_ref().len())
            .min()
            .unwrap_or(0);
        let end = end.min((length + 1).saturating_sub(SYMBOL_FFT));
        let mut start = first;
        while start < end {
            let lags = HOP.min(end - start);
            let mut windows: [&[Complex32]; MAX_ANTENNAS] = [&[]; MAX_ANTENNAS];
            let count = antennas.len().min(self.spectra.len());
            for (window, samples) in windows.iter_mut().zip(antennas) {
                *window = &samples.as_ref()[start..length.min(start + BLOCK)];
            }
            let windows = &windows[..count.min(MAX_ANTENNAS)];
            let weights = whitening(windows);
            for antenna in 0..windows.len() {
                let weights = weights.as_ref().map(|rows| &rows[antenna][..=antenna]);
                self.load_block(antenna, windows, weights);
                self.load_antenna(antenna);
            }
            for n_id_2 in 0..3 {
                self.correlate(n_id_2);
                self.collect(n_id_2 as u8, start, lags, threshold, candidates);
            }
            start += lags;
        }
    }

    /// Loads the window of an antenna, or of its whitened channel.
    fn load_block(
        &mut self,
        antenna: usize,
        windows: &[&[Complex32]],
        weights: Option<&[Complex32]>,
    ) {
        let window = windows[antenna];
        self.block[window.len()..].fill(Complex32::ZERO);
        let block = &mut self.block[..window.len()];
        let Some(weights) = weights else {
            block.copy_from_slice(window);
            return;
        };
        block.fill(Complex32::ZERO);
        for (window, weight) in windows.iter().zip(weights) {
            for (sum, x) in block.iter_mut().zip(*window) {
                *sum += x * weight;
            }
        }
    }

    /// Computes the spectrum of the block and the energy under the window at each pair of lags.
    fn load_antenna(&mut self, antenna: usize) {
        let pair_energy =
            |pair: &[Complex32; 2]| f64::from(pair[0].norm_sqr() + pair[1].norm_sqr());
        let (pairs, _) = self.block.as_chunks::<2>();
        // A silent window next to a signal contains the ringing of the band limitation.
        let silence = RINGING * pairs.iter().map(pair_energy).sum::<f64>();
        let mut energy: f64 = pairs[..SYMBOL_FFT / 2].iter().map(pair_energy).sum();
        let moves = pairs.iter().zip(&pairs[SYMBOL_FFT / 2..]);
        for (slot, (old, new)) in self.inverse_energy[antenna].iter_mut().zip(moves) {
            let known = energy > silence.max(f64::from(f32::MIN_POSITIVE));
            *slot = if known { OCCUPIED / energy as f32 } else { 0.0 };
            energy += pair_energy(new) - pair_energy(old);
        }
        self.forward
            .process_with_scratch(&mut self.block, &mut self.scratch);
        let (negative, positive) = self.spectra[antenna].split_at_mut(BLOCK / 2);
        positive.copy_from_slice(&self.block[..BLOCK / 2]);
        negative.copy_from_slice(&self.block[BLOCK / 2..]);
    }

    /// Computes the maximum statistic over the frequency hypotheses in `best`.
    fn correlate(&mut self, n_id_2: usize) {
        let (above, below) = self.replicas[n_id_2].split_at(QUARTER);
        for (hypothesis, shift) in self.hypotheses.iter().enumerate() {
            let centre = (BLOCK / 2).saturating_add_signed(self.centre + shift);
            self.sum.fill(0.0);
            for (spectrum, inverse_energy) in self.spectra.iter().zip(&self.inverse_energy) {
                let (positive, negative) = self.product.split_at_mut(QUARTER);
                multiply(positive, &spectrum[centre..], above);
                multiply(negative, &spectrum[centre - QUARTER..], below);
                self.inverse
                    .process_with_scratch(&mut self.product, &mut self.scratch);
                let (even, odd) = self.sum.split_at_mut(HOP / 2);
                add_power(even, odd, &self.product, inverse_energy);
            }
            if hypothesis == 0 {
                self.best.copy_from_slice(&self.sum);
                self.best_hypothesis.fill(0);
                continue;
            }
            keep_best(
                &mut self.best,
                &mut self.best_hypothesis,
                &self.sum,
                hypothesis as u32,
            );
        }
    }

    fn collect(
        &self,
        n_id_2: u8,
        start: usize,
        lags: usize,
        threshold: f32,
        candidates: &mut Vec<PssCandidate>,
    ) {
        for lag in 0..lags {
            // Even lags precede odd ones.
            let slot = lag / 2 + (lag % 2) * (HOP / 2);
            let (statistic, hypothesis) = (self.best[slot], self.best_hypothesis[slot]);
            if statistic < threshold {
                continue;
            }
            let candidate = PssCandidate {
                n_id_2,
                sample: start + lag,
                cfo_hz: (self.centre + self.hypotheses[hypothesis as usize]) as f64 * self.bin_hz,
                statistic,
            };
            let near = candidates.iter_mut().rev().take(64).find(|other| {
                other.n_id_2 == n_id_2
                    && other.sample.abs_diff(candidate.sample) < CANDIDATE_SPACING
            });
            match near {
                Some(other) if other.statistic >= statistic => {}
                Some(other) => *other = candidate,
                None => candidates.push(candidate),
            }
        }
    }
}

/// Computes the elementwise product; further elements of `a` and `b` are ignored.
fn multiply(product: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    let n = product.len();
    let (a, b) = (&a[..n], &b[..n]);
    for i in 0..n {
        product[i] = Complex32::new(
            a[i].re * b[i].re - a[i].im * b[i].im,
            a[i].re * b[i].im + a[i].im * b[i].re,
        );
    }
}

/// Adds the statistic of one antenna at even and odd lags, from the correlation at even lags.
fn add_power(even: &mut [f32], odd: &mut [f32], correlation: &[Complex32], inverse_energy: &[f32]) {
    // Equal lengths eliminate bounds checks in the loop.
    let lags = inverse_energy.len();
    let (even, odd) = (&mut even[..lags], &mut odd[..lags]);
    let (here, next) = (&correlation[..lags], &correlation[1..=lags]);
    for i in 0..lags {
        let (a, b, scale) = (here[i], next[i], inverse_energy[i]);
        let (re, im) = (a.re + b.re, a.im + b.im);
        even[i] += (a.re * a.re + a.im * a.im) * scale;
        odd[i] += (re * re + im * im) * (0.5 * scale);
    }
}

/// Keeps the larger statistic and its hypothesis. The loop has no branch, so that the compiler
/// vectorises it.
fn keep_best(best: &mut [f32], index: &mut [u32], sum: &[f32], hypothesis: u32) {
    let n = sum.len();
    let (best, index) = (&mut best[..n], &mut index[..n]);
    for i in 0..n {
        let better = u32::from(sum[i] > best[i]).wrapping_neg();
        let bits = best[i].to_bits() & !better | sum[i].to_bits() & better;
        best[i] = f32::from_bits(bits);
        index[i] = index[i] & !better | hypothesis & better;
    }
}
