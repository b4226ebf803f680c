//! Narrow lines in the received spectrum: a receiver's DC offset, spurious tones, carriers of other
//! systems. They are found in a long spectrum and subtracted before any correlation.
//!
//! # Detection
//! Up to 16 frames of 2048 samples, spread evenly over the samples, are tapered (Blackman–Harris, whose
//! sidelobes are 92 dB below the main lobe) and transformed. The power of a bin is summed over the antennas
//! and its median is taken over the frames: bursts that last for less than half of the frames are no
//! lines. A bin is a line if it exceeds the medians of its surroundings, 5 to 16 bins away, on either side by
//! [`PROMINENCE`]: the edge of a band exceeds only one of them. Resource elements are 8 bins wide
//! at the base rate, and remain below that.
//! An input without lines is left unchanged, bit by bit.
//!
//! # Removal
//! The frequency is refined with the phase between the halves of a frame. Amplitudes of all lines are
//! fitted jointly by least squares to each antenna and each stretch of 4096 samples or more, so that
//! slow drift is followed. The projection is the same at all antennas: it leaves an SSB's direction
//! unchanged and takes at most one part in 4096 / 1024 of a single subcarrier's energy.

use std::f64::consts::TAU;
use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use super::received_grid::MAX_ANTENNAS;
use crate::numeric::decibel::decibel;
use crate::numeric::fft::{self, Fft};
use crate::numeric::hermitian::{Matrix, cholesky, solve};
use crate::numeric::phasors::fill_phasors;

/// Samples of a frame at the base rate: 3.75 kHz per bin at 30 kHz subcarrier spacing.
const FRAME: usize = 2048;
/// Maximum number of frames: further frames hardly change the median.
const MAX_FRAMES: usize = 16;
/// Minimum number of samples for the detection of lines, in frames: about one SSB.
const SHORTEST_FRAMES: f64 = 0.5;
/// Minimum ratio of a line's power per bin to that of its surroundings, 16 dB. White noise exceeds it in one
/// of 1e8 bins of a single frame, SSBs stay below 13 dB. A weaker line adds less than 12 dB to the noise of
/// one resource element, which is 2 % of the noise of all pilots.
const PROMINENCE: f32 = 40.0;
/// Minimum power of a line relative to the strongest frame, −100 dB: weaker lines may be rounding
/// errors.
const ROUNDING: f32 = 1e-10;
/// Minimum power of a line within the main lobe of a known one, relative to the known one, −40 dB:
/// the residual of a subtracted line is below −50 dB, and is visible in a band without noise.
const RESIDUAL: f32 = 1e-4;
/// Half of the taper's main lobe, in bins of a full frame.
const LOBE: usize = 4;
/// Farthest bin of a line's surroundings, in half main lobes.
const SURROUNDINGS: usize = 4;
/// Maximum number of lines.
const MAX_TONES: usize = 16;
/// Amplitudes are fitted again after this number of samples.
const STRETCH: usize = 4096;
/// Minimum number of samples that amplitudes are fitted to.
const SHORTEST_FIT: usize = 256;
/// Number of corrections of a frequency; each one reduces the error at least tenfold.
const CORRECTIONS: usize = 3;

/// A line in the spectrum of received samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Frequency from the centre of the samples, Hz.
    pub frequency_hz: f64,
    /// Mean power over the antennas, 0 dB for an amplitude of one.
    pub power_dbfs: f64,
}

/// Returns the lines in the whole band of a recording, the strongest first; empty for a recording
/// below one millisecond.
pub fn tones<S: AsRef<[Complex32]>>(antennas: &[S], sample_rate_hz: f64) -> Vec<Tone> {
    // Frames with the frequency resolution of a receiver for 15 kHz subcarriers, or finer.
    let frames = (sample_rate_hz / 3.84e6).ceil().clamp(1.0, 64.0) as usize;
    let count = antennas.len().min(MAX_ANTENNAS);
    let mut canceller = ToneCanceller::with_frame(FRAME * frames.next_power_of_two(), count);
    canceller.detect(&antennas[..count], 0);
    canceller.tones(sample_rate_hz).collect()
}

