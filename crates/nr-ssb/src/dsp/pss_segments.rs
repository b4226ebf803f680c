//! PSS detection anywhere in a band, at any frequency.
//!
//! The three PSS are cyclic shifts of one m-sequence. Cut at the shifts, it has three segments of
//! about 43 subcarriers, and each PSS contains all of them in another order. A segment is therefore
//! correlated once at every subcarrier of the band, at a third of the PSS's rate. The powers of
//! three segments are added for each PSS at each frequency. The inverse transforms have nine times
//! fewer samples than those of a matched filter for each PSS. (Adding powers instead of amplitudes
//! loses 0.8 dB.)
//!
//! Frequencies halfway between subcarriers, and lags halfway between samples, are the sums of their
//! neighbours divided by √2, like the lags of the [matched filter](super::matched_filter). At the
//! maximum distance of a quarter, the loss is 0.9 dB in frequency and 0.7 dB in time.
//!
//! Each power is normalised by the energy under the window in the 48 subcarriers around the
//! segment, and is exponentially distributed with mean one in noise. The energy is measured at the
//! frequency of each correlation, because next to an empty band (a resampled recording) one
//! subcarrier more or fewer changes it by orders of magnitude.

use std::f64::consts::PI;
use std::sync::Arc;

use num_complex::{Complex32, Complex64};

use super::base_rate::SYMBOL_FFT;
use crate::numeric::fft::{self, Fft};
use crate::numeric::phasors::fill_phasors;
use crate::standard::sequence::pss::{SYNC_LEN, pss};

/// Length of an overlap-save transform, at the base rate.
const BLOCK: usize = 2048;
const BINS_PER_SUBCARRIER: usize = BLOCK / SYMBOL_FFT;
/// Number of lags per block, at the base rate.
pub(crate) const HOP: usize = BLOCK - SYMBOL_FFT;
/// Number of subcarriers around a segment in an inverse transform.
const WIDTH: usize = 48;
const NARROW: usize = WIDTH * BINS_PER_SUBCARRIER;
/// Samples at the base rate per sample of the inverse transform.
const STEP: f64 = BLOCK as f64 / NARROW as f64;
/// Number of lags per block, in samples of the inverse transform.
const LAGS: usize = HOP * NARROW / BLOCK;
/// Even and odd lags on a subcarrier, followed by those half a subcarrier above.
const PLANE: usize = 4 * LAGS;
/// First chip of each segment.
const SEGMENTS: [usize; 3] = [0, 43, 86];
/// Central subcarrier of a segment.
const MIDDLE: isize = 21;
/// Number of subcarriers from the first subcarrier of a PSS to its centre.
const TO_CENTRE: isize = 64;
/// Number of subcarriers from the first subcarrier of a PSS to its last segment.
const TO_LAST: isize = 86;
/// Number of segment positions of a PSS, plus one that is being filled.
const RING: usize = TO_LAST as usize + 2;
/// Number of samples on either side of the window into which most of a segment leaks. A segment
/// leaks because it is limited to 48 subcarriers.
const NEIGHBOURS: usize = 3;
/// Leakage factor: 48 times 0.6 %, the maximum fraction of the energy that leaks into the
/// neighbouring samples. The energy of the window is increased by this fraction of the neighbouring
/// energy. A strong signal next to a silent window then has a statistic of at most one.
const LEAK: f32 = 0.29;
/// Leakage factor beyond that distance (7e-5 of a segment's energy), applied to the energy of the
/// whole block.
const FAR_LEAK: f32 = 1.2e-5;

/// Maximum number of segment positions in a tile: 192 positions of 43 subcarriers are within the
/// 240 of the front end.
const TILE_POSITIONS: usize = 192;

/// First subcarriers of the segments that are visible with one tuning of the front end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tile {
    /// Subcarrier at 0 Hz.
    pub(crate) centre: isize,
    first: isize,
    positions: usize,
}

/// Returns tiles that contain all PSS with a centre up to `reach` subcarriers from that of the
/// band.
pub(crate) fn tiles(reach: usize) -> Vec<Tile> {
    let all = 2 * reach + TO_LAST as usize + 1;
    let count = all.div_ceil(TILE_POSITIONS);
    let mut first = -(reach as isize) - TO_CENTRE;
    (0..count)
        .map(|number| {
            let positions = (number + 1) * all / count - number * all / count;
            let tile = Tile {
                centre: first + (positions / 2) as isize + MIDDLE,
                first,
                positions,
            };
            first += positions as isize;
            tile
        })
        .collect()
}

