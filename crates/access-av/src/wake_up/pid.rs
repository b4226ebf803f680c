//! The paper's Algorithm 1, and the decision that it leads to.

use super::{SAME_TIME_S, WakeUpDecision, WakeUpInputs};
use crate::BoxError;
use crate::scenario::{PidSettings, SensingMode, SnrSetPoint};

/// Turns errors into a wake-up time: Algorithm 1, or what a user puts in its place.
pub trait Controller: Send + std::fmt::Debug {
    /// The next wake-up time in seconds, from the normalised SNR error, the normalised velocity
    /// error and the time since the last call in seconds.
    ///
    /// # Errors
    /// Algorithm 1 never fails; another controller may.
    fn wake_up_time_s(
        &mut self,
        snr_error: f64,
        velocity_error: f64,
        interval_s: f64,
    ) -> Result<f64, BoxError>;
}

/// Algorithm 1: "Adaptive Wake-Up Time Calculation". Numbers in comments are the paper's lines.
///
/// The errors have no unit; `u` is read as seconds, which with the paper's gains moves the wake-up
/// time across [t_base, t_max] within the errors that occur.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid {
    kp: f64,
    ki: f64,
    kd: f64,
    weight_snr: f64,
    weight_velocity: f64,
    base_s: f64,
    max_s: f64,
    integral_clamp: f64,
    integral: f64,
    previous_error: f64,
}

impl Pid {
    /// Lines 1–6: `Initialize`.
    pub fn new(settings: &PidSettings, base_s: f64) -> Self {
        Self {
            kp: settings.kp,                           // 2
            ki: settings.ki,                           // 2
            kd: settings.kd,                           // 2
            previous_error: 0.0,                       // 3
            integral: 0.0,                             // 3
            weight_snr: settings.weight_snr,           // 4
            weight_velocity: settings.weight_velocity, // 4
            base_s,                                    // 5
            max_s: settings.t_max_ms * 1e-3,           // 5
            // Not in the paper: a shortfall that lasts would otherwise keep the wake-up time at
            // its bound long after it has passed.
            integral_clamp: if settings.integral_clamp > 0.0 {
                settings.integral_clamp
            } else {
                f64::INFINITY
            },
        }
    }

    /// Lines 7–18: `CalculateWakeUpTime`.
    pub fn calculate_wake_up_time(
        &mut self,
        snr_error: f64,
        velocity_error: f64,
        interval_s: f64,
    ) -> f64 {
        let error = self.weight_snr * snr_error + self.weight_velocity * velocity_error; // 10
        self.integral = (self.integral + error * interval_s) // 11
            .clamp(-self.integral_clamp, self.integral_clamp);
        let derivative = (error - self.previous_error) / interval_s; // 12
        let u = self.kp * error + self.ki * self.integral + self.kd * derivative; // 13
        self.previous_error = error; // 14
        let wake_up_time_s = self.base_s + u; // 15
        wake_up_time_s.max(self.base_s).min(self.max_s) // 16, 17
    }
}

impl Controller for Pid {
    fn wake_up_time_s(
        &mut self,
        snr_error: f64,
        velocity_error: f64,
        interval_s: f64,
    ) -> Result<f64, BoxError> {
        Ok(self.calculate_wake_up_time(snr_error, velocity_error, interval_s))
    }
}

/// Estimates an angle once the controller's wake-up time has passed since the last estimate.
#[derive(Debug)]
pub struct Adaptive {
    controller: Box<dyn Controller>,
    set_point: SnrSetPoint,
    snr_scale_db: f64,
    top_speed_mps: f64,
    sensing: SensingMode,
    deferral: bool,
    wake_up_time_s: f64,
    last_sensed_s: Option<f64>,
    last_estimate_s: Option<f64>,
}

impl Adaptive {
    /// A policy around `controller`. The velocity error is the shortfall from the top speed.
    pub fn new(
        settings: &PidSettings,
        controller: Box<dyn Controller>,
        top_speed_mps: f64,
    ) -> Self {
        Self {
            controller,
            set_point: settings.snr_set_point,
            snr_scale_db: settings.snr_scale_db,
            top_speed_mps,
            sensing: settings.sensing,
            deferral: settings.deferral,
            wake_up_time_s: 0.0,
            last_sensed_s: None,
            last_estimate_s: None,
        }
    }

    /// Whether the receiver listens at `time_s`: always, or from the wake-up time on.
    pub fn listens(&self, time_s: f64) -> bool {
        self.sensing == SensingMode::EverySsb || self.is_due(time_s)
    }

    fn is_due(&self, time_s: f64) -> bool {
        self.last_estimate_s
            .is_none_or(|last_s| time_s - last_s + SAME_TIME_S >= self.wake_up_time_s)
    }

    /// (set point − sensed SNR) / scale: positive when the signal is too weak.
    fn snr_error(&self, inputs: &WakeUpInputs) -> f64 {
        let set_point_db = match self.set_point {
            SnrSetPoint::Expected { offset_db } => inputs.expected_snr_db + offset_db,
            SnrSetPoint::Absolute { snr_db } => snr_db,
        };
        (set_point_db - inputs.sensed_snr_db) / self.snr_scale_db
    }