/// Frequency and power of a line.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Cycles per sample.
    frequency: f64,
    power: f64,
    /// Median power of the line's bin when it was found.
    bin_power: f32,
}

/// Detector and canceller of lines; owns all buffers.
pub(crate) struct ToneCanceller {
    fft: Arc<dyn Fft<f32>>,
    frame: Vec<Complex32>,
    scratch: Vec<Complex32>,
    taper: Vec<f32>,
    /// Frame of every antenna.
    work: Vec<Vec<Complex32>>,
    /// Power per bin and frame; the frames of a bin are adjacent in memory.
    powers: Vec<[f32; MAX_FRAMES]>,
    median: Vec<f32>,
    phasors: Vec<Complex32>,
    lines: Vec<Line>,
}

/// Frames of equal length within the examined samples.
#[derive(Clone, Copy)]
struct Frames {
    first: usize,
    length: usize,
    count: usize,
    step: usize,
}

impl Frames {
    /// Creates frames of `full` samples, or one shorter frame, in the samples from `first` to
    /// `end`; `None` if there are too few samples.
    fn new(first: usize, end: usize, full: usize) -> Option<Self> {
        let available = end.checked_sub(first)?;
        if (available as f64) < SHORTEST_FRAMES * full as f64 {
            return None;
        }
        let length = available.min(full) & !1;
        let count = (available / length).clamp(1, MAX_FRAMES);
        let step = (available - length) / (count - 1).max(1);
        Some(Self {
            first,
            length,
            count,
            step,
        })
    }

    fn start(&self, number: usize) -> usize {
        self.first + number * self.step
    }
}

impl ToneCanceller {
    /// Creates a canceller for samples at the base rate.
    pub(crate) fn new(antennas: usize) -> Self {
        Self::with_frame(FRAME, antennas)
    }

    fn with_frame(frame: usize, antennas: usize) -> Self {
        let fft = fft::forward(frame);
        let scratch = vec![Complex32::ZERO; fft.get_inplace_scratch_len()];
        Self {
            fft,
            frame: vec![Complex32::ZERO; frame],
            scratch,
            taper: blackman_harris(frame),
            work: vec![vec![Complex32::ZERO; frame]; antennas],
            powers: vec![[0.0; MAX_FRAMES]; frame],
            median: vec![0.0; frame],
            phasors: vec![Complex32::ZERO; frame.max(2 * STRETCH)],
            lines: Vec::with_capacity(MAX_TONES),
        }
    }

    /// Whether there are lines to subtract.
    pub(crate) fn is_needed(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Removes all lines from the state.
    pub(crate) fn forget(&mut self) {
        self.lines.clear();
    }

    /// Returns the lines of the last detection, the strongest first.
    pub(crate) fn tones(&self, sample_rate_hz: f64) -> impl Iterator<Item = Tone> + '_ {
        self.lines.iter().map(move |line| Tone {
            frequency_hz: line.frequency * sample_rate_hz,
            power_dbfs: decibel(line.power),
        })
    }

    /// Detects lines in the samples from index `first`; with less than half a frame, the known
    /// lines are unchanged.
    pub(crate) fn detect<S: AsRef<[Complex32]>>(&mut self, antennas: &[S], first: usize) {
        let end = antennas.iter().map(|it| it.as_ref().len()).min();
        let Some(frames) = Frames::new(first, end.unwrap_or(0), self.frame.len()) else {
            return;
        };
        if self.taper.len() != frames.length {
            self.taper = blackman_harris(frames.length);
        }
        self.lines.clear();
        while self.lines.len() < MAX_TONES {
            self.measure(antennas, frames);
            let Some(bin) = self.most_prominent(frames.length) else {
                break;
            };
            let turns = bin as f64 / self.frame.len() as f64;
            self.lines.push(Line {
                frequency: turns - turns.round(),
                power: 0.0,
                bin_power: self.median[bin],
            });
            for _ in 0..CORRECTIONS {
                for index in 0..self.lines.len() {
                    self.correct(antennas, frames, index);
                }
            }
            if self.coincide(frames.length) {
                self.lines.pop();
                break;
            }
        }
        self.measure_lines(antennas, frames);
        self.lines.sort_by(|a, b| b.power.total_cmp(&a.power));
    }

