//! Front end: shifts the SSB's centre to 0 Hz, resamples to the base rate of 256 samples per
//! symbol, and filters everything outside the SSB's 240 subcarriers.
//!
//! Overlap-save method in the frequency domain: a block of the input is transformed once. The bins
//! around the SSB are weighted with a zero-phase raised-cosine low-pass filter and transformed back
//! at the base rate. Mixing is a selection of bins, without computation. Output sample `j`
//! corresponds exactly to input time `j · M / L`. An input at the base rate with the SSB at 0 Hz is
//! passed unchanged, because the filter would remove eight subcarriers on either side, which
//! demodulation separates anyway.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use crate::dsp::base_rate::SYMBOL_FFT;
use crate::dsp::received_grid::MAX_ANTENNAS;
use crate::numeric::fft::{self, Fft};

/// Maximum ratio of the input rate to the base rate.
const MAX_OVERSAMPLING: f64 = 4096.0;
/// Maximum numerator of the ratio of base rate to input rate.
const MAX_INTERPOLATION: usize = 1024;
/// Maximum relative error of that ratio: a tenth of a good oscillator's error.
const RATE_TOLERANCE: f64 = 1e-7;
/// Maximum number of samples in an output block of the overlap-save method, at the base rate.
const MAX_BLOCK: usize = 4096;
/// Minimum number of samples that are discarded on each side of a block, at the base rate: the
/// length of the low-pass filter.
const MIN_MARGIN: usize = 128;
/// Carrier frequency offset within the passband of the filter, in subcarriers.
const CFO_MARGIN_SUBCARRIERS: f64 = 0.7;

/// Reason why a front end is impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrontEndError {
    /// The input rate is not positive, or has no simple ratio to the base rate.
    #[error(
        "sample rate {input_hz} Hz: {base_hz} Hz must be a fraction of it, up to 1024 over any \
         integer, within 0.1 ppm (10, 20, 25, 50 Msps and all multiples of 3.84 Msps are)"
    )]
    Rate {
        /// Sample rate of the recording.
        input_hz: f64,
        /// 256 × subcarrier spacing.
        base_hz: f64,
    },
    /// The input rate is below the base rate of the numerology.
    #[error("sample rate {input_hz} Hz is below the {base_hz} Hz that the SSB needs")]
    RateTooLow {
        /// Sample rate of the recording.
        input_hz: f64,
        /// 256 × subcarrier spacing.
        base_hz: f64,
    },
    /// No antenna, or more than [`MAX_ANTENNAS`].
    #[error("{0} antennas: 1 to {MAX_ANTENNAS} are possible")]
    Antennas(usize),
    /// The SSB is outside the recorded band.
    #[error("an SSB {offset_hz} Hz off the centre does not fit a band of {input_hz} Hz")]
    OutOfBand {
        /// SSB centre minus recording centre.
        offset_hz: f64,
        /// Sample rate of the recording.
        input_hz: f64,
    },
    /// The number of antennas differs from the configuration.
    #[error("{given} antennas given, {expected} expected")]
    AntennaCount {
        /// Number of channels passed.
        given: usize,
        /// Configured number of channels.
        expected: usize,
    },
    /// The blocks of the antennas have different lengths.
    #[error("antennas hold different numbers of samples: {first} and {other}")]
    UnequalLengths {
        /// Length of antenna 0.
        first: usize,
        /// Length that differs.
        other: usize,
    },
}

/// Mixer, low-pass filter and rate conversion by L/M for all antennas of one receiver: L/M = 1/4
/// from 30.72 to 7.68 Msps, 2/3 from 11.52, 48/125 from 20.
pub struct FrontEnd {
    input_rate_hz: f64,
    scs_hz: f64,
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    /// Number of input samples of one output block.
    input_block: usize,
    /// Number of output samples that are discarded on each side of a block, a multiple of L.
    margin: usize,
    /// Numerator L of the rate ratio L/M.
    interpolation: usize,
    decimation: usize,
    tuning: Tuning,
    low_pass: Vec<f32>,
    spectrum: Vec<Complex32>,
    block: Vec<Complex32>,
    scratch: Vec<Complex32>,
    /// Input that is not yet consumed, for each antenna; it begins `margin` output samples before
    /// the next output.
    pending: Vec<Vec<Complex32>>,
    /// Number of input samples so far, for each antenna.
    consumed_input: u64,
    /// Number of output samples so far, for each antenna.
    produced: u64,
    /// Index of the first output sample in the stream, for the phase of the mixer.
    origin: u64,
}

