//! Cramér–Rao bounds: the minimum standard deviation of an unbiased estimator.
//!
//! All bounds are for white noise. SNRs are linear, per antenna and snapshot. Most functions bound
//! the electrical angle; [`angle_sigma_rad`] converts to the angle.

use num_complex::Complex64;

use crate::array::linear::Array;
use crate::array::manifold::{Direction, Manifold, Neighbourhood};
use crate::array::steering::{aperture, steering_vector};
use crate::error::Error;
use crate::linalg::dense::{adjoint, inverse, product};
use crate::linalg::matrix::{Matrix, zeros};
use crate::list::List;

/// Returns the bound for one Gaussian source of unknown power: standard deviation of the electrical
/// angle in rad, `sqrt((1 + 1 / (N snr)) / (2 L snr A))` with `A = N (N^2 - 1) / 12` (Stoica and
/// Nehorai 1990, stochastic bound). Maximum likelihood, MUSIC and Root-MUSIC attain it.
pub fn stochastic<const N: usize>(snr: f64, snapshots: usize) -> f64 {
    ((1.0 + 1.0 / (N as f64 * snr)) / (2.0 * snapshots as f64 * snr * aperture::<N>())).sqrt()
}

/// Returns the bound for one source with an unknown deterministic waveform: `sqrt(1 / (2 L snr A))`
/// in rad (Stoica and Nehorai 1989, deterministic bound). Below about 0 dB and with few snapshots,
/// no estimator attains it.
pub fn deterministic<const N: usize>(snr: f64, snapshots: usize) -> f64 {
    (2.0 * snapshots as f64 * snr * aperture::<N>())
        .sqrt()
        .recip()
}

/// Returns the bound for one source whose waveform is known up to a complex gain (pilots): `sqrt(1
/// / (2 SNR A))` in rad. `total_snr` is the sum over all known samples, i.e. the SNR per antenna
/// after despreading.
pub fn known_signal<const N: usize>(total_snr: f64) -> f64 {
    (2.0 * total_snr * aperture::<N>()).sqrt().recip()
}

/// Returns the bound of [`known_signal`] for a different SNR `g_n` at each antenna (0 for a dead
/// channel): `sqrt(1 / (2 A))` in rad with `A = sum g_n n^2 - (sum g_n n)^2 / sum g_n`.
pub fn known_signal_unequal<const N: usize>(total_snrs: &[f64; N]) -> f64 {
    let moment = |power: i32| -> f64 {
        let terms = total_snrs.iter().enumerate();
        terms.map(|(n, snr)| snr * (n as f64).powi(power)).sum()
    };
    let aperture = moment(2) - moment(1).powi(2) / moment(0);
    (2.0 * aperture).sqrt().recip()
}

/// Converts a bound on the electrical angle to a bound on the angle: `sigma_theta = sigma_omega /
/// (2 pi (d / lambda) sin(theta))`. The result diverges at end-fire.
pub fn angle_sigma_rad<const N: usize>(
    phase_sigma_rad: f64,
    angle_rad: f64,
    array: &Array<N>,
) -> f64 {
    phase_sigma_rad / (array.phase_at_end_fire_rad() * angle_rad.sin())
}

/// Returns the bound for one Gaussian source of unknown power and any array: covariance of
/// (azimuth, elevation) in rad^2. It is the inverse of `2 L q^2 / (1 + q) Re(D^H P D) / a^H a`
/// (Stoica and Nehorai 1990). `D` are the derivatives of the response `a`, `P` projects onto its
/// complement, and `q` = N snr with the mean SNR over the antennas. The bound is infinite where the
/// response is stationary, for example in elevation at the horizon of a horizontal array.
pub fn azimuth_elevation<M: Manifold<N> + ?Sized, const N: usize>(
    manifold: &M,
    direction: Direction,
    snr: f64,
    snapshots: usize,
) -> [[f64; 2]; 2] {
    let around = Neighbourhood::of(manifold, direction);
    covariance_around(&around, direction, snr, snapshots, true)
}

