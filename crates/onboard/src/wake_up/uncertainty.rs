//! Wake-up policy driven by the localizer's covariance: as late as a target error permits, and
//! earlier where information is cheap.
//!
//! The paper's t_max keeps the position uncertainty below x̃_max by a worst case: the distance
//! driven at top speed. The filter computes its covariance and the growth of the covariance, so
//! that the rule can be exact. The vehicle wakes up at the last SSB before the error exceeds the
//! target at the specified confidence, and uses the minimum number of angles that keeps it. If all
//! angles together are not sufficient, [`WakeUpPolicy::keeps_bound`] returns `false`.
//!
//! The value of an angle is its reduction of the position variance a few metres ahead, because
//! information about heading and odometer has become position information there. The value depends
//! on the position: one angle close to a radio head has the value of many from a distance. A given
//! energy is used best if the last angle has the same value everywhere (equal marginal gains). An
//! angle with at least the value `min_variance_reduction_m2` is therefore used before the target requires it,
//! so that the stretch ahead, where angles have less value, begins with a small error.
//!
//! A wake-up has a fixed energy: the receiver settles and is on for the burst. The platform
//! expresses it in units of one estimate. If it is large, all radio heads of a burst are used at
//! once, and the next wake-up is later.
//!
//! The value of an angle depends mainly on the SNR of its SSB, which an active receiver measures
//! before any angle is estimated. With `snr_headroom_db`, the measured SNR determines the value.

use super::policy::{SAME_TIME_S, Situation, WakeUpPolicy};
use crate::BoxError;
use crate::gaussian::RadialQuantile;
use crate::localize::Ekf;
use crate::localize::ekf::state::Belief;
use crate::observation::SsbDetection;
use crate::radio_head::RadioHead;
use crate::settings::{Site, UncertaintySettings, Vehicle};
use crate::thermal::ThermalNoise;

/// Maximum look-ahead for a wake-up time, in seconds.
const HORIZON_S: f64 = 20.0;

/// Distance ahead at which the value of an angle is evaluated, in metres.
const LOOK_AHEAD_M: f64 = 10.0;

/// Maximum number of radio heads to choose from.
const MAX_HEADS: usize = 64;

/// Wake-up policy driven by the covariance.
#[derive(Clone, Debug)]
pub struct UncertaintyDriven {
    target_error_m: f64,
    quantile: RadialQuantile,
    wake_up_cost: f64,
    min_variance_reduction_m2: f64,
    snr_headroom_db: Option<f64>,
    period_s: f64,
    base_s: f64,
    last_wake_up_s: Option<f64>,
    thermal: ThermalNoise,
}

impl UncertaintyDriven {
    /// Creates the policy for a site's SSBs. `wake_up_cost` is the energy of a wake-up before its
    /// first angle, in units of one estimate.
    pub fn new(
        settings: &UncertaintySettings,
        wake_up_cost: f64,
        site: &Site,
        vehicle: &Vehicle,
    ) -> Self {
        Self {
            target_error_m: settings.target_error_m,
            quantile: RadialQuantile::new(1.0 - settings.confidence),
            wake_up_cost,
            min_variance_reduction_m2: settings.min_variance_reduction_m2,
            snr_headroom_db: settings.snr_headroom_db,
            period_s: site.ssb.period_s(),
            base_s: settings.base_ms.unwrap_or(0.0) * 1e-3,
            last_wake_up_s: None,
            thermal: ThermalNoise::new(site, vehicle),
        }
    }

    /// Whether the error stays below the target until the SSB after `time_s`, without another
    /// angle.
    pub fn keeps(&self, ekf: &Ekf, time_s: f64) -> bool {
        self.error_m(ekf, time_s + self.period_s) <= self.target_error_m
    }

