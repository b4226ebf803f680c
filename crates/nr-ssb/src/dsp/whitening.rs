//! Whitening over the antennas. The signal of a loaded neighbour cell is the same waveform at all
//! antennas, so that its accidental correlation with a PSS occurs at every antenna. After
//! whitening, it occurs at one channel only.

use num_complex::{Complex32, Complex64};

use super::base_rate::SSB_SAMPLES;
use super::received_grid::MAX_ANTENNAS;
use crate::numeric::hermitian::cholesky;

/// Step between the samples that the covariance estimate uses.
const STRIDE: usize = 4;
/// Number of parts of a block. The covariance is estimated in the quietest quarter of the parts.
/// They contain a loaded neighbour cell, but not the SSBs that are searched for. If a strong SSB
/// were whitened too, weaker SSBs below it could not be separated from it.
const PARTS: usize = 64;
/// Squared coherence of two antennas above which whitening is applied. The squared coherence of
/// noise is the inverse of the number of samples.
const COHERENT: f64 = 0.05;

/// Rows of weights, one per whitened channel.
pub(crate) type Weights = [[Complex32; MAX_ANTENNAS]; MAX_ANTENNAS];

/// Returns the inverse of the covariance's Cholesky factor, lower triangular; `None` if the
/// antennas are independent, or an SSB fills most of the block.
pub(crate) fn whitening(antennas: &[&[Complex32]]) -> Option<Weights> {
    let count = antennas.len().min(MAX_ANTENNAS);
    let length = antennas.first()?.len();
    if length < 2 * SSB_SAMPLES {
        return None;
    }
    let part = length / PARTS;
    let energies: [f32; PARTS] = std::array::from_fn(|number| {
        let samples = antennas.iter().flat_map(|it| &it[number * part..][..part]);
        samples.map(Complex32::norm_sqr).sum()
    });
    let mut sorted = energies;
    sorted.sort_unstable_by(f32::total_cmp);
    let is_quiet = |sample: &usize| energies[sample / part] <= sorted[PARTS / 4 - 1];
    let mut covariance = [[Complex64::ZERO; MAX_ANTENNAS]; MAX_ANTENNAS];
    for (i, row) in covariance.iter_mut().enumerate() {
        row[i] = Complex64::ONE;
    }
    let mut coherence: f64 = 0.0;
    for i in 0..count {
        for j in 0..=i {
            let places = (0..PARTS * part).step_by(STRIDE).filter(is_quiet);
            let sum: Complex32 = places.map(|n| antennas[i][n] * antennas[j][n].conj()).sum();
            covariance[i][j] = Complex64::new(f64::from(sum.re), f64::from(sum.im));
        }
        // Keeps the matrix regular if channels are copies of each other.
        covariance[i][i] *= 1.0 + 1e-5;
        for j in 0..i {
            let powers = covariance[i][i].re * covariance[j][j].re;
            coherence = coherence.max(covariance[i][j].norm_sqr() / powers.max(f64::MIN_POSITIVE));
        }
    }
    if coherence < COHERENT {
        return None;
    }
    let factor = cholesky(&covariance)?;
    let mut weights = [[Complex64::ZERO; MAX_ANTENNAS]; MAX_ANTENNAS];
    for i in 0..count {
        for j in 0..=i {
            let known: Complex64 = (j..i).map(|m| factor[i][m] * weights[m][j]).sum();
            let unit = if i == j {
                Complex64::ONE
            } else {
                Complex64::ZERO
            };
            weights[i][j] = (unit - known) * factor[i][i].re;
        }
    }
    let narrow = |it: Complex64| Complex32::new(it.re as f32, it.im as f32);
    let weights = weights.map(|row| row.map(narrow));
    let finite = weights.iter().flatten().all(|it| it.is_finite());
    finite.then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a unit waveform without correlation to those of other seeds.
    fn waveform(seed: u64) -> Vec<Complex32> {
        let mut state = seed;
        (0..4096)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                let turn = (state >> 40) as f32 / 16_777_216.0;
                Complex32::cis(std::f32::consts::TAU * turn)
            })
            .collect()
    }

    #[test]
    fn independent_antennas_are_unchanged_and_correlated_ones_whitened() {
        let noise: Vec<_> = (1..4).map(waveform).collect();
        let slices: Vec<&[Complex32]> = noise.iter().map(Vec::as_slice).collect();
        assert!(whitening(&slices).is_none());
        let common = waveform(9);
        let loaded: Vec<Vec<Complex32>> = noise
            .iter()
            .zip([Complex32::ONE, Complex32::I, Complex32::new(-0.6, 0.8)])
            .map(|(noise, gain)| {
                let both = noise.iter().zip(&common);
                both.map(|(noise, wave)| noise + wave * gain * 10.0)
                    .collect()
            })
            .collect();
        let slices: Vec<&[Complex32]> = loaded.iter().map(Vec::as_slice).collect();
        let weights = whitening(&slices).unwrap();
        let white: Vec<Vec<Complex32>> = (0..3)
            .map(|i| {
                (0..4096)
                    .map(|n| (0..3).map(|j| loaded[j][n] * weights[i][j]).sum())
                    .collect()
            })
            .collect();
        let slices: Vec<&[Complex32]> = white.iter().map(Vec::as_slice).collect();
        assert!(whitening(&slices).is_none());
    }

    #[test]
    fn silent_and_identical_channels_cause_no_failure() {
        let (silence, wave) = (vec![Complex32::ZERO; 4096], waveform(3));
        assert!(whitening(&[&silence, &silence]).is_none());
        let _ = whitening(&[&wave, &silence]);
        let copies = whitening(&[&wave, &wave]).unwrap();
        assert!(copies.iter().flatten().all(|it| it.is_finite()));
    }
}
