//! Estimate of one source from despread pilots.

use num_complex::Complex64;

use super::residual::Residuals;
use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::linalg::hermitians::Hermitians;
use crate::method::maximum_likelihood;
use crate::result::angle::{AngleEstimate, UntestedEstimate};
use crate::result::direction::{Found, Output, describe, threshold_doubt};
use crate::result::goodness_of_fit::{Model, Tested};
use crate::spectrum::side_by_side::Spectra;

/// Returns the maximum likelihood angle from despread pilots.
///
/// A block is a coherent part of the signal (an OFDM symbol). For each antenna, it is the sum of
/// the received samples times the conjugated pilots, divided by the square root of the pilots'
/// energy. The noise variance of a block then equals that of a sample. Blocks are combined
/// non-coherently, so that carrier offset and channel phase between blocks do not matter.
///
/// With `B` blocks and the total SNR `g` after despreading (per antenna, all blocks), the variance
/// is the known-signal bound plus the loss due to the unknown gain of each block: `sigma^2 = (1 + B
/// / (N g)) / (2 g A)`, `A = N (N^2 - 1) / 12`.
///
/// `noise_variance` is per antenna and block; `None` estimates it from the residual. The estimate's
/// `snr_db` is per antenna and block.
///
/// # Errors
/// [`Error::NotPositive`] for an invalid noise variance; errors of [`Covariance::from_snapshots`].
pub fn maximum_likelihood_pilots<const N: usize>(
    blocks: &[[Complex64; N]],
    noise_variance: Option<f64>,
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    pilots(blocks, noise_variance, array)
}

/// Returns the angle of [`maximum_likelihood_pilots`] without the goodness of fit.
///
/// # Errors
/// Errors of [`maximum_likelihood_pilots`].
pub fn maximum_likelihood_pilots_untested<const N: usize>(
    blocks: &[[Complex64; N]],
    noise_variance: Option<f64>,
    array: &Array<N>,
) -> Result<UntestedEstimate, Error> {
    pilots(blocks, noise_variance, array)
}

fn pilots<O: Output, const N: usize>(
    blocks: &[[Complex64; N]],
    noise_variance: Option<f64>,
    array: &Array<N>,
) -> Result<O, Error> {
    let covariance = Covariance::from_snapshots(blocks)?
        .calibrated(array)
        .validated()?;
    let mut single = Hermitians::<N, 1>::ZERO;
    single.set(0, covariance.unscaled());
    let spectrum = Spectra::of_matrices(&single);
    let place = spectrum.maxima::<false>();
    let beam = spectrum.values::<false>(&place)[0] / N as f64;
    let power = spectrum.re[0][0];
    let noise = match noise_variance {
        Some(value) => checked_noise_variance(value)? * covariance.weight(),
        None => maximum_likelihood::residual_power::<N>(power, beam),
    };
    let snr = maximum_likelihood::snr::<N>(beam, noise);
    let tests = Model::one::<N>(blocks.len(), noise_variance.is_some()).tests();
    let needed = tests.needed_snr(bound::resolvable_snr::<N>(blocks.len()));
    let tested = if O::IS_TESTED {
        let left = Residuals::of::<false, N>(&single, &place).item(0);
        tests.of(&left, noise, power)
    } else {
        Tested::NOTHING
    };
    Ok(describe(
        &Found {
            phase_rad: place.phase_rad[0],
            noise_sigma_rad: bound::stochastic::<N>(snr, blocks.len())
                * tests.variance_factor(snr, needed).sqrt(),
            snr,
            tests,
            tested,
            doubt: threshold_doubt(snr, needed).or(tests.noise_doubt()),
        },
        array,
    ))
}

pub(super) fn checked_noise_variance(value: f64) -> Result<f64, Error> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        let name = "noise_variance";
        Err(Error::NotPositive { name, value })
    }
}