/// Maximum of the statistic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SegmentMaximum {
    pub(crate) statistic: f32,
    /// Start of the PSS without its cyclic prefix, in samples at the base rate.
    pub(crate) sample: f64,
    /// Subcarriers from the centre of the band to that of the PSS.
    pub(crate) subcarriers: f64,
}

/// Number of evaluations per lag at the base rate and subcarrier.
pub(crate) const TRIALS: f64 = 3.0 * 4.0 / STEP;

/// PSS detector of the module documentation. It owns its FFT plans and buffers.
pub(crate) struct SegmentFilter {
    forward: Arc<dyn Fft<f32>>,
    inverse: Arc<dyn Fft<f32>>,
    /// Conjugated spectrum of each segment, with its centre at 0 Hz.
    replicas: [Vec<Complex32>; 3],
    /// Phasors that align the correlation of the next subcarrier with that of the current one, for
    /// the sum halfway between both.
    half_turns: Vec<Complex32>,
    block: Vec<Complex32>,
    scratch: Vec<Complex32>,
    /// Spectrum of each antenna's block, lowest frequency first.
    spectra: Vec<Vec<Complex32>>,
    /// 48 divided by the energy under the window at the previous subcarrier, for each antenna.
    last_inverse_energy: Vec<[f32; LAGS]>,
    /// 48 divided by the energy under the window at the current subcarrier.
    inverse_energy: [f32; LAGS],
    /// 48 divided by the energy under the window halfway between the previous and the current
    /// subcarrier.
    inverse_energy_between: [f32; LAGS],
    /// Correlation at the previous subcarrier, for each antenna and segment.
    last: Vec<[Vec<Complex32>; 3]>,
    /// Correlation at the current subcarrier.
    here: Vec<Complex32>,
    /// Summed powers for each position (modulo the ring) and segment.
    planes: Vec<[[f32; PLANE]; 3]>,
}

impl SegmentFilter {
    pub(crate) fn new(antennas: usize) -> Self {
        let forward = fft::forward(BLOCK);
        let inverse = fft::inverse(NARROW);
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        let mut half_turns = vec![Complex32::ZERO; NARROW];
        // Half a turn at the centre of the window, and one turn per symbol.
        fill_phasors(&mut half_turns, 0.5, 1.0 / WIDTH as f64);
        let narrow = vec![Complex32::ZERO; NARROW];
        Self {
            forward,
            inverse,
            replicas: [0, 1, 2].map(replica),
            half_turns,
            block: vec![Complex32::ZERO; BLOCK],
            scratch: vec![Complex32::ZERO; scratch],
            spectra: vec![vec![Complex32::ZERO; BLOCK]; antennas],
            last_inverse_energy: vec![[0.0; LAGS]; antennas],
            inverse_energy: [0.0; LAGS],
            inverse_energy_between: [0.0; LAGS],
            last: vec![std::array::from_fn(|_| narrow.clone()); antennas],
            here: narrow,
            planes: vec![[[0.0; PLANE]; 3]; RING],
        }
    }

    /// Appends the maxima above `threshold` of PSS that begin in `first..end`, in samples at the
    /// base rate. `bases` contains the samples of the antennas for each tile.
    pub(crate) fn run(
        &mut self,
        tiles: &[Tile],
        bases: &[Vec<Vec<Complex32>>],
        (first, end): (usize, usize),
        threshold: f32,
        maxima: &mut Vec<SegmentMaximum>,
    ) {
        let mut start = first;
        while start < end {
            let lags = HOP.min(end - start);
            self.run_block(tiles, bases, (start, lags), threshold, maxima);
            start += lags;
        }
    }

    fn run_block(
        &mut self,
        tiles: &[Tile],
        bases: &[Vec<Vec<Complex32>>],
        (start, lags): (usize, usize),
        threshold: f32,
        maxima: &mut Vec<SegmentMaximum>,
    ) {
        let Some(origin) = tiles.first().map(|tile| tile.first) else {
            return;
        };
        let narrow_lags = ((lags as f64 / STEP).ceil() as usize).min(LAGS);
        for (tile, antennas) in tiles.iter().zip(bases) {
            for (antenna, samples) in antennas.iter().enumerate() {
                self.load(antenna, samples.get(start..).unwrap_or_default());
            }
            // Compute one additional position, for the frequency halfway to it.
            for number in 0..=tile.positions {
                let position = tile.first + number as isize;
                self.correlate(tile, position, number);
                // All segments of the PSS that ends at the previous position are available.
                let centre = position - 1 - (TO_LAST - TO_CENTRE);
                if number > 0 && position - 1 - origin >= TO_LAST {
                    self.collect(centre, (start, narrow_lags), threshold, maxima);
                }
            }
        }
    }