    /// Subtracts the lines from the samples from index `first`.
    pub(crate) fn subtract(&mut self, antennas: &mut [Vec<Complex32>], first: usize) {
        let end = antennas.iter().map(Vec::len).min().unwrap_or(0);
        if self.lines.is_empty() || end < first + SHORTEST_FIT {
            return;
        }
        let stretches = ((end - first) / STRETCH).max(1);
        for number in 0..stretches {
            let from = first + number * STRETCH;
            let to = if number + 1 == stretches {
                end
            } else {
                from + STRETCH
            };
            self.fit(antennas, from..to, None, true);
        }
    }

    /// Fits the amplitudes of all lines except `without` to a range of samples, and subtracts the
    /// lines if `subtract` is set. Returns the power of each line.
    fn fit(
        &mut self,
        antennas: &mut [Vec<Complex32>],
        range: std::ops::Range<usize>,
        without: Option<usize>,
        subtract: bool,
    ) -> [f64; MAX_TONES] {
        let mut powers = [0.0; MAX_TONES];
        let length = range.len();
        let lines = self.lines.iter().enumerate();
        let lines = lines.filter(|(index, _)| Some(*index) != without);
        let mut frequencies = [0.0; MAX_TONES];
        let mut count = 0;
        for ((_, line), slot) in lines.zip(&mut frequencies) {
            *slot = line.frequency;
            count += 1;
        }
        let frequencies = &frequencies[..count];
        let Some(factor) = cholesky(&gram(frequencies, length)) else {
            return powers;
        };
        let phasors = &mut self.phasors[..length];
        let mut amplitudes = [[Complex64::ZERO; MAX_TONES]; MAX_ANTENNAS];
        for (index, frequency) in frequencies.iter().enumerate() {
            fill_phasors(phasors, 0.0, *frequency);
            for (samples, amplitudes) in antennas.iter().zip(&mut amplitudes) {
                let samples = samples.get(range.clone()).unwrap_or_default();
                amplitudes[index] = correlate(phasors, samples);
            }
        }
        let used = antennas.len().min(MAX_ANTENNAS);
        for amplitudes in &mut amplitudes[..used] {
            *amplitudes = solve(&factor, amplitudes);
            for (power, amplitude) in powers.iter_mut().zip(amplitudes.iter()) {
                *power += amplitude.norm_sqr() / used as f64;
            }
        }
        if subtract {
            for (index, frequency) in frequencies.iter().enumerate() {
                fill_phasors(phasors, 0.0, *frequency);
                for (samples, amplitudes) in antennas.iter_mut().zip(&amplitudes) {
                    let amplitude = amplitudes[index];
                    let amplitude = Complex32::new(amplitude.re as f32, amplitude.im as f32);
                    let samples = samples.get_mut(range.clone()).unwrap_or_default();
                    for (sample, phasor) in samples.iter_mut().zip(&*phasors) {
                        *sample -= phasor * amplitude;
                    }
                }
            }
        }
        powers
    }

    /// Copies a frame of every antenna to `work`, and subtracts all lines except line `kept`.
    fn load<S: AsRef<[Complex32]>>(
        &mut self,
        antennas: &[S],
        frames: Frames,
        number: usize,
        kept: Option<usize>,
    ) {
        let start = frames.start(number);
        let mut work = std::mem::take(&mut self.work);
        for (work, samples) in work.iter_mut().zip(antennas) {
            let samples = samples.as_ref().get(start..start + frames.length);
            for (slot, sample) in work.iter_mut().zip(samples.unwrap_or_default()) {
                *slot = if sample.is_finite() {
                    *sample
                } else {
                    Complex32::ZERO
                };
            }
        }
        if self.lines.len() > usize::from(kept.is_some()) {
            self.fit(&mut work, 0..frames.length, kept, true);
        }
        self.work = work;
    }

