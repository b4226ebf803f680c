//! PSS matched filter: overlap-save correlation of all antennas with the three PSS at several
//! carrier frequency offsets, normalised by the energy under the window.
//!
//! Per antenna `a` and start sample `n` the statistic is
//! `T_a = 240 |Σ p*(i) x_a(n+i)|² / Σ |x_a(n+i)|²` with `‖p‖ = 1`: in noise over the SSB's 240
//! subcarriers exponentially distributed with mean one whatever the level (a beta distribution, to
//! be exact, whose tail is the thinner), and about 127 × SNR where the PSS is. Antennas are summed
//! non-coherently, so in noise the sum of `A` of them follows a gamma distribution of shape `A`.

use std::sync::Arc;

use num_complex::{Complex32, Complex64};
use rustfft::{Fft, FftPlanner};

use crate::demodulate::SYMBOL_FFT;
use crate::pss::pss;

/// Length of a transform of the overlap-save scheme.
const BLOCK: usize = 2048;
/// Correlation lags that one block yields.
const HOP: usize = BLOCK - SYMBOL_FFT;
/// Two maxima of one PSS closer than this are one candidate.
const CANDIDATE_SPACING: usize = 12;
/// Resource elements that share a window's energy when the whole SSB band is occupied.
const OCCUPIED: f32 = 240.0;

/// A maximum of the matched filter above the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PssCandidate {
    /// N_ID^(2), 0..=2.
    pub n_id_2: u8,
    /// First sample of the PSS without its cyclic prefix.
    pub sample: usize,
    /// Carrier frequency offset of the hypothesis, Hz.
    pub cfo_hz: f64,
    /// Σ_a T_a; see the module.
    pub statistic: f32,
}

/// Correlator with its transforms, replicas and buffers.
pub struct MatchedFilter {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    cfo_hypotheses_hz: Vec<f64>,
    /// Conjugated spectra of the replicas, `[n_id_2][hypothesis]`.
    replicas: [Vec<Vec<Complex32>>; 3],
    /// Spectrum of the block, per antenna.
    spectra: Vec<Vec<Complex32>>,
    /// 240 / energy under the window, per antenna and lag.
    inverse_energy: Vec<Vec<f32>>,
    product: Vec<Complex32>,
    scratch: Vec<Complex32>,
    sum: Vec<f32>,
    best: Vec<f32>,
    best_hypothesis: Vec<u8>,
}

impl MatchedFilter {
    /// Correlator for `antennas` channels at 256 samples a symbol; offsets in Hz at subcarrier
    /// spacing `scs_hz`.
    pub fn new(scs_hz: f64, cfo_hypotheses_hz: &[f64], antennas: usize) -> Self {
        let mut planner = FftPlanner::new();
        let forward = planner.plan_fft_forward(BLOCK);
        let inverse = planner.plan_fft_inverse(BLOCK);
        let replicas = [0, 1, 2].map(|n_id_2| {
            let symbol = pss_symbol(n_id_2);
            cfo_hypotheses_hz
                .iter()
                .map(|cfo_hz| {
                    let cycles = cfo_hz / (scs_hz * SYMBOL_FFT as f64);
                    let mut replica = vec![Complex32::ZERO; BLOCK];
                    for (i, sample) in symbol.iter().enumerate() {
                        let rotation = Complex64::cis(std::f64::consts::TAU * cycles * i as f64);
                        replica[i] =
                            sample * Complex32::new(rotation.re as f32, rotation.im as f32);
                    }
                    forward.process(&mut replica);
                    // The pair of unnormalised transforms multiplies by BLOCK.
                    for bin in &mut replica {
                        *bin = bin.conj() / BLOCK as f32;
                    }
                    replica
                })
                .collect()
        });
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        Self {
            forward,
            inverse,
            cfo_hypotheses_hz: cfo_hypotheses_hz.to_vec(),
            replicas,
            spectra: vec![vec![Complex32::ZERO; BLOCK]; antennas],
            inverse_energy: vec![vec![0.0; HOP]; antennas],
            product: vec![Complex32::ZERO; BLOCK],
            scratch: vec![Complex32::ZERO; scratch],
            sum: vec![0.0; HOP],
            best: vec![0.0; HOP],
            best_hypothesis: vec![0; HOP],
        }
    }

