//! Lane keeping: stochastic model of the lateral deviation.

use std::f64::consts::TAU;

/// Maximum damping ratio of an oscillation.
const MAX_DAMPING: f64 = 0.99;

/// Fraction of the wavelength below which a step is short.
const SHORT: f64 = 0.05;

/// Abscissas and weights of the three-point Gauss–Legendre rule on [0, 1].
const GAUSS_LEGENDRE: [[f64; 2]; 3] = [
    [0.112_701_665_379_258_3, 5.0 / 18.0],
    [0.5, 4.0 / 9.0],
    [0.887_298_334_620_741_7, 5.0 / 18.0],
];

/// Lateral deviation `d` from the lane centre as a damped oscillator over the distance driven, with
/// white noise as input: `d″ + 2ζΩ d′ + Ω² d = w`. The heading relative to the lane is `ψ = d′`.
///
/// The process is Gaussian and Markov, with the stationary standard deviations `σ_d` and `Ω σ_d`. A
/// step of any length has a closed form: `Φ = e^{Al}`, `Q = P∞ − Φ P∞ Φᵀ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaneKeeping {
    /// Stationary standard deviation of the lateral deviation, `σ_d`, in metres.
    pub rms_m: f64,
    /// Wavelength of the oscillation, `2π/Ω`, in metres.
    pub wavelength_m: f64,
    /// Damping ratio ζ, in (0, 1).
    pub damping: f64,
}

impl LaneKeeping {
    /// Returns the transition matrix `Φ` of (d, ψ) over a length. For a negative length it is that
    /// of the time-reversed process, `P∞ Φᵀ P∞⁻¹`, which decays as well.
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

    /// Returns the stationary variances of deviation (m²) and heading (rad²).
    #[must_use]
    pub fn stationary(&self) -> [f64; 2] {
        let variance = self.rms_m * self.rms_m;
        let natural = TAU / self.wavelength_m;
        [variance, natural * natural * variance]
    }

    /// Returns the random walk of the heading over lengths far below the wavelength (rad per √m):
    /// the square root of the spectral density of `w`, `4ζΩ³σ_d²`.
    #[must_use]
    pub fn steering_rad_per_sqrt_m(&self) -> f64 {
        let natural = TAU / self.wavelength_m;
        (4.0 * self.damping * natural.powi(3)).sqrt() * self.rms_m
    }

    /// Returns the variance per metre (m²/m) of the distance along the lane relative to the
    /// distance driven, for a heading variance P: `ψ²/2` has the variance `P²/2`, with the
    /// correlation length of the squared oscillation, `1/(2ζΩ)`.
    #[must_use]
    pub fn shortening_m2_per_m(&self, heading_variance: f64) -> f64 {
        let natural = TAU / self.wavelength_m;
        heading_variance * heading_variance / (4.0 * self.damping * natural)
    }

    /// Returns the oscillator that is equivalent to the sum of this one and another: variances of
    /// deviation and heading, and the noise, are added.
    #[must_use]
    pub fn and(&self, other: &Self) -> Self {
        let sum = |moment: &dyn Fn(&Self) -> f64| moment(self) + moment(other);
        let offset = sum(&|it| it.stationary()[0]);
        let heading = sum(&|it| it.stationary()[1]);
        let density = sum(&|it| it.steering_rad_per_sqrt_m().powi(2));
        if offset == 0.0 {
            return *self;
        }
        let natural = (heading / offset).sqrt();
        Self {
            rms_m: offset.sqrt(),
            wavelength_m: TAU / natural,
            damping: (density / (4.0 * natural * heading)).min(MAX_DAMPING),
        }
    }

    /// Returns the stationary standard deviation of the curvature with which the vehicle steers
    /// back (1/m), that of `2ζΩ ψ + Ω² d`.
    #[must_use]
    pub fn pull_per_m(&self) -> f64 {
        let natural = TAU / self.wavelength_m;
        natural * natural * self.rms_m * (2.0 * self.damping).hypot(1.0)
    }

