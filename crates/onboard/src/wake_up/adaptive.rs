//! Algorithm 1 as a policy: what it is told, and the decision that it leads to.

use super::pid::Pid;
use super::policy::{SAME_TIME_S, Situation, WakeUpPolicy};
use crate::BoxError;
use crate::observation::SensedSsb;
use crate::settings::{PidSettings, SensingMode, SnrSetPoint};

/// Estimates an angle once the wake-up time of Algorithm 1 has passed since the last estimate.
#[derive(Debug)]
pub struct Adaptive {
    pid: Pid,
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
    /// Algorithm 1 from the base wake-up time on. The velocity error is the shortfall from the top
    /// speed.
    pub fn new(settings: &PidSettings, base_s: f64, top_speed_mps: f64) -> Self {
        Self {
            pid: Pid::new(settings, base_s),
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

    fn is_due(&self, time_s: f64) -> bool {
        self.last_estimate_s
            .is_none_or(|last_s| time_s - last_s + SAME_TIME_S >= self.wake_up_time_s)
    }

    /// Takes in the SSB at `time_s` and says whether its angle is to be estimated. The SNR error is
    /// positive when the signal is too weak, the velocity error 0 when cruising, 1 when standing.
    fn take(&mut self, time_s: f64, snr_error: f64, velocity_error: f64) -> bool {
        let usable = !self.deferral || snr_error <= 0.0;
        let interval_s = self.last_sensed_s.map(|last_s| time_s - last_s);
        if interval_s.is_none_or(|interval_s| interval_s > 0.0) {
            self.last_sensed_s = Some(time_s);
        }
        let estimate_if_due = self.is_due(time_s) && usable;
        // The first SSB has no interval before it: Algorithm 1 begins with the second.
        if let Some(interval_s) = interval_s.filter(|interval_s| *interval_s > 0.0) {
            self.wake_up_time_s =
                (self.pid).calculate_wake_up_time(snr_error, velocity_error, interval_s);
        }
        let estimate = match self.sensing {
            SensingMode::EverySsb => self.is_due(time_s) && usable,
            // Asleep until due, the controller learns of this SSB only once it is awake.
            SensingMode::WakeUp => estimate_if_due,
        };
        if estimate {
            self.last_estimate_s = Some(time_s);
        }
        estimate
    }
}

impl WakeUpPolicy for Adaptive {
    /// Always, or from the wake-up time on.
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        Ok(self.sensing == SensingMode::EverySsb || self.is_due(now.time_s))
    }

    /// Judges by the strongest SSB that is on the map.
    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SensedSsb],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        let known = sensed.iter().filter_map(|ssb| Some((ssb, now.head(ssb)?)));
        let strongest = known.max_by(|a, b| a.0.snr_db.total_cmp(&b.0.snr_db));
        if let Some((ssb, head)) = strongest {
            let set_point_db = match self.set_point {
                SnrSetPoint::Expected { offset_db } => now.expected_snr_db(head)? + offset_db,
                SnrSetPoint::Absolute { snr_db } => snr_db,
            };
            let snr_error = (set_point_db - ssb.snr_db) / self.snr_scale_db;
            let velocity_error = (self.top_speed_mps - now.speed_mps) / self.top_speed_mps;
            chosen.fill(self.take(now.time_s, snr_error, velocity_error));
        }
        Ok(self.wake_up_time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED_DB: f64 = 5.0;

    /// SSB number `number`, sensed with so much SNR while the vehicle cruises.
    fn take(policy: &mut Adaptive, number: u32, snr_db: f64) -> bool {
        let snr_error = (EXPECTED_DB + 3.0 - snr_db) / 10.0;
        policy.take(f64::from(number) * 0.02, snr_error, 0.0)
    }

    fn adaptive(settings: &PidSettings) -> Adaptive {
        Adaptive::new(settings, 0.08, 4.0)
    }

    #[test]
    fn a_weak_ssb_defers_the_estimate() {
        let mut policy = adaptive(&PidSettings::default());
        assert!(take(&mut policy, 0, 9.0));
        for number in 1..20 {
            assert!(!take(&mut policy, number, 7.9));
        }
        assert!(take(&mut policy, 20, 8.1));
        assert!(!take(&mut policy, 21, 9.0), "the base time has not passed");
    }

    #[test]
    fn a_late_ssb_leaves_the_controller_alone() {
        let settings = PidSettings::default();
        let (mut policy, mut undisturbed) = (adaptive(&settings), adaptive(&settings));
        for number in 0..50 {
            if number == 30 {
                assert!(!take(&mut policy, 20, 9.0));
            }
            let snr_db = 7.0 + f64::from(number % 7);
            let chosen = take(&mut policy, number, snr_db);
            assert_eq!(chosen, take(&mut undisturbed, number, snr_db));
            assert_eq!(policy.wake_up_time_s, undisturbed.wake_up_time_s);
        }
    }

    #[test]
    fn asleep_it_listens_only_when_due() {
        let settings = PidSettings {
            sensing: SensingMode::WakeUp,
            deferral: false,
            ..Default::default()
        };
        let mut policy = adaptive(&settings);
        assert!(take(&mut policy, 0, 3.0));
        assert!(policy.is_due(0.02), "Algorithm 1 has not run yet");
        assert!(take(&mut policy, 1, 3.0) && policy.wake_up_time_s > 0.2);
        assert!(!policy.is_due(0.22) && policy.is_due(0.28));
    }
}
