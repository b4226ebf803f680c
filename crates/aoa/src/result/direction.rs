//! From an electrical angle to the direction, and what geometry leaves in doubt there.

use std::f64::consts::{FRAC_PI_2, PI};

use super::angle::AngleEstimate;
use super::goodness_of_fit::{Tested, Tests};
use super::verdict::{Reason, Verdict};
use crate::array::linear::Array;
use crate::simd::math::{acos, log10};

/// What is known of an electrical angle before it becomes a direction.
pub(crate) struct Found {
    pub(crate) phase_rad: f64,
    pub(crate) noise_sigma_rad: f64,
    pub(crate) snr: f64,
    pub(crate) tests: Tests,
    pub(crate) tested: Tested,
    /// What gives reason to doubt it, geometry and misfit aside.
    pub(crate) doubt: Option<Reason>,
}

/// An estimate from its electrical angle, with the angle, its standard deviation, and the verdict.
pub(crate) fn describe<const N: usize>(found: &Found, array: &Array<N>) -> AngleEstimate {
    let end_fire = array.phase_at_end_fire_rad();
    let Found {
        phase_rad,
        tests,
        tested,
        ..
    } = *found;
    let noise_sigma = no_more_than_ignorance(found.noise_sigma_rad);
    let sigma = noise_sigma * tested.inflation.sqrt();
    let (phase_sigma_rad, angle_rad, sigma_rad) = direction::<false>(phase_rad, sigma, end_fire);
    let geometric = geometric_doubt(phase_rad, noise_sigma, end_fire);
    AngleEstimate {
        phase_rad,
        phase_sigma_rad,
        phase_noise_sigma_rad: noise_sigma,
        angle_rad,
        sigma_rad,
        snr_db: 10.0 * log10::<false>(found.snr),
        fit: tests.fit(&tested),
        verdict: verdict(found.doubt, geometric, tests.misfit(tested.ratios())),
    }
}

/// Whether noise and geometry leave a doubt. Something wrong with the model explains why the SNR seems low,
/// so it is named in the place of that.
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

/// Whether noise may have led to a wholly wrong direction, where this SNR is needed to exclude that.
#[inline(always)]
pub(crate) fn threshold_doubt(snr: f64, needed: f64) -> Option<Reason> {
    (snr < needed).then_some(if snr < 1.0 {
        Reason::ThresholdSnr
    } else {
        Reason::TooFewSnapshots
    })
}

/// A standard deviation, or that of a phase drawn at random, `pi / sqrt(3)`, where it is larger.
#[inline(always)]
pub(crate) fn no_more_than_ignorance(phase_sigma_rad: f64) -> f64 {
    const IGNORANCE: f64 = 1.813_799_364_234_217_8;
    if phase_sigma_rad < IGNORANCE {
        phase_sigma_rad
    } else {
        IGNORANCE
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
    let lesser = |a: f64, b: f64| if a < b { a } else { b };
    let phase_sigma_rad = no_more_than_ignorance(phase_sigma_rad);
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
