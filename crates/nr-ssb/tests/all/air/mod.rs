//! Received signals for tests: SSBs with delay, frequency offset, antenna gains and noise.
#![allow(dead_code, reason = "each test uses its part")]

pub mod receivers;

use std::f64::consts::TAU;

use nr_ssb::{
    BchPayload, Beam, Burst, Case, Complex32, Lmax, Mib, Numerology, Ofdm, Pci, SubcarrierSpacing,
    fft,
};
use num_complex::Complex64;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Received signal of one cell.
#[derive(Debug, Clone)]
pub struct Cell {
    pub pci: u16,
    pub spacing: SubcarrierSpacing,
    pub lmax: Lmax,
    pub ssb_indices: Vec<u8>,
    pub sfn: u16,
    pub half_frame: bool,
    pub mib: Mib,
    pub ssb_freq_hz: f64,
    /// Start of the half frame in the recording, in samples.
    pub delay: f64,
    pub cfo_hz: f64,
    /// Complex gain of each antenna.
    pub gains: Vec<Complex32>,
}

impl Cell {
    /// Creates a random cell of one SSB with unit gains of random phase.
    pub fn random(rng: &mut ChaCha8Rng, spacing: SubcarrierSpacing, antennas: usize) -> Self {
        let lmax = match spacing {
            SubcarrierSpacing::Khz120 | SubcarrierSpacing::Khz240 => Lmax::L64,
            _ if rng.random() => Lmax::L4,
            _ => Lmax::L8,
        };
        Self {
            pci: rng.random_range(0..1008),
            spacing,
            lmax,
            ssb_indices: vec![rng.random_range(0..lmax.count())],
            sfn: rng.random_range(0..1024),
            half_frame: rng.random(),
            mib: Mib {
                pdcch_config_sib1: rng.random(),
                ssb_subcarrier_offset: rng.random_range(0..16),
                cell_barred: rng.random(),
                ..Mib::default()
            },
            ssb_freq_hz: match lmax {
                Lmax::L4 => 2.1e9 + 50e3,
                Lmax::L8 => 3.6e9,
                Lmax::L64 => 24_250.08e6 + 150.0 * 17.28e6,
            },
            delay: 500.0 + rng.random_range(0.0..20_000.0),
            cfo_hz: rng.random_range(-0.5..0.5) * spacing.hz(),
            gains: (0..antennas)
                .map(|_| phasor(rng.random_range(0.0..TAU)))
                .collect(),
        }
    }

    pub fn case(&self) -> Case {
        match self.spacing {
            SubcarrierSpacing::Khz15 => Case::A,
            SubcarrierSpacing::Khz30 => Case::C,
            SubcarrierSpacing::Khz120 => Case::D,
            SubcarrierSpacing::Khz240 => Case::E,
        }
    }

    /// Returns the samples of the half frame without delay and frequency offset.
    pub fn half_frame_samples(&self) -> Vec<Complex32> {
        let burst = Burst {
            pci: Pci::new(self.pci).unwrap(),
            case: self.case(),
            lmax: self.lmax,
            payload: BchPayload::new(self.mib, self.sfn, self.half_frame, 0).unwrap(),
            beams: self
                .ssb_indices
                .iter()
                .map(|index| Beam::new(*index))
                .collect(),
            ssb_freq_hz: Some(self.ssb_freq_hz),
        };
        let mut ofdm = Ofdm::new(Numerology::new(self.spacing, 256).unwrap());
        burst.iq(&mut ofdm).unwrap()
    }

    /// Returns the first sample of an SSB including its cyclic prefix, in the recording.
    pub fn ssb_start(&self, ssb_index: u8) -> f64 {
        let numerology = Numerology::new(self.spacing, 256).unwrap();
        let symbol = self.case().start_symbol(ssb_index).unwrap();
        // The search counts a prefix of 18 samples for every symbol; a longer prefix shifts the start.
        let long = numerology.cp_len(symbol) - numerology.ssb_cp_len();
        self.delay + (numerology.symbol_start(symbol) + long) as f64
    }