    /// Appends to `candidates` the maxima above `threshold` whose PSS starts in
    /// `first..end`; the PSS must lie inside the samples.
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
            for (antenna, samples) in antennas.iter().enumerate().take(self.spectra.len()) {
                let window = &samples.as_ref()[start..length.min(start + BLOCK)];
                self.load_antenna(antenna, window);
            }
            for n_id_2 in 0..3 {
                self.correlate(n_id_2);
                self.collect(n_id_2 as u8, start, lags, threshold, candidates);
            }
            start += lags;
        }
    }

    /// Spectrum of a block and the energy under the window at each lag.
    fn load_antenna(&mut self, antenna: usize, window: &[Complex32]) {
        let spectrum = &mut self.spectra[antenna];
        spectrum[..window.len()].copy_from_slice(window);
        spectrum[window.len()..].fill(Complex32::ZERO);

        let mut energy: f64 = spectrum[..SYMBOL_FFT]
            .iter()
            .map(|x| f64::from(x.norm_sqr()))
            .sum();
        let (old, new) = (spectrum.iter(), spectrum[SYMBOL_FFT..].iter());
        for (slot, (old, new)) in self.inverse_energy[antenna].iter_mut().zip(old.zip(new)) {
            *slot = if energy > f64::from(f32::MIN_POSITIVE) {
                OCCUPIED / energy as f32
            } else {
                0.0
            };
            energy += f64::from(new.norm_sqr()) - f64::from(old.norm_sqr());
        }
        self.forward
            .process_with_scratch(spectrum, &mut self.scratch);
    }

    /// Leaves the largest statistic over the frequency hypotheses in `best`.
    fn correlate(&mut self, n_id_2: usize) {
        for (hypothesis, replica) in self.replicas[n_id_2].iter().enumerate() {
            self.sum.fill(0.0);
            for (spectrum, inverse_energy) in self.spectra.iter().zip(&self.inverse_energy) {
                for ((product, bin), weight) in self.product.iter_mut().zip(spectrum).zip(replica) {
                    *product = bin * weight;
                }
                self.inverse
                    .process_with_scratch(&mut self.product, &mut self.scratch);
                for ((sum, value), scale) in
                    self.sum.iter_mut().zip(&self.product).zip(inverse_energy)
                {
                    *sum += value.norm_sqr() * scale;
                }
            }
            if hypothesis == 0 {
                self.best.copy_from_slice(&self.sum);
                self.best_hypothesis.fill(0);
                continue;
            }
            let kept = self.best.iter_mut().zip(&mut self.best_hypothesis);
            for ((best, index), sum) in kept.zip(&self.sum) {
                if *sum > *best {
                    *best = *sum;
                    *index = hypothesis as u8;
                }
            }
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
        for (lag, (&statistic, &hypothesis)) in self
            .best
            .iter()
            .zip(&self.best_hypothesis)
            .take(lags)
            .enumerate()
        {
            if statistic < threshold {
                continue;
            }
            let candidate = PssCandidate {
                n_id_2,
                sample: start + lag,
                cfo_hz: self.cfo_hypotheses_hz[usize::from(hypothesis)],
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

/// PSS in time, 256 samples of unit energy together, without cyclic prefix.
pub(crate) fn pss_symbol(n_id_2: u8) -> Vec<Complex32> {
    let mut symbol = vec![Complex32::ZERO; SYMBOL_FFT];
    for (n, chip) in pss(n_id_2).iter().enumerate() {
        let bin = (56 + n + SYMBOL_FFT - 120) % SYMBOL_FFT;
        symbol[bin] = Complex32::new(*chip, 0.0);
    }
    FftPlanner::new()
        .plan_fft_inverse(SYMBOL_FFT)
        .process(&mut symbol);
    // Σ|p|² = 127 · 256 after the unnormalised transform.
    let scale = 1.0 / (127.0 * SYMBOL_FFT as f32).sqrt();
    symbol.iter().map(|sample| sample * scale).collect()
}
