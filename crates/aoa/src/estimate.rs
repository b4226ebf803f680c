//! One call for every method, and what an estimate says about itself.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;

use crate::eigen::{HermitianEigen, hermitian_eigen, principal_eigenvector};
use crate::linear::{adjoint, inverse, product};
use crate::list::List;
use crate::math::{acos, log10};
use crate::{
    Array, Complex64, Covariance, Error, bound, esprit, maximum_likelihood, music, root_music,
};

/// How to find the directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The maximum of `a^H R a`: optimal for one source, and the cheapest.
    MaximumLikelihood,
    /// Peaks of the MUSIC spectrum on a grid `grid_deg` apart at broadside.
    Music {
        /// Grid step in degrees, 0.001 to 10.
        grid_deg: f64,
        /// Whether to continue from the grid to the peak itself.
        refine: bool,
    },
    /// The roots of the MUSIC polynomial.
    RootMusic,
    /// ESPRIT, least squares.
    EspritLs,
    /// ESPRIT, total least squares.
    EspritTls,
}

impl Method {
    /// How many sources the method can tell apart with `N` antennas.
    pub const fn maximum_sources<const N: usize>(self) -> usize {
        match self {
            Self::MaximumLikelihood => 1,
            _ => N - 1,
        }
    }
}

/// Whether an estimate may be used as a Gaussian measurement with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It may.
    Resolved,
    /// It may not, for this reason.
    Unresolved(Reason),
}

/// Why an estimate should not be relied on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// SNR and snapshots are too few to exclude a wholly wrong direction.
    ThresholdSnr,
    /// So near to the array's axis that the other end, or no direction, fits as well.
    NearEndFire,
    /// Elements more than half a wavelength apart: several directions fit equally well.
    Ambiguous,
    /// Fewer peaks than sources, or two sources closer than their standard deviations.
    SourcesNotSeparated,
}

impl Verdict {
    /// Every verdict there is.
    pub const ALL: [Self; 5] = [
        Self::Resolved,
        Self::Unresolved(Reason::ThresholdSnr),
        Self::Unresolved(Reason::NearEndFire),
        Self::Unresolved(Reason::Ambiguous),
        Self::Unresolved(Reason::SourcesNotSeparated),
    ];

    /// Its place in [`Verdict::ALL`].
    pub const fn index(&self) -> usize {
        match self {
            Self::Resolved => 0,
            Self::Unresolved(Reason::ThresholdSnr) => 1,
            Self::Unresolved(Reason::NearEndFire) => 2,
            Self::Unresolved(Reason::Ambiguous) => 3,
            Self::Unresolved(Reason::SourcesNotSeparated) => 4,
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ThresholdSnr => "SNR too low to exclude a wholly wrong direction",
            Self::NearEndFire => "too near to the array's axis",
            Self::Ambiguous => "several directions fit: elements more than half a wavelength apart",
            Self::SourcesNotSeparated => "sources not separated",
        })
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resolved => f.write_str("resolved"),
            Self::Unresolved(reason) => write!(f, "unresolved: {reason}"),
        }
    }
}

/// A direction, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleEstimate {
    /// Electrical angle `omega`, in (-pi, pi]: what was measured. Its noise is Gaussian and does not
    /// depend on the direction, so filters should take this one.
    pub phase_rad: f64,
    /// Standard deviation of `phase_rad`, from the bound at the estimated SNR.
    pub phase_sigma_rad: f64,
    /// Angle from the array's axis, 0 to pi.
    pub angle_rad: f64,
    /// Standard deviation of `angle_rad`; near end-fire, where the linear law diverges, the angle
    /// that one standard deviation of `phase_rad` makes there.
    pub sigma_rad: f64,
    /// Estimated SNR per antenna and snapshot.
    pub snr_db: f64,
    /// Whether the estimate may be relied on.
    pub verdict: Verdict,
}

impl AngleEstimate {
    /// Whether the verdict is [`Verdict::Resolved`].
    pub fn is_resolved(&self) -> bool {
        self.verdict == Verdict::Resolved
    }
}

/// The estimate of who knows nothing: any direction, not resolved.
impl Default for AngleEstimate {
    fn default() -> Self {
        Self {
            phase_rad: 0.0,
            phase_sigma_rad: PI / 3.0_f64.sqrt(),
            angle_rad: FRAC_PI_2,
            sigma_rad: FRAC_PI_2,
            snr_db: f64::NEG_INFINITY,
            verdict: Verdict::Unresolved(Reason::ThresholdSnr),
        }
    }
}

/// Angle estimates of several sources, by ascending angle.
pub type AngleEstimates<const N: usize> = List<AngleEstimate, N>;