    /// (top speed − sensed speed) / top speed: 0 when cruising, 1 when standing.
    fn velocity_error(&self, inputs: &WakeUpInputs) -> f64 {
        (self.top_speed_mps - inputs.speed_mps) / self.top_speed_mps
    }

    /// Whether the angle of the SSB at hand is to be estimated.
    ///
    /// # Errors
    /// Whatever the controller fails with.
    pub fn decide(&mut self, inputs: &WakeUpInputs) -> Result<WakeUpDecision, BoxError> {
        let time_s = inputs.time_s;
        let snr_error = self.snr_error(inputs);
        let usable = !self.deferral || snr_error <= 0.0;
        let interval_s = self.last_sensed_s.map(|last_s| time_s - last_s);
        self.last_sensed_s = Some(time_s);
        // The first SSB has no interval before it: Algorithm 1 begins with the second.
        let update = |policy: &mut Self| -> Result<(), BoxError> {
            if let Some(interval_s) = interval_s.filter(|interval_s| *interval_s > 0.0) {
                let velocity_error = policy.velocity_error(inputs);
                policy.wake_up_time_s =
                    policy
                        .controller
                        .wake_up_time_s(snr_error, velocity_error, interval_s)?;
            }
            Ok(())
        };
        let estimate = match self.sensing {
            SensingMode::EverySsb => {
                update(self)?;
                self.is_due(time_s) && usable
            }
            // Asleep until due, the controller learns of this SSB only once it is awake.
            SensingMode::WakeUp => {
                let estimate = self.is_due(time_s) && usable;
                update(self)?;
                estimate
            }
        };
        if estimate {
            self.last_estimate_s = Some(time_s);
        }
        Ok(WakeUpDecision {
            estimate,
            wake_up_time_s: self.wake_up_time_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn algorithm_1_by_hand() {
        // t_base 0.08 s, t_max 0.24 s, Δt 0.1 s, the paper's gains and weights.
        // combined = 0.6·snr + 0.4·velocity; integral += combined·0.1; derivative = change/0.1.
        let table = [
            // SNR error, velocity error, WT: combined, integral, derivative, u
            (0.1, 0.0, 0.24), // 0.06, 0.006, 0.6, 0.045 + 0.00048 + 0.117 = 0.16248: t_max
            (0.1, 0.0, 0.12596), // 0.06, 0.012, 0.0, 0.045 + 0.00096 = 0.04596
            (0.0, 0.05, 0.08), // 0.02, 0.014, −0.4, 0.015 + 0.00112 − 0.078 < 0: t_base
            (0.2, 0.25, 0.24), // 0.22, 0.036, 2.0, 0.165 + 0.00288 + 0.39: t_max
        ];
        let mut pid = Pid::new(&PidSettings::default(), 0.08);
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
    fn integral_is_clamped_only_when_asked() {
        let run = |integral_clamp| {
            let settings = PidSettings {
                integral_clamp,
                ..Default::default()
            };
            let mut pid = Pid::new(&settings, 0.08);
            for _ in 0..1000 {
                pid.calculate_wake_up_time(1.0, 0.0, 0.02);
            }
            pid.integral
        };
        assert!((run(0.5) - 0.5).abs() < 1e-12);
        assert!((run(0.0) - 12.0).abs() < 1e-9);
    }

    fn inputs(number: u32, sensed_snr_db: f64) -> WakeUpInputs {
        let time_s = f64::from(number) * 0.02;
        WakeUpInputs {
            time_s,
            sensed_snr_db,
            expected_snr_db: 5.0,
            speed_mps: 4.0,
        }
    }

    fn adaptive(settings: &PidSettings) -> Adaptive {
        Adaptive::new(settings, Box::new(Pid::new(settings, 0.08)), 4.0)
    }

    #[test]
    fn a_weak_ssb_defers_the_estimate() {
        let mut policy = adaptive(&PidSettings::default());
        assert!(policy.decide(&inputs(0, 9.0)).unwrap().estimate);
        for number in 1..20 {
            assert!(!policy.decide(&inputs(number, 7.9)).unwrap().estimate);
        }
        assert!(policy.decide(&inputs(20, 8.1)).unwrap().estimate);
        assert!(
            !policy.decide(&inputs(21, 9.0)).unwrap().estimate,
            "the base time has not passed"
        );
    }

    #[test]
    fn asleep_it_listens_only_when_due() {
        let settings = PidSettings {
            sensing: SensingMode::WakeUp,
            deferral: false,
            ..Default::default()
        };
        let mut policy = adaptive(&settings);
        assert!(policy.decide(&inputs(0, 3.0)).unwrap().estimate);
        assert!(policy.listens(0.02), "Algorithm 1 has not run yet");
        let second = policy.decide(&inputs(1, 3.0)).unwrap();
        assert!(second.estimate && second.wake_up_time_s > 0.2);
        assert!(!policy.listens(0.22) && policy.listens(0.28));
    }
}