/// Frequency that is shifted to 0 Hz.
#[derive(Debug, Clone, Copy, Default)]
struct Tuning {
    /// Bin of the input spectrum.
    centre_bin: i64,
    /// Residual of the selection of bins, in cycles per output sample.
    residual_cycles: f64,
}

impl FrontEnd {
    /// Creates a front end from `input_rate_hz` to `256 × scs_hz`, for an SSB whose centre is
    /// `offset_hz` above that of the recording.
    ///
    /// # Errors
    /// See [`FrontEndError`].
    pub fn new(
        input_rate_hz: f64,
        offset_hz: f64,
        scs_hz: f64,
        antennas: usize,
    ) -> Result<Self, FrontEndError> {
        if antennas == 0 || antennas > MAX_ANTENNAS {
            return Err(FrontEndError::Antennas(antennas));
        }
        let base_rate_hz = SYMBOL_FFT as f64 * scs_hz;
        let (interpolation, decimation) = rate_ratio(input_rate_hz, base_rate_hz)?;
        let repeats = (1..=MAX_BLOCK / interpolation)
            .rev()
            .find(|repeats| is_smooth(*repeats))
            .unwrap_or(1);
        let (block, input_block) = (repeats * interpolation, repeats * decimation);
        let margin = MIN_MARGIN.next_multiple_of(interpolation);
        let forward = fft::forward(input_block);
        let inverse = fft::inverse(block);
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        let lead_in = margin / interpolation * decimation;
        let mut front_end = Self {
            input_rate_hz,
            scs_hz,
            forward,
            inverse,
            input_block,
            margin,
            interpolation,
            decimation,
            tuning: Tuning::default(),
            low_pass: low_pass(block, input_block),
            spectrum: vec![Complex32::ZERO; input_block],
            block: vec![Complex32::ZERO; block],
            scratch: vec![Complex32::ZERO; scratch],
            pending: vec![vec![Complex32::ZERO; lead_in]; antennas],
            consumed_input: 0,
            produced: 0,
            origin: 0,
        };
        front_end.tune(offset_hz)?;
        Ok(front_end)
    }

    /// Sets another offset of the SSB from the recording's centre. Permitted between recordings
    /// only, because the phase would jump within a stream.
    ///
    /// # Errors
    /// [`FrontEndError::OutOfBand`].
    pub fn tune(&mut self, offset_hz: f64) -> Result<(), FrontEndError> {
        self.tuning = self.tuning_to(offset_hz)?;
        Ok(())
    }

    fn tuning_to(&self, offset_hz: f64) -> Result<Tuning, FrontEndError> {
        let edge_hz = offset_hz.abs() + 120.0 * self.scs_hz;
        if edge_hz.is_nan() || edge_hz > 0.5 * self.input_rate_hz {
            return Err(FrontEndError::OutOfBand {
                offset_hz,
                input_hz: self.input_rate_hz,
            });
        }
        let base_rate_hz = SYMBOL_FFT as f64 * self.scs_hz;
        let bin_hz = base_rate_hz / self.block.len() as f64;
        let centre_bin = (offset_hz / bin_hz).round();
        Ok(Tuning {
            centre_bin: centre_bin as i64,
            residual_cycles: (offset_hz - centre_bin * bin_hz) / base_rate_hz,
        })
    }

    /// Returns the number of input samples per output sample, M/L.
    pub fn input_per_output(&self) -> f64 {
        self.decimation as f64 / self.interpolation as f64
    }