    /// Measures the median power of every bin over the frames, after subtraction of the known
    /// lines.
    fn measure<S: AsRef<[Complex32]>>(&mut self, antennas: &[S], frames: Frames) {
        for number in 0..frames.count {
            self.load(antennas, frames, number, None);
            for powers in &mut self.powers {
                powers[number] = 0.0;
            }
            for work in self.work.iter().take(antennas.len()) {
                self.frame.fill(Complex32::ZERO);
                for ((slot, sample), weight) in self.frame.iter_mut().zip(work).zip(&self.taper) {
                    *slot = sample * weight;
                }
                self.fft
                    .process_with_scratch(&mut self.frame, &mut self.scratch);
                for (powers, bin) in self.powers.iter_mut().zip(&self.frame) {
                    powers[number] += bin.norm_sqr();
                }
            }
        }
        let middle = (frames.count - 1) / 2;
        for (median, powers) in self.median.iter_mut().zip(&self.powers) {
            let mut sorted = *powers;
            let (_, value, _) =
                sorted[..frames.count].select_nth_unstable_by(middle, f32::total_cmp);
            *median = *value;
        }
    }

    /// Returns the strongest bin whose power exceeds that of its surroundings by [`PROMINENCE`].
    fn most_prominent(&self, length: usize) -> Option<usize> {
        let bins = self.median.len();
        let lobe = (LOBE * bins).div_ceil(length);
        let strongest = self.median.iter().copied().fold(0.0, f32::max);
        let frames = self.powers.iter().flatten().copied();
        let floor = ROUNDING * frames.fold(0.0, f32::max);
        let at = |bin: usize, away: isize| {
            let place = (bin + bins).wrapping_add_signed(away) % bins;
            self.median[place]
        };
        let stands_out = |bin: usize| {
            let power = self.median[bin];
            if power <= floor
                || power < at(bin, 1)
                || power < at(bin, -1)
                || self.is_residual(bin, lobe)
            {
                return false;
            }
            let exceeds = |sign: isize| {
                let surroundings = lobe + 1..=SURROUNDINGS * lobe;
                let lower = surroundings
                    .filter(|away| PROMINENCE * at(bin, sign * *away as isize) < power)
                    .count();
                2 * lower >= (SURROUNDINGS - 1) * lobe
            };
            exceeds(1) && exceeds(-1)
        };
        if strongest <= 0.0 {
            return None;
        }
        (0..bins)
            .filter(|bin| stands_out(*bin))
            .max_by(|a, b| self.median[*a].total_cmp(&self.median[*b]))
    }

    /// Whether a bin within half a main lobe of a known line contains the residual of that line.
    fn is_residual(&self, bin: usize, lobe: usize) -> bool {
        let bins = self.median.len() as f64;
        self.lines.iter().any(|line| {
            let away = line.frequency - bin as f64 / bins;
            (away - away.round()).abs() * bins <= lobe as f64
                && self.median[bin] < RESIDUAL * line.bin_power
        })
    }

    /// Corrects a line's frequency by the phase between the tapered halves of the frames.
    fn correct<S: AsRef<[Complex32]>>(&mut self, antennas: &[S], frames: Frames, index: usize) {
        let half = frames.length / 2;
        let Some(frequency) = self.lines.get(index).map(|line| line.frequency) else {
            return;
        };
        let mut turned = Complex64::ZERO;
        for number in 0..frames.count {
            self.load(antennas, frames, number, Some(index));
            let phasors = &mut self.phasors[..frames.length];
            fill_phasors(phasors, 0.0, frequency);
            for (n, phasor) in phasors.iter_mut().enumerate() {
                let place = ((n % half) as f64 + 0.5) / half as f64;
                *phasor *= (TAU * 0.5 * place).sin().powi(2) as f32;
            }
            let (early, late) = phasors.split_at(half);
            for work in self.work.iter().take(antennas.len()) {
                let first = correlate(early, &work[..half]);
                let second = correlate(late, &work[half..frames.length]);
                turned += first.conj() * second;
            }
        }
        if let Some(line) = self.lines.get_mut(index)
            && turned.norm_sqr() > 0.0
        {
            line.frequency += turned.arg() / (TAU * half as f64);
        }
    }

