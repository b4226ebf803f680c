//! From an electrical angle to the direction, and what geometry leaves in doubt there.

use std::f64::consts::{FRAC_PI_2, PI};

use super::angle::AngleEstimate;
use super::verdict::{Reason, Verdict};
use crate::array::linear::Array;
use crate::simd::math::{acos, log10};

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
