//! Timing to a fraction of a sample from the phase slope over the subcarriers.

use std::f64::consts::TAU;

use num_complex::{Complex32, Complex64};

use crate::demodulate::{SYMBOL_FFT, fill_phasors};
use crate::grid::SUBCARRIERS;

/// Delay in samples that maximises `Σ_r |Σ_k z_r(k) exp(j2πk'τ/256)|²`, `k' = k − 120`, over rows
/// whose phases are unrelated (antennas, or antennas × symbols): the maximum-likelihood delay of
/// one path. Looks in `±reach` samples on a grid of `1/4`, then by Newton's method.
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

/// Newton's method for the maximum of [`delay`] from a near start; a step is at most 0.3 samples.
pub(crate) fn refine(rows: &[[Complex32; SUBCARRIERS]], start: f64, iterations: usize) -> f64 {
    let mut delay = start;
    for _ in 0..iterations {
        let moments = moments(rows, delay);
        // Beyond the inflection, half a sample away, uphill is all that is known.
        delay += if moments.curvature < 0.0 {
            (-moments.slope / moments.curvature).clamp(-0.3, 0.3)
        } else {
            0.3 * moments.slope.signum()
        };
    }
    delay
}

/// The same for a delay already near zero, with the antennas first combined by their sums over the
/// subcarriers: one row instead of one per antenna.
pub(crate) fn refine_combined(rows: &[[Complex32; SUBCARRIERS]]) -> f64 {
    let mut combined = [[Complex32::ZERO; SUBCARRIERS]];
    for row in rows {
        let gain = row.iter().fold(Complex32::ZERO, |sum, z| sum + z).conj();
        for (slot, z) in combined[0].iter_mut().zip(row) {
            slot.re += z.re * gain.re - z.im * gain.im;
            slot.im += z.re * gain.im + z.im * gain.re;
        }
    }
    refine(&combined, 0.0, 4)
}

/// `exp(j2πk'τ/256)`: takes a delay of τ samples out of the subcarriers.
pub(crate) fn ramp(delay: f64) -> [Complex32; SUBCARRIERS] {
    let mut ramp = [Complex32::ZERO; SUBCARRIERS];
    let cycles = delay / SYMBOL_FFT as f64;
    fill_phasors(&mut ramp, -120.0 * cycles, cycles);
    ramp
}

struct Moments {
    power: f64,
    slope: f64,
    curvature: f64,
}

/// The objective and its first two derivatives with respect to the delay.
fn moments(rows: &[[Complex32; SUBCARRIERS]], delay: f64) -> Moments {
    let ramp = ramp(delay);
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
            let centred = k as f32 - 120.0;
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
    fn a_ramp_gives_its_delay() {
        for truth in [-1.3, -0.25, 0.0, 0.113, 0.9] {
            let row: [Complex32; SUBCARRIERS] = std::array::from_fn(|k| {
                let phase = -TAU * (k as f64 - 120.0) * truth / SYMBOL_FFT as f64;
                Complex32::new(phase.cos() as f32, phase.sin() as f32)
            });
            assert!((delay(&[row], 1.5) - truth).abs() < 1e-5);
        }
    }
}
