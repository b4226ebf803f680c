//! Fractional timing from the phase slope over the subcarriers.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use super::base_rate::SYMBOL_FFT;
use crate::numeric::phasors::fill_phasors;
use crate::standard::grid::SUBCARRIERS;

/// Number of subcarrier groups for the estimation of a small delay.
const GROUPS: usize = 30;

/// Returns the delay in samples that maximises `Σ_r |Σ_k z_r(k) exp(j2πk'τ/256)|²`, `k' = k − 120`,
/// over rows with unrelated phases (antennas, or antennas × symbols): the maximum-likelihood delay
/// of one path. The search covers `±reach` samples on a grid of `1/4`, followed by Newton's method.
pub(crate) fn delay(rows: &[[Complex32; SUBCARRIERS]], reach: f64) -> f64 {
    let steps = (reach * 4.0).ceil() as i32;
    let mut best = (f64::NEG_INFINITY, 0.0);
    for step in -steps..=steps {
        let delay = f64::from(step) * 0.25;
        let power = moments(rows, delay).power;
        if power > best.0 {
            best = (power, delay);
        }
    }
    refine(rows, best.1, 3)
}

/// Refines the maximum of [`delay`] by Newton's method from a nearby start, with steps of at most
/// 0.3 samples. `N` sums over equal groups of subcarriers are as accurate as 240 subcarriers.
pub(crate) fn refine<const N: usize>(
    rows: &[[Complex32; N]],
    start: f64,
    iterations: usize,
) -> f64 {
    let mut delay = start;
    for _ in 0..iterations {
        let moments = moments(rows, delay);
        // Beyond the inflection point, half a sample away, only the direction of ascent is known.
        delay += if moments.curvature < 0.0 {
            (-moments.slope / moments.curvature).clamp(-0.3, 0.3)
        } else {
            0.3 * moments.slope.signum()
        };
    }
    delay
}

/// Returns the delay if it is within half a sample of zero and known to within a tenth of a sample.
/// The antennas are combined by their sums over the subcarriers. Groups of eight subcarriers are
/// added, over which the phase changes by less than 0.1 rad. Both simplifications lose less than
/// 0.1 % of the information.
pub(crate) fn refine_combined(rows: &[[Complex32; SUBCARRIERS]], near: f64) -> f64 {
    let mut combined = [[Complex32::ZERO; GROUPS]];
    for row in rows {
        let (groups, _) = row.as_chunks::<{ SUBCARRIERS / GROUPS }>();
        let sums: [Complex32; GROUPS] =
            std::array::from_fn(|group| groups.get(group).map_or(Complex32::ZERO, total));
        let gain = total(&sums).conj();
        for (slot, z) in combined[0].iter_mut().zip(&sums) {
            *slot += z * gain;
        }
    }
    refine(&combined, near, 2)
}

/// Returns Σ a as two partial sums, so that consecutive additions are independent.
fn total<const N: usize>(a: &[Complex32; N]) -> Complex32 {
    let mut sums = [Complex32::ZERO; 2];
    for (i, z) in a.iter().enumerate() {
        sums[i % 2] += z;
    }
    sums[0] + sums[1]
}

/// Returns `exp(j2πk'τ/256)`, which removes a delay of τ samples from the subcarriers.
pub(crate) fn ramp(delay: f64) -> [Complex32; SUBCARRIERS] {
    group_ramp(delay)
}

/// Returns the phase ramp at the centres of `N` groups.
fn group_ramp<const N: usize>(delay: f64) -> [Complex32; N] {
    let mut ramp = [Complex32::ZERO; N];
    let cycles = delay / SYMBOL_FFT as f64;
    fill_phasors(&mut ramp, centre(N, 0) * cycles, width(N) * cycles);
    ramp
}

/// Returns the number of subcarriers of one of `groups` groups.
fn width(groups: usize) -> f64 {
    (SUBCARRIERS / groups) as f64
}

/// Returns the centre of a group, in subcarriers relative to the SSB's centre.
fn centre(groups: usize, group: usize) -> f64 {
    (group as f64 + 0.5) * width(groups) - 0.5 - 120.0
}

struct Moments {
    power: f64,
    slope: f64,
    curvature: f64,
}

/// Computes the objective and its first two derivatives with respect to the delay.
fn moments<const N: usize>(rows: &[[Complex32; N]], delay: f64) -> Moments {
    let ramp = group_ramp::<N>(delay);
    let omega = TAU / SYMBOL_FFT as f64;
    let mut result = Moments {
        power: 0.0,
        slope: 0.0,
        curvature: 0.0,
    };
    for row in rows {
        // Sums of z, k z and k² z, rotated: D' = jω S1, D'' = −ω² S2.
        let mut sums = [Complex32::ZERO; 3];
        for (k, (z, phasor)) in row.iter().zip(&ramp).enumerate() {
            let centred = centre(N, k) as f32;
            let rotated = z * phasor;
            let first = rotated * centred;
            sums[0] += rotated;
            sums[1] += first;
            sums[2] += first * centred;
        }
        let [s0, s1, s2] = sums.map(|s| Complex64::new(f64::from(s.re), f64::from(s.im)));
        result.power += s0.norm_sqr();
        result.slope -= 2.0 * omega * (s0.conj() * s1).im;
        result.curvature += 2.0 * omega * omega * (s1.norm_sqr() - (s0.conj() * s2).re);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delay_is_estimated_from_a_phase_ramp() {
        for truth in [-1.3, -0.25, 0.0, 0.113, 0.9] {
            let row: [Complex32; SUBCARRIERS] = std::array::from_fn(|k| {
                let phase = -TAU * (k as f64 - 120.0) * truth / SYMBOL_FFT as f64;
                Complex32::new(phase.cos() as f32, phase.sin() as f32)
            });
            assert!((delay(&[row], 1.5) - truth).abs() < 1e-5);
            if truth.abs() < 0.5 {
                assert!((refine_combined(&[row, row], truth + 0.1) - truth).abs() < 1e-4);
            }
        }
    }
}