    /// Returns the angles to use, one bit for each radio head. The number of angles has the maximum
    /// variance reduction per energy, if that reduction is sufficient or the target requires
    /// angles; the number is larger if the target requires it. If all angles together cannot meet
    /// the target, every angle whose reduction justifies its energy is used. `snr_db` returns the
    /// SNR of a radio head at a distance.
    fn choice(
        &self,
        ekf: &Ekf,
        time_s: f64,
        heads: &[RadioHead],
        snr_db: impl Fn(&RadioHead, f64) -> f64,
    ) -> u64 {
        let demanded = !self.keeps(ekf, time_s);
        let mut belief = ekf.forecast(time_s);
        let ahead_m = ekf.speed_mps() * (time_s - ekf.time_s()).max(0.0);
        let ahead = ekf.transition(&belief, LOOK_AHEAD_M);
        let spread = |belief: &Belief| ahead.principal_variances(belief).iter().sum::<f64>();
        let next = ekf.transition(&belief, ekf.speed_mps() * self.period_s);
        let keeps = |belief: &Belief| {
            self.quantile.radius(next.principal_variances(belief)) <= self.target_error_m
        };
        let before = spread(&belief);
        let (mut taken, mut best, mut max_m2) = (0u64, 0u64, 0.0);
        let (mut improving, mut kept) = (true, !demanded);
        for count in 1..=heads.len().min(MAX_HEADS) {
            let next = (heads.iter().enumerate().take(MAX_HEADS))
                .filter(|(index, _)| taken >> index & 1 == 0)
                .filter_map(|(index, head)| {
                    let sigma_rad = |distance_m| self.thermal.sigma_rad(snr_db(head, distance_m));
                    let thermal = |distance_m| sigma_rad(distance_m).powi(2);
                    let after = ekf.predicted_update(&belief, ahead_m, head, thermal)?;
                    Some((index, after, spread(&after)))
                })
                .min_by(|a, b| a.2.total_cmp(&b.2));
            let Some((index, after, left)) = next else {
                break;
            };
            taken |= 1 << index;
            belief = after;
            let cost = (self.wake_up_cost + count as f64) / (self.wake_up_cost + 1.0);
            let gain_m2 = (before - left) / cost;
            improving &= gain_m2 > max_m2;
            if improving {
                (best, max_m2) = (taken, gain_m2);
            }
            if !kept && keeps(&belief) {
                // Both criteria add the angles in the same order.
                best |= taken;
                kept = true;
            }
            if !improving && kept {
                break;
            }
        }
        if (demanded && kept) || max_m2 >= self.min_variance_reduction_m2 {
            best
        } else {
            0
        }
    }

    /// Returns the duration after `time_s` for which the error stays below the target without
    /// another angle, in seconds. It determines the latest wake-up.
    fn wake_up_time_s(&self, ekf: &Ekf, time_s: f64) -> f64 {
        let holds = |periods: f64| {
            self.error_m(ekf, time_s + periods * self.period_s) <= self.target_error_m
        };
        let (mut low, mut high) = (0.0, (HORIZON_S / self.period_s).ceil());
        if holds(high) {
            return high * self.period_s;
        }
        while high - low > 1.0 {
            let middle = (0.5 * (low + high)).floor();
            if holds(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        (low * self.period_s).max(self.period_s)
    }

    fn error_m(&self, ekf: &Ekf, time_s: f64) -> f64 {
        self.quantile.radius(ekf.forecast_variances(time_s))
    }
}

/// With another localizer, or while the position is unknown, every angle is used.
impl WakeUpPolicy for UncertaintyDriven {
    /// Whether the error would exceed the target at the following SSB, or the value of an angle
    /// justifies its energy.
    fn listens(&mut self, now: &Situation<'_>) -> Result<bool, BoxError> {
        let is_free = |last_s: f64| now.time_s - last_s + SAME_TIME_S >= self.base_s;
        if !self.last_wake_up_s.is_none_or(is_free) {
            return Ok(false);
        }
        let ekf = now.localizer.worst_case();
        let headroom_db = self.snr_headroom_db.unwrap_or(0.0);
        let snr_db =
            |head: &RadioHead, distance_m| now.budget.snr_db(head, distance_m) + headroom_db;
        Ok(ekf.is_none_or(|ekf| self.choice(ekf, now.now_s, now.heads, snr_db) != 0))
    }

    fn decide(
        &mut self,
        now: &Situation<'_>,
        sensed: &[SsbDetection],
        chosen: &mut [bool],
    ) -> Result<f64, BoxError> {
        self.last_wake_up_s = Some(now.time_s);
        let Some(ekf) = now.localizer.worst_case() else {
            chosen.fill(true);
            return Ok(self.period_s);
        };
        let snr_db = |head: &RadioHead, distance_m| {
            let sends = |ssb: &&SsbDetection| head.sends(ssb.pci, ssb.ssb_index);
            let ssb = (self.snr_headroom_db).and_then(|_| sensed.iter().find(sends));
            ssb.map_or_else(|| now.budget.snr_db(head, distance_m), |ssb| ssb.snr_db)
        };
        let choice = self.choice(ekf, now.now_s, now.heads, snr_db);
        for (ssb, chosen) in sensed.iter().zip(chosen) {
            let sends = |head: &RadioHead| head.sends(ssb.pci, ssb.ssb_index);
            *chosen = (now.heads.iter().position(sends))
                .is_some_and(|index| index < MAX_HEADS && choice >> index & 1 == 1);
        }
        Ok(self.wake_up_time_s(ekf, now.now_s))
    }

    fn keeps_bound(&self, now: &Situation<'_>) -> Option<bool> {
        let ekf = now.localizer.ekf()?;
        Some(self.keeps(ekf, now.now_s))
    }
}