    /// Whether the line added last coincides with another line.
    fn coincide(&self, length: usize) -> bool {
        let Some((last, others)) = self.lines.split_last() else {
            return false;
        };
        let near = 0.5 / length as f64;
        let apart = |line: &Line| {
            let away = line.frequency - last.frequency;
            (away - away.round()).abs()
        };
        others.iter().any(|line| apart(line) < near)
    }

    /// Measures the power of the lines.
    fn measure_lines<S: AsRef<[Complex32]>>(&mut self, antennas: &[S], frames: Frames) {
        if self.lines.is_empty() {
            return;
        }
        let lines = std::mem::take(&mut self.lines);
        let mut powers = [0.0; MAX_TONES];
        for number in 0..frames.count {
            self.load(antennas, frames, number, None);
            self.lines.extend_from_slice(&lines);
            let mut work = std::mem::take(&mut self.work);
            let antennas = antennas.len().min(work.len());
            let found = self.fit(&mut work[..antennas], 0..frames.length, None, false);
            self.work = work;
            self.lines.clear();
            for (sum, power) in powers.iter_mut().zip(found) {
                *sum += power / frames.count as f64;
            }
        }
        self.lines = lines;
        for (line, power) in self.lines.iter_mut().zip(powers) {
            line.power = power;
        }
    }
}

/// Returns the inner products of the lines, `Σ exp(j2π (f_j − f_i) n)` over `length` samples;
/// unused rows belong to lines that are orthogonal to all others.
fn gram(frequencies: &[f64], length: usize) -> Matrix<MAX_TONES> {
    let mut gram = [[Complex64::ZERO; MAX_TONES]; MAX_TONES];
    for (i, row) in gram.iter_mut().enumerate() {
        row[i] = Complex64::new(length as f64, 0.0);
        for (j, entry) in row.iter_mut().enumerate() {
            if let (Some(a), Some(b)) = (frequencies.get(i), frequencies.get(j))
                && i != j
            {
                let step = Complex64::cis(TAU * (b - a));
                let last = Complex64::cis(TAU * ((b - a) * length as f64).fract());
                let below = step - 1.0;
                if below.norm_sqr() > 1e-24 {
                    *entry = (last - 1.0) / below;
                } else {
                    *entry = Complex64::new(length as f64, 0.0);
                }
            }
        }
    }
    gram
}

/// Returns `Σ x conj(phasor)` as a sum of partial sums, which reduces rounding errors of single
/// precision.
fn correlate(phasors: &[Complex32], samples: &[Complex32]) -> Complex64 {
    const PART: usize = 64;
    let parts = phasors.chunks(PART).zip(samples.chunks(PART));
    parts
        .map(|(phasors, samples)| {
            let products = phasors.iter().zip(samples).map(|(p, x)| x * p.conj());
            let sum: Complex32 = products.sum();
            Complex64::new(f64::from(sum.re), f64::from(sum.im))
        })
        .sum()
}

