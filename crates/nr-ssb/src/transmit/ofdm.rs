//! OFDM of the SSB's 240 subcarriers, its centre at 0 Hz (TS 38.211 §5.3.1 and §5.4).
//!
//! Modulation is the inverse DFT with the factor 1/N, and demodulation is the DFT, so that they are
//! inverse at any FFT size.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use crate::error::Error;
use crate::numeric::fft::{self, Fft};
use crate::standard::grid::SUBCARRIERS;
use crate::standard::numerology::Numerology;

/// Modulator and demodulator of single OFDM symbols. It owns its FFT plans and buffers.
///
/// ```
/// use nr_ssb::{Complex32, Numerology, Ofdm, SubcarrierSpacing};
/// let mut ofdm = Ofdm::new(Numerology::new(SubcarrierSpacing::Khz30, 512)?);
/// let mut subcarriers = [Complex32::ZERO; 240];
/// subcarriers[7] = Complex32::ONE;
/// let mut samples = vec![Complex32::ZERO; 36 + 512];
/// ofdm.modulate(&subcarriers, &mut samples)?;
///
/// let mut received = [Complex32::ZERO; 240];
/// // The window may begin inside the cyclic prefix, here 10 samples early.
/// ofdm.demodulate(&samples[36 - 10..][..512], 10, &mut received)?;
/// assert!((received[7] - Complex32::ONE).norm() < 1e-5);
/// # Ok::<(), nr_ssb::Error>(())
/// ```
pub struct Ofdm {
    numerology: Numerology,
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    spectrum: Vec<Complex32>,
    scratch: Vec<Complex32>,
}

impl std::fmt::Debug for Ofdm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ofdm")
            .field("numerology", &self.numerology)
            .finish_non_exhaustive()
    }
}

impl Ofdm {
    /// Creates the FFT plans of `numerology`.
    pub fn new(numerology: Numerology) -> Self {
        let size = numerology.fft_size();
        let forward = fft::forward(size);
        let inverse = fft::inverse(size);
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        Self {
            numerology,
            forward,
            inverse,
            spectrum: vec![Complex32::ZERO; size],
            scratch: vec![Complex32::ZERO; scratch],
        }
    }

    /// Returns the numerology.
    pub const fn numerology(&self) -> Numerology {
        self.numerology
    }

    /// Writes one symbol with its cyclic prefix: `samples` contains the prefix and N samples.
    ///
    /// # Errors
    /// [`Error::Length`] if `samples` is shorter than N or longer than 2N.
    pub fn modulate(
        &mut self,
        subcarriers: &[Complex32; SUBCARRIERS],
        samples: &mut [Complex32],
    ) -> Result<(), Error> {
        let size = self.numerology.fft_size();
        let cp_len = samples.len().wrapping_sub(size);
        if cp_len > size {
            return Err(Error::Length {
                what: "OFDM symbol with cyclic prefix",
                got: samples.len(),
                expected: self.numerology.ssb_symbol_len(),
            });
        }
        samples.fill(Complex32::ZERO);
        self.add(subcarriers, Complex32::ONE, cp_len, samples);
        Ok(())
    }

    /// Adds one symbol, multiplied by `gain`, to `samples`: a cyclic prefix of `cp_len` (up to N),
    /// then the symbol.
    pub(crate) fn add(
        &mut self,
        subcarriers: &[Complex32; SUBCARRIERS],
        gain: Complex32,
        cp_len: usize,
        samples: &mut [Complex32],
    ) {
        let size = self.numerology.fft_size();
        self.spectrum.fill(Complex32::ZERO);
        let (negative, positive) = subcarriers.split_at(SUBCARRIERS / 2);
        self.spectrum[..SUBCARRIERS / 2].copy_from_slice(positive);
        self.spectrum[size - SUBCARRIERS / 2..].copy_from_slice(negative);
        self.inverse
            .process_with_scratch(&mut self.spectrum, &mut self.scratch);
        let scale = gain / size as f32;
        let values = self.spectrum[size - cp_len..].iter().chain(&self.spectrum);
        for (sample, value) in samples.iter_mut().zip(values) {
            *sample += value * scale;
        }
    }

    /// Computes the subcarriers of one symbol from N samples that begin `early` samples before the
    /// end of the cyclic prefix. The phase ramp of the early start is compensated.
    ///
    /// # Errors
    /// [`Error::Length`] unless `window` has N samples.
    pub fn demodulate(
        &mut self,
        window: &[Complex32],
        early: usize,
        subcarriers: &mut [Complex32; SUBCARRIERS],
    ) -> Result<(), Error> {
        let size = self.numerology.fft_size();
        if window.len() != size {
            return Err(Error::Length {
                what: "window of one OFDM symbol",
                got: window.len(),
                expected: size,
            });
        }
        // A cyclic shift of the window by `early` samples is exactly this phase ramp.
        let early = early % size;
        self.spectrum[..size - early].copy_from_slice(&window[early..]);
        self.spectrum[size - early..].copy_from_slice(&window[..early]);
        self.forward
            .process_with_scratch(&mut self.spectrum, &mut self.scratch);
        let (negative, positive) = subcarriers.split_at_mut(SUBCARRIERS / 2);
        positive.copy_from_slice(&self.spectrum[..SUBCARRIERS / 2]);
        negative.copy_from_slice(&self.spectrum[size - SUBCARRIERS / 2..]);
        Ok(())
    }
}

/// Returns the phase exp(−j2π·f·t) of OFDM symbol `symbol` of a half frame at `freq_hz` (TS 38.211
/// §5.4); t is the time from the start of the symbol's subframe to the end of its cyclic prefix.
///
/// The transmitter resets its carrier phase in every symbol, whereas the mixer of a receiver is
/// continuous. `freq_hz` is the absolute frequency of the SSB's centre, whatever the carrier
/// frequency.
pub fn symbol_phase(numerology: Numerology, symbol: usize, freq_hz: f64) -> Complex32 {
    let symbols_per_subframe = 2 * numerology.spacing().symbols_per_half_ms();
    let symbol = symbol % symbols_per_subframe;
    let sample = numerology.symbol_start(symbol) + numerology.cp_len(symbol);
    let cycles = freq_hz * sample as f64 / numerology.sample_rate_hz();
    let phasor = Complex64::cis(-TAU * cycles.fract());
    Complex32::new(phasor.re as f32, phasor.im as f32)
}