    /// Computes the spectrum of the block that begins with `samples`.
    fn load(&mut self, antenna: usize, samples: &[Complex32]) {
        let length = samples.len().min(BLOCK);
        self.block[..length].copy_from_slice(&samples[..length]);
        self.block[length..].fill(Complex32::ZERO);
        self.forward
            .process_with_scratch(&mut self.block, &mut self.scratch);
        let (negative, positive) = self.spectra[antenna].split_at_mut(BLOCK / 2);
        positive.copy_from_slice(&self.block[..BLOCK / 2]);
        negative.copy_from_slice(&self.block[BLOCK / 2..]);
    }

    /// Computes the energy under the window at the subcarrier with this bin, and halfway to the
    /// previous one.
    fn measure(&mut self, antenna: usize, centre: usize) {
        let bins = &self.spectra[antenna][centre - NARROW / 2..][..NARROW];
        let (negative, positive) = bins.split_at(NARROW / 2);
        let (low, high) = self.here.split_at_mut(NARROW / 2);
        low.copy_from_slice(positive);
        high.copy_from_slice(negative);
        self.inverse
            .process_with_scratch(&mut self.here, &mut self.scratch);
        let powers: [f32; NARROW] = std::array::from_fn(|n| self.here[n].norm_sqr());
        let far = FAR_LEAK * powers.iter().sum::<f32>();
        let mut energy: f64 = powers[..WIDTH].iter().map(|it| f64::from(*it)).sum();
        for (n, slot) in self.inverse_energy.iter_mut().enumerate() {
            let neighbours: f32 = (0..NEIGHBOURS)
                .map(|i| powers[(n + NARROW - 1 - i) % NARROW] + powers[(n + WIDTH + i) % NARROW])
                .sum();
            let all = energy as f32 + LEAK * neighbours;
            // Converts the sum over samples of the inverse transform to samples at the base rate.
            let scale = WIDTH as f32 / STEP as f32;
            *slot = if all > far.max(f32::MIN_POSITIVE) {
                scale / all
            } else {
                0.0
            };
            energy += f64::from(powers[n + WIDTH]) - f64::from(powers[n]);
        }
        // Inverse of the mean energy.
        let both = self.inverse_energy.iter();
        let both = both.zip(&mut self.last_inverse_energy[antenna]);
        for (slot, (here, last)) in self.inverse_energy_between.iter_mut().zip(both) {
            let product = here * *last;
            *slot = if product > 0.0 {
                2.0 * product / (here + *last)
            } else {
                0.0
            };
            *last = *here;
        }
    }

    /// Computes the powers of the segments at a position, and half a subcarrier above the previous
    /// one.
    fn correlate(&mut self, tile: &Tile, position: isize, number: usize) {
        let Some(centre) = bin(tile, position) else {
            return;
        };
        let slot = position.rem_euclid(RING as isize) as usize;
        let slot_before = (position - 1).rem_euclid(RING as isize) as usize;
        for antenna in 0..self.spectra.len() {
            self.measure(antenna, centre);
            let bins = &self.spectra[antenna][centre - NARROW / 2..][..NARROW];
            for segment in 0..3 {
                let (negative, positive) = bins.split_at(NARROW / 2);
                let (low, high) = self.here.split_at_mut(NARROW / 2);
                let (below, above) = self.replicas[segment].split_at(NARROW / 2);
                multiply(low, positive, above);
                multiply(high, negative, below);
                self.inverse
                    .process_with_scratch(&mut self.here, &mut self.scratch);
                let last = &mut self.last[antenna][segment];
                let fresh = antenna == 0;
                if number < tile.positions {
                    let plane = &mut self.planes[slot][segment][..2 * LAGS];
                    add_powers(plane, &self.here, &self.inverse_energy, fresh);
                }
                if number > 0 {
                    for ((a, b), turn) in last.iter_mut().zip(&self.here).zip(&self.half_turns) {
                        *a = (*a + b * turn) * std::f32::consts::FRAC_1_SQRT_2;
                    }
                    let plane = &mut self.planes[slot_before][segment][2 * LAGS..];
                    add_powers(plane, last, &self.inverse_energy_between, fresh);
                }
                last.copy_from_slice(&self.here);
            }
        }
    }