    /// Processes the next samples of every antenna and appends the available output to `output`,
    /// one vector per antenna. With a rate conversion, about 4096 samples at the base rate are
    /// delayed.
    ///
    /// # Errors
    /// [`FrontEndError::AntennaCount`], [`FrontEndError::UnequalLengths`].
    pub fn push<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        output: &mut [Vec<Complex32>],
    ) -> Result<(), FrontEndError> {
        self.push_at(antennas, &[self.tuning], &mut [output])
    }

    fn push_at<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        tunings: &[Tuning],
        outputs: &mut [&mut [Vec<Complex32>]],
    ) -> Result<(), FrontEndError> {
        let mut length = 0;
        for output in outputs.iter() {
            length = self.common_length(antennas, output)?;
        }
        self.consumed_input += length as u64;
        if let ([tuning], [output]) = (tunings, &mut *outputs)
            && self.passes(tuning)
        {
            for (output, input) in output.iter_mut().zip(antennas) {
                output.extend_from_slice(input.as_ref());
            }
            self.produced = self.consumed_input;
            return Ok(());
        }
        for (pending, input) in self.pending.iter_mut().zip(antennas) {
            pending.extend_from_slice(input.as_ref());
        }
        self.run_blocks(tunings, outputs);
        Ok(())
    }

    /// Whether the input is passed unchanged.
    fn passes(&self, tuning: &Tuning) -> bool {
        self.interpolation == self.decimation
            && tuning.centre_bin == 0
            && tuning.residual_cycles == 0.0
    }

    /// Ends the stream and appends the delayed samples. The front end is then ready for another
    /// stream.
    pub fn finish(&mut self, output: &mut [Vec<Complex32>]) {
        self.finish_at(&[self.tuning], &mut [output]);
    }

    fn finish_at(&mut self, tunings: &[Tuning], outputs: &mut [&mut [Vec<Complex32>]]) {
        let (up, down) = (self.interpolation as u64, self.decimation as u64);
        let total = (self.consumed_input * up).div_ceil(down);
        while self.produced < total {
            for pending in &mut self.pending {
                pending.resize(self.input_block, Complex32::ZERO);
            }
            self.run_blocks(tunings, outputs);
        }
        let excess = self.produced.saturating_sub(total) as usize;
        for samples in outputs.iter_mut().flat_map(|output| output.iter_mut()) {
            samples.truncate(samples.len() - excess.min(samples.len()));
        }
        let lead_in = self.margin / self.interpolation * self.decimation;
        for pending in &mut self.pending {
            pending.clear();
            pending.resize(lead_in, Complex32::ZERO);
        }
        self.consumed_input = 0;
        self.produced = 0;
        self.origin = 0;
    }

    /// Continues a finished stream at input sample `sample`, after a gap. Returns the index of the
    /// next output sample. Output samples remain at multiples of M/L input samples, and the mixer
    /// continues its phase.
    pub(crate) fn resume_at(&mut self, sample: u64) -> u64 {
        let missing = sample % self.decimation as u64;
        for pending in &mut self.pending {
            pending.resize(pending.len() + missing as usize, Complex32::ZERO);
        }
        self.consumed_input = missing;
        self.origin = sample / self.decimation as u64 * self.interpolation as u64;
        self.origin
    }

    /// Processes a whole recording: [`push`](Self::push) and [`finish`](Self::finish).
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn process<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
    ) -> Result<Vec<Vec<Complex32>>, FrontEndError> {
        let mut output = vec![Vec::new(); antennas.len()];
        self.push(antennas, &mut output)?;
        self.finish(&mut output);
        Ok(output)
    }

    /// Processes a whole recording at several offsets, each with its own output for every antenna.
    /// The transform of the input, which takes most of the time at high rates, is computed once.
    ///
    /// # Errors
    /// As [`tune`](Self::tune) and [`push`](Self::push).
    pub(crate) fn process_at<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        offsets_hz: &[f64],
        outputs: &mut [Vec<Vec<Complex32>>],
    ) -> Result<(), FrontEndError> {
        let tunings = offsets_hz
            .iter()
            .map(|offset_hz| self.tuning_to(*offset_hz));
        let tunings: Vec<_> = tunings.collect::<Result<_, _>>()?;
        let mut outputs: Vec<_> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        for samples in outputs.iter_mut().flat_map(|output| output.iter_mut()) {
            samples.clear();
        }
        self.push_at(antennas, &tunings, &mut outputs)?;
        self.finish_at(&tunings, &mut outputs);
        Ok(())
    }

    fn common_length<S: AsRef<[Complex32]>>(
        &self,
        antennas: &[S],
        output: &[Vec<Complex32>],
    ) -> Result<usize, FrontEndError> {
        let expected = self.pending.len();
        for given in [antennas.len(), output.len()] {
            if given != expected {
                return Err(FrontEndError::AntennaCount { given, expected });
            }
        }
        let first = antennas.first().map_or(0, |samples| samples.as_ref().len());
        match antennas
            .iter()
            .find(|samples| samples.as_ref().len() != first)
        {
            Some(samples) => Err(FrontEndError::UnequalLengths {
                first,
                other: samples.as_ref().len(),
            }),
            None => Ok(first),
        }
    }

    fn run_blocks(&mut self, tunings: &[Tuning], outputs: &mut [&mut [Vec<Complex32>]]) {
        let margin = self.margin;
        let hop_output = self.block.len() - 2 * margin;
        let hop_input = hop_output / self.interpolation * self.decimation;
        let available = self.pending.first().map_or(0, Vec::len);
        let mut start = 0;
        while start + self.input_block <= available {
            for antenna in 0..self.pending.len() {
                let input = &self.pending[antenna][start..start + self.input_block];
                self.spectrum.copy_from_slice(input);
                self.forward
                    .process_with_scratch(&mut self.spectrum, &mut self.scratch);
                for (tuning, output) in tunings.iter().zip(outputs.iter_mut()) {
                    self.filter_block(tuning);
                    let (mut rotation, step) = self.block_phase(tuning);
                    let kept = self.block[margin..margin + hop_output].iter();
                    output[antenna].extend(kept.map(|sample| {
                        let rotated =
                            sample * Complex32::new(rotation.re as f32, rotation.im as f32);
                        rotation *= step;
                        rotated
                    }));
                }
            }
            start += hop_input;
            self.produced += hop_output as u64;
        }
        for pending in &mut self.pending {
            pending.drain(..start);
        }
    }

    /// Computes the part of `spectrum` around the tuning, filtered and at the base rate, in
    /// `block`.
    fn filter_block(&mut self, tuning: &Tuning) {
        let length = self.block.len();
        let first = (tuning.centre_bin - (length / 2) as i64).rem_euclid(self.input_block as i64);
        let mut source = first as usize;
        for (index, weight) in self.low_pass.iter().enumerate() {
            self.block[(index + length.div_ceil(2)) % length] = self.spectrum[source] * *weight;
            source += 1;
            if source == self.input_block {
                source = 0;
            }
        }
        self.inverse
            .process_with_scratch(&mut self.block, &mut self.scratch);
    }

    /// Returns the phase of the mixer at the first sample of the next output block, and its step
    /// per sample.
    fn block_phase(&self, tuning: &Tuning) -> (Complex64, Complex64) {
        let next = self.origin + self.produced;
        let hop_start = i128::from(next) - self.margin as i128;
        let start_input = hop_start / self.interpolation as i128 * self.decimation as i128;
        let bins =
            (i128::from(tuning.centre_bin) * start_input).rem_euclid(self.input_block as i128);
        let cycles =
            bins as f64 / self.input_block as f64 + (tuning.residual_cycles * next as f64).fract();
        (
            Complex64::cis(-TAU * cycles),
            Complex64::cis(-TAU * tuning.residual_cycles),
        )
    }
}