/// Returns the four-term Blackman–Harris taper (Harris 1978).
fn blackman_harris(length: usize) -> Vec<f32> {
    let weight = |n: usize| {
        let turn = TAU * (n as f64 + 0.5) / length as f64;
        let terms = [0.35875, -0.48829, 0.14128, -0.01168];
        let sum: f64 = terms
            .iter()
            .enumerate()
            .map(|(order, term)| term * (order as f64 * turn).cos())
            .sum();
        sum as f32
    };
    (0..length).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::noise::noise;

    fn add_tone(samples: &mut [Complex32], cycles: f64, amplitude: f32) {
        let mut phasors = vec![Complex32::ZERO; samples.len()];
        fill_phasors(&mut phasors, 0.3, cycles);
        for (sample, phasor) in samples.iter_mut().zip(phasors) {
            *sample += phasor * amplitude;
        }
    }

    #[test]
    fn tones_are_measured_and_removed_and_noise_is_unchanged() {
        let clean: Vec<_> = (1..3).map(|seed| noise(seed, 40_000)).collect();
        let mut canceller = ToneCanceller::new(2);
        canceller.detect(&clean, 0);
        assert!(!canceller.is_needed());
        let tones = [
            (0.0, 10.0_f32),
            (0.1234567, 1.0),
            (-0.3, 0.3),
            (0.004, 30.0),
        ];
        let mut disturbed = clean.clone();
        for samples in &mut disturbed {
            for (cycles, amplitude) in tones {
                add_tone(samples, cycles, amplitude);
            }
        }
        canceller.detect(&disturbed, 0);
        let found: Vec<_> = canceller.tones(1.0).collect();
        assert_eq!(found.len(), tones.len(), "{found:?}");
        for (cycles, amplitude) in tones {
            let of = |tone: &&Tone| (tone.frequency_hz - cycles).abs() < 1e-5;
            let tone = found.iter().find(of).unwrap();
            let expected = 20.0 * f64::from(amplitude).log10();
            // The noise in 2048 × 16 × 2 samples changes the power of the weakest tone, 10 dB below
            // the noise, by 1e-4.
            assert!((tone.power_dbfs - expected).abs() < 0.2, "{tone:?}");
        }
        canceller.subtract(&mut disturbed, 0);
        let left: f32 = disturbed
            .iter()
            .flatten()
            .zip(clean.iter().flatten())
            .map(|(a, b)| (a - b).norm_sqr())
            .sum();
        // Four amplitudes and frequencies per antenna and nine stretches are 72 degrees of freedom
        // of unit noise. Frequencies estimated from a part of the samples add at most as much.
        assert!(left < 4.0 * 72.0, "{left}");
    }

    #[test]
    fn a_tone_in_an_empty_band_is_one_line() {
        let mut samples = noise(9, 32_768);
        fft::forward(32_768).process(&mut samples);
        // Noise in the lower half of the band only.
        samples[..16_384].fill(Complex32::ZERO);
        fft::inverse(32_768).process(&mut samples);
        let mut samples: Vec<_> = samples.iter().map(|x| x / 32_768.0).collect();
        let true_cycles = [0.2123, 0.4761];
        for cycles in true_cycles {
            add_tone(&mut samples, cycles, 3.0);
        }
        let mut canceller = ToneCanceller::new(1);
        canceller.detect(&[&samples[..]], 0);
        let mut found: Vec<_> = canceller.tones(1.0).map(|it| it.frequency_hz).collect();
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), true_cycles.len(), "{found:?}");
        for (found, true_cycles) in found.iter().zip(true_cycles) {
            assert!((found - true_cycles).abs() < 1e-6, "{found} {true_cycles}");
        }
    }

    #[test]
    fn short_silent_and_unusable_samples_have_no_tones() {
        let mut canceller = ToneCanceller::new(1);
        let silence = vec![Complex32::ZERO; 10_000];
        canceller.detect(&[&silence[..]], 0);
        assert!(!canceller.is_needed());
        canceller.detect(&[&silence[..7]], 0);
        let mut corrupted = noise(5, 5000);
        corrupted[100].re = f32::NAN;
        canceller.detect(&[&corrupted[..]], 0);
        assert!(!canceller.is_needed());
        // A frame with the length of one SSB is sufficient for a strong tone.
        let mut short = noise(6, 1100);
        add_tone(&mut short, 0.05, 1.0);
        canceller.detect(&[&short[..]], 0);
        assert_eq!(canceller.tones(1.0).count(), 1);
    }
}
