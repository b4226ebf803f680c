//! The paper's Algorithm 1. Its inputs are in `controller.rs`, and `adaptive.rs` is its wake-up
//! policy, which optionally defers an estimate until a better SSB.

use crate::settings::PidSettings;

/// Algorithm 1: "Adaptive Wake-Up Time Calculation". Numbers in comments are the paper's line
/// numbers.
///
/// The paper specifies neither the unit of `u` nor that of Δt. The settings contain the unit of
/// `u`; with seconds, errors of the usual size move the wake-up time across [t_base, t_max]. The
/// caller determines Δt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid {
    kp: f64,
    ki: f64,
    kd: f64,
    weight_snr: f64,
    weight_velocity: f64,
    base_s: f64,
    max_s: f64,
    u_unit_s: f64,
    integral_clamp: f64,
    integral: f64,
    previous_error: f64,
}

impl Pid {
    /// Creates the controller: lines 1–6 of the algorithm, `Initialize`.
    pub fn new(settings: &PidSettings, base_s: f64, max_s: f64) -> Self {
        Self {
            kp: settings.kp,                           // 2
            ki: settings.ki,                           // 2
            kd: settings.kd,                           // 2
            previous_error: 0.0,                       // 3
            integral: 0.0,                             // 3
            weight_snr: settings.weight_snr,           // 4
            weight_velocity: settings.weight_velocity, // 4
            base_s,                                    // 5
            max_s,                                     // 5
            u_unit_s: settings.u_unit_ms * 1e-3,
            // Anti-windup, which the paper does not specify. Without it, the wake-up time stays at
            // its bound for a long time after a persistent deficit.
            integral_clamp: if settings.integral_clamp > 0.0 {
                settings.integral_clamp
            } else {
                f64::INFINITY
            },
        }
    }

    /// Calculates the time until the next wake-up: lines 7–18 of the algorithm,
    /// `CalculateWakeUpTime`.
    pub fn calculate_wake_up_time(
        &mut self,
        snr_error: f64,
        velocity_error: f64,
        delta_t: f64,
    ) -> f64 {
        let error = self.weight_snr * snr_error + self.weight_velocity * velocity_error; // 10
        self.integral = (self.integral + error * delta_t) // 11
            .clamp(-self.integral_clamp, self.integral_clamp);
        let derivative = (error - self.previous_error) / delta_t; // 12
        let u = self.kp * error + self.ki * self.integral + self.kd * derivative; // 13
        self.previous_error = error; // 14
        let wake_up_time_s = self.base_s + u * self.u_unit_s; // 15
        wake_up_time_s.max(self.base_s).min(self.max_s) // 16, 17
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_controller_equals_algorithm_1_of_the_paper() {
        // t_base 0.08 s, t_max 0.24 s, Δt 0.1 s, the paper's gains and weights.
        // combined = 0.6·snr + 0.4·velocity; integral += combined·0.1; derivative = change/0.1.
        let table = [
            // SNR error, velocity error, WT: combined, integral, derivative, u
            (0.1, 0.0, 0.24), // 0.06, 0.006, 0.6, 0.045 + 0.00048 + 0.117 = 0.16248: t_max
            (0.1, 0.0, 0.12596), // 0.06, 0.012, 0.0, 0.045 + 0.00096 = 0.04596
            (0.0, 0.05, 0.08), // 0.02, 0.014, −0.4, 0.015 + 0.00112 − 0.078 < 0: t_base
            (0.2, 0.25, 0.24), // 0.22, 0.036, 2.0, 0.165 + 0.00288 + 0.39: t_max
        ];
        let mut pid = Pid::new(&PidSettings::default(), 0.08, 0.24);
        for (snr, velocity, expected) in table {
            let wake_up_time_s = pid.calculate_wake_up_time(snr, velocity, 0.1);
            assert!(
                (wake_up_time_s - expected).abs() < 1e-12,
                "{wake_up_time_s} {expected}"
            );
        }
        assert!((pid.integral - 0.036).abs() < 1e-15);
        assert!((pid.previous_error - 0.22).abs() < 1e-15);
    }

    #[test]
    fn integral_is_clamped_only_if_configured() {
        let run = |integral_clamp| {
            let settings = PidSettings {
                integral_clamp,
                ..Default::default()
            };
            let mut pid = Pid::new(&settings, 0.08, 0.24);
            for _ in 0..1000 {
                pid.calculate_wake_up_time(1.0, 0.0, 0.02);
            }
            pid.integral
        };
        assert!((run(0.5) - 0.5).abs() < 1e-12);
        assert!((run(0.0) - 12.0).abs() < 1e-9);
    }
}