/// Returns the weights of the bins of an output block, in ascending order of frequency: one over
/// the 240 subcarriers and the tolerated frequency offset, a raised-cosine edge to the Nyquist
/// frequency, and the scale of the transforms.
fn low_pass(block: usize, input_block: usize) -> Vec<f32> {
    let bins_per_subcarrier = block as f64 / SYMBOL_FFT as f64;
    let pass = (120.5 + CFO_MARGIN_SUBCARRIERS) * bins_per_subcarrier;
    let stop = 128.0 * bins_per_subcarrier;
    (0..block)
        .map(|index| {
            let bin = (index as f64 - (block / 2) as f64).abs();
            let edge = ((bin - pass) / (stop - pass)).clamp(0.0, 1.0);
            (0.5 * (1.0 + (0.5 * TAU * edge).cos()) / input_block as f64) as f32
        })
        .collect()
}

/// Returns L and M; the base rate is L/M of the input rate.
fn rate_ratio(input_hz: f64, base_hz: f64) -> Result<(usize, usize), FrontEndError> {
    if !(input_hz > 0.0 && base_hz > 0.0 && input_hz <= MAX_OVERSAMPLING * base_hz) {
        return Err(FrontEndError::Rate { input_hz, base_hz });
    }
    if input_hz < base_hz * (1.0 - RATE_TOLERANCE) {
        return Err(FrontEndError::RateTooLow { input_hz, base_hz });
    }
    let ratio = |up: usize| (up, input_hz / base_hz * up as f64);
    (1..=MAX_INTERPOLATION)
        .map(ratio)
        .find(|(_, down)| (down - down.round()).abs() < RATE_TOLERANCE * down)
        .map(|(up, down)| (up, down.round() as usize))
        .ok_or(FrontEndError::Rate { input_hz, base_hz })
}

/// Whether transforms of this length are fast: no prime factor above 7.
fn is_smooth(length: usize) -> bool {
    let without = |rest: usize, prime: usize| {
        std::iter::successors(Some(rest), |it| {
            it.is_multiple_of(prime).then(|| it / prime)
        })
        .last()
    };
    let rest = [2, 3, 5, 7].into_iter().try_fold(length, without);
    rest == Some(1)
}
