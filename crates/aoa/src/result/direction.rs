//! Conversion of an electrical angle to a direction, with its ambiguities.

use std::f64::consts::{FRAC_PI_2, PI};

use super::angle::{AngleEstimate, UntestedEstimate};
use super::goodness_of_fit::{Tested, Tests};
use super::verdict::{Reason, Verdict};
use crate::array::linear::Array;
use crate::simd::math::{acos, log10};

/// Estimated electrical angle before the conversion to a direction.
pub(crate) struct Found {
    pub(crate) phase_rad: f64,
    pub(crate) noise_sigma_rad: f64,
    pub(crate) snr: f64,
    pub(crate) tests: Tests,
    pub(crate) tested: Tested,
    /// Reason for an unreliable estimate, except geometry and misfit.
    pub(crate) doubt: Option<Reason>,
}

/// Converts an electrical angle to an estimate with angle, standard deviation and verdict.
pub(crate) fn describe<O: Output, const N: usize>(found: &Found, array: &Array<N>) -> O {
    let end_fire = array.phase_at_end_fire_rad();
    let Found {
        phase_rad,
        tests,
        tested,
        ..
    } = *found;
    let noise_sigma = limit_to_uniform_sigma(found.noise_sigma_rad);
    let sigma = noise_sigma * tested.inflation.sqrt();
    let (phase_sigma_rad, angle_rad, sigma_rad) = direction::<false>(phase_rad, sigma, end_fire);
    let described = Described {
        phase_rad,
        phase_sigma_rad,
        phase_noise_sigma_rad: noise_sigma,
        angle_rad,
        sigma_rad,
        snr_db: 10.0 * log10::<false>(found.snr),
        doubt: found.doubt,
        geometric: geometric_doubt(phase_rad, noise_sigma, end_fire),
    };
    O::new(&described, &tests, &tested)
}

/// Values of an estimate, and the reasons for an unreliable one except misfit.
pub(crate) struct Described {
    pub(crate) phase_rad: f64,
    pub(crate) phase_sigma_rad: f64,
    pub(crate) phase_noise_sigma_rad: f64,
    pub(crate) angle_rad: f64,
    pub(crate) sigma_rad: f64,
    pub(crate) snr_db: f64,
    pub(crate) doubt: Option<Reason>,
    pub(crate) geometric: Option<Reason>,
}

/// Estimate with or without goodness of fit.
pub(crate) trait Output {
    /// Whether the goodness of fit is computed. If not, `tested` is [`Tested::NOTHING`].
    const IS_TESTED: bool;

    fn new(described: &Described, tests: &Tests, tested: &Tested) -> Self;
}

impl Output for AngleEstimate {
    const IS_TESTED: bool = true;

    #[inline(always)]
    fn new(described: &Described, tests: &Tests, tested: &Tested) -> Self {
        let misfit = tests.misfit(tested.ratios());
        Self {
            phase_rad: described.phase_rad,
            phase_sigma_rad: described.phase_sigma_rad,
            phase_noise_sigma_rad: described.phase_noise_sigma_rad,
            angle_rad: described.angle_rad,
            sigma_rad: described.sigma_rad,
            snr_db: described.snr_db,
            fit: tests.fit(tested),
            verdict: verdict(described.doubt, described.geometric, misfit),
        }
    }
}

impl Output for UntestedEstimate {
    const IS_TESTED: bool = false;

    #[inline(always)]
    fn new(described: &Described, _: &Tests, _: &Tested) -> Self {
        Self {
            phase_rad: described.phase_rad,
            phase_noise_sigma_rad: described.phase_noise_sigma_rad,
            angle_rad: described.angle_rad,
            sigma_rad: described.sigma_rad,
            snr_db: described.snr_db,
            verdict: verdict(described.doubt, described.geometric, None),
        }
    }
}

/// Returns the verdict with respect to noise and geometry. A misfit of the model can cause a low
/// SNR, so that the misfit is reported instead of the low SNR.
#[inline(always)]
pub(crate) fn verdict(
    doubt: Option<Reason>,
    geometric: Option<Reason>,
    misfit: Option<Reason>,
) -> Verdict {
    let reason = match doubt {
        None => geometric,
        Some(Reason::ThresholdSnr | Reason::TooFewSnapshots) => misfit.or(doubt),
        Some(_) => doubt,
    };
    reason.map_or(Verdict::Resolved, Verdict::Unresolved)
}

/// Returns the reason if the SNR is below `needed`, the minimum that excludes an outlier.
#[inline(always)]
pub(crate) fn threshold_doubt(snr: f64, needed: f64) -> Option<Reason> {
    (snr < needed).then_some(if snr < 1.0 {
        Reason::ThresholdSnr
    } else {
        Reason::TooFewSnapshots
    })
}

/// Limits a standard deviation to that of a uniformly distributed phase, `pi / sqrt(3)`.
#[inline(always)]
pub(crate) fn limit_to_uniform_sigma(phase_sigma_rad: f64) -> f64 {
    const UNIFORM_SIGMA_RAD: f64 = 1.813_799_364_234_217_8;
    if phase_sigma_rad < UNIFORM_SIGMA_RAD {
        phase_sigma_rad
    } else {
        UNIFORM_SIGMA_RAD
    }
}

/// Converts an electrical angle and its standard deviation to the limited standard deviation, the
/// angle, and the standard deviation of the angle.
#[inline(always)]
pub(crate) fn direction<const FUSED: bool>(
    phase_rad: f64,
    phase_sigma_rad: f64,
    end_fire_rad: f64,
) -> (f64, f64, f64) {
    let minimum_of = |a: f64, b: f64| if a < b { a } else { b };
    let phase_sigma_rad = limit_to_uniform_sigma(phase_sigma_rad);
    let cosine = phase_rad / end_fire_rad;
    let cosine = if cosine > 1.0 { 1.0 } else { cosine };
    let cosine = if cosine < -1.0 { -1.0 } else { cosine };
    let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
    let spread = phase_sigma_rad / end_fire_rad;
    // acos(1 - x) is sqrt(2 x) near the axis, so that the standard deviation is of this size
    // instead of infinite.
    let sigma_rad = minimum_of(spread / sine, (2.0 * spread).sqrt());
    (
        phase_sigma_rad,
        acos::<FUSED>(cosine),
        minimum_of(sigma_rad, FRAC_PI_2),
    )
}

/// Returns the reason if the direction is ambiguous or near end-fire.
pub(crate) fn geometric_doubt(
    phase_rad: f64,
    phase_sigma_rad: f64,
    end_fire_rad: f64,
) -> Option<Reason> {
    let reach = phase_rad.abs() + 3.0 * phase_sigma_rad;
    // A second direction has the phase beyond ±2 pi: the nearest one is -(2 pi - |phase|).
    if phase_rad.abs() + end_fire_rad >= 2.0 * PI * (1.0 + 1e-9) {
        Some(Reason::Ambiguous)
    } else if reach > end_fire_rad {
        Some(Reason::NearEndFire)
    } else {
        None
    }
}
