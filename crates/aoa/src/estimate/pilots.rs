//! One source with known pilots: the entry for despread snapshots.

use num_complex::Complex64;

use crate::array::linear::Array;
use crate::bound;
use crate::covariance::sample::Covariance;
use crate::error::Error;
use crate::method::maximum_likelihood;
use crate::result::angle::AngleEstimate;
use crate::result::direction::describe;
use crate::result::verdict::Reason;

/// Maximum likelihood angle from despread pilots.
///
/// A block is one coherent piece of signal (an OFDM symbol): for each antenna the sum of its
/// received samples times the conjugated pilots, divided by the root of the pilots' energy, so that
/// the noise keeps the variance it has per sample. Blocks are summed non-coherently, hence neither
/// carrier offset nor channel phase between blocks matters.
///
/// With `B` blocks and total SNR `g` after despreading (per antenna, all blocks), the standard
/// deviation is the known-signal bound and what the unknown gain of each block costs at finite SNR:
/// `sigma^2 = (1 + B / (N g)) / (2 g A)`, `A = N (N^2 - 1) / 12`.
///
/// `noise_variance` is per antenna and block; `None` estimates it from what does not fit the source.
/// The estimate's `snr_db` is per antenna and block.
///
/// # Errors
/// [`Error::NotPositive`] for a bad noise variance and those of [`Covariance::from_snapshots`].
pub fn maximum_likelihood_pilots<const N: usize>(
    blocks: &[[Complex64; N]],
    noise_variance: Option<f64>,
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    let covariance = Covariance::from_snapshots(blocks)?
        .calibrated(array)
        .validated()?;
    let spectrum = covariance.spectrum();
    let (phase_rad, value) = spectrum.maximum();
    let beam = value / N as f64;
    let noise = match noise_variance {
        Some(value) => checked_noise_variance(value)? * covariance.weight(),
        None => maximum_likelihood::residual_power::<N>(spectrum.lags[0].re, beam),
    };
    let snr = maximum_likelihood::snr::<N>(beam, noise);
    let threshold = snr < bound::resolvable_snr::<N>(blocks.len());
    let sigma = bound::stochastic::<N>(snr, blocks.len());
    Ok(describe(
        phase_rad,
        sigma,
        snr,
        threshold.then_some(Reason::ThresholdSnr),
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