    /// Adds the cell to the antennas' samples.
    pub fn add_to(&self, antennas: &mut [Vec<Complex32>]) {
        let whole = self.delay.floor();
        let sent = delayed(&self.half_frame_samples(), self.delay - whole);
        let step = TAU * self.cfo_hz / self.spacing.base_rate_hz();
        for (antenna, gain) in antennas.iter_mut().zip(&self.gains) {
            for (n, x) in sent.iter().enumerate() {
                let at = whole as usize + n;
                if let Some(sample) = antenna.get_mut(at) {
                    *sample += x * gain * phasor(step * at as f64);
                }
            }
        }
    }
}

/// Applies a circular delay, which may be a fraction of a sample.
pub fn delayed(samples: &[Complex32], fraction: f64) -> Vec<Complex32> {
    let n = samples.len();
    let mut spectrum = samples.to_vec();
    fft::forward(n).process(&mut spectrum);
    for (k, bin) in spectrum.iter_mut().enumerate() {
        let signed = if k < n / 2 {
            k as f64
        } else {
            k as f64 - n as f64
        };
        *bin *= phasor(-TAU * signed * fraction / n as f64) / n as f32;
    }
    fft::inverse(n).process(&mut spectrum);
    spectrum
}

/// Interpolates to `factor` times the rate and mixes up by `cycles` per output sample.
pub fn raised(samples: &[Complex32], factor: usize, cycles: f64) -> Vec<Complex32> {
    let wide = resampled(samples, factor, 1);
    let mixed = wide.iter().enumerate();
    mixed
        .map(|(i, x)| x * phasor(TAU * cycles * i as f64))
        .collect()
}

/// Interpolates to `up / down` times the rate; `down` must divide the number of samples.
pub fn resampled(samples: &[Complex32], up: usize, down: usize) -> Vec<Complex32> {
    let n = samples.len();
    let mut spectrum = samples.to_vec();
    fft::forward(n).process(&mut spectrum);
    let mut wide = vec![Complex32::ZERO; n / down * up];
    let end = wide.len() - n / 2;
    wide[..n / 2].copy_from_slice(&spectrum[..n / 2]);
    wide[end..].copy_from_slice(&spectrum[n / 2..]);
    fft::inverse(wide.len()).process(&mut wide);
    wide.iter().map(|x| x / n as f32).collect()
}

/// Adds noise such that a resource element of unit gain has this SNR.
pub fn add_noise(antennas: &mut [Vec<Complex32>], snr_db: f64, rng: &mut ChaCha8Rng) {
    let scale = (0.5 / 256.0 / 10f64.powf(0.1 * snr_db)).sqrt() as f32;
    for sample in antennas.iter_mut().flatten() {
        *sample += gaussian(rng) * scale;
    }
}

/// Replaces the samples by noise such that a resource element of unit gain has this SNR.
pub fn fill_with_noise(antennas: &mut [Vec<Complex32>], snr_db: f64, rng: &mut ChaCha8Rng) {
    for samples in antennas.iter_mut() {
        samples.fill(Complex32::ZERO);
    }
    add_noise(antennas, snr_db, rng);
}

fn gaussian(rng: &mut impl Rng) -> Complex32 {
    Complex32::new(StandardNormal.sample(rng), StandardNormal.sample(rng))
}

pub fn silence(antennas: usize, samples: usize) -> Vec<Vec<Complex32>> {
    vec![vec![Complex32::ZERO; samples]; antennas]
}

pub fn slices(antennas: &[Vec<Complex32>]) -> Vec<&[Complex32]> {
    antennas.iter().map(Vec::as_slice).collect()
}

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn phasor(angle: f64) -> Complex32 {
    let phasor = Complex64::cis(angle);
    Complex32::new(phasor.re as f32, phasor.im as f32)
}
