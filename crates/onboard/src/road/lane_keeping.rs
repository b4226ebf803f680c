//! How a vehicle strays from the middle of its lane and comes back.

use std::f64::consts::TAU;

/// The offset `d` from the middle of the lane as a damped oscillator over the distance travelled,
/// driven by white noise: `d″ + 2ζΩ d′ + Ω² d = w`, the heading against the lane being `ψ = d′`.
///
/// It is Gaussian and Markov, with stationary deviations `σ_d` and `Ω σ_d`, and a step of any
/// length has a closed form: `Φ = e^{Al}`, `Q = P∞ − Φ P∞ Φᵀ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneKeeping {
    /// Stationary deviation across the lane, `σ_d`, in metres.
    pub rms_m: f64,
    /// Wavelength of the wander, `2π/Ω`, in metres.
    pub wavelength_m: f64,
    /// Damping ratio ζ, in (0, 1): how soon one swing forgets the last.
    pub damping: f64,
}

impl LaneKeeping {
    /// `Φ` of (d, ψ) over the length; backwards, a negative one, that of the reversed process,
    /// `P∞ Φᵀ P∞⁻¹`, which forgets as well.
    #[must_use]
    pub fn transition(&self, length_m: f64) -> [[f64; 2]; 2] {
        let natural = TAU / self.wavelength_m;
        let decay = self.damping * natural;
        let damped = natural * (1.0 - self.damping * self.damping).sqrt();
        let envelope = (-decay * length_m.abs()).exp();
        let (sin, cos) = (damped * length_m.abs()).sin_cos();
        let slope = sin / damped;
        let ahead = slope.copysign(slope * length_m);
        [
            [envelope * (cos + decay * slope), envelope * ahead],
            [
                -envelope * natural * natural * ahead,
                envelope * (cos - decay * slope),
            ],
        ]
    }

    /// Stationary variances of offset (m²) and heading (rad²).
    #[must_use]
    pub fn stationary(&self) -> [f64; 2] {
        let variance = self.rms_m * self.rms_m;
        let natural = TAU / self.wavelength_m;
        [variance, natural * natural * variance]
    }

    /// Random walk of the heading over a length short against the wavelength (rad per √m): the root
    /// of the density of `w`, `4ζΩ³σ_d²`.
    #[must_use]
    pub fn steering_rad_per_sqrt_m(&self) -> f64 {
        let natural = TAU / self.wavelength_m;
        (4.0 * self.damping * natural.powi(3)).sqrt() * self.rms_m
    }

    /// Stationary deviation of the curvature with which the vehicle steers back (1/m), that of
    /// `2ζΩ ψ + Ω² d`.
    #[must_use]
    pub fn pull_per_m(&self) -> f64 {
        let natural = TAU / self.wavelength_m;
        natural * natural * self.rms_m * (2.0 * self.damping).hypot(1.0)
    }

    /// `Q` of a step with the given `Φ`.
    #[must_use]
    pub fn noise(&self, transition: &[[f64; 2]; 2]) -> [[f64; 2]; 2] {
        let [d, psi] = self.stationary();
        let [[a, b], [c, e]] = *transition;
        let cross = -(a * d * c + b * psi * e);
        [
            [(d - a * d * a - b * psi * b).max(0.0), cross],
            [cross, (psi - c * d * c - e * psi * e).max(0.0)],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEEPING: LaneKeeping = LaneKeeping {
        rms_m: 0.1,
        wavelength_m: 60.0,
        damping: 0.2,
    };

    #[test]
    fn two_steps_are_one() {
        let (one, two) = (KEEPING.transition(1.7), KEEPING.transition(3.4));
        for i in 0..2 {
            for j in 0..2 {
                let product = one[i][0] * one[0][j] + one[i][1] * one[1][j];
                assert!((product - two[i][j]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn backwards_it_is_the_reversed_process() {
        let variances = KEEPING.stationary();
        let (ahead, back) = (KEEPING.transition(11.0), KEEPING.transition(-11.0));
        for i in 0..2 {
            for j in 0..2 {
                let reversed = variances[i] * ahead[j][i] / variances[j];
                assert!((back[i][j] - reversed).abs() < 1e-14);
            }
        }
        let noise = KEEPING.noise(&KEEPING.transition(-500.0));
        assert!((noise[0][0] / variances[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn solves_its_equation() {
        let h = 1e-4;
        let [[a, b], [c, e]] = KEEPING.transition(h);
        let natural = TAU / 60.0;
        assert!((a - 1.0).abs() < 1e-7 && (b / h - 1.0).abs() < 1e-4);
        assert!((c / h + natural * natural).abs() < 1e-6);
        assert!(((e - 1.0) / h + 0.4 * natural).abs() < 1e-5);
    }

    #[test]
    fn noise_of_a_short_step_is_that_of_a_white_acceleration() {
        let l = 0.01;
        let noise = KEEPING.noise(&KEEPING.transition(l));
        let density = 4.0 * 0.2 * (TAU / 60.0_f64).powi(3) * 0.01;
        assert!((noise[1][1] / (density * l) - 1.0).abs() < 1e-3);
        assert!((noise[0][1] / (density * l * l / 2.0) - 1.0).abs() < 1e-2);
    }
}