    /// Collects the maxima of the three PSS with a centre on this subcarrier or half a subcarrier
    /// above.
    fn collect(
        &self,
        centre: isize,
        (start, lags): (usize, usize),
        threshold: f32,
        maxima: &mut Vec<SegmentMaximum>,
    ) {
        for n_id_2 in 0..3 {
            let plane = |segment: usize| {
                let first_chip = SEGMENTS[segment] + SYNC_LEN;
                let after = ((first_chip - 43 * n_id_2) % SYNC_LEN) as isize;
                let position = centre - TO_CENTRE + after;
                &self.planes[position.rem_euclid(RING as isize) as usize][segment]
            };
            let (a, b, c) = (plane(0), plane(1), plane(2));
            let mut most = [0.0_f32; 8];
            for at in (0..PLANE).step_by(8) {
                for lane in 0..8 {
                    let sum = a[at + lane] + b[at + lane] + c[at + lane];
                    most[lane] = if sum > most[lane] { sum } else { most[lane] };
                }
            }
            if most.iter().all(|it| *it < threshold) {
                continue;
            }
            for at in 0..PLANE {
                let (quarter, lag) = (at / LAGS, at % LAGS);
                let statistic = a[at] + b[at] + c[at];
                if statistic < threshold || lag >= lags {
                    continue;
                }
                let maximum = SegmentMaximum {
                    statistic,
                    sample: start as f64 + (lag as f64 + 0.5 * (quarter % 2) as f64) * STEP,
                    subcarriers: centre as f64 + 0.5 * (quarter / 2) as f64,
                };
                let near = maxima.iter_mut().rev().take(64).find(|other| {
                    (other.sample - maximum.sample).abs() < 3.0 * STEP
                        && (other.subcarriers - maximum.subcarriers).abs() < 2.0
                });
                match near {
                    Some(other) if other.statistic >= statistic => {}
                    Some(other) => *other = maximum,
                    None => maxima.push(maximum),
                }
            }
        }
    }
}

/// Returns the bin of the centre of the segment at a position, in a spectrum in ascending order of
/// frequency; `None` if its 48 subcarriers are not within the spectrum.
fn bin(tile: &Tile, position: isize) -> Option<usize> {
    let off = (position + MIDDLE - tile.centre) * BINS_PER_SUBCARRIER as isize;
    let centre = (BLOCK / 2).checked_add_signed(off)?;
    (centre >= NARROW / 2 && centre + NARROW / 2 <= BLOCK).then_some(centre)
}

/// Returns the conjugated spectrum of a segment with the duration of a symbol, in ascending order
/// of frequency.
fn replica(segment: usize) -> Vec<Complex32> {
    let end = SEGMENTS.get(segment + 1).copied().unwrap_or(SYNC_LEN);
    let chips = &pss(0)[SEGMENTS[segment]..end];
    // Unit energy in 256 samples, and the scale of the transforms relative to that of the energy.
    let scale = (SYMBOL_FFT as f64 / chips.len() as f64).sqrt();
    (0..NARROW)
        .map(|bin| {
            let at = (bin as f64 - (NARROW / 2) as f64) / BINS_PER_SUBCARRIER as f64;
            let sum: Complex64 = chips
                .iter()
                .enumerate()
                .map(|(i, chip)| {
                    let off = PI * (i as f64 - MIDDLE as f64 - at);
                    let sinc = if off.abs() < 1e-9 {
                        1.0
                    } else {
                        off.sin() / off
                    };
                    Complex64::cis(off) * sinc * f64::from(*chip)
                })
                .sum();
            let conjugated = sum.conj() * scale;
            Complex32::new(conjugated.re as f32, conjugated.im as f32)
        })
        .collect()
}

/// Computes the elementwise product.
fn multiply(product: &mut [Complex32], a: &[Complex32], b: &[Complex32]) {
    for ((slot, a), b) in product.iter_mut().zip(a).zip(b) {
        *slot = Complex32::new(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re);
    }
}