    /// Returns the process noise `Q` of a step of this length, which may be negative.
    ///
    /// For a short step the difference `P∞ − Φ P∞ Φᵀ` cancels to rounding errors, which may not
    /// form a covariance. It is then computed as `∫ Φ(s) (0, 1)ᵀ S (0, 1) Φ(s)ᵀ ds` by the
    /// three-point Gauss–Legendre rule: a sum of positive terms, with a relative error below 1e-5.
    #[must_use]
    pub fn noise(&self, length_m: f64) -> [[f64; 2]; 2] {
        let distance_m = length_m.abs();
        let [[d_d, d_psi], [_, psi_psi]] = if distance_m < SHORT * self.wavelength_m {
            let density = self.steering_rad_per_sqrt_m().powi(2);
            let mut sum = [[0.0; 2]; 2];
            for [at, weight] in GAUSS_LEGENDRE {
                let [[_, d], [_, psi]] = self.transition(at * distance_m);
                let share = weight * density * distance_m;
                sum[0][0] += share * d * d;
                sum[0][1] += share * d * psi;
                sum[1][1] += share * psi * psi;
            }
            sum
        } else {
            let [d, psi] = self.stationary();
            let [[a, b], [c, e]] = self.transition(distance_m);
            let cross = -(a * d * c + b * psi * e);
            [
                [d - a * d * a - b * psi * b, cross],
                [cross, psi - c * d * c - e * psi * e],
            ]
        };
        let cross = d_psi.copysign(d_psi * length_m);
        [[d_d, cross], [cross, psi_psi]]
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
    fn two_steps_equal_one_step_of_the_total_length() {
        let (one, two) = (KEEPING.transition(1.7), KEEPING.transition(3.4));
        for i in 0..2 {
            for j in 0..2 {
                let product = one[i][0] * one[0][j] + one[i][1] * one[1][j];
                assert!((product - two[i][j]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_reversed_process_is_equal() {
        let variances = KEEPING.stationary();
        let (ahead, back) = (KEEPING.transition(11.0), KEEPING.transition(-11.0));
        for i in 0..2 {
            for j in 0..2 {
                let reversed = variances[i] * ahead[j][i] / variances[j];
                assert!((back[i][j] - reversed).abs() < 1e-14);
            }
        }
        let noise = KEEPING.noise(-500.0);
        assert!((noise[0][0] / variances[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_transition_solves_the_differential_equation() {
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
        let noise = KEEPING.noise(l);
        let density = 4.0 * 0.2 * (TAU / 60.0_f64).powi(3) * 0.01;
        assert!((noise[1][1] / (density * l) - 1.0).abs() < 1e-3);
        assert!((noise[0][1] / (density * l * l / 2.0) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn process_noise_of_every_step_length_is_positive_semidefinite() {
        for damping in [0.02, 0.2, 0.9] {
            let keeping = LaneKeeping { damping, ..KEEPING };
            for exponent in -60..20 {
                let length_m = 1.7_f64.powi(exponent);
                for length_m in [length_m, -length_m] {
                    let [[dd, dp], [_, pp]] = keeping.noise(length_m);
                    assert!(dd > 0.0 && dp * dp < dd * pp, "{damping} {length_m}");
                }
            }
        }
    }

    #[test]
    fn the_noise_is_continuous_between_short_and_long_steps() {
        let max_m = SHORT * KEEPING.wavelength_m;
        let (short, long) = (
            KEEPING.noise(max_m * (1.0 - 1e-12)),
            KEEPING.noise(max_m * (1.0 + 1e-12)),
        );
        for (short, long) in short.iter().flatten().zip(long.iter().flatten()) {
            assert!((short / long - 1.0).abs() < 1e-5, "{short} {long}");
        }
    }

    #[test]
    fn combined_lane_keeping_has_the_moments_of_both_processes() {
        let survey = LaneKeeping {
            rms_m: 0.02,
            wavelength_m: 20.0,
            damping: 0.1,
        };
        let both = KEEPING.and(&survey);
        for state in 0..2 {
            let sum = KEEPING.stationary()[state] + survey.stationary()[state];
            assert!((both.stationary()[state] / sum - 1.0).abs() < 1e-12);
        }
        let noise = |it: &LaneKeeping| it.noise(0.01)[1][1];
        assert!((noise(&both) / (noise(&KEEPING) + noise(&survey)) - 1.0).abs() < 1e-3);
        assert_eq!(
            KEEPING
                .and(&LaneKeeping {
                    rms_m: 0.0,
                    ..survey
                })
                .rms_m,
            KEEPING.rms_m
        );
    }

    #[test]
    fn unobserved_lane_oscillation_shortens_the_distance_as_predicted() {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
        let keeping = LaneKeeping {
            rms_m: 0.5,
            wavelength_m: 15.0,
            damping: 0.2,
        };
        let (step_m, steps, drives) = (0.25, 400, 400);
        let phi = keeping.transition(step_m);
        let noise = keeping.noise(step_m);
        let [offset, heading] = keeping.stationary();
        let shared = noise[0][1] / noise[1][1].sqrt();
        let own = (noise[0][0] - shared * shared).sqrt();
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..drives {
            let mut state = [offset.sqrt() * normal(), heading.sqrt() * normal()];
            let mut along_m = 0.0;
            for _ in 0..steps {
                along_m += step_m * state[1].cos();
                let (common, alone) = (normal(), normal());
                state = [
                    phi[0][0] * state[0] + phi[0][1] * state[1] + shared * common + own * alone,
                    phi[1][0] * state[0] + phi[1][1] * state[1] + noise[1][1].sqrt() * common,
                ];
            }
            sum += along_m;
            squares += along_m * along_m;
        }
        let mean_m = sum / f64::from(drives);
        let variance_m2 = squares / f64::from(drives) - mean_m * mean_m;
        let driven_m = step_m * f64::from(steps);
        assert!(
            (mean_m / (driven_m * (-0.5 * heading).exp()) - 1.0).abs() < 0.003,
            "{mean_m}"
        );
        let predicted_m2 = driven_m * keeping.shortening_m2_per_m(heading);
        assert!(
            (0.75..1.25).contains(&(variance_m2 / predicted_m2)),
            "{variance_m2} {predicted_m2}"
        );
    }
}