/// Returns the bound of [`azimuth_elevation`], or the variance of the azimuth only if the elevation
/// is known.
pub(crate) fn covariance_around<const N: usize>(
    around: &Neighbourhood<N>,
    direction: Direction,
    snr: f64,
    snapshots: usize,
    elevation_too: bool,
) -> [[f64; 2]; 2] {
    let ratio = N as f64 * snr;
    let factor = 2.0 * snapshots as f64 * ratio * ratio / ((1.0 + ratio) * around.power);
    let [[a, b], [_, c]] = around.metric.map(|row| row.map(|it| it * factor));
    // Convert from the great circle to the azimuth.
    let stretch = direction.elevation_rad.cos().recip();
    if !elevation_too {
        return [[stretch * stretch / a, 0.0], [0.0, 0.0]];
    }
    let determinant = a * c - b * b;
    if determinant <= 1e-12 * a * c || determinant.is_nan() {
        return [[stretch * stretch / a, 0.0], [0.0, f64::INFINITY]];
    }
    let cross = -b / determinant * stretch;
    [
        [c / determinant * stretch * stretch, cross],
        [cross, a / determinant],
    ]
}

/// Returns the SNR per antenna and snapshot below which an estimate is unresolved.
///
/// Below this SNR, the noise in one of the N - 1 directions orthogonal to the source may exceed the
/// source with a probability above 1 %. Estimators then deviate from the Cramér–Rao bound
/// (threshold region). The Chernoff bound of this probability is `(N - 1) (4 r / (1 + r)^2)^L`,
/// where `r = 1 + N snr` is the ratio of the mean powers.
pub fn resolvable_snr<const N: usize>(snapshots: usize) -> f64 {
    const OUTLIERS: f64 = 0.01;
    // Solve 4 r / (1 + r)^2 = q for the root above 1.
    let q = (OUTLIERS / (N - 1) as f64).powf(1.0 / snapshots as f64);
    let ratio = (2.0 - q + 2.0 * (1.0 - q).sqrt()) / q;
    (ratio - 1.0) / N as f64
}

/// Returns the bounds for several uncorrelated Gaussian sources: the standard deviation of each
/// electrical angle in rad, from `C^-1 = 2 L Re[(D^H P D) * (S A^H R^-1 A S)^T]` (Stoica and
/// Nehorai 1990). `P` projects onto the complement of the steering vectors `A`, `D` are their
/// derivatives, and `S` is the diagonal matrix of the SNRs.
///
/// # Errors
/// [`Error::TooManySources`] for none or more than N - 1, [`Error::NotPositive`] for an SNR or
/// snapshot count that is not positive, [`Error::Singular`] for coinciding angles.
pub fn stochastic_several<const N: usize>(
    phases_rad: &[f64],
    snrs: &[f64],
    snapshots: usize,
) -> Result<List<f64, N>, Error> {
    let powers = checked_powers::<N>(phases_rad, snrs, snapshots)?;
    stochastic_of(phases_rad, &powers, 1.0, snapshots)
}

/// Returns the bounds for several uncorrelated sources with unknown deterministic waveforms, in
/// rad: [`stochastic_several`] with `S` in place of `S A^H R^-1 A S` (Stoica and Nehorai 1989).
///
/// # Errors
/// See [`stochastic_several`].
pub fn deterministic_several<const N: usize>(
    phases_rad: &[f64],
    snrs: &[f64],
    snapshots: usize,
) -> Result<List<f64, N>, Error> {
    let powers = checked_powers::<N>(phases_rad, snrs, snapshots)?;
    from_information(phases_rad, &powers, 1.0, snapshots)
}

/// Returns the bounds for several uncorrelated sources whose waveforms are known up to complex
/// gains, in rad. Each source has the bound of a single source, [`known_signal`] with `snapshots`
/// times its SNR (Li and Compton 1993).
///
/// # Errors
/// See [`stochastic_several`]. Coinciding angles are allowed, because known waveforms separate the
/// sources.
pub fn known_signal_several<const N: usize>(
    phases_rad: &[f64],
    snrs: &[f64],
    snapshots: usize,
) -> Result<List<f64, N>, Error> {
    checked_powers::<N>(phases_rad, snrs, snapshots)?;
    let total = snrs
        .iter()
        .map(|snr| known_signal::<N>(snr * snapshots as f64));
    Ok(List::collect(0.0, total))
}