/// Adds the powers of a correlation at even and odd lags; with `fresh`, the plane is overwritten.
fn add_powers(plane: &mut [f32], correlation: &[Complex32], energy: &[f32; LAGS], fresh: bool) {
    let (even, odd) = plane.split_at_mut(LAGS);
    let (here, next) = (&correlation[..LAGS], &correlation[1..=LAGS]);
    let kept = if fresh { 0.0 } else { 1.0 };
    for i in 0..LAGS {
        let (a, b, scale) = (here[i], next[i], energy[i]);
        let (re, im) = (a.re + b.re, a.im + b.im);
        even[i] = even[i] * kept + (a.re * a.re + a.im * a.im) * scale;
        odd[i] = odd[i] * kept + (re * re + im * im) * (0.5 * scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dsp::pss_symbol::pss_symbol;

    /// Detects each PSS at its position, in noise 10 dB below it, anywhere in the tiles.
    #[test]
    fn a_pss_is_detected_at_its_position() {
        let mut filter = SegmentFilter::new(1);
        let mut state = 1_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / 16_777_216.0 - 0.5
        };
        let tiles = tiles(150);
        assert!(tiles.len() > 1);
        for (n_id_2, at, subcarriers) in [
            (0, 700, 0.0),
            (1, 1803, 20.0),
            (2, 2900, -149.5),
            (0, 450, 33.25),
            (1, 1000, 75.75),
            (2, 3217, 149.0),
            (2, 64, -61.5),
        ] {
            let symbol = pss_symbol(n_id_2);
            let noise: Vec<Complex32> = (0..6000)
                .map(|_| Complex32::new(uniform(), uniform()) * 0.03)
                .collect();
            let bases: Vec<Vec<Vec<Complex32>>> = tiles
                .iter()
                .map(|tile| {
                    let off = subcarriers - tile.centre as f64;
                    let mut samples = noise.clone();
                    // Limit of the front end's band.
                    if off.abs() < 183.0 {
                        for (n, chip) in symbol.iter().enumerate() {
                            let turn = 2.0 * PI * off * (at + n) as f64 / 256.0;
                            let phasor = Complex64::cis(turn);
                            samples[at + n] +=
                                chip * Complex32::new(phasor.re as f32, phasor.im as f32);
                        }
                    }
                    vec![samples]
                })
                .collect();
            let mut maxima = Vec::new();
            filter.run(&tiles, &bases, (0, 5000), 20.0, &mut maxima);
            let best = maxima
                .iter()
                .max_by(|a, b| a.statistic.total_cmp(&b.statistic));
            let best = best.unwrap();
            assert!((best.sample - at as f64).abs() < 3.0, "{best:?}");
            assert!((best.subcarriers - subcarriers).abs() < 0.5, "{best:?}");
            assert!(best.statistic > 60.0, "{best:?}");
        }
    }
    /// At the edge of an empty band, where the power decreases by 70 dB within a subcarrier, the
    /// statistic is distributed as in noise: the sum of three powers of mean one exceeds 40 with a
    /// probability of 4e-15.
    #[test]
    fn the_edge_of_an_empty_band_gives_no_pss_detection() {
        let (forward, inverse) = (fft::forward(8192), fft::inverse(8192));
        let tiles = tiles(60);
        let mut filter = SegmentFilter::new(1);
        for edge in [-40_isize, 7, 33] {
            let mut samples = crate::numeric::noise::noise(7, 8192);
            forward.process(&mut samples);
            for (bin, value) in samples.iter_mut().enumerate() {
                let signed = (bin as isize + 4096) % 8192 - 4096;
                *value *= if signed < edge * 32 { 3e-4 } else { 1.0 } / 8192.0;
            }
            inverse.process(&mut samples);
            let bases: Vec<_> = tiles
                .iter()
                .map(|tile| {
                    let turn = |n: usize| -2.0 * PI * tile.centre as f64 * n as f64 / 256.0;
                    let shifted = samples.iter().enumerate().map(|(n, x)| {
                        let phasor = Complex64::cis(turn(n));
                        x * Complex32::new(phasor.re as f32, phasor.im as f32)
                    });
                    vec![shifted.collect()]
                })
                .collect();
            let mut maxima = Vec::new();
            filter.run(&tiles, &bases, (0, 7000), 10.0, &mut maxima);
            assert!(!maxima.is_empty());
            let most = maxima.iter().map(|it| it.statistic).fold(0.0, f32::max);
            assert!(most < 40.0, "{edge}: {most}");
        }
    }
}