/// Direction of the strongest source.
///
/// The covariance is of the snapshots as received: the array's calibration is applied here.
///
/// # Errors
/// If the covariance is empty, zero or not finite, or the method's grid makes no sense.
pub fn estimate<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
) -> Result<AngleEstimate, Error> {
    let covariance = covariance.calibrated(array).validated()?;
    let spectrum = covariance.spectrum();
    let (phase_rad, excess) = match method {
        Method::MaximumLikelihood => (maximum_likelihood::maximum(&spectrum).0, 1.0),
        Method::Music { grid_deg, refine } => {
            let signal = music::signal_spectrum_of_one(&covariance);
            (
                music::phase(&signal, array, checked_grid(grid_deg)?, refine),
                1.0,
            )
        }
        Method::RootMusic => {
            let signal = music::signal_spectrum_of_one(&covariance);
            (root_music::phase(&signal), 1.0)
        }
        Method::EspritLs | Method::EspritTls => {
            let (_, principal) = principal_eigenvector(covariance.unscaled());
            (esprit::phase(&principal), esprit::excess::<N>())
        }
    };
    let beam = spectrum.value(phase_rad) / N as f64;
    let noise = maximum_likelihood::residual_power::<N>(spectrum.lags[0].re, beam);
    let snr = maximum_likelihood::snr::<N>(beam, noise);
    let snapshots = covariance.snapshots();
    let sigma = bound::stochastic::<N>(snr, snapshots) * excess;
    let threshold = snr < bound::resolvable_snr::<N>(snapshots);
    Ok(describe(
        phase_rad,
        sigma,
        snr,
        threshold.then_some(Reason::ThresholdSnr),
        array,
    ))
}

/// Directions of `sources` sources, by ascending angle.
///
/// # Errors
/// As [`estimate`]; [`Error::TooManySources`] unless `sources` is 1 to N - 1 (1 for maximum
/// likelihood); [`Error::Singular`] if ESPRIT's equations have no solution.
pub fn estimate_several<const N: usize>(
    method: Method,
    covariance: &Covariance<N>,
    array: &Array<N>,
    sources: usize,
) -> Result<AngleEstimates<N>, Error> {
    let maximum = method.maximum_sources::<N>();
    if sources == 0 || sources > maximum {
        return Err(Error::TooManySources {
            requested: sources,
            maximum,
        });
    }
    if sources == 1 {
        let only = estimate(method, covariance, array)?;
        return Ok(List::collect(only, [only]));
    }
    let covariance = covariance.calibrated(array).validated()?;
    let eigen = hermitian_eigen(covariance.matrix(), N);
    let mut phases = subspace_phases(method, &eigen, sources, array)?;
    let mut separated = phases.len() == sources;
    if !separated {
        // The spectrum has fewer peaks than sources; the roots of the same polynomial are complete.
        phases = subspace_phases(Method::RootMusic, &eigen, sources, array)?;
    }
    let noise_variance = eigen.values[sources..].iter().sum::<f64>() / (N - sources) as f64;
    let noise_variance = noise_variance.max(eigen.values[0] * 1e-15);
    let strengths = strengths(&phases, &covariance, noise_variance);
    separated &= strengths.is_some();
    let strengths = strengths.unwrap_or(Strengths {
        snr: [1e-9; N],
        phase_sigma_rad: [PI; N],
    });
    let weakest = (eigen.values[sources - 1] / noise_variance - 1.0) / N as f64;
    let hidden = weakest < bound::resolvable_snr::<N>(covariance.snapshots());
    let mut estimates = [None; N];
    for (k, place) in estimates[..sources].iter_mut().enumerate() {
        let (phase, sigma) = (phases[k], strengths.phase_sigma_rad[k]);
        let close = (0..sources).any(|other| {
            let gap = crate::spectrum::wrap(phases[other] - phase).abs();
            other != k && gap < 2.0 * sigma.hypot(strengths.phase_sigma_rad[other])
        });
        let doubt = if hidden {
            Some(Reason::ThresholdSnr)
        } else if close || !separated {
            Some(Reason::SourcesNotSeparated)
        } else {
            None
        };
        *place = Some(describe(phase, sigma, strengths.snr[k], doubt, array));
    }
    estimates[..sources].sort_unstable_by(|a, b| match (a, b) {
        (Some(a), Some(b)) => a.angle_rad.total_cmp(&b.angle_rad),
        _ => std::cmp::Ordering::Equal,
    });
    Ok(List::collect(
        AngleEstimate::default(),
        estimates.into_iter().flatten(),
    ))
}

/// Electrical angles from the eigenvectors.
fn subspace_phases<const N: usize>(
    method: Method,
    eigen: &HermitianEigen<N>,
    sources: usize,
    array: &Array<N>,
) -> Result<List<f64, N>, Error> {
    match method {
        Method::Music { grid_deg, refine } => {
            let spectrum = music::signal_spectrum(eigen, sources);
            Ok(music::phases(
                &spectrum,
                sources,
                array,
                checked_grid(grid_deg)?,
                refine,
            ))
        }
        Method::MaximumLikelihood | Method::RootMusic => {
            let null = music::null_spectrum(eigen, sources);
            Ok(root_music::phases(&null, sources))
        }
        Method::EspritLs => esprit::least_squares(eigen, sources).ok_or(Error::Singular),
        Method::EspritTls => esprit::total_least_squares(eigen, sources).ok_or(Error::Singular),
    }
}