fn checked_powers<const N: usize>(
    phases_rad: &[f64],
    snrs: &[f64],
    snapshots: usize,
) -> Result<Matrix<N>, Error> {
    let sources = phases_rad.len();
    if sources == 0 || sources >= N || snrs.len() != sources {
        return Err(Error::TooManySources {
            requested: sources.max(snrs.len()),
            maximum: N - 1,
        });
    }
    if snapshots == 0 {
        return Err(Error::NoSnapshots);
    }
    if phases_rad.iter().any(|phase| !phase.is_finite()) {
        return Err(Error::NotFinite);
    }
    let mut powers = zeros::<N>();
    for (i, &snr) in snrs.iter().enumerate() {
        if !(snr.is_finite() && snr > 0.0) {
            return Err(Error::NotPositive {
                name: "snr",
                value: snr,
            });
        }
        powers[i][i] = Complex64::from(snr);
    }
    Ok(powers)
}

/// Returns the matrix whose columns are the steering vectors.
pub(crate) fn steering_matrix<const N: usize>(phases_rad: &[f64]) -> Matrix<N> {
    let mut columns = zeros::<N>();
    for (k, &phase) in phases_rad.iter().enumerate() {
        for (n, element) in steering_vector::<N>(phase).into_iter().enumerate() {
            columns[n][k] = element;
        }
    }
    columns
}

/// Returns the stochastic bound for any source covariance.
pub(crate) fn stochastic_of<const N: usize>(
    phases_rad: &[f64],
    source_covariance: &Matrix<N>,
    noise_variance: f64,
    snapshots: usize,
) -> Result<List<f64, N>, Error> {
    let sources = phases_rad.len();
    let steering = steering_matrix::<N>(phases_rad);
    // A S, an N by K matrix.
    let mixed = product(&steering, source_covariance, [N, sources, sources]);
    let mut covariance = product(&mixed, &adjoint(&steering), [N, sources, N]);
    for (n, row) in covariance.iter_mut().enumerate() {
        row[n] += noise_variance;
    }
    let inverse = inverse(covariance, N).ok_or(Error::Singular)?;
    let right = product(&inverse, &mixed, [N, N, sources]);
    let effective = product(&adjoint(&mixed), &right, [sources, N, sources]);
    from_information(phases_rad, &effective, noise_variance, snapshots)
}

/// Returns the standard deviations from `C^-1 = (2 L / sigma^2) Re[(D^H P D) * G^T]`.
fn from_information<const N: usize>(
    phases_rad: &[f64],
    effective: &Matrix<N>,
    noise_variance: f64,
    snapshots: usize,
) -> Result<List<f64, N>, Error> {
    let sources = phases_rad.len();
    let steering = steering_matrix::<N>(phases_rad);
    let mut derivative = steering;
    for (n, row) in derivative.iter_mut().enumerate() {
        for element in row {
            *element *= Complex64::new(0.0, n as f64);
        }
    }
    let [a_h, d_h] = [adjoint(&steering), adjoint(&derivative)];
    let gram = product(&a_h, &steering, [sources, N, sources]);
    let gram_inverse = inverse(gram, sources).ok_or(Error::Singular)?;
    let overlap = product(&a_h, &derivative, [sources, N, sources]);
    let projected = product(&gram_inverse, &overlap, [sources; 3]);
    let removed = product(&adjoint(&overlap), &projected, [sources; 3]);
    let total = product(&d_h, &derivative, [sources, N, sources]);
    let scale = 2.0 * snapshots as f64 / noise_variance;
    let mut information = zeros::<N>();
    for i in 0..sources {
        for j in 0..sources {
            let value = ((total[i][j] - removed[i][j]) * effective[j][i]).re * scale;
            information[i][j] = Complex64::from(value);
        }
    }
    let variances = inverse(information, sources).ok_or(Error::Singular)?;
    let determined = (0..sources).all(|k| variances[k][k].re > 0.0);
    if !determined {
        return Err(Error::Singular);
    }
    Ok(List::collect(
        0.0,
        (0..sources).map(|k| variances[k][k].re.sqrt()),
    ))
}
