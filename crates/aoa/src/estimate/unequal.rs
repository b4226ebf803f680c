//! Estimate of one source from despread pilots with a different noise variance per channel.

use num_complex::Complex64;

use super::residual;
use crate::array::linear::Array;
use crate::array::steering::steering_vector;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::result::angle::AngleEstimate;
use crate::result::direction::{Found, describe, threshold_doubt};
use crate::result::goodness_of_fit::Model;
use crate::result::verdict::Reason;
use crate::spectrum::polynomial::Spectrum;

/// Number of directions at which the pattern of the weighted array is evaluated.
const DIRECTIONS: usize = 64;
/// Maximum relative side lobe power. Above it, a direction is ambiguous.
const MAX_SIDE_LOBE: f64 = 0.98;

/// Estimates the angle like [`maximum_likelihood_pilots`](crate::maximum_likelihood_pilots), but
/// for different noise variances of the antennas: `noise_variances[n]` per block and antenna `n`,
/// as received; infinite for a dead channel.
///
/// With the weights `w_n = |gain_n|^2 / sigma_n^2`, the estimate maximises `sum_b |sum_n w_n a_n*
/// x_nb|^2`. The variance is that of [`bound::known_signal_unequal`] plus, as with equal noise, the
/// loss due to the unknown gain of each block. The verdict accounts for the side lobes of a thinned
/// array.
///
/// # Errors
/// [`Error::NotPositive`] for an invalid noise variance; [`Error::DeadChannels`] if fewer than two
/// channels have a finite noise variance; errors of [`Covariance::from_snapshots`].
pub fn maximum_likelihood_pilots_unequal<const N: usize>(
    blocks: &[[Complex64; N]],
    noise_variances: &[f64; N],
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    if let Some(&value) = noise_variances.iter().find(|it| it.is_nan() || **it <= 0.0) {
        let name = "noise_variances";
        return Err(Error::NotPositive { name, value });
    }
    let gains = array.calibration().gains();
    let weights: [f64; N] = std::array::from_fn(|n| gains[n].norm_sqr() / noise_variances[n]);
    let living = weights.iter().filter(|weight| **weight > 0.0).count();
    if living < 2 {
        return Err(Error::DeadChannels { living });
    }
    let mut covariance = Covariance::new();
    for block in blocks {
        // Set the samples of dead channels to zero, because they may be NaN.
        let live = |n| {
            if weights[n] > 0.0 {
                block[n]
            } else {
                Complex64::ZERO
            }
        };
        covariance.accumulate(&std::array::from_fn(live), 1.0);
    }
    let covariance = covariance.validated()?.calibrated(array);
    let mut weighted = *covariance.unscaled();
    for (row, a) in weighted.iter_mut().zip(weights) {
        for (entry, b) in row.iter_mut().zip(weights) {
            *entry *= a * b;
        }
    }
    let (phase_rad, value) = Spectrum::of_matrix(&weighted).maximum();
    let total: f64 = weights.iter().sum();
    let count = blocks.len();
    let per_block = value / (total * count as f64);
    let snr = ((per_block - 1.0) / N as f64).max(1e-9);
    // SNR of each antenna over all blocks.
    let snrs = weights.map(|weight| snr * (N * count) as f64 * weight / total);
    let lost = 1.0 + 1.0 / (N as f64 * snr);
    let sigma = bound::known_signal_unequal(&snrs) * lost.sqrt();
    let side_lobe = strongest_side_lobe(&weights);
    let doubt = if side_lobe > MAX_SIDE_LOBE {
        Some(Reason::Ambiguous)
    } else {
        threshold_doubt(snr, bound::resolvable_snr::<N>(count) / (1.0 - side_lobe))
    };
    // Whiten to unit noise variance in the channels with a finite noise variance.
    let whitening = weights.map(f64::sqrt);
    let mut white = *covariance.unscaled();
    for (row, a) in white.iter_mut().zip(whitening) {
        for (entry, b) in row.iter_mut().zip(whitening) {
            *entry *= a * b;
        }
    }
    let steering = steering_vector::<N>(phase_rad);
    let response = std::array::from_fn(|n| steering[n] * whitening[n]);
    let centre = (0..N).map(|n| n as f64 * weights[n]).sum::<f64>() / total;
    let tangent = std::array::from_fn(|n| response[n] * Complex64::new(0.0, n as f64 - centre));
    let left = residual::of_response(&white, &response, &[tangent]);
    let model = Model {
        antennas: living as u8,
        ..Model::one::<N>(count, true)
    };
    let tests = model.tests();
    let noise = count as f64;
    Ok(describe(
        &Found {
            phase_rad,
            noise_sigma_rad: sigma,
            snr,
            tests,
            tested: tests.of(&left, noise, value / total),
            doubt,
        },
        array,
    ))
}

/// Returns the largest power of the weighted array's pattern outside its main lobe, relative to the
/// maximum.
fn strongest_side_lobe<const N: usize>(weights: &[f64; N]) -> f64 {
    let total: f64 = weights.iter().sum();
    let turn = Complex64::cis(std::f64::consts::PI / DIRECTIONS as f64);
    let mut step = Complex64::ONE;
    let mut next_power = || {
        step *= turn;
        // Horner's scheme for sum_n w_n step^n.
        let horner = |sum: Complex64, weight: &f64| sum * step + weight;
        let sum = weights.iter().rev().fold(Complex64::ZERO, horner);
        sum.norm_sqr() / (total * total)
    };
    let mut last = 1.0;
    let mut worst: Option<f64> = None;
    for _ in 0..DIRECTIONS {
        let here = next_power();
        // Skip the main lobe, then take the maximum.
        if let Some(worst) = &mut worst {
            *worst = worst.max(here);
        } else if here > last {
            worst = Some(here);
        }
        last = here;
    }
    worst.unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn side_lobes_equal_textbook_values() {
        // Four equal elements have a first side lobe of -11.3 dB; with every second element
        // missing, the side lobe equals the main lobe.
        let uniform = strongest_side_lobe(&[1.0; 4]);
        assert!((10.0 * uniform.log10() + 11.3).abs() < 0.2, "{uniform}");
        assert!(strongest_side_lobe(&[1.0, 0.0, 1.0, 0.0]) > MAX_SIDE_LOBE);
        assert!(strongest_side_lobe(&[1.0, 1.0, 0.0, 1.0]) < 0.7);
    }
}