/// The grid step in rad.
fn checked_grid(grid_deg: f64) -> Result<f64, Error> {
    let sensible = (0.001..=10.0).contains(&grid_deg);
    if sensible {
        Ok(grid_deg.to_radians())
    } else {
        Err(Error::Grid(grid_deg))
    }
}

struct Strengths<const N: usize> {
    snr: [f64; N],
    phase_sigma_rad: [f64; N],
}

/// Each source's SNR, from `S = A^+ (R - sigma^2 I) A^+H`, and the stochastic bound for that `S`.
/// `None` if the steering vectors do not tell the sources apart.
fn strengths<const N: usize>(
    phases: &[f64],
    covariance: &Covariance<N>,
    noise_variance: f64,
) -> Option<Strengths<N>> {
    let sources = phases.len();
    let steering = bound::steering_matrix::<N>(phases);
    let adjoint_steering = adjoint(&steering);
    let gram = product(&adjoint_steering, &steering, [sources, N, sources]);
    let pseudo_inverse = product(
        &inverse(gram, sources)?,
        &adjoint_steering,
        [sources, sources, N],
    );
    let mut signal = covariance.matrix();
    for (n, row) in signal.iter_mut().enumerate() {
        row[n] -= noise_variance;
    }
    let half = product(&pseudo_inverse, &signal, [sources, N, N]);
    let mut powers = product(&half, &adjoint(&pseudo_inverse), [sources, N, sources]);
    let floor = noise_variance * 1e-9;
    for k in 0..sources {
        powers[k][k] = Complex64::from(powers[k][k].re.max(floor));
    }
    let sigma =
        bound::stochastic_of(phases, &powers, noise_variance, covariance.snapshots()).ok()?;
    let mut strengths = Strengths {
        snr: [0.0; N],
        phase_sigma_rad: [0.0; N],
    };
    for k in 0..sources {
        strengths.snr[k] = powers[k][k].re / noise_variance;
        strengths.phase_sigma_rad[k] = sigma[k];
    }
    Some(strengths)
}

/// An estimate from its electrical angle, with the angle, its standard deviation, and the verdict
/// as far as geometry decides it.
pub(crate) fn describe<const N: usize>(
    phase_rad: f64,
    phase_sigma_rad: f64,
    snr: f64,
    doubt: Option<Reason>,
    array: &Array<N>,
) -> AngleEstimate {
    let end_fire = array.phase_at_end_fire_rad();
    let (phase_sigma_rad, angle_rad, sigma_rad) =
        direction::<false>(phase_rad, phase_sigma_rad, end_fire);
    let reason = doubt.or_else(|| geometric_doubt(phase_rad, phase_sigma_rad, end_fire));
    AngleEstimate {
        phase_rad,
        phase_sigma_rad,
        angle_rad,
        sigma_rad,
        snr_db: 10.0 * log10::<false>(snr),
        verdict: reason.map_or(Verdict::Resolved, Verdict::Unresolved),
    }
}

/// From an electrical angle and its standard deviation: that standard deviation limited to what it
/// means to know nothing, the angle, and its standard deviation.
#[inline(always)]
pub(crate) fn direction<const FUSED: bool>(
    phase_rad: f64,
    phase_sigma_rad: f64,
    end_fire_rad: f64,
) -> (f64, f64, f64) {
    // Standard deviation of a phase drawn at random, pi / sqrt(3).
    const IGNORANCE: f64 = 1.813_799_364_234_217_8;
    let lesser = |a: f64, b: f64| if a < b { a } else { b };
    let phase_sigma_rad = lesser(phase_sigma_rad, IGNORANCE);
    let cosine = phase_rad / end_fire_rad;
    let cosine = if cosine > 1.0 { 1.0 } else { cosine };
    let cosine = if cosine < -1.0 { -1.0 } else { cosine };
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let spread = phase_sigma_rad / end_fire_rad;
    // acos(1 - x) is sqrt(2 x) near the axis: there the deviation is of that size, not infinite.
    let sigma_rad = lesser(spread / sine, (2.0 * spread).sqrt());
    (
        phase_sigma_rad,
        acos::<FUSED>(cosine),
        lesser(sigma_rad, FRAC_PI_2),
    )
}

/// What the direction itself gives reason to doubt.
pub(crate) fn geometric_doubt(
    phase_rad: f64,
    phase_sigma_rad: f64,
    end_fire_rad: f64,
) -> Option<Reason> {
    let reach = phase_rad.abs() + 3.0 * phase_sigma_rad;
    // Another direction has the phase beyond the turn: nearest -(2 pi - |phase|).
    if phase_rad.abs() + end_fire_rad >= 2.0 * PI * (1.0 + 1e-9) {
        Some(Reason::Ambiguous)
    } else if reach > end_fire_rad {
        Some(Reason::NearEndFire)
    } else {
        None
    }
}
